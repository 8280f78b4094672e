"""Layout of the viewer: chase view, map, plan view of the wheels, plots and summary."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import rerun.blueprint as rrb

from activesteer.drawing.bodywork import CHASSIS
from activesteer.drawing.panels import BODY, DRIVING, MOTION, WHEELS, Panel, panels_in
from activesteer.playback import events, plots
from activesteer.playback.car import body_path, ghost_path
from activesteer.playback.course import COURSE, MAP, ROAD, map_bounds
from activesteer.playback.legend import LEGEND, LEGEND_OF_RUNS, height, legend
from activesteer.playback.runs import Run
from activesteer.playback.timeline import TIMELINE
from activesteer.playback.wheel_angles import plan_view, wedges_path

SUMMARY: Final = "summary"
"""Entity of the summary text."""

_PLOTS: Final = 690.0
"""Height of a page of plots with its legend in a window of 1280 x 800 [points]."""
_SKY: Final = (176, 196, 214)
_BEHIND: Final = rrb.EyeControls3D(position=(-7.6, 0.0, 3.5), look_target=(-0.4, 0.0, 0.2), eye_up=(0.0, 0.0, 1.0))
# Left is up in the picture, so that the car drives to the right.
_ABOVE: Final = rrb.EyeControls3D(position=(-1.3, 0.0, 6.5), look_target=(-1.3, 0.0, 0.0), eye_up=(0.0, 1.0, 0.0))
"""Eye positions in the frame that follows the car; its origin lies on the road below the front axle."""


def blueprint(runs: Sequence[Run], *, compare: bool, page: int = 0) -> rrb.Blueprint:
    """Return the layout of the viewer.

    Args:
        runs: The runs. If there are several, the first page shows all of them.
        compare: Whether to leave out the pages of single runs.
        page: The page of plots that is shown first.
    """
    if len(runs) == 1:
        content = _page(runs[0], runs, page)
    elif compare:
        content = _comparison(runs, page)
    else:
        content = rrb.Tabs(_comparison(runs, page), *(_page(run, runs, page) for run in runs), active_tab=0)
    return rrb.Blueprint(
        content,
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, loop_mode="all"),
        auto_views=False,
        auto_layout=False,
    )


def _page(run: Run, runs: Sequence[Run], page: int) -> rrb.Horizontal:
    """Return the page of a single run with all its views."""
    return rrb.Horizontal(
        rrb.Vertical(
            _chase(run, runs),
            _map(runs),
            rrb.Horizontal(_above(run, runs), plan_view([run]), _words([run]), column_shares=[6, 5.8, 9.2]),
            row_shares=[5, 1.5, 4],
        ),
        rrb.Tabs(
            *(_tab(name, shown, run, alone=len(runs) == 1) for name, shown in plots.pages(run).items()),
            active_tab=page,
        ),
        column_shares=[3, 2],
        name=run.label,
    )


def _tab(name: str, shown: Sequence[Panel], run: Run, *, alone: bool) -> rrb.Vertical:
    views, curves = plots.views(shown, [run]), plots.curves(shown, run, alone=alone)
    names = legend(f"{LEGEND}/{run.name}/{name}", curves)
    high = height(curves)
    return rrb.Vertical(
        names, *views, row_shares=[high, *([(_PLOTS - high) / max(1, len(views))] * len(views))], name=name
    )


def _comparison(runs: Sequence[Run], page: int) -> rrb.Horizontal:
    """Return the page of all runs: a view for each car, with the others as ghosts, and overlaid plots."""
    loads, use = panels_in(WHEELS)[:2]
    return rrb.Horizontal(
        rrb.Vertical(
            rrb.Horizontal(*(_chase(run, runs) for run in runs)),
            _map(runs),
            rrb.Horizontal(plan_view(runs), _words(runs), column_shares=[2, 3]),
            row_shares=[4, 1.3, 4],
        ),
        rrb.Vertical(
            legend(LEGEND_OF_RUNS, {run.label: run.colour for run in runs}),
            rrb.Tabs(
                *(rrb.Vertical(*plots.views(panels_in(name), runs), name=name) for name in (MOTION, DRIVING, BODY)),
                rrb.Vertical(*plots.views_by_corner(loads, runs), name="Wheel loads"),
                rrb.Vertical(*plots.views_by_corner(use, runs), name="Friction utilisation"),
                active_tab=page,
            ),
            row_shares=[1, 22],
        ),
        column_shares=[3, 2],
        name="Comparison",
    )


def _chase(run: Run, runs: Sequence[Run]) -> rrb.Spatial3DView:
    return _car_view(run, runs, run.label, _BEHIND, numbers=len(runs) == 1)


def _above(run: Run, runs: Sequence[Run]) -> rrb.Spatial3DView:
    return _car_view(run, runs, "From above", _ABOVE, numbers=False)


def _car_view(run: Run, runs: Sequence[Run], name: str, eye: rrb.EyeControls3D, *, numbers: bool) -> rrb.Spatial3DView:
    others = [other for other in runs if other is not run]
    return rrb.Spatial3DView(
        origin=f"/{run.name}/chase",
        contents=[
            f"+ /{ROAD}/**",
            f"+ /{COURSE}/**",
            f"+ /{run.scene}/**",
            f"+ /{wedges_path(run)}/**",
            # The numbers would hide the car in a small view; the plan shows them too.
            *([] if numbers else [f"- /{wedges_path(run)}/angle"]),
            f"- /{body_path(run, CHASSIS)}/ghost/**",
            *(f"+ /{ghost_path(other, run)}/**" for other in others),
            *(f"+ /{other.scene}/driven" for other in others),
        ],
        name=name,
        background=rrb.Background(color=_SKY, kind=rrb.BackgroundKind.SolidColor),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=eye,
    )


def _map(runs: Sequence[Run]) -> rrb.Spatial2DView:
    across, down = map_bounds(runs)
    return rrb.Spatial2DView(
        origin=f"/{MAP}",
        name="Course [m]",
        visual_bounds=rrb.VisualBounds2D(x_range=across, y_range=down),
    )


def _words(runs: Sequence[Run]) -> rrb.Tabs | rrb.TextDocumentView:
    """Return the view of the summary, with the warnings behind it if there are any."""
    summary = rrb.TextDocumentView(origin=f"/{SUMMARY}", name="Summary")
    warnings = events.view(runs)
    return rrb.Tabs(summary, *warnings, active_tab=0) if warnings else summary
