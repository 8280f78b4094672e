"""ISO 3888-2: obstacle avoidance, the highest entry speed without a cone hit."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import groupby
from typing import Final

from activesteer.pages import Table
from activesteer.plotting import Curve, Panel, Picture
from activesteer.standards.standard import SIDES, Findings, StandardRun, StandardRunner, cell, time_panels

MARGINS_M: Final = (0.1, 0.15, 0.2)
"""Margins of the lines at every speed [m]. The best margin depends on car and speed."""
THROTTLE_OFF_M: Final = 2.0
"""Distance into the entry lane after which the throttle is released [m]."""
COARSE_KMH: Final = (35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0, 75.0, 80.0)
"""Entry speeds of the coarse search [km/h]. The search does not go beyond the lowest and the highest."""
FINE_KMH: Final = 1.0
"""Resolution of the search [km/h]."""
_CHANNELS: Final = ("x_m", "y_m", "speed_mps", "steering_wheel_rad", "yaw_rate_radps", "sideslip_rad")
_SHOWN: Final = ("steering_wheel_rad", "yaw_rate_radps", "sideslip_rad", "speed_mps")
_DURATION_S: Final = 14.0
_BEYOND_M: Final = 10.0
"""Length of the drawn track after the last lane [m]."""

Try = Callable[[str, Sequence[float]], list[bool]]
"""Function of the name of a series and entry speeds [km/h]. It returns True for each clean speed."""


def highest_clean(attempt: Try) -> float | None:
    """Return the highest clean speed [km/h], from `COARSE_KMH` and then a finer search; None if there is none."""
    clean = [speed for speed, good in zip(COARSE_KMH, attempt("coarse", COARSE_KMH), strict=True) if good]
    if not clean or clean[-1] == COARSE_KMH[-1]:
        return clean[-1] if clean else None
    above = COARSE_KMH[COARSE_KMH.index(clean[-1]) + 1]
    between = [clean[-1] + FINE_KMH * number for number in range(1, round((above - clean[-1]) / FINE_KMH))]
    good = [speed for speed, kept in zip(between, attempt("fine", between), strict=True) if kept]
    return max([clean[-1], *good])


def is_clean(run: StandardRun) -> bool:
    """Return True if the whole body stays in the lanes and hits no cone."""
    return run.metric("stays_in_lanes") == 1.0 and run.metric("cones_hit") == 0.0


def best_run(runs: Sequence[StandardRun], highest_kmh: float | None) -> StandardRun | None:
    """Return the run with the largest clearance at the highest clean speed, or at any speed if none is clean."""
    good = [run for run in runs if highest_kmh in (None, run.case["speed_kmh"]) and not run.error]
    return min(good, key=lambda run: run.metric("lane_overstep_m"), default=None)


def examine(runner: StandardRunner) -> Findings:
    """Drive and evaluate one car with one controller."""
    speeds: dict[str, float | None] = {}
    driven: dict[str, list[StandardRun]] = {side: [] for side in SIDES}
    for side in SIDES:

        def attempt(series: str, speeds_kmh: Sequence[float], side: str = side) -> list[bool]:
            runs = runner.drive(
                f"{side}_{series}",
                "severe_lane_change",
                [{"speed_kmh": speed, "lane.margin_m": margin} for speed in speeds_kmh for margin in MARGINS_M],
                {"lane.side": side, "lane.throttle_off_m": THROTTLE_OFF_M, "duration_s": _DURATION_S},
                _CHANNELS,
            )
            driven[side] += runs
            clean = {run.case["speed_kmh"] for run in runs if is_clean(run)}
            return [speed in clean for speed in speeds_kmh]

        speeds[side] = highest_clean(attempt)
        driven[side].sort(key=lambda run: (run.case["speed_kmh"], run.case["lane.margin_m"]))
    values = {
        "entry_speed_kmh": speeds,
        "runs": [{"direction": side, "clean": is_clean(run), **run.values} for side in SIDES for run in driven[side]],
    }
    summary = "highest clean entry speed: " + ", ".join(f"{side} {_words(speed)}" for side, speed in speeds.items())
    return Findings(values, summary, [_table(driven)], _pictures(runner, speeds, driven))


def _words(speed_kmh: float | None) -> str:
    if speed_kmh is None:
        return f"none at {COARSE_KMH[0]:g} km/h or above"
    return f"{speed_kmh:.0f} km/h" + (" or more" if speed_kmh == COARSE_KMH[-1] else "")


def _table(driven: dict[str, list[StandardRun]]) -> Table:
    """Return a row for each entry speed, with a column for each line."""
    rows = []
    for side, runs in driven.items():
        for speed_kmh, group in groupby(runs, key=lambda run: run.case["speed_kmh"]):
            lines = list(group)
            best = best_run(lines, speed_kmh)
            end_mps = math.nan if best is None else best.metric("speed_end_mps")
            clean = any(is_clean(run) for run in lines)
            rows.append((
                side, f"{speed_kmh:.0f}", *(_room(run) for run in lines), cell(3.6 * end_mps, 1),
                "clean" if clean else "not clean",
            ))  # fmt: skip
    columns = (
        "first direction", "entry speed [km/h]",
        *(f"overstep of the body, line with a margin of {margin:g} m [m]" for margin in MARGINS_M),
        "final speed of the best run [km/h]", "",
    )  # fmt: skip
    outside = frozenset(i for i, row in enumerate(rows) if row[-1] != "clean")
    return Table("Entry speeds; a negative overstep is clearance to the edge of the lane", columns, rows, outside)


def _room(run: StandardRun) -> str:
    cones = run.metric("cones_hit")
    hit = f", {cones:.0f} cone{'s' if cones > 1.0 else ''}" if cones > 0.0 else ""
    return run.error or cell(run.metric("lane_overstep_m"), 3) + hit


def _pictures(
    runner: StandardRunner, speeds: dict[str, float | None], driven: dict[str, list[StandardRun]]
) -> list[Picture]:
    """Return figures of the best run to each side: track between the cones, and channels over time."""
    best = {side: run for side, runs in driven.items() if (run := best_run(runs, speeds[side])) is not None}
    if not best:
        return []
    tracks = []
    for side, run in best.items():
        course = runner.scenario("severe_lane_change", {"lane.side": side}).maneuver.course
        assert course is not None
        x, y = run["x_m"], run["y_m"]
        inside = x < course.lanes[-1].end_x_m + _BEYOND_M
        curves = [
            Curve(x[inside], y[inside], "centre of gravity"),
            Curve(course.cones_m[:, 0], course.cones_m[:, 1], "cones", dashes="", marker="o"),
        ]
        tracks.append(Panel("x [m]", "y [m]", curves, f"{side} first"))
    words = {
        side: f"{run.case['speed_kmh']:.0f} km/h{'' if is_clean(run) else ', not clean'}" for side, run in best.items()
    }
    labelled = {f"{side}, {words[side]}": run for side, run in best.items()}
    return [
        Picture("Fastest clean runs, or the runs closest to clean", tracks),
        Picture("The same over time", time_panels(labelled, _SHOWN, 0.0, "the start")),
    ]
