"""Many cars at once: each equals a simulation of its own to the last bit."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer import ActuatorCommand, Batch, DriverCommand, Simulation
from activesteer.controllers import NoControl
from activesteer.core.signals import numbers_in
from activesteer.errors import ActiveSteerError, ControllerError, ManeuverError, ParameterError
from activesteer.scenario import resolve
from tests.raising import raises

FRICTIONS = np.array([0.7, 0.8, 0.9])
STEPS = 700
SETTLED: dict[str, Any] = {"settle_s": 0.2}
STEER: dict[str, Any] = {**SETTLED, "steer.steering_wheel_deg": 30.0}
SINE: dict[str, Any] = {**SETTLED, "steer.steering_wheel_deg": 90.0}
"""Amplitudes without a search."""


def numbers(simulation: Simulation) -> list[float]:
    return [*numbers_in(simulation.measurement), *simulation.motion]


def row(batch: Batch, car: int) -> list[float]:
    return [*numbers_in(batch.loops[car].measurement), *batch.loops[car].motion]


@pytest.mark.parametrize(
    ("maneuver", "controller", "angle"),
    [
        ("sine_with_dwell", "none", {"steer.steering_wheel_deg": 90.0}),
        ("slalom", "ars", {}),
        ("brake_in_turn", "afs", {"turn.steering_wheel_deg": 40.0}),
    ],
)
def test_each_car_equals_its_simulation_for_any_number_of_threads_and_chunks(
    maneuver: str, controller: str, angle: dict[str, float]
) -> None:
    overrides = {
        **SETTLED,
        **angle,
        "road.mu": FRICTIONS,
        "sensors.preset": "production",
        "controllers.bus_delay_s": 0.004,
    }
    if controller == "none":
        del overrides["controllers.bus_delay_s"]
    two, one = (Batch(maneuver, 3, controller, overrides=overrides, threads=threads) for threads in (2, 1))
    two.advance(STEPS)
    for chunk in (1, 249, 7, STEPS - 257):
        one.advance(chunk)
    for car, friction in enumerate(FRICTIONS):
        alone = Simulation(maneuver, controller, overrides=overrides | {"road.mu": friction})
        alone.advance(STEPS)
        assert row(two, car) == row(one, car) == numbers(alone)
        assert one.loops[car].commands == alone.loop.commands
        assert (one.loops[car].vehicle.save_state() == alone.loop.vehicle.save_state()).all()


def driven_by_python(simulation: Simulation) -> Simulation:
    """Replace the controller's method, so that compiled code does not carry out its law."""
    controller: Any = simulation.loop.controller
    controller.step = controller.step
    return simulation


@pytest.mark.parametrize("sensors", [pytest.param("ideal", marks=pytest.mark.slow), "production"])
def test_the_law_of_lqr_gives_the_same_bits_in_python_and_in_compiled_code(sensors: str) -> None:
    both = {
        **SETTLED,
        "turn.steering_wheel_deg": 40.0,
        "sensors.preset": sensors,
        "controllers.bus_delay_s": 0.003 if sensors == "production" else 0.0,
    }
    cars = [{"road.mu": 0.7}, {"road.mu": 0.9, "factors.mass": 1.1}]
    batch = Batch("brake_in_turn", 2, "lqr", overrides=[both | car for car in cars], threads=2)
    batch.advance(1301)
    for car, own in enumerate(cars):
        known, alone = (Simulation("brake_in_turn", "lqr", overrides=both | own) for _ in range(2))
        known.advance(1301)
        driven_by_python(alone).advance(1301)
        assert row(batch, car) == numbers(alone)
        assert batch.loops[car].commands == alone.loop.commands
        assert alone.loop.commands[1].estimate is not None
        states = [loop.vehicle.save_state() for loop in (batch.loops[car], alone.loop)]
        assert (states[0] == states[1]).all()
        recordings = known.recording(), alone.recording()
        assert "estimated_friction" in recordings[0].channels
        for channel in recordings[0].channels:
            assert np.array_equal(*(recording[channel.name] for recording in recordings), equal_nan=True)


def test_a_car_whose_loop_stands_still_keeps_the_kind_of_its_last_command() -> None:
    batch = Batch("step_steer", 2, "lqr", overrides=STEER, threads=1)
    batch.advance(20, actuator_command=ActuatorCommand(0.01))
    batch.advance(20, cars=[0])
    assert [loop.commands[1].estimate is None for loop in batch.loops] == [False, True]


