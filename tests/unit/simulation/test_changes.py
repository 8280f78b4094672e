"""Changes on the way: what they do, what they leave alone, what they refuse, and how they are recorded."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import activesteer
from activesteer import ActuatorCommand, Simulation
from activesteer.errors import ManeuverError, ParameterError
from activesteer.recording import Recording
from activesteer.recording.contents import events_of
from activesteer.scenario import value_of
from tests.raising import raises

STEP = {"duration_s": 1.2, "settle_s": 0.3, "steer.steering_wheel_deg": 30.0, "steer.start_s": 0.2}


class Follows:
    """A filter on the yaw rate, with a value computed on the way."""

    derived = ("squared",)

    def __init__(self, gain_s: float = 0.1, sign: float = 1.0) -> None:
        self.gain_s = gain_s
        self.sign = sign
        self.filtered = 0.0
        self.squared: float | None = None

    def step(self, command, measurement):
        self.squared = self.gain_s**2 if self.squared is None else self.squared
        self.filtered += 0.01 * (measurement.yaw_rate_radps - self.filtered)
        demand_rad = self.sign * self.gain_s * self.filtered
        return ActuatorCommand(rear_steer_demand_rad=demand_rad, correction_rad=self.squared)


def step_steer(controller: object = "none", **more: object) -> Simulation:
    return Simulation("step_steer", controller, overrides={**STEP, **more})


def test_friction_changes_from_the_next_step_on_and_is_an_event_of_the_file(tmp_path: Path) -> None:
    simulation = step_steer()
    simulation.advance(500)
    simulation.set("road.mu", 0.3)
    simulation.run()
    recording = simulation.recording()
    assert recording["fl_mu"][499] == recording["rr_mu"][0] > 0.5
    assert (recording["rr_mu"][501:] == 0.3).all()
    recording.save(tmp_path / "a.mcap")
    again = Recording.open(tmp_path / "a.mcap")
    assert events_of(again.metadata) == [(0.5, "set", "road.mu = 0.3")] == list(simulation.events)


def test_a_remark_is_an_event_at_the_current_time() -> None:
    simulation = Simulation("straight_line", overrides={"duration_s": 0.2})
    simulation.advance(100)
    simulation.note("brakes are hot")
    for wrong in ("", "a" * 2001):
        with raises(ParameterError, key="what"):
            simulation.note(wrong)
    simulation.run()
    assert events_of(simulation.recording().metadata) == [(0.1, "note", "brakes are hot")]


def test_a_car_that_cannot_keep_the_speed_of_a_response_is_an_event_at_the_end(tmp_path: Path) -> None:
    for speed_kmh, noted in ((80.0, []), (300.0, [(2.5, "note")])):
        simulation = step_steer(speed_kmh=speed_kmh, duration_s=2.5)
        with simulation.recorded_to(tmp_path / "a.mcap"):
            simulation.run()
            for _ in range(2):  # the second adds none
                recording = simulation.recording()
            simulation.end_file(recording)
        events = events_of(recording.metadata)
        assert [event[:2] for event in events] == noted
        assert events == events_of(Recording.open(tmp_path / "a.mcap").metadata)
        assert all("300 km/h are demanded" in event.what and "2 %" in event.what for event in events)


@pytest.mark.parametrize(
    ("controller", "key"), [("ars", "ars.limit_deg"), ("lqr", "servos.lag_s"), (Follows, "Follows.gain_s")]
)
def test_a_parameter_set_to_its_value_changes_nothing_to_the_last_bit(controller, key) -> None:
    plain, changed = step_steer(controller), step_steer(controller)
    value = value_of(plain.scenario, f"controllers.{key}", [controller])
    plain.run()
    changed.advance(700)
    changed.set(f"controllers.{key}", value)
    changed.set("driver.steering_rate_limit_degps", value_of(plain.scenario, "driver.steering_rate_limit_degps"))
    changed.run()
    assert np.array_equal(plain.recording().values, changed.recording().values)


def test_a_user_s_controller_keeps_its_memory_and_gets_new_parameters() -> None:
    simulation = step_steer(Follows)
    simulation.advance(800)
    simulation.set("controllers.Follows.gain_s", 0.2)
    simulation.run()
    recording = simulation.recording()
    before, after = recording["rear_steer_demand_rad"][[799, 801]]
    assert after == pytest.approx(2.0 * before, rel=0.01)
    assert recording["correction_rad"][[799, 801]] == pytest.approx([0.01, 0.04])


def test_a_second_parameter_of_a_user_s_controller_leaves_the_first_as_it_was_set() -> None:
    simulation = step_steer(Follows)
    simulation.advance(800)
    simulation.set("controllers.Follows.gain_s", 0.2)
    simulation.set("controllers.Follows.sign", -1.0)
    simulation.run()
    before, after = simulation.recording()["rear_steer_demand_rad"][[799, 801]]
    assert after == pytest.approx(-2.0 * before, rel=0.01)


def test_speed_changes_and_a_driver_stays_on_his_path() -> None:
    simulation = Simulation("double_lane_change", overrides={"settle_s": 0.3})
    simulation.advance(300)
    path = simulation.setpoint.path
    simulation.set("speed_kmh", 60.0)
    assert simulation.setpoint.path is path
    assert simulation.setpoint.speed_demand_mps == pytest.approx(60.0 / 3.6)


def test_states_and_copies_hold_the_changes(rng) -> None:
    simulation = step_steer("ars")
    simulation.advance(300)
    start = simulation.save_state()
    simulation.set("road.mu", 0.4)
    simulation.set("controllers.ars.prediction_gain", 0.5)
    simulation.fail("rear:stuck")
    simulation.advance(300)
    copies = [simulation.copy(), pickle.loads(pickle.dumps(simulation))]
    for run in (simulation, *copies):
        run.run()
    first, *others = (run.recording() for run in (simulation, *copies))
    assert all(np.array_equal(first.values, other.values) for other in others)
    assert all(other.metadata["events"] == first.metadata["events"] for other in others)
    simulation.restore_state(start)
    simulation.run()
    untouched = activesteer.simulate("step_steer", "ars", overrides=STEP)
    assert np.array_equal(simulation.recording().values, untouched.values)
    assert simulation.events == ()


def test_a_fault_acts_beside_an_earlier_one_which_goes_on() -> None:
    simulation = step_steer("ars")
    simulation.advance(500)
    simulation.fail("rl_brake:stuck")
    simulation.advance(100)
    simulation.fail("rear:offset=1deg@0.7-0.9")
    simulation.run()
    recording = simulation.recording()
    assert recording["active_faults"][[499, 501, 750, 950]].tolist() == [0, 1, 2, 1]
    assert [event["what"] for event in recording.metadata["events"]] == [
        "rl_brake:stuck", "rear:offset=1deg@0.7-0.9",
    ]  # fmt: skip
    with raises(ManeuverError, key="fault.1"):
        again = step_steer()
        again.fail("rear:stuck")
        again.fail("rear_left:float")


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("duration_s", 3.0, "cannot change during a run"),
        ("factors.mass", 1.1, "cannot change during a run: it is built into the car"),
        ("road.grade", 0.1, "cannot change during a run: only the friction"),
        ("road.mu_left", 0.3, "no such area; define it before the run"),
        ("controllers.bus_delay_s", 0.01, "cannot change during a run"),
        ("controllers.lqr.sideslip_scale_deg", 1.0, "has no effect: controller ars reads"),
        ("road.mu", 9.0, "out of range"),
        ("steer.rate_degp", 1.0, "rate_degps"),
    ],
)
def test_what_cannot_change_says_so(key, value, said) -> None:
    simulation = step_steer("ars")
    with pytest.raises(ParameterError, match=said):
        simulation.set(key, value)
    assert simulation.events == ()


def test_an_input_without_effect_on_the_rest_is_refused() -> None:
    simulation = step_steer()
    simulation.advance(1000)
    with raises(ManeuverError, key="steer.start_s"):
        simulation.set("steer.start_s", 0.1)


@pytest.mark.parametrize(
    ("maneuver", "timestep_s", "noted"), [("cleat", 1e-3, 1), ("cleat", 2.5e-4, 0), ("straight_line", 1e-3, 0)]
)
def test_a_run_over_a_short_obstacle_with_long_steps_says_so(maneuver, timestep_s, noted) -> None:
    simulation = Simulation(maneuver, timestep_s=timestep_s, overrides={"duration_s": 0.1, "settle_s": 0.1})
    assert [event.kind for event in simulation.events] == ["note"] * noted


def test_an_event_before_the_file_stands_in_the_file(tmp_path: Path) -> None:
    simulation = step_steer()
    simulation.set("road.mu", 0.3)
    with simulation.recorded_to(tmp_path / "a.mcap"):
        simulation.advance(10)
    assert events_of(Recording.open(tmp_path / "a.mcap").metadata) == [(0.0, "set", "road.mu = 0.3")]
