"""Screws in the toe links, a motor on the column, production sensors and faults, all at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from activesteer import Simulation
from activesteer.config.faults import fault_table
from activesteer.sensors.parameters import RANDOM, Sensor, Sensors
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
    for name, sensor in vars(Sensors(preset="production")).items()
    if isinstance(sensor, Sensor)
    for key, value in vars(sensor).items()
    if key.startswith(RANDOM) and value
}


def turn(side: float = 1.0) -> dict[str, Any]:
    return {"steer.steering_wheel_deg": 40.0 * side, "duration_s": 1.3, "settle_s": 0.5, "speed_kmh": 80.0}


def test_what_follows_a_saved_state_and_a_second_run_are_the_same_to_the_last_bit() -> None:
    overrides = {**turn(), **HARDWARE, "sensors.seed": 3, "fault": FAULTS}
    assert_goes_on_bit_by_bit(overrides, save_at=960, back_after=200)


@pytest.mark.parametrize(("vehicle", "of_the_peak"), [("compact", 1e-10), ("sedan", 1e-6)])
def test_left_and_right_mirror_where_sensors_have_no_chance(vehicle, of_the_peak) -> None:
    """The compact to rounding, 2e-12 of the peak; the sedan less, whose links stand for rigid ones.

    There rounding of lengths, which 1e9 N/m turn into forces of 1e-7 N, is 1e-7 of the yaw rate, and a tenth of it
    where the links have a third of the stiffness. Its superposition gives way by no more than 7e-7 rad.
    """
    runs = []
    for side, corner in ((1.0, "left"), (-1.0, "right")):
        faults = [fault_table(f"rear_{corner}:stuck@0.9-1.1"), fault_table("superposition:stuck@0.95")]
        overrides = {**turn(side), **HARDWARE, **WITHOUT_CHANCE, "fault": faults}
        simulation = Simulation("step_steer", "ars", vehicle, overrides=overrides)
        simulation.run()
        runs.append(simulation.recording())
    left, right = runs
    for name in ("y_m", "yaw_rate_radps", "rear_steer_rad", "superposition_rad", "measured_yaw_rate_radps"):
        np.testing.assert_allclose(left[name], -right[name], atol=of_the_peak * np.abs(left[name]).max(), err_msg=name)
