"""Controllers over a population: the same samples for all, their counts, and their description."""

from __future__ import annotations

import json
import math
import shlex
from argparse import Namespace

import pyarrow as pa
import pytest

from activesteer.commands.arguments import overrides_of
from activesteer.core.metric_table import SIDESLIP_PEAKS
from activesteer.errors import ParameterError, StudyError
from activesteer.studies.engine.factor_values import FactorValues, label_of
from activesteer.studies.engine.plan import Plan
from tests.raising import raises
from tools.comparison import (
    comparison_text,
    population_targets,
)
from tools.population_results import STEERING_EFFORT, Population, SystemEffect, comparison_study, summarise
from tools.proportions import Proportion

SPIN_RAD = 1.0


def made_up(**peaks: list[float | None]) -> Population:
    """Peaks of the sideslip in samples of a sine with dwell [rad]; None if the run did not finish."""
    planned = comparison_study(tuple(peaks), 8)
    samples = planned.samples()[0]
    rows = [
        {
            "run": 0, "sample": sample, "maneuver": "sine_with_dwell", "vehicle": "compact", "controller": name,
            **samples[sample], "status": "failed" if peak is None else "ok", "error": "", "sideslip_peak_abs_rad": peak,
        }
        for name, values in peaks.items()
        for sample, peak in enumerate(values)
    ]  # fmt: skip
    return summarise(pa.Table.from_pylist(rows), planned)


def effect_of(found: Population, controller: str) -> SystemEffect:
    [effect] = [effect for effect in found.systems if effect.controller == controller]
    return effect


def test_the_best_of_the_references_is_taken_sample_by_sample():
    found = made_up(
        none=[SPIN_RAD, SPIN_RAD, 0.1, 0.1],
        ars=[0.10, 0.30, 0.05, 0.05],
        afs=[0.20, 0.20, 0.05, 0.05],
        esc=[0.30, 0.10, 0.05, 0.05],
        lqr=[0.09, 0.11, 0.05, SPIN_RAD],
    )
    lqr = effect_of(found, "lqr")
    assert lqr.lower == Proportion(1, 4)  # as low is not lower
    assert lqr.saved == Proportion(2, 2)
    assert lqr.spoiled == Proportion(1, 2)
    assert effect_of(found, "ars").lower == Proportion(0, 0)
    assert lqr.median_change(SIDESLIP_PEAKS) == pytest.approx((-0.89 - 0.05) / 2.0)
    assert math.isnan(lqr.median_change([STEERING_EFFORT]))
    assert (lqr.harmed, lqr.harmed_unspun) == (Proportion(1, 4), Proportion(1, 2))  # the lost one
    assert not any(target.passed for target in population_targets(found) if "harms" in target.text)


def test_a_run_that_did_not_end_is_lower_than_nothing_and_all_are_lower_than_it():
    found = made_up(none=[0.1, 0.1], ars=[None, 0.1], afs=[None, 0.1], esc=[None, 0.1], lqr=[5.0, None])
    lqr = effect_of(found, "lqr")
    assert lqr.lower == Proportion(1, 2)
    assert lqr.spoiled == Proportion(2, 2)
    assert found.failed == 4


def test_the_worst_runs_come_with_the_command_that_repeats_them():
    found = made_up(none=[0.3, 0.1, 0.1], lqr=[0.1, 0.1, SPIN_RAD])
    [run] = found.worst
    assert (run.controller, run.sample, run.growth) == ("lqr", 2, {"lost": 1.0})
    planned = comparison_study(("none", "lqr"), 3)
    words = shlex.split(run.command)
    assert words[:5] == ["activesteer", "run", "sine_with_dwell", "-c", "lqr"]
    given = overrides_of(Namespace(override_files=None, overrides=words[words.index("--set") + 1 :: 2]))
    sample = planned.samples()[0][2]
    needed = planned.overrides | FactorValues(planned).overrides(0, 0, sample)
    assert given == {key: value for key, value in needed.items() if key != "driver"}
    assert ("--driver" in words) == (sample["driver"] != "typical")
    assert run.command in comparison_text(found)


