"""Phases: inputs over time, conditions on the car, mirrored runs, and what is refused."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest

import activesteer
from activesteer import Simulation
from activesteer.errors import ManeuverError
from activesteer.maneuver.phases import Phases, PhaseSequence, Seen
from activesteer.scenario import resolve
from tests.raising import raises

STILL = Seen(0.0, 0.0, 0.0, 20.0, 0.0, 0.0)
TURN = {"name": "turn", "steering_wheel_deg": 90.0, "steering_rate_degps": 90.0}


def phases(*listed: dict[str, object], **more: object) -> PhaseSequence:
    maneuver = resolve(
        {"kind": "phases", "speed_kmh": 72.0, "duration_s": 9.0, "phases": list(listed), **more}
    ).maneuver
    assert isinstance(maneuver, Phases)
    return maneuver.sequence()


def angles(sequence: PhaseSequence, times_s: list[float], seen: Seen = STILL) -> list[float]:
    return [math.degrees(sequence.setpoint(time_s, seen).steering_wheel_demand_rad) for time_s in times_s]


def test_the_steering_wheel_turns_at_its_rate_and_the_next_phase_begins_when_it_has() -> None:
    sequence = phases(TURN, {"name": "back", "steering_wheel_deg": 0.0, "steering_time_s": 2.0})
    assert angles(sequence, [0.0, 0.5, 1.0, 1.5, 3.0, 5.0]) == pytest.approx([0.0, 45.0, 90.0, 67.5, 0.0, 0.0])
    assert sequence.began == [(0.0, "turn"), (pytest.approx(1.0), "back")]


@pytest.mark.parametrize(
    ("until", "before", "after"),
    [
        ({"yaw_rate_above_degps": 10.0}, STILL, STILL._replace(yaw_rate_radps=0.2)),
        ({"roll_rate_within_degps": 1.5}, STILL._replace(roll_rate_radps=-0.1), STILL._replace(roll_rate_radps=0.02)),
        ({"ay_below_g": -0.1}, STILL, STILL._replace(ay_mps2=-1.0)),
        ({"speed_below_kmh": 50.0}, STILL, STILL._replace(speed_mps=13.0)),
        ({"y_above_m": 2.0, "time_s": 8.0}, STILL, STILL._replace(y_m=2.1)),
    ],
)
def test_a_phase_ends_when_its_condition_holds(until, before, after) -> None:
    sequence = phases({**TURN, "until": until}, {"name": "next"})
    assert angles(sequence, [0.1, 0.5], before)[-1] == pytest.approx(45.0)
    assert len(sequence.began) == 1
    # The angle that is reached stays.
    assert angles(sequence, [0.6, 2.0], after) == pytest.approx([54.0, 54.0])
    assert sequence.began[-1] == (0.6, "next")


def test_a_phase_ends_at_its_time_though_its_condition_does_not_hold() -> None:
    sequence = phases({**TURN, "until": {"y_above_m": 2.0, "time_s": 0.5}}, {"name": "next"})
    assert angles(sequence, [0.4, 0.5, 0.9]) == pytest.approx([36.0, 45.0, 45.0])
    assert sequence.began[-1] == (0.5, "next")


def test_a_car_that_stands_at_the_start_settles_with_the_brake_of_its_first_phase() -> None:
    for speed_kmh, pedal in ((0.0, 0.4), (72.0, 0.0)):
        sequence = phases({"name": "hold", "brake_pedal": 0.4, "brake_time_s": 0.2}, speed_kmh=speed_kmh)
        assert sequence.maneuver.settling_setpoint().brake_pedal == pedal


def test_to_the_right_angles_and_conditions_are_mirrored() -> None:
    end = {**TURN, "until": {"yaw_rate_above_degps": 10.0}}
    sequence = phases(end, {"name": "next"}, direction="right")
    assert angles(sequence, [0.5], STILL._replace(yaw_rate_radps=0.5)) == pytest.approx([-45.0])
    sequence.setpoint(0.6, STILL._replace(yaw_rate_radps=-0.5))
    assert sequence.began[-1] == (0.6, "next")


def test_speed_pedal_and_repetition() -> None:
    drive = {"name": "drive", "brake_pedal": 0.0, "speed_mps": 10.0, "acceleration_mps2": 2.0, "until": {"time_s": 6.0}}
    stop = {"name": "stop", "brake_pedal": 0.4, "brake_time_s": 0.2, "speed_mps": 0.0, "until": {"time_s": 1.0}}
    sequence = phases(drive, stop, speed_kmh=0.0, repeat=2, duration_s=20.0)
    found = [sequence.setpoint(time_s, STILL) for time_s in (1.0, 5.5, 6.1, 6.5, 8.0)]
    assert [one.speed_demand_mps for one in found] == pytest.approx([2.0, 10.0, 0.0, 0.0, 2.0])
    assert [one.brake_pedal for one in found] == pytest.approx([0.0, 0.0, 0.2, 0.4, 0.0])
    assert [one.hold_speed for one in found] == [True, True, False, False, True]
    assert [name for _, name in sequence.began] == ["drive", "stop", "drive"]


def test_a_factor_is_searched_for_and_a_copy_goes_on_alike() -> None:
    maneuver = resolve("fishhook").maneuver
    assert maneuver.search is not None
    found = maneuver.search.accept(math.radians(30.0))
    sequence = found.sequence()
    sequence.setpoint(0.5, STILL)
    assert math.degrees(sequence.setpoint(0.7, STILL).steering_wheel_demand_rad) == pytest.approx(144.0)
    other = copy.deepcopy(sequence)
    assert angles(sequence, [0.8, 1.0]) == angles(other, [0.8, 1.0])
    assert angles(sequence, [5.0]) == pytest.approx([-195.0])


@pytest.mark.parametrize(
    ("phase", "key"),
    [
        ({"name": "a", "steering_wheel_deg": 1.0, "steering_factor": 1.0}, "steering_factor"),
        ({"name": "a", "steering_rate_degps": 100.0}, "steering_rate_radps"),
        ({"name": "a", "acceleration_mps2": 1.0}, "acceleration_mps2"),
        ({"name": "a", "until": {}}, "until"),
        ({"name": "a", "until": {"yaw_rate_degps": 1.0}}, "until.yaw_rate_degps"),
        ({"steering_wheel_deg": 1.0}, "name"),
    ],
)
def test_what_has_no_effect_or_is_unknown_is_refused(phase, key) -> None:
    with raises(ManeuverError, key=f"phases.0.{key}"):
        phases(phase)
    with raises(ManeuverError, key="phases"):
        phases()


def test_a_run_records_its_phases_and_goes_back_to_them() -> None:
    end = {**TURN, "steering_rate_degps": 400.0, "until": {"yaw_rate_above_degps": 5.0}}
    table = {"kind": "phases", "speed_kmh": 72.0, "duration_s": 1.2, "settle_s": 0.3, "phases": [
        {"name": "straight", "until": {"time_s": 0.2}}, end, {"name": "hold"},
    ]}  # fmt: skip
    simulation = Simulation(table)
    simulation.advance(250)
    state = simulation.save_state()
    simulation.run()
    recording = simulation.recording()
    events = recording.metadata["events"]
    assert [event["what"] for event in events] == ["straight", "turn", "hold"]
    rate = np.degrees(recording["yaw_rate_radps"])
    assert recording.time_s[np.argmax(rate > 5.0)] == pytest.approx(events[-1]["time_s"], abs=0.002)
    simulation.restore_state(state)
    simulation.run()
    again = simulation.recording()
    assert np.array_equal(again.values, recording.values)
    assert again.metadata["events"] == events
    assert np.array_equal(activesteer.simulate(table).values, recording.values)
