"""The comparison as one HTML page with its pictures in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from activesteer.pages import Page, Section, Table, Text, failed, passed
from tests.reference.chrono.comparison import Comparison
from tests.reference.chrono.figures import cross_picture, run_picture, sweep_picture, uneven_picture
from tests.reference.chrono.programme import Validation
from tests.reference.chrono.study import Response

_STUDY_COLUMNS: Final = {
    "steady_yaw_rate_radps": "steady yaw rate [rad/s]",
    "peak_yaw_rate_radps": "peak [rad/s]",
    "peak_time_s": "at [s]",
    "steady_sideslip_rad": "steady sideslip [rad]",
    "peak_sideslip_rad": "greatest [rad]",
    "steady_roll_rad": "steady roll [rad]",
}


def validation_page(result: Validation, studies: Mapping[str, list[Response]] | None = None) -> Page:
    """Return the page.

    Args:
        result: Result of the comparison.
        studies: Further tables by their titles; each compares its rows with its first row.

    Raises:
        ParameterError: matplotlib is not installed.
    """
    reference, within = result.reference, result.judged - len(result.outside)
    count = (failed if result.outside else passed)(str(within))
    lead = [
        count + f" of {result.judged} comparisons keep their tolerance; {len(result.comparisons) - result.judged} are "
        "reported without a tolerance. Corridors: 20 ms in time, 2 % of peak to peak in amplitude, in the manner of "
        "ISO 19364 and ISO 19365.",
    ]
    sections = [Section("Outside", tables=[comparison_table(result.outside)])] if result.outside else []
    if reference.notes:
        sections.append(Section("Differences, and which code is right", points=reference.notes))
    sections += [Section(title, tables=[study_table(rows)]) for title, rows in (studies or {}).items()]
    sections += _runs(result)
    title = f"activesteer: {reference.name}"
    return Page(title, f"{reference.vehicle} against {reference.code}", lead, sections)


def _runs(result: Validation) -> list[Section]:
    """Return the sections of the rigs, then those of the runs."""
    by_run: dict[str, list[Comparison]] = {}
    for comparison in result.comparisons:
        by_run.setdefault(comparison.run, []).append(comparison)
    rack = [curve for curve in result.curves if curve.title == "rack"]
    sweeps = {"rack": rack, "wheel_travel": [curve for curve in result.curves if curve.title != "rack"]}
    sections = []
    for run, rows in by_run.items():
        if run not in result.runs:
            pictures = [sweep_picture(sweeps[run])] if run in sweeps else []
            sections.append(Section(run, pictures=pictures, tables=[comparison_table(rows)]))
    for run, ours in result.runs.items():
        reference = result.references.get(run)
        if reference is not None and "ay" not in reference:
            pictures = [uneven_picture(run, ours, reference)]
        else:
            pictures = [picture(run, ours, reference) for picture in (run_picture, cross_picture)]
        texts = (
            ["The reference of this run is not known here; the page shows our run alone."] if reference is None else []
        )
        tables = [comparison_table(by_run[run])] if run in by_run else []
        sections.append(Section(run, texts, tables, pictures=pictures))
    return sections


def comparison_table(rows: Sequence[Comparison]) -> Table:
    """Return comparisons with their verdicts."""
    verdicts: dict[bool | None, Text] = {None: "", True: passed("inside"), False: failed("outside")}
    return Table(
        "",
        ["run", "quantity", "ours", "reference", "difference", "tolerance", ""],
        [(*row.words(), verdicts[row.inside]) for row in rows],
        frozenset(number for number, row in enumerate(rows) if row.inside is False),
        frozenset(number for number, row in enumerate(rows) if row.inside is None),
        "comparisons",
    )


def study_table(rows: Sequence[Response]) -> Table:
    """Return the values of each row, and their differences from the first row."""
    cells = []
    for row in rows:
        change = row.relative_to(rows[0])
        cells.append([
            row.name,
            *(
                f"{getattr(row, key):.5g} ("
                + (f"{1e3 * change[key]:+.0f} ms)" if key == "peak_time_s" else f"{100.0 * change[key]:+.2f} %)")
                for key in _STUDY_COLUMNS
            ),
        ])  # fmt: skip
    return Table("", ["", *_STUDY_COLUMNS.values()], cells, kind="comparisons")
