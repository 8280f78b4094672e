"""Factors relative to the values of the files, and factors of some manoeuvres only."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer import study
from activesteer.errors import ParameterError, StudyError
from activesteer.scenario import resolve, value_of
from activesteer.studies.engine.factor_values import FactorValues
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.study_file import read_study
from tests.raising import raises
from tests.unit.studies.short import MANEUVER, TIMESTEP_S

OTHER = {**MANEUVER, "name": "other", "speed_kmh": 60, "road": {"mu": 0.5}}


def table(**factors: object) -> dict[str, object]:
    return {"maneuvers": [MANEUVER, OTHER], "factors": factors, "design": {"samples": 4}, "timestep_s": TIMESTEP_S}


def test_a_relative_factor_starts_from_each_manoeuvre() -> None:
    values = FactorValues(
        read_study(
            table(
                speed_kmh={"uniform": [0.9, 1.1], "nominal": "times"},
                **{"road.mu": {"uniform": [-0.1, 0.1], "nominal": "plus", "maneuvers": ["other"]}},
            )
        )
    )
    sample = {"speed_kmh": 1.1, "road.mu": 0.1}
    assert values.overrides(0, 0, sample) == {"speed_kmh": pytest.approx(88.0)}
    assert values.overrides(1, 0, sample) == {"speed_kmh": pytest.approx(66.0), "road.mu": pytest.approx(0.6)}


def test_a_factor_follows_an_earlier_one() -> None:
    factors = {
        "road.mu": {"uniform": [0.3, 0.9]},
        "speed_kmh": {"grid": [100.0], "nominal": "times", "of": "road.mu"},
    }
    values = FactorValues(read_study(table(**factors)))
    # The order of the sample does not count, that of the file does.
    assert values.overrides(0, 0, {"speed_kmh": 100.0, "road.mu": 0.5})["speed_kmh"] == pytest.approx(50.0)
    with pytest.raises(StudyError, match="not an earlier factor"):
        FactorValues(read_study(table(**dict(reversed(factors.items())))))


def test_a_factor_of_a_value_of_another_leaves_all_other_samples_alone() -> None:
    sensors = {
        "sensors.preset": {"choice": ["ideal", "production"]},
        "sensors.seed": {"choice": [1, 2], "when": {"sensors.preset": "production"}},
    }
    studied = read_study(table(**sensors))
    values = FactorValues(studied)
    assert values.overrides(0, 0, {"sensors.preset": "ideal", "sensors.seed": 2}) == {"sensors.preset": "ideal"}
    production = {"sensors.preset": "production", "sensors.seed": 2}
    assert values.overrides(0, 0, production) == production
    assert len(Plan(read_study(studied.to_table()))) == 8  # also where the first sample has ideal sensors


def test_runs_are_driven_with_the_values_and_rows_keep_the_sample() -> None:
    rows = study(
        table(speed_kmh={"uniform": [0.9, 1.1], "nominal": "times"}) | {"curves": ["speed_mps"]}, jobs=1
    ).to_pylist()
    assert [row["status"] for row in rows] == ["ok"] * 8
    assert [row["speed_kmh"] for row in rows[:4]] == [row["speed_kmh"] for row in rows[4:]]
    for row in rows:
        nominal_kmh = 80.0 if row["maneuver"] == "short" else 60.0
        assert 3.6 * row["curve_speed_mps"][0] == pytest.approx(nominal_kmh * row["speed_kmh"], rel=5e-3)
        assert len(row["curve_speed_mps"]) == math.ceil(2300 / 20)


def test_what_a_scenario_says_behind_a_key() -> None:
    scenario = resolve("slalom", overrides={"controllers.ars.limit_deg": 2.0})
    assert value_of(scenario, "speed_kmh") == pytest.approx(3.6 * scenario.maneuver.speed_mps)
    assert value_of(scenario, "vehicle.controllers.ars.limit_deg") == pytest.approx(2.0)
    assert value_of(scenario, "controllers.ars.limit_rad") == pytest.approx(np.radians(2.0))
    with raises(ParameterError, key="cones.no_such"):
        value_of(scenario, "cones.no_such")


@pytest.mark.parametrize(
    ("factors", "key", "value"),
    [
        ({"road.mu": {"uniform": [0.8, 1.0], "maneuvers": ["nowhere"]}}, "road.mu.maneuvers", "nowhere"),
        ({"road.mu": {"uniform": [0.8, 1.0], "nominal": "twice"}}, "road.mu.nominal", "twice"),
        (
            {"load.payload_position_m": {"uniform": [0.8, 1.0], "nominal": "times"}},
            "load.payload_position_m.nominal",
            None,
        ),
        ({"road.mu": {"uniform": [0.8, 1.0], "nominal": "times", "maneuvers": []}}, "road.mu.maneuvers", []),
        ({"road.mu": {"uniform": [0.8, 1.0], "when": {"speed_kmh": 80}}}, "road.mu.when.speed_kmh", "speed_kmh"),
        (
            {
                "road.mu": {"uniform": [0.8, 1.0], "when": {"sensors.preset": "best"}},
                "sensors.preset": {"choice": ["ideal", "production"]},
            },
            "road.mu.when.sensors.preset",
            "best",
        ),
        (
            {
                "road.mu": {"uniform": [0.8, 1.0], "when": {"sensors.preset": ["ideal", "best"]}},
                "sensors.preset": {"choice": ["ideal", "production"]},
            },
            "road.mu.when.sensors.preset",
            "best",
        ),
    ],
)
def test_what_cannot_be_is_told_before_anything_runs(factors: dict[str, object], key: str, value: object) -> None:
    with raises(StudyError, key=f"factors.{key}", value=value):
        Plan(read_study(table(**factors)))


def test_a_channel_that_is_not_recorded_is_told_before_anything_runs() -> None:
    with raises(StudyError, key="curves", value="yaw_rat_radps"):
        Plan(read_study(table(**{"road.mu": {"uniform": [0.8, 1.0]}}) | {"curves": ["yaw_rat_radps"]}))
