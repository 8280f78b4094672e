"""Screws in the toe links, a motor on the column, sensors of a production car and faults, all at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer.faults import fault_table
from activesteer.sensors.parameters import RANDOM
from activesteer.sensors.presets import PRESETS
from activesteer.sensors.sensor_kinds import Sensor
from tests.physics.runs import assert_goes_on_bit_by_bit

HARDWARE: dict[str, Any] = {
    "rear_actuator.preset": "screw_3deg",
    "superposition_actuator.preset": "strain_wave",
    "sensors.preset": "production",
}
FAULTS = [
    fault_table(text)
    for text in ("rear_left:stuck@0.9", "yaw_rate_sensor:stuck@0.8-1.0", "superposition:float@0.95-1.1")
]
WITHOUT_CHANCE = {
    f"sensors.{name}.{key}": 0.0
    for name, sensor in PRESETS["production"].items()
    if isinstance(sensor, Sensor)
    for key, value in vars(sensor).items()
    if key.startswith(RANDOM) and value
}


def turn(side: float = 1.0) -> dict[str, Any]:
    return {"steer.steering_wheel_deg": 40.0 * side, "duration_s": 1.3, "settle_s": 0.5, "speed_kmh": 80.0}


def test_what_follows_a_saved_state_and_a_second_run_are_the_same_to_the_last_bit() -> None:
    overrides = {**turn(), **HARDWARE, "sensors.seed": 3, "fault": FAULTS}
    assert_goes_on_bit_by_bit(overrides, save_at=960, back_after=200)


@pytest.mark.parametrize("vehicle", ["compact", "sedan"])
def test_left_and_right_mirror_where_sensors_have_no_chance(vehicle: str) -> None:
    left, right = (
        activesteer.simulate("step_steer", "ars", vehicle, overrides={**turn(side), **HARDWARE, **WITHOUT_CHANCE})
        for side in (1.0, -1.0)
    )
    for name in ("y_m", "yaw_rate_radps", "rear_steer_rad", "superposition_rad", "measured_yaw_rate_radps"):
        np.testing.assert_allclose(left[name], -right[name], atol=1e-5 * np.abs(left[name]).max() + 1e-7, err_msg=name)
