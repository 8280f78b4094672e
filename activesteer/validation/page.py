"""The comparison as one HTML page with its pictures in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from typing import Final

from activesteer.errors import ParameterError
from activesteer.files import make_folder, write_text
from activesteer.validation.comparison import Comparison
from activesteer.validation.figures import RUN_FIGURES, as_svg, sweep_figure
from activesteer.validation.programme import Validation
from activesteer.validation.study import Response
from activesteer.version import __version__

_STYLE: Final = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 70rem; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; font-size: 13px; } td, th { padding: 2px 10px; text-align: right; }
td:nth-child(-n+2), th:nth-child(-n+2) { text-align: left; } tr { border-bottom: 1px solid #e4e4e4; }
tr.outside { background: #f9d9d3; } tr.told td { color: #777; } svg { max-width: 100%; height: auto; }
details { margin: .4rem 0 1.2rem; } summary { cursor: pointer; }
"""


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
    data = result.reference
    kept = result.judged - len(result.outside)
    parts = [
        f"<h1>{escape(data.vehicle)} against {escape(data.code)}</h1>",
        f"<p><b>{kept}</b> of {result.judged} comparisons keep their tolerance; "
        f"{len(result.comparisons) - result.judged} are told without one. Corridors: 20 ms in time, 2 % of peak to "
        "peak in amplitude, in the manner of ISO 19364 and ISO 19365.</p>",
    ]
    if result.outside:
        parts.append("<h2>Outside</h2>" + _table(result.outside))
    if data.notes:
        parts.append("<h2>Where they differ, and which is right</h2><ul>")
        parts += [f"<li>{escape(note)}</li>" for note in data.notes]
        parts.append("</ul>")
    parts += [f"<h2>{escape(title)}</h2>" + _study_table(rows) for title, rows in studies.items()]
    by_run: dict[str, list[Comparison]] = {}
    for comparison in result.comparisons:
        by_run.setdefault(comparison.run, []).append(comparison)
    for run, rows in by_run.items():
        if run in result.runs:
            continue
        parts.append(f"<h2>{escape(run)}</h2>")
        if run == "wheel_travel":
            parts.append(as_svg(sweep_figure([curve for curve in result.curves if curve.title != "rack"])))
        if run == "rack":
            parts.append(as_svg(sweep_figure([curve for curve in result.curves if curve.title == "rack"])))
        parts.append(_table(rows))
    for run, ours in result.runs.items():
        reference = result.references.get(run)
        parts.append(f"<h2>{escape(run)}</h2>")
        if reference is None:
            parts.append("<p>The reference of this run is not known here; ours alone.</p>")
        parts += [as_svg(draw(run, ours, reference)) for draw in RUN_FIGURES]
        if run in by_run:
            parts.append(_table(by_run[run]))
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>activesteer validate: {escape(data.name)}'
        f"</title><style>{_STYLE}</style></head><body>{''.join(parts)}<p>activesteer {escape(__version__)}</p>"
        "</body></html>"
    )


def _table(rows: Iterable[Comparison]) -> str:
    heads = ("run", "quantity", "ours", "reference", "difference", "tolerance", "")
    lines = ["<table><tr>" + "".join(f"<th>{head}</th>" for head in heads) + "</tr>"]
    for row in rows:
        mark = {True: ("inside", "inside"), False: ("outside", "outside"), None: ("told", "")}[row.inside]
        cells = "".join(f"<td>{escape(word)}</td>" for word in (*row.words(), mark[1]))
        lines.append(f'<tr class="{mark[0]}">{cells}</tr>')
    return "".join([*lines, "</table>"])


def _study_table(rows: list[Response]) -> str:
    columns = {
        "steady_yaw_rate_radps": "steady yaw rate [rad/s]",
        "peak_yaw_rate_radps": "peak [rad/s]",
        "peak_time_s": "at [s]",
        "steady_sideslip_rad": "steady sideslip [rad]",
        "peak_sideslip_rad": "greatest [rad]",
        "steady_roll_rad": "steady roll [rad]",
    }
    lines = ["<table><tr><th></th>" + "".join(f"<th>{head}</th>" for head in columns.values()) + "</tr>"]
    for row in rows:
        change = row.relative_to(rows[0])
        cells = []
        for key in columns:
            by = f"{1e3 * change[key]:+.0f} ms" if key == "peak_time_s" else f"{100.0 * change[key]:+.2f} %"
            cells.append(f"<td>{getattr(row, key):.5g} ({by})</td>")
        lines.append(f"<tr><td>{escape(row.name)}</td>{''.join(cells)}</tr>")
    return "".join([*lines, "</table>"])
