"""The native step has the result of the engine's own interface, and reports errors."""

from __future__ import annotations

import sys
import threading

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from activesteer.core.signals import ActuatorCommand, DriverCommand, WheelTorques
from activesteer.errors import ParameterError, SimulationDiverged
from activesteer.scenario import load_car
from activesteer.vehicle import Tape, Vehicle
from activesteer.vehicle.channels import RawRows
from tests.raising import raises
from tests.unit.vehicle.cars import standing

COMMAND, STEER = DriverCommand(0.4, 300.0, 0.0), ActuatorCommand(0.01, 0.02)


def _rolling() -> Vehicle:
    vehicle = standing()
    vehicle.start(20.0)
    return vehicle


@pytest.mark.parametrize(
    ("command", "asked"),
    [
        (DriverCommand(), None),
        (DriverCommand(), (1.0, 2.0)),
        ((0.1,), STEER),
        (DriverCommand("left"), STEER),  # type: ignore[arg-type]
        (DriverCommand(), ActuatorCommand(brake_torque_demand_Nm=(1.0,))),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_message_is_an_error_and_ends_no_process(command, asked) -> None:
    vehicle = _rolling()
    with pytest.raises(ParameterError):
        vehicle.step(command, asked)
    assert vehicle.step(COMMAND, STEER)[0].speed_mps == pytest.approx(20.0, abs=0.1)


def test_a_row_is_a_copy_of_the_engine_s_arrays() -> None:
    vehicle = _rolling()
    rows, bodies = vehicle.rows.empty(3), vehicle.model.nbody - 1
    positions_m, quaternions = np.zeros((2, bodies, 3)), np.zeros((2, bodies, 4))
    tape = (recorded := Tape()).record
    tape["row"], tape["row_bytes"], tape["room"] = rows.sensordata.ctypes.data, rows.sensordata.strides[0], 3
    tape["pose_every"], tape["position"], tape["quaternion"] = 2, positions_m.ctypes.data, quaternions.ctypes.data
    vehicle.record_on(recorded)
    for row in range(3):
        vehicle.step(COMMAND, STEER)
        assert (tape["rows"][0], tape["room"][0]) == (row + 1, 2 - row)
        if row % 2 == 0:
            np.testing.assert_array_equal(positions_m[row // 2], vehicle.data.xpos[1:])
            np.testing.assert_array_equal(quaternions[row // 2], vehicle.data.xquat[1:])
        for name, live in zip(RawRows._fields, vehicle.rows.live(), strict=True):
            np.testing.assert_array_equal(getattr(rows, name)[row], live, err_msg=name)
    vehicle.step(COMMAND, STEER)
    assert tape["rows"][0] == 3, "where there is no room, nothing is written"


@pytest.mark.parametrize(
    ("name", "asked"),
    [
        ("compact", STEER),
        ("compact_electric", STEER._replace(wheel_torque_demand_Nm=(0.0, 0.0, -150.0, 250.0))),
        ("tesla_model_s", ActuatorCommand()),
    ],
)
def test_inputs_played_back_give_the_same_drive(name, asked) -> None:
    driven, replayed = (load_car(name).on() for _ in range(2))
    for vehicle in (driven, replayed):
        vehicle.start(20.0)
    inputs = np.empty((50, driven.model.nu))
    for step, row in enumerate(inputs):
        driven.step(COMMAND._replace(steering_wheel_demand_rad=0.01 * step), asked)
        row[:] = driven.data.ctrl
    # The gear is no input.
    replayed.step(COMMAND, asked)
    replayed.start(20.0)
    replayed.replay(inputs)
    assert replayed.data.qpos.tobytes() == driven.data.qpos.tobytes()


def test_what_a_step_returns_is_what_the_sensors_say() -> None:
    vehicle = _rolling()
    for _ in range(50):
        vehicle.step(COMMAND, STEER)
    measurement, motion = vehicle.step(COMMAND, STEER)
    assert (measurement, motion) == (vehicle.measure(), vehicle.motion())
    assert type(measurement).__name__ == "Measurement"
    sensor = {name: vehicle.data.sensor(name).data for name in ("cg_velocimeter", "cg_accelerometer", "cg_position")}
    assert measurement.speed_mps == sensor["cg_velocimeter"][0]
    assert (measurement.ax_mps2, measurement.ay_mps2) == tuple(sensor["cg_accelerometer"][:2])
    assert (motion.x_m, motion.y_m) == tuple(sensor["cg_position"][:2])
    assert measurement.wheel_speed_radps == tuple(
        vehicle.data.sensor(f"{corner}_wheel_speed").data[0] for corner in CORNERS
    )
    assert motion.speed_mps == pytest.approx(20.0, rel=0.01)


@pytest.mark.parametrize("kind", range(len(mujoco.mjtWarning.__members__) - 1))
def test_any_warning_of_the_engine_ends_it(kind: int) -> None:
    vehicle = _rolling()
    vehicle.step(COMMAND, STEER)
    vehicle.data.warning[kind].number = 1
    with raises(SimulationDiverged, value=mujoco.mjtWarning(kind)):
        vehicle.step(COMMAND, STEER)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["userdata", "sensordata", "ten_length", "actuator_force"])
def test_whatever_is_recorded_has_to_be_finite(name: str, value: float) -> None:
    vehicle = _rolling()
    vehicle.step(COMMAND, STEER)
    getattr(vehicle.data, name)[-1] = value
    with raises(SimulationDiverged, value=name):
        vehicle.measure()


def test_cars_step_in_threads_as_they_do_alone() -> None:
    cars = [_rolling() for _ in range(3)]

    def drive(vehicle: Vehicle) -> None:
        for _ in range(300):
            vehicle.step(COMMAND, STEER)

    threads = [threading.Thread(target=drive, args=(car,)) for car in cars[1:]]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    drive(cars[0])
    assert {car.data.qpos.tobytes() for car in cars} == {cars[0].data.qpos.tobytes()}


def test_a_step_lets_other_threads_run() -> None:
    """Python does not have to switch threads here: the other thread runs only if a step releases the lock."""
    cars, start, order = [_rolling(), _rolling()], threading.Barrier(2), []

    def drive(index: int) -> None:
        start.wait()
        for _ in range(2000):
            cars[index].step(COMMAND, STEER)
            order.append(index)

    threads = [threading.Thread(target=drive, args=(index,)) for index in (0, 1)]
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval_s)
    # One after the other there is a single change.
    assert np.count_nonzero(np.diff(order)) > 1


def test_after_torques_given_wheel_by_wheel_the_usual_ones_count_again() -> None:
    vehicle, usual = _rolling(), _rolling()
    torques = WheelTorques((100.0, 200.0, 300.0, 400.0), (10.0, 20.0, 30.0, 40.0))
    vehicle.step(DriverCommand(wheel_torques=torques), STEER)
    inputs = {name: vehicle.data.actuator(name).ctrl[0] for name in ("fl_drive", "rr_drive", "fl_brake", "rr_brake")}
    assert inputs == {"fl_drive": 100.0, "rr_drive": 400.0, "fl_brake": 10.0, "rr_brake": 40.0}
    for each in (vehicle, usual):
        each.step(COMMAND, STEER)
    np.testing.assert_array_equal(vehicle.data.ctrl, usual.data.ctrl)
    assert vehicle.data.actuator("rr_drive").ctrl == 0.0
