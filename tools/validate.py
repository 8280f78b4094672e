"""Compare the sedan with Project Chrono's sedan: every number, a page, and our runs as CSV files.

    python tools/validate.py [-o DIR] [--reference DIR] [--study] [--json]

The exit status is 1 if a comparison is outside its tolerance. `docs/validation.md` explains the result.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from activesteer.core.conventions import DEFAULT_TIMESTEP_S
from activesteer.core.files import write_json
from activesteer.errors import ActiveSteerError, ParameterError
from activesteer.pages import write_page
from tests.reference.chrono.comparison import Comparison, to_json
from tests.reference.chrono.programme import validate, write_runs
from tests.reference.chrono.study import TITLES, responses
from tests.reference.chrono.validation_page import study_table, validation_page


def main() -> int:
    """Compare, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, help="folder for page, JSON and runs")
    parser.add_argument("--reference", type=Path, help="folder with further runs NAME.csv of Chrono, and roads.json")
    parser.add_argument("--study", action="store_true", help="also: effect of tyre conventions and of the step size")
    parser.add_argument("--timestep", type=float, default=DEFAULT_TIMESTEP_S, help="step of the simulation [s]")
    parser.add_argument("--jobs", type=int, help="number of processes")
    parser.add_argument("--json", action="store_true", help="print JSON and nothing else")
    options = parser.parse_args()
    try:
        return _validate(options)
    except ActiveSteerError as error:
        print(f"tools/validate.py: {error}", file=sys.stderr)
        return 1


def _validate(options: argparse.Namespace) -> int:
    result = validate(
        more=options.reference,
        timestep_s=options.timestep,
        unknown_runs=options.output is not None,
        jobs=options.jobs,
    )
    tables = responses(result.reference, lambda _share, _what: None, options.jobs) if options.study else {}
    titled = {TITLES[key]: rows for key, rows in tables.items()}
    if options.output is not None:
        write_page(validation_page(result, titled), options.output / "validation.html")
        write_json(options.output / "validation.json", to_json(result.comparisons), ParameterError)
        write_runs(result, options.output / "runs")
    if options.json:
        rows = {key: [row._asdict() for row in found] for key, found in tables.items()}
        print(json.dumps(to_json(result.comparisons) | rows, indent=2))
        return 1 if result.outside else 0
    print("\n".join(_lines(result.comparisons)))
    kept = result.judged - len(result.outside)
    print(f"{kept} of {result.judged} comparisons within tolerance (! outside, ~ no tolerance)")
    for title, rows in titled.items():
        print("\n".join((title, *study_table(rows).lines())))
    return 1 if result.outside else 0


def _lines(rows: Sequence[Comparison]) -> Iterator[str]:
    """Yield the comparisons in 80 columns, grouped by their runs."""
    for run, group in itertools.groupby(rows, lambda row: row.run):
        yield run
        for row in group:
            _, quantity, ours, reference, error, tolerance = row.words()
            mark = {None: "~", True: " ", False: "!"}[row.inside]
            percent = " %" if error.endswith("%") else "  "
            numbers = f"{ours.split()[0]:>9}  {reference:12.12} {error.split()[0]:>10}{percent}  {tolerance}"
            yield f"{mark} {quantity:31.31} {numbers}"


if __name__ == "__main__":
    sys.exit(main())
