"""Write the paper's setting from a match: every number with its range and its reason.

    python tools/make_setting.py DIR [--number N]

DIR is the folder of `activesteer match match_paper -o DIR`; by default the best setting is taken. The tool rounds its
numbers to four digits, drives the 15 runs with 1 ms, and writes `activesteer/analysis/claims/paper_setting.toml`. It
keeps the reasons in the file for the statements that fail, and marks those that it does not find there.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any, Final

from activesteer.analysis.claims import setting as setting_file
from activesteer.analysis.claims.setting import PAPER, Number, Setting, read_setting
from activesteer.config import toml_value
from activesteer.resources import find_study
from activesteer.studies.engine.factor_values import FactorValues, label_of
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.matching import Match, read_match
from activesteer.studies.engine.study_file import StudyFile
from activesteer.studies.paper.reproduction import reproduce

STUDY: Final = "match_paper"
FILE: Final = Path(setting_file.__file__).parent / "paper_setting.toml"
_HEAD: Final = """# The paper's setting: numbers for all that the paper leaves open, with which most statements hold.
# Selected by the verdicts of the claims, among the settings of `activesteer match match_paper`: the most plausible of
# those with the most statements. It shows under which conditions the statements are so; it is no evidence for them. The
# ranges were committed before the search, which started from settings chosen by hand (docs/claims.md). Written by
# tools/make_setting.py.
"""


def reasons(study: str = STUDY) -> dict[str, str]:
    """Return key -> comment above the factor in the study file."""
    found: dict[str, str] = {}
    words: list[str] = []
    fresh = True
    for line in find_study(study).read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            words = [*words, line[1:].strip()] if not fresh else [line[1:].strip()]
            fresh = False
        elif line.startswith('"') and "=" in line:
            found.setdefault(line.split('"')[1], " ".join(words))
            fresh = True
        else:
            fresh = True
    return found


def numbers(study: StudyFile, values: dict[str, Any]) -> list[Number]:
    """Return the numbers of a setting, absolute and rounded, manoeuvre by manoeuvre where they differ."""
    resolver, why = FactorValues(study), reasons()
    names = [label_of(item) for item in study.maneuvers]
    found: list[Number] = []
    for factor in study.factors:
        by_value: dict[Any, list[str]] = {}
        bounds: dict[Any, tuple[Any, Any, Any]] = {}
        for place, name in enumerate(names):
            overrides = resolver.overrides(place, 0, values)
            if factor.key in overrides:
                value = rounded(overrides[factor.key])
                by_value.setdefault(value, []).append(name)
                bounds[value] = ends(study, resolver, factor, place, values)
        for value, where in by_value.items():
            nominal, low, high = bounds[value]
            everywhere = tuple(where) if len(where) < len(names) else ()
            found.append(Number(factor.key, value, nominal, why.get(factor.key, ""), low, high, everywhere))
    return found


def ends(
    study: StudyFile, resolver: FactorValues, factor: Factor, place: int, values: dict[str, Any]
) -> tuple[Any, Any, Any]:
    """Return the nominal value and the ends of the range of a factor, absolute."""
    from activesteer.scenario import resolve, value_of  # noqa: PLC0415

    scenario = resolve(study.maneuvers[place], study.vehicles[0], study.overrides, study.driver)
    nominal = rounded(value_of(scenario, factor.key))
    if factor.values:
        return nominal, None, None
    low, high = (
        rounded(resolver.overrides(place, 0, {**values, factor.key: end})[factor.key])
        for end in (factor.low, factor.high)
    )
    return nominal, low, high


def rounded(value: Any) -> Any:
    """Return a number with four digits, and anything else as it is."""
    return float(f"{value:.4g}") if isinstance(value, (int, float)) else value


def text(found: Setting) -> str:
    """Return a setting as a file."""
    lines = [_HEAD, f"title = {toml_value(found.title)}", "", "[fails]"]
    lines += [f"{claim} = {json.dumps(reason)}" for claim, reason in found.fails.items()]
    for number in found.numbers:
        lines += ["", "[[numbers]]"]
        lines += [
            f"{key} = {json.dumps(list(value) if isinstance(value, tuple) else value)}"
            for key, value in vars(number).items()
            if value is not None and value != ()
        ]
    return "\n".join(lines) + "\n"


def write(found: Match, number: int | None, jobs: int | None) -> Setting:
    """Write the setting, drive it, and write it again with the statements that fail."""
    chosen = found.best if number is None else next(one for one in found.candidates if one.number == number)
    if chosen is None:
        raise SystemExit("the match has no complete setting")
    kept = read_setting(PAPER).fails
    size = found.prior.implausibility(chosen.values)
    about = (
        f"The paper's setting, selected by its verdicts: {found.prior.plausibility(chosen.values).value} "
        f"(implausibility {size:.2f})"
    )
    made = Setting(about, tuple(numbers(found.study, chosen.values)), {})
    FILE.write_text(text(made), encoding="utf-8")
    read_setting.cache_clear()
    with tempfile.TemporaryDirectory() as folder:
        result = reproduce(folder, setting=PAPER, jobs=jobs)
    failed = [item.claim for item in result.scorecard.judged if not item.claim.passed]
    fails = {claim.id: kept.get(claim.id, f"TODO {claim.values} {claim.obstacle}") for claim in failed}
    made = Setting(about, made.numbers, fails)
    FILE.write_text(text(made), encoding="utf-8")
    return made


def main() -> None:
    """Run the tool."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument("--number", type=int, metavar="N", help="number of the setting in the match")
    parser.add_argument("--jobs", type=int, metavar="N")
    options = parser.parse_args()
    found = write(read_match(STUDY, options.folder), options.number, options.jobs)
    print(f"{FILE}: {len(found.numbers)} numbers; fails: {' '.join(found.fails) or '-'}")


if __name__ == "__main__":
    main()