def test_harm_is_counted_car_by_car_with_and_without_the_cars_that_leave_their_line():
    planned = comparison_study(("none", "esc", "lqr"), 2)
    samples = planned.samples()[0]
    metres = {  # stopping distance and deviation from the line
        ("compact", "none"): (50.0, 0.2), ("compact", "esc"): (50.0, 0.2), ("compact", "lqr"): (50.7, 0.2),
        ("sedan", "none"): (50.0, 3.0), ("sedan", "esc"): (50.0, 0.7), ("sedan", "lqr"): (63.0, 0.1),
    }  # fmt: skip
    rows = [
        {
            "run": 0, "sample": 0, "maneuver": "split_mu_braking", "vehicle": vehicle, "controller": name, **samples[0],
            "status": "ok", "error": "", "stopping_distance_m": stop_m, "lateral_deviation_max_m": aside_m,
            "heading_end_rad": 0.0,
        }
        for (vehicle, name), (stop_m, aside_m) in metres.items()
    ]  # fmt: skip
    found = summarise(pa.Table.from_pylist(rows), planned)
    compact, sedan = (
        next(car for car in found.cars if (car.vehicle, car.controller) == (vehicle, "lqr"))
        for vehicle in ("compact", "sedan")
    )
    assert (compact.harmed, compact.harmed_anywhere) == (Proportion(1, 1), Proportion(1, 1))
    assert compact.worst("stopping") == pytest.approx(0.7)
    assert (sedan.harmed, sedan.harmed_anywhere) == (Proportion(0, 1), Proportion(1, 1))
    assert sedan.worst("stopping_elsewhere") == pytest.approx(13.0)
    assert found.total("lqr").harmed_anywhere == Proportion(2, 2)
    assert found.total("lqr").worst("stopping_elsewhere") == pytest.approx(13.0)
    [against] = [effect for effect in found.against_required if effect.vehicle == "sedan"]
    assert against.worst("stopping_elsewhere") == pytest.approx(13.0)  # esc leaves the free side of the lane too
    again = Population.from_json(json.loads(json.dumps(found.to_json(), allow_nan=False)))
    assert again.to_json() == found.to_json()


def test_a_turn_that_the_road_does_not_bear_is_not_counted():
    planned = comparison_study(("none", "lqr"), 2)
    samples = planned.samples()[0]
    rows = [
        {
            "run": 0, "sample": sample, "maneuver": "brake_in_turn", "vehicle": "compact", "controller": name,
            **samples[sample], "status": "failed" if sample else "ok",
            "error": "ManeuverError: no angle found" if sample else "",
            "sideslip_peak_abs_rad": None if sample else 0.1,
        }
        for sample in (0, 1)
        for name in ("none", "lqr")
    ]  # fmt: skip
    found = summarise(pa.Table.from_pylist(rows), planned)
    assert effect_of(found, "lqr").harmed == Proportion(0, 1)
    assert (found.samples, found.failed) == (2, 2)

    only_lqr = [
        row | ({"status": "ok", "error": "", "sideslip_peak_abs_rad": 0.1} if row["controller"] == "none" else {})
        for row in rows
    ]
    assert effect_of(summarise(pa.Table.from_pylist(only_lqr), planned), "lqr").harmed == Proportion(1, 2)


def test_what_is_stored_is_what_was_found():
    found = made_up(none=[0.3], ars=[0.2], afs=[0.2], esc=[0.2], lqr=[0.1])
    again = Population.from_json(json.loads(json.dumps(found.to_json(), allow_nan=False)))
    assert again.to_json() == found.to_json()
    assert again.total("lqr").lower == Proportion(1, 1)
    with raises(StudyError, cause=KeyError):
        Population.from_json({"claims": []})


def test_every_sample_drives_one_manoeuvre_around_the_limit_of_its_road(monkeypatch: pytest.MonkeyPatch):
    # `test_every_study_that_comes_along_can_be_begun[comparison]` checks every factor in every car.
    monkeypatch.setattr("activesteer.studies.engine.plan._check", lambda *_: None)
    planned = comparison_study(("none", "lqr"), 7, vehicle="compact")
    plan = Plan(planned)
    assert len(plan) == 7 * 2
    runs = [plan.request(run) for run in range(0, len(plan), 2)]
    assert sorted(run.maneuver for run in runs) == [*range(7)]
    preset, voltage = "rear_actuator.preset", "rear_actuator.supply_voltage_V"
    assert all((voltage in run.overrides) == (run.overrides[preset] != "hinge") for run in runs)
    assert all(plan.request(run.run + 1).overrides == run.overrides for run in runs)  # the next controller
    values, place = FactorValues(planned), [label_of(item) for item in planned.maneuvers].index("double_lane_change")
    slippery = values.overrides(place, 0, {"speed_kmh": 1.1, "road.mu": 0.4})
    assert slippery["speed_kmh"] == pytest.approx(1.1 * 80.0 * math.sqrt(0.4 / 0.9))


def test_without_the_car_without_control_nothing_is_driven():
    with raises(ParameterError, key="--controllers", allowed=["none"]):
        comparison_study(("ars", "afs", "lqr"), 4)
