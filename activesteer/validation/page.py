"""The comparison as one HTML page with its pictures in it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple

from markupsafe import Markup

from activesteer.errors import ParameterError
from activesteer.files import make_folder, write_text
from activesteer.pages import render
from activesteer.plotting import as_svg
from activesteer.validation.comparison import Comparison
from activesteer.validation.figures import RUN_FIGURES, sweep_figure
from activesteer.validation.programme import Validation
from activesteer.validation.study import Response

_STUDY_COLUMNS: Final = {
    "steady_yaw_rate_radps": "steady yaw rate [rad/s]",
    "peak_yaw_rate_radps": "peak [rad/s]",
    "peak_time_s": "at [s]",
    "steady_sideslip_rad": "steady sideslip [rad]",
    "peak_sideslip_rad": "greatest [rad]",
    "steady_roll_rad": "steady roll [rad]",
}


class _Section(NamedTuple):
    """What the page says of one run or rig; the names are those of the template."""

    run: str
    rows: list[Comparison]
    figures: list[Markup]
    alone: bool = False


def write_page(result: Validation, path: Path, studies: Mapping[str, list[Response]] | None = None) -> Path:
    """Writes the page; a file that exists is replaced.

    Args:
        result: What came out.
        path: The HTML file.
        studies: Further tables by their titles, each against its first row.

    Returns:
        The path.

    Raises:
        ParameterError: matplotlib is not installed, or the file cannot be written.
    """
    text = page(result, studies or {})
    make_folder(path.parent, ParameterError)
    return write_text(path, text, ParameterError)


def page(result: Validation, studies: Mapping[str, list[Response]]) -> str:
    """The page; see `write_page`."""
    return render(
        "validation.html",
        result=result,
        studies=studies,
        study_columns=list(_STUDY_COLUMNS.values()),
        study_cells=_study_cells,
        sections=_sections(result),
    )


def _sections(result: Validation) -> list[_Section]:
    """First the rigs, then the runs."""
    by_run: dict[str, list[Comparison]] = {}
    for comparison in result.comparisons:
        by_run.setdefault(comparison.run, []).append(comparison)
    rack = [curve for curve in result.curves if curve.title == "rack"]
    sweeps = {"rack": rack, "wheel_travel": [curve for curve in result.curves if curve.title != "rack"]}
    sections = [
        _Section(run, rows, [as_svg(sweep_figure(sweeps[run]))] if run in sweeps else [])
        for run, rows in by_run.items()
        if run not in result.runs
    ]
    for run, ours in result.runs.items():
        reference = result.references.get(run)
        figures = [as_svg(draw(run, ours, reference)) for draw in RUN_FIGURES]
        sections.append(_Section(run, by_run.get(run, []), figures, alone=reference is None))
    return sections


def _study_cells(row: Response, first: Response) -> list[str]:
    """The values of a row and what they differ by from the first."""
    change = row.relative_to(first)
    return [
        f"{getattr(row, key):.5g} ("
        + (f"{1e3 * change[key]:+.0f} ms)" if key == "peak_time_s" else f"{100.0 * change[key]:+.2f} %)")
        for key in _STUDY_COLUMNS
    ]
