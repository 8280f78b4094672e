"""The paper's setting: its runs give the verdicts that its file lists, and fakes do not pass in it either."""

from __future__ import annotations

from typing import Any

import pytest

from activesteer import simulate
from activesteer.analysis.claims.judge import SCENARIO_OF, SCENARIOS, SYSTEMS
from activesteer.analysis.claims.scorecard import PAPER, read_setting
from activesteer.recording import Recording
from activesteer.studies.engine.study_file import read_study
from tests.fakes import Fake
from tests.reproduction.test_fakes import passed, turned_round
from tools.make_setting import AROUND, around


def driven(scenario: str, controllers: dict[str, Any]) -> dict[str, Recording]:
    overrides = read_setting(PAPER).overrides(scenario)
    return {name: simulate(scenario, controller, overrides=overrides) for name, controller in controllers.items()}


def check(scenario: str) -> None:
    fails = {claim for claim in read_setting(PAPER).fails if SCENARIO_OF[claim] == scenario}
    claims = SCENARIOS[scenario](driven(scenario, dict(zip(SYSTEMS, SYSTEMS, strict=True))))
    assert {claim.id for claim in claims if not claim.passed} == fails


def test_the_step_steer_gives_the_listed_verdicts() -> None:
    check("step_steer")


@pytest.mark.slow
@pytest.mark.parametrize("name", AROUND)
def test_the_studies_around_the_setting_are_as_the_tool_writes_them(name: str) -> None:
    found = read_study(name)
    assert found.to_toml() == around(name).to_toml()
    numbers = read_setting(PAPER).numbers
    values = {number.key: number.value for number in numbers if isinstance(number.value, float)}
    varied = [factor for factor in found.factors if factor.low < factor.high and factor.key in values]
    assert all(factor.low < values[factor.key] < factor.high for factor in varied if not factor.nominal)
    assert len(varied) == (17 if AROUND[name] else 5)


@pytest.mark.slow
@pytest.mark.parametrize("scenario", [name for name in SCENARIOS if name != "step_steer"])
def test_the_other_scenarios_give_the_listed_verdicts(scenario: str) -> None:
    check(scenario)


@pytest.mark.slow
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_system_turned_round_has_none_of_the_effects(scenario: str) -> None:
    runs = driven(scenario, {"none": "none", **{system: turned_round(system) for system in SYSTEMS[1:]}})
    assert passed(SCENARIOS[scenario](runs), Fake.REVERSED) == []
    none = runs["none"]
    assert passed(SCENARIOS[scenario](dict.fromkeys(SYSTEMS, none)), Fake.NONE_AS_BOTH) == []