def test_given_commands_replace_the_blocks() -> None:
    batch = Batch("step_steer", 2, "ars", overrides=STEER, threads=1)
    rear: Any = np.array([-0.02, 0.03])
    wheel: Any = np.array([0.2, -0.4])
    drivers = DriverCommand(steering_wheel_demand_rad=wheel, drive_torque_demand_Nm=300.0)
    batch.advance(300, actuator_command=ActuatorCommand(rear_steer_demand_rad=rear))
    batch.advance(200, drivers)
    batch.advance(100)
    for car in range(2):
        alone = Simulation("step_steer", "ars", overrides=STEER)
        alone.advance(300, actuator_command=ActuatorCommand(rear_steer_demand_rad=rear[car]))
        alone.advance(200, DriverCommand(steering_wheel_demand_rad=wheel[car], drive_torque_demand_Nm=300.0))
        alone.advance(100)
        assert row(batch, car) == numbers(alone)


def test_a_given_steering_wheel_turns_the_front_wheels_by_the_ratio_of_its_own_car() -> None:
    ratios = np.array([12.0, 20.0])
    batch = Batch("straight_line", 2, overrides={"vehicle.steering.ratio": ratios, "settle_s": 0.0}, threads=1)
    batch.advance(1, DriverCommand(steering_wheel_demand_rad=0.24))
    assert batch.driver_command.front_steer_demand_rad == pytest.approx(0.24 / ratios)


def test_a_fault_acts_at_its_time_in_its_car() -> None:
    fault = {"part": "rear", "kind": "stuck", "start_s": 0.3, "end_s": 0.5}
    noisy = {"part": "yaw_rate_sensor", "kind": "offset", "size_degps": 5.0, "start_s": 0.2}
    faults = [[], [fault], [noisy]]
    batch = Batch("sine_with_dwell", 3, "ars", overrides=[SINE | {"fault": each} for each in faults])
    batch.advance(900)
    for car, each in enumerate(faults):
        alone = Simulation("sine_with_dwell", "ars", overrides=SINE | {"fault": each})
        alone.advance(900)
        assert row(batch, car) == numbers(alone)


@pytest.mark.parametrize("controller", ["ars", "lqr"])
@pytest.mark.parametrize("twin", [copy.deepcopy, lambda batch: pickle.loads(pickle.dumps(batch))])
def test_states_and_copies_continue_bit_identically(twin, controller: str) -> None:
    batch = Batch(
        "double_lane_change", 2, controller, overrides={**SETTLED, "road.mu": np.array([0.5, 0.9])}, threads=1
    )
    batch.advance(1100)
    (state,), other = batch.save_state([1]), twin(batch)
    expected = batch.advance(400).yaw_rate_radps
    assert (other.advance(400).yaw_rate_radps == expected).all()
    batch.restore_state([state], [1])
    assert batch.step_count.tolist() == [1500, 1100]
    assert batch.advance(400, cars=[1]).yaw_rate_radps[1] == expected[1]
    batch.reset([0])
    batch.advance(1500, cars=[True, False])
    assert batch.measurement.yaw_rate_radps[0] == expected[0]


def test_every_controller_and_driver_can_be_driven() -> None:
    class Damper:
        def step(self, _command, measurement):
            return ActuatorCommand(rear_steer_demand_rad=0.05 * measurement.yaw_rate_radps)

    for controller in (Damper(), "esc"):
        batch, alone = (
            Batch("step_steer", 2, controller, overrides=STEER),
            Simulation("step_steer", controller, overrides=STEER),
        )
        batch.advance(120)
        alone.advance(120)
        assert row(batch, 1) == numbers(alone)


