"""A run stepped by hand: equal to `simulate`, with saved states and external commands."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer import ActuatorCommand, DriverCommand, Recording, Simulation
from activesteer.errors import (
    ControllerError,
    DriverError,
    ManeuverError,
    ParameterError,
    RecordingError,
    SimulationDiverged,
)
from activesteer.scenario import resolve
from tests.raising import raises

STEP_STEER = {"steer.steering_wheel_deg": 36.5, "duration_s": 1.7, "settle_s": 0.5}
SLALOM = {"settle_s": 0.5, "cones.count": 2, "duration_s": 5.0}
RUNS = [("step_steer", "ars", STEP_STEER | {"duration_s": 3.0}), ("slalom", "afs", SLALOM)]
OF_THE_COMMANDS = (
    "ax_mps2",
    "ay_mps2",
    "az_mps2",
    "drive_torque",
    "steer_torque",
    "demand",
    "desired",
    "prediction",
    "correction",
    "abs_",
)


def made(maneuver: str = "step_steer", controller: Any = "ars", overrides: Any = STEP_STEER, **more: Any) -> Simulation:
    return Simulation(maneuver, controller, overrides=overrides, **more)


def assert_same(one: Recording, other: Recording) -> None:
    np.testing.assert_array_equal(one.time_s, other.time_s)
    np.testing.assert_array_equal(one.values, other.values)
    np.testing.assert_array_equal(one.poses.time_s, other.poses.time_s)
    np.testing.assert_array_equal(one.poses.positions_m, other.poses.positions_m)
    np.testing.assert_array_equal(one.poses.quaternions, other.poses.quaternions)
    assert (one.metadata, one.metrics, one.attachments) == (other.metadata, other.metrics, other.attachments)


@pytest.mark.parametrize(("maneuver", "controller", "overrides"), RUNS)
def test_however_it_is_stepped_it_is_the_run_of_simulate(maneuver: str, controller: str, overrides: Any) -> None:
    whole = activesteer.simulate(maneuver, controller, overrides=overrides)
    assert whole.metrics
    stepped, chunks, restored = (made(maneuver, controller, overrides) for _ in range(3))
    while not stepped.done:
        stepped.step()
    assert_same(stepped.recording(), whole)
    for steps in (1, 0, 7, 499, 500, 3, 613):
        chunks.advance(steps)
    chunks.run()
    assert_same(chunks.recording(), whole)
    restored.advance(777)
    state = restored.save_state()
    restored.advance(400, DriverCommand(-1.0), ActuatorCommand(0.02))
    restored.restore_state(state)
    assert restored.time_s == pytest.approx(0.777)
    restored.advance(11)
    restored.recording()
    restored.run()
    assert_same(restored.recording(), whole)


def test_an_amplitude_is_searched_as_for_simulate(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("activesteer.simulation.preparation.amplitude", lambda *_: 0.5)
    simulation = Simulation("step_steer", overrides={"duration_s": 1.0, "settle_s": 0.2})
    assert simulation.recording().metadata["maneuver"]["steer"]["steering_wheel_rad"] == 0.5


def test_a_scenario_has_its_vehicle_already() -> None:
    scenario = resolve("step_steer", overrides=STEP_STEER)
    assert Simulation(scenario, "ars").context.metadata == made().context.metadata
    with raises(ParameterError, key="vehicle, overrides, driver"):
        Simulation(scenario, overrides=STEP_STEER)


def test_every_branch_keeps_its_own_rows() -> None:
    simulation = made()
    simulation.advance(600)
    early = simulation.save_state()
    simulation.advance(300, actuator_command=ActuatorCommand(0.01))
    left = simulation.save_state()
    left_so_far = simulation.recording()
    simulation.restore_state(early)
    simulation.advance(300, actuator_command=ActuatorCommand(-0.01))
    right_so_far = simulation.recording()
    simulation.advance(100)
    simulation.restore_state(left)
    assert_same(simulation.recording(), left_so_far)
    assert len(left_so_far) == len(right_so_far) == 900
    np.testing.assert_array_equal(left_so_far.values[:600], right_so_far.values[:600])
    assert (left_so_far["rear_steer_demand_rad"][600:] == 0.01).all()
    assert (right_so_far["rear_steer_demand_rad"][600:] == -0.01).all()


def test_going_back_often_copies_nothing_that_nobody_refers_to() -> None:
    simulation = made()
    simulation.advance(600)
    state = simulation.save_state()
    memory = simulation._recorder._kept
    for _ in range(3):
        simulation.advance(50)
        simulation.restore_state(state)
    assert simulation._recorder._kept is memory


def test_two_simulations_go_on_from_one_state_without_disturbing_each_other() -> None:
    one, other = made(), made()
    one.advance(600)
    state = one.save_state()
    other.restore_state(state)
    one.advance(200)
    other.advance(200, actuator_command=ActuatorCommand(0.01))
    again = made()
    again.restore_state(pickle.loads(pickle.dumps(state)))
    again.advance(200)
    assert_same(again.recording(), one.recording())
    assert (other.recording()["rear_steer_demand_rad"][600:] == 0.01).all()


def test_the_state_of_another_simulation_is_refused() -> None:
    with raises(ParameterError, key="state"):
        made().restore_state(made(overrides=STEP_STEER | {"speed_kmh": 70}).save_state())


def test_truth_is_the_next_row_but_for_what_the_next_commands_decide() -> None:
    whole = activesteer.simulate("step_steer", "ars", overrides=STEP_STEER)
    looked, plain = made(), made()
    names = [channel.name for channel in whole.channels]
    servo = looked.loop.vehicle.model.actuator("rl_steer")
    torque_per_demand_Nm = servo.gainprm[0] * plain.loop.vehicle.timestep_s / servo.dynprm[0]
    for step in (0, 1, 499, 500, 777):
        looked.advance(step - looked.loop.step_count)
        truth = looked.truth
        assert list(truth) == names
        differing = [name for name in names if truth[name] != whole[name][step]]
        assert all(any(part in name for part in OF_THE_COMMANDS) for name in differing), differing
        # A servo's torque follows the demand of the same step: its angle moves by the fraction timestep / lag of it.
        change_rad = whole["rear_steer_demand_rad"][step] - truth["rear_steer_demand_rad"]
        for name in ("rl_steer_torque_Nm", "rr_steer_torque_Nm"):
            assert whole[name][step] - truth[name] == pytest.approx(torque_per_demand_Nm * change_rad, abs=1e-9)
    looked.run()
    plain.run()
    assert_same(looked.recording(), plain.recording())


def test_what_is_seen_from_outside() -> None:
    simulation = made(timestep_s=0.0005)
    assert (simulation.time_s, simulation.done, simulation.steps) == (0.0, False, 3400)
    assert simulation.measurement.time_s == 0.0
    steps: Any = np.int64(1600)
    measurement = simulation.advance(steps)
    assert measurement == simulation.measurement
    assert simulation.time_s == 0.8
    assert measurement.time_s == pytest.approx(0.8)
    assert simulation.motion.speed_mps == pytest.approx(80 / 3.6, rel=0.02)
    assert simulation.setpoint == simulation.scenario.maneuver.setpoint(simulation.time_s)
    assert "Simulation" in activesteer.__all__


def test_a_partial_recording_says_so_and_stays_as_it_is() -> None:
    simulation = made()
    simulation.advance(200)
    part = simulation.recording()
    values = part.values.copy()
    assert (len(part), part.metadata["complete"], part.metrics) == (200, False, {})
    assert part.metadata["error"] == "driven to 0.2 of 1.7 s"
    simulation.run()
    np.testing.assert_array_equal(part.values, values)
    assert simulation.recording().metadata["complete"] is True


def test_nobody_drives_past_the_end() -> None:
    simulation = made()
    simulation.advance(1699)
    with raises(ManeuverError, value=2):
        simulation.advance(2)
    simulation.step()
    assert simulation.done
    simulation.run()
    with raises(ManeuverError, value=1):
        simulation.step()
    assert len(simulation.recording()) == 1700


@pytest.mark.parametrize("steps", [-1, 1.5, True, "3", None])
def test_steps_are_a_whole_number(steps: Any) -> None:
    with raises(ParameterError, key="steps"):
        made().advance(steps)


@pytest.mark.parametrize(
    ("commands", "error", "value"),
    [
        ({"driver_command": DriverCommand(float("inf"))}, DriverError, float("inf")),
        ({"driver_command": DriverCommand(brake_pedal=1.5)}, DriverError, 1.5),
        ({"driver_command": DriverCommand(front_steer_demand_rad=1.0)}, DriverError, 1.0),
        ({"driver_command": ActuatorCommand()}, DriverError, ActuatorCommand()),
        ({"driver_command": 0.1}, DriverError, 0.1),
        ({"actuator_command": ActuatorCommand(3.0)}, ControllerError, 3.0),
        ({"actuator_command": ActuatorCommand("left")}, ControllerError, "left"),  # pyright: ignore[reportArgumentType]
        ({"actuator_command": [0.1]}, ControllerError, [0.1]),
    ],
)
def test_a_wrong_command_is_refused_before_anything_is_driven(commands: Any, error: Any, value: Any) -> None:
    simulation = made()
    simulation.advance(100)
    with raises(error, value=value):
        simulation.step(**commands)
    simulation.advance(100)
    plain = made()
    plain.advance(200)
    assert_same(simulation.recording(), plain.recording())


def test_commands_from_outside_are_carried_out_and_put_on_record() -> None:
    simulation = made(controller="none")
    simulation.advance(200)
    simulation.advance(10, DriverCommand(0.4, 100.0, 0.1))
    simulation.step(actuator_command=ActuatorCommand(0.01))
    recording = simulation.recording()
    ratio = simulation.loop.driver_setup.steering_ratio
    assert recording["front_steer_demand_rad"][200:210] == pytest.approx(0.4 / ratio)
    assert recording["front_steer_demand_rad"][210] == 0.0
    assert recording["rear_steer_demand_rad"][[209, 210]].tolist() == [0.0, 0.01]
    assert recording.metadata["commands_given"] == {"driver": 10, "controller": 1}
    simulation.advance(500, DriverCommand(0.4))
    assert simulation.measurement.yaw_rate_radps > 0.05


def test_given_what_the_blocks_would_say_it_is_the_same_run() -> None:
    alone, outside = made(), made()
    driver, controller = alone.loop.driver, alone.loop.controller
    shadow = made().loop
    while not outside.done:
        command = shadow.driver.step(outside.setpoint, outside.measurement, outside.motion)
        outside.step(command, shadow.controller.step(command, outside.measurement))
    alone.run()
    assert (driver, controller) == (alone.loop.driver, alone.loop.controller)
    np.testing.assert_array_equal(outside.recording().values, alone.recording().values)


class _Breaks:
    def __init__(self) -> None:
        self.steps = 0

    def step(self, command: Any, measurement: Any) -> ActuatorCommand:
        self.steps += 1
        if measurement.time_s > 0.2995:
            raise ValueError("broken")
        return ActuatorCommand()


def test_a_failed_run_keeps_its_rows_and_goes_on_from_a_saved_state_only() -> None:
    simulation = made(controller=_Breaks())
    simulation.advance(100)
    state = simulation.save_state()
    with raises(ControllerError, cause=ValueError):
        simulation.run()
    assert not simulation.done
    with raises(ManeuverError, cause=ControllerError):
        simulation.step()
    recording = simulation.recording()
    assert len(recording) == 300
    assert recording.metadata["complete"] is False
    assert "broken" in recording.metadata["error"]
    simulation.restore_state(state)
    simulation.advance(1600, actuator_command=ActuatorCommand())
    assert simulation.recording().metadata["complete"] is True


def test_an_interrupted_chunk_is_not_gone_on_with(monkeypatch: pytest.MonkeyPatch) -> None:
    simulation = made()
    simulation.advance(100)
    monkeypatch.setattr(simulation.loop.controller, "step", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        simulation.step()
    monkeypatch.undo()
    with raises(ManeuverError, cause=KeyboardInterrupt):
        simulation.step()
    assert len(simulation.recording()) == 100


def test_a_recorded_value_that_is_not_finite_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    simulation = made()
    simulation.step(actuator_command=ActuatorCommand(correction_rad=float("nan")))
    with raises(SimulationDiverged, value="correction_rad"):
        simulation.recording()
    assert simulation.recording().metadata["error"].startswith("SimulationDiverged: correction_rad")


def test_a_run_with_a_file_does_not_go_back(tmp_path: Any) -> None:
    simulation = made()
    with simulation.recorded_to(tmp_path / "run.mcap"):
        state = simulation.save_state()
        simulation.advance(10)
        with pytest.raises(RecordingError):
            simulation.restore_state(state)


def test_scenario_whose_amplitude_is_not_known_yet_is_prepared() -> None:
    keys = {"duration_s": 0.7, "settle_s": 0.5}
    simulation = Simulation(resolve("step_steer", overrides=keys), "ars")
    assert simulation.scenario.maneuver.search is None
    simulation.run()
    assert_same(simulation.recording(), activesteer.simulate("step_steer", "ars", overrides=keys))
    assert simulation.recording()["steering_wheel_demand_rad"][-1] > 0.5


def test_a_pace_that_is_no_number_and_a_second_file_are_refused(tmp_path):
    with raises(ParameterError, key="realtime"):
        Simulation("straight_line", realtime="x")  # pyright: ignore[reportArgumentType]
    simulation = Simulation("straight_line", overrides={"duration_s": 0.2, "settle_s": 0.1})
    with (
        simulation.recorded_to(tmp_path / "a.mcap"),
        raises(RecordingError),
        simulation.recorded_to(tmp_path / "b.mcap"),
    ):
        pass
    assert not (tmp_path / "b.mcap").exists()
