"""The fields of a message are its only description: rows, channels and native code follow from them."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
from numba import njit, types

from activesteer.core.conventions import CORNERS
from activesteer.core.signals import (
    ActuatorCommand,
    DriverCommand,
    Estimate,
    Measurement,
    PerWheel,
    Recorded,
    widths_of,
)
from activesteer.native.memory import native_type, store_numbers
from activesteer.sensors import SensorBlock, Sensors
from activesteer.sensors.block import MEASURED
from activesteer.vehicle.step_bindings import (
    CARRIED_OUT,
    COMMANDS,
    ESTIMATE_CHANNELS,
    command_channels,
    command_numbers,
    write_commands,
)


def distinct(kind: type[Any], first: float = 1.0) -> Any:
    """Return a message whose numbers are first, first + 1, ... in the order of its fields."""
    values, members = iter(np.arange(first, first + 100.0).tolist()), []
    for width in widths_of(kind):
        members.append(
            None if width == 0 else next(values) if width == 1 else tuple(next(values) for _ in range(width))
        )
    return kind(*members)


def by_name(message: Any) -> dict[str, float]:
    """Return the numbers of a message by name, from the names of its fields alone."""
    found = {}
    for name, value in message._asdict().items():
        if isinstance(value, tuple):
            found |= {f"{corner}_{name}": number for corner, number in zip(CORNERS, value, strict=True)}
        elif value is not None:
            found[name] = value
    return found


def test_every_number_of_a_command_lands_under_its_own_name():
    driver, actuator = distinct(DriverCommand), distinct(ActuatorCommand, 50.0)
    row = np.zeros(len(COMMANDS))
    write_commands(row, driver, actuator)
    named = dict(zip(COMMANDS, row.tolist(), strict=True))
    expected = {f"driver_{name}" if name == "saturated" else name: value for name, value in by_name(driver).items()}
    expected |= {f"controller_{n}" if n == "saturated" else n: value for n, value in by_name(actuator).items()}
    assert named == expected


def test_what_only_the_recording_needs_is_not_carried_out():
    assert set(COMMANDS) - set(CARRIED_OUT) == {
        "driver_saturated", "controller_saturated", "front_steer_demand_rad", "yaw_rate_desired_radps",
        "prediction_rad", "correction_rad",
    }  # fmt: skip


class Extended(NamedTuple):
    """A command of a version with more fields."""

    first: float
    wheels: Annotated[PerWheel, Recorded("Nm", "torque")]
    estimate: Estimate | None
    level_rad: Annotated[float, Recorded("rad", "level")]
    saturated: Annotated[bool, Recorded("", "1 at a limit", acts=False)]


def test_a_field_is_added_in_one_place():
    numbers = command_numbers({"driver": DriverCommand, "controller": Extended})
    own = ["first", *(f"{corner}_wheels" for corner in CORNERS), "level_rad", "controller_saturated"]
    assert list(numbers)[-len(own) :] == own
    channels = {channel.name: channel for channel in command_channels(numbers)}
    assert "first" not in channels
    assert channels["rl_wheels"][1:4] == ("Nm", "torque, rear left", "control")
    assert channels["level_rad"].meaning == "level"

    @njit
    def store(address, message):
        store_numbers(address, message)

    row = np.zeros(len(own))
    call: Any = store.compile(types.void(types.intp, native_type(Extended)))
    call(row.ctypes.data, Extended(1.0, (2.0, 3.0, 4.0, 5.0), None, 6.0, True))
    assert row.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1.0]


def test_sensors_return_the_measurement_that_they_were_given():
    block, measurement = SensorBlock(Sensors(), 0.001), distinct(Measurement)
    block.say(measurement)
    assert block.measurement(measurement.time_s) == measurement
    assert [number.name for number in MEASURED] == list(by_name(measurement))[1:]


def test_every_field_of_an_estimate_is_a_channel():
    assert [channel.name for channel in ESTIMATE_CHANNELS] == [f"estimated_{name}" for name in Estimate._fields]
