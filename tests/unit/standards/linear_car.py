"""A test runner whose car has a known understeer, no lag and a hand torque with dry friction: nothing is driven."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from activesteer.maneuver import Maneuver
from activesteer.standards.standard import StandardRun
from tests.unit.standards.runners import PrescribedRunner
from tests.unit.standards.signals import run_of, times

EG: Final = 0.004
"""Understeer gradient [rad/(m/s2)]."""
ROLL: Final = 0.01
REAR: Final = 0.005
"""Gradients of roll angle and rear slip angle [rad/(m/s2)]."""
LIMIT_MPS2: Final = 7.0
"""Lateral acceleration at which the car stays."""
BRAKED_MPS2: Final = 10.0
"""Deceleration at full pedal."""
FRICTION_Nm: Final = 1.5
TORQUE_NmPMPS2: Final = 0.8
"""Hand torque: friction, and what it rises by over lateral acceleration."""


class LinearCarRunner(PrescribedRunner):
    """A runner that computes the channels from the setpoints of each manoeuvre."""

    def __init__(self, metrics: Mapping[str, float] | None = None) -> None:
        super().__init__(lambda *_: metrics or {})
        config = self.scenario("straight_line").car.config
        self.ratio, track = config.steering.ratio, config.single_track
        self.rear_m, self.wheelbase_m = track.cg_to_rear_m, track.cg_to_front_m + track.cg_to_rear_m

    def steering_wheel_rad(self, ay_mps2: float, speed_mps: float) -> float:
        """Return the steering wheel angle of a steady turn."""
        return self.ratio * (self.wheelbase_m * ay_mps2 / speed_mps**2 + EG * ay_mps2)

    def run_of(self, series: str, case: Mapping[str, Any], maneuver: Maneuver) -> StandardRun:
        return replace(super().run_of(series, case, maneuver), channels=self.channels(maneuver))

    def channels(self, maneuver: Maneuver) -> Mapping[str, np.ndarray]:
        """Return the channels of the car in a manoeuvre."""
        time_s = times(maneuver.duration_s)
        setpoints = [maneuver.setpoint(time) for time in time_s.tolist()]
        speed = np.array([setpoint.speed_demand_mps for setpoint in setpoints])
        braked = [BRAKED_MPS2 * setpoint.brake_pedal for setpoint in setpoints]
        speed = np.maximum(speed - np.cumsum(braked) * (time_s[1] - time_s[0]), 1.0)
        if setpoints[0].curvature_demand_1pm is not None:
            curvature = np.array([setpoint.curvature_demand_1pm for setpoint in setpoints])
            steer = (self.wheelbase_m + EG * speed**2) * curvature
        else:
            steer = np.array([setpoint.steering_wheel_demand_rad for setpoint in setpoints]) / self.ratio
            curvature = steer / (self.wheelbase_m + EG * speed**2)
        ay = np.clip(curvature * speed**2, -LIMIT_MPS2, LIMIT_MPS2)
        curvature = ay / np.maximum(speed, 1e-3) ** 2
        zero = np.zeros_like(ay)
        wheel, friction = self.ratio * steer, FRICTION_Nm * np.sign(np.gradient(steer))
        return run_of({
            "steering_wheel_rad": wheel, "steering_wheel_demand_rad": wheel,
            "ay_mps2": ay, "vx_mps": speed, "speed_mps": speed, "yaw_rate_radps": curvature * speed,
            "sideslip_rad": self.rear_m * curvature - REAR * ay, "roll_rad": ROLL * ay, "yaw_rad": zero, "y_m": zero,
            "ax_mps2": zero, "hand_torque_Nm": TORQUE_NmPMPS2 * ay + friction,
        }).channels  # fmt: skip
