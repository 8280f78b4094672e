"""Write the paper's setting from a search: every number with its range and its reason.

    python tools/make_setting.py DIR [--number N]
    python tools/make_setting.py --studies

DIR is the folder of `activesteer tune match_paper -o DIR`; by default the best setting is taken. The tool rounds its
numbers to four digits, drives the 15 runs with 1 ms, and writes `activesteer/analysis/claims/paper_setting.toml`. It
keeps the reasons in the file for the statements that fail, and marks those that it does not find there.

Both forms write the studies of populations around the setting, `studies/around_paper_setting.toml` and
`studies/around_paper_setting_wide.toml`. Their ranges are as wide, relative to the setting, as those of
`studies/population.toml` relative to the nominal values: in the first for car, road, speed and sensors, in the second
for the driver, the cones and the gains too, and for what the setting alone changes: the tolerance band (half to
double) and the characteristic speed of the reference (5 %, the error of an identification).
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any, Final

from activesteer.analysis.claims import scorecard as setting_file
from activesteer.analysis.claims.scorecard import PAPER, Number, Setting, read_setting
from activesteer.config import toml_value
from activesteer.resources import find_study
from activesteer.studies.engine.factor_values import FactorValues, Prior, label_of
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.engine.tuning import Tuning, read_tuning
from activesteer.studies.reproduction import reproduce

STUDY: Final = "match_paper"
AROUND: Final = {"around_paper_setting": False, "around_paper_setting_wide": True}
"""Study around the setting -> whether driver, band and reference vary too."""
_CAR: Final = ("factors.", "load.", "road.", "speed_", "sensors.")
_BAND: Final = "controllers.ars.corrector.deadband_start_degps"
_WIDE: Final = {_BAND: {"log_uniform": [0.5, 2.0]}, "single_track.characteristic_speed_kmh": {"uniform": [0.95, 1.05]}}
"""Ranges of the second study that the population does not have, relative to the setting."""
FILE: Final = Path(setting_file.__file__).parent / "paper_setting.toml"
_HEAD: Final = """# The paper's setting: numbers for all that the paper leaves open, with which most statements hold.
# Selected by the verdicts of the claims, among the settings of `activesteer tune match_paper`: the most plausible of
# those with the most statements. It shows under which conditions the statements are so; it is no evidence for them. The
# ranges were committed before the search, which started from settings chosen by hand (docs/claims.md). Written by
# tools/make_setting.py.
"""


_AROUND_HEAD: Final = (
    "# Written by tools/make_setting.py from paper_setting.toml and population.toml, which have the reasons.\n"
)
_OTHER_UNIT: Final = {"driver.steering_rate_per_metre_degps": "driver.steering_rate_per_metre_radps"}
"""Key of the setting -> the same key in the unit of the population."""


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


def write(found: Tuning, number: int | None, jobs: int | None) -> Setting:
    """Write the setting, drive it, and write it again with the statements that fail."""
    sets = found.front if number is None else [one for one in found.trials if one.number == number]
    chosen = next(iter(sets), None)
    if chosen is None:
        raise SystemExit("the search has no such setting")
    kept, study = read_setting(PAPER).fails, read_study(STUDY)
    about = (
        f"The paper's setting, selected by its verdicts: {Prior(study).plausibility(chosen.values).value} "
        f"(implausibility {chosen.implausibility:.2f})"
    )
    made = Setting(about, tuple(numbers(study, chosen.values)), {})
    FILE.write_text(text(made), encoding="utf-8")
    read_setting.cache_clear()
    with tempfile.TemporaryDirectory() as folder:
        result = reproduce(folder, setting=PAPER, jobs=jobs)
    failed = [item.claim for item in result.scorecard.judged if not item.claim.passed]
    fails = {claim.id: kept.get(claim.id, f"TODO {claim.values} {claim.obstacle}") for claim in failed}
    made = Setting(about, made.numbers, fails)
    FILE.write_text(text(made), encoding="utf-8")
    return made


def around(name: str) -> StudyFile:
    """Return a study of a population around the setting."""
    wide, population = AROUND[name], read_study("population")
    spans = {factor.key: span(population, factor) for factor in population.factors}
    spans = {key: one for key, one in spans.items() if one and (wide or key.startswith(_CAR))} | (_WIDE if wide else {})
    factors: dict[str, Any] = {}
    for number in read_setting(PAPER).numbers:
        where = {"maneuvers": list(number.maneuvers)} if number.maneuvers else {}
        relative = spans.pop(_OTHER_UNIT.get(number.key, number.key), None)
        value = number.value
        if number.key.partition("deadband_")[1] and number.key != _BAND and isinstance(value, float):
            # The band keeps its shape, and is the same for both systems.
            start = float(next(one.value for one in read_setting(PAPER).numbers if one.key == _BAND))
            factors[number.key] = {"grid": [rounded(value / start)], "nominal": "times", "of": _BAND, **where}
        elif relative is None or not isinstance(value, float):
            factors[number.key] = {"grid": [value], **where}
        else:
            kind = next(iter(relative))
            shift = relative.get("nominal") == "plus"
            factors[number.key] = {
                kind: [rounded(value + end if shift else value * end) for end in relative[kind]],
                **where,
            }
    # What the setting leaves as it is. Lines in the middle of the lanes have no margin.
    spans.pop("lane.margin_m", None)
    table = {key: value for key, value in population.to_table().items() if key != "curves"} | {
        "title": f"Around the paper's setting: car, road, speed{', driver, band, reference' * wide} and sensors vary",
        "factors": factors | spans,
        "design": {"kind": "sobol", "samples": 64},
        "vehicles": [setting_file.VEHICLE],
    }
    return read_study(table)


def span(study: StudyFile, factor: Factor) -> dict[str, Any]:
    """Return the range of a factor relative to its nominal value, as the table of a factor, choices as they are."""
    given = factor.to_table()
    if factor.values or factor.nominal or factor.key == "lane.margin_m":
        return given
    nominal = Prior(study).nominal[factor.key]
    if nominal == 0.0:
        return {factor.kind: [factor.low, factor.high], "nominal": "plus"}
    return {factor.kind: [factor.low / nominal, factor.high / nominal], "nominal": "times"}


def write_around() -> None:
    """Write the studies of the populations around the setting."""
    for name in AROUND:
        path = find_study("population").parent / f"{name}.toml"
        path.write_text(f"{_AROUND_HEAD}{around(name).to_toml()}", encoding="utf-8")
        print(path)


def main() -> None:
    """Run the tool."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", metavar="DIR")
    parser.add_argument("--studies", action="store_true", help="write only the studies around the setting")
    parser.add_argument("--number", type=int, metavar="N", help="number of the set in the search")
    parser.add_argument("--jobs", type=int, metavar="N")
    options = parser.parse_args()
    if not options.studies:
        if options.folder is None:
            parser.error("DIR is needed: the folder of a search")
        found = write(read_tuning(STUDY, options.folder), options.number, options.jobs)
        print(f"{FILE}: {len(found.numbers)} numbers; fails: {' '.join(found.fails) or '-'}")
    write_around()


if __name__ == "__main__":
    main()