def test_a_diverging_car_stops_alone() -> None:
    batch = Batch("straight_line", 2, overrides={**SETTLED, "duration_s": 3.0}, threads=1)
    batch.loops[0].vehicle.data.qvel[2] = np.nan
    batch.advance(100)
    assert list(batch.failures) == [0]
    assert batch.done.tolist() == [True, False]
    batch.advance(100)
    assert batch.step_count[1] == 200
    batch.reset([0])
    batch.advance(100)
    assert not batch.failures


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"n": 0}, "from 1 to"),
        ({"n": 2, "threads": 0}, "at least 1"),
        ({"n": 2, "overrides": {"road.mu": FRICTIONS}}, "3 values; one for each of 2 cars"),
        ({"n": 2, "overrides": [{}]}, "1 entries"),
        ({"n": 2, "overrides": [{}, {"rod.mu": 1.0}]}, "rod.mu"),
    ],
)
def test_wrong_inputs_are_refused(arguments: dict, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        Batch("straight_line", **arguments)


def test_the_error_of_a_list_says_that_an_array_has_a_value_for_each_car() -> None:
    with raises(ManeuverError, key="road.mu", value=[0.3, 0.5]) as caught:
        Batch("straight_line", 2, overrides={"road.mu": [0.3, 0.5]})
    assert "array" in caught.value.__notes__[0]
    with pytest.raises(ManeuverError) as other:
        Batch("straight_line", 2, overrides={"road.mu": -1.0})
    assert "array" not in other.value.__notes__[0]


def test_a_scenario_gets_its_amplitude_as_in_a_simulation() -> None:
    batch, alone = Batch(resolve("step_steer"), 2), Simulation("step_steer")
    for each in (batch, alone):
        each.advance(700)
    assert batch.driver_command.steering_wheel_demand_rad[1] == alone.loop.commands[0].steering_wheel_demand_rad > 0.1
    with raises(ParameterError, key="vehicle, overrides, driver"):
        Batch(resolve("step_steer"), 2, overrides={"road.mu": 0.5})


def test_wrong_commands_are_refused_before_anything_is_driven() -> None:
    batch = Batch("straight_line", 2, overrides=SETTLED)
    rear: Any
    for rear, words in ((np.zeros(3), r"shape \(2,\)"), (np.array([0.0, 3.0]), "car 1"), (np.nan, "car 0")):
        with pytest.raises(ControllerError, match=words):
            batch.advance(1, actuator_command=ActuatorCommand(rear_steer_demand_rad=rear))
    with pytest.raises(ParameterError, match="mask of 2"):
        batch.advance(1, cars=[5])
    assert batch.step_count.tolist() == [0, 0]
    assert isinstance(batch.loops[0].controller, NoControl)
    assert activesteer.Batch is Batch


@pytest.mark.parametrize("steps", [10**400, [1, 2, 3], [[1, 2]], "x", -1, None])
def test_a_wrong_number_of_steps_is_one_error(steps: Any) -> None:
    batch = Batch("straight_line", 2, overrides=SETTLED)
    with raises(ParameterError, key="steps"):
        batch.advance(steps)
    assert batch.step_count.tolist() == [0, 0]


@pytest.mark.parametrize("angle_rad", [10**400, np.array([None, 1.0], dtype=object), np.ones(3), np.ones(2) * 1j])
def test_a_wrong_command_is_one_error(angle_rad: Any) -> None:
    batch = Batch("straight_line", 2, overrides=SETTLED)
    with pytest.raises(ActiveSteerError, match="steering_wheel_demand_rad"):
        batch.advance(1, DriverCommand(angle_rad))
    assert batch.step_count.tolist() == [0, 0]


def test_a_state_of_another_road_is_refused() -> None:
    dry, wet = (Batch("straight_line", 1, overrides={**SETTLED, "road.mu": mu}) for mu in (0.9, 0.5))
    with raises(ParameterError, key="state"):
        wet.restore_state(dry.save_state())
    wet.restore_state(wet.save_state())


def test_friction_and_faults_change_on_the_way_in_some_cars() -> None:
    batch = Batch("step_steer", 3, "ars", overrides=STEER)
    alone = [Simulation("step_steer", "ars", overrides=STEER) for _ in range(3)]
    for each in (batch, *alone):
        each.advance(700)
    batch.set("road.mu", np.array([0.5, 0.6, 0.7]), cars=[0, 2])
    batch.fail("rear:stuck", cars=[1])
    alone[0].set("road.mu", 0.5)
    alone[2].set("road.mu", 0.7)
    alone[1].fail("rear:stuck")
    for each in (batch, *alone):
        each.advance(400)
    assert [row(batch, car) for car in range(3)] == [numbers(each) for each in alone]
    batch.reset()
    batch.advance(1100)
    assert row(batch, 0) == row(batch, 1) == row(batch, 2)
    with raises(ParameterError, key="road.mew"):
        batch.set("road.mew", 0.5)
