"""Active front steering: an angle from the yaw rate error, added to the driver's angle (Dorsch 2012, section V.B)."""

from __future__ import annotations

import math
from types import MappingProxyType

from activesteer.controllers.corrector import (
    MIN_SPEED_MPS,
    Corrector,
    DesiredYawRate,
    corrected,
    cut_off,
    desired_yaw_rate,
    rear_direction,
    reset,
)
from activesteer.controllers.parameters import ControllerSetup
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement, steering
from activesteer.native.records import NativeBlock
from activesteer.native.shared_laws import law_of
from activesteer.theory.single_track import SingleTrack


class FrontSuperposition(NativeBlock):
    """Active front steering (AFS): the corrector of the rear steering with opposite sign, and no prediction."""

    reads = ("afs", "desired_yaw_rate")
    rates_radps = MappingProxyType({"superposition": math.radians(13.0)})
    """Actuator rate for a sine of 0.7 Hz (FMVSS 126) with an amplitude of 3 deg [rad/s]."""
    _desired: DesiredYawRate
    _corrector: Corrector
    _limit_rad: float
    _saturated: int

    def __init__(self, setup: ControllerSetup) -> None:
        """Create the controller of one run."""
        gains, timestep_s = setup.gains, setup.timestep_s
        self._desired = DesiredYawRate(SingleTrack(setup.single_track), gains.desired_yaw_rate, timestep_s)
        self._corrector = Corrector(gains.afs.corrector, timestep_s)
        self._limit_rad = gains.afs.limit_rad
        self._saturated = 0

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return the angle to add at the front wheels."""
        return steering(front_superposition(self, command, measurement))


@law_of(FrontSuperposition)
def front_superposition(
    block: FrontSuperposition, command: DriverCommand, measurement: Measurement
) -> tuple[float, float, float, float, float, bool]:
    """Return the first fields of an `ActuatorCommand` by the law of `FrontSuperposition.step`."""
    speed_mps = measurement.speed_mps
    desired = desired_yaw_rate(block._desired, command.front_steer_demand_rad, speed_mps)
    if speed_mps < MIN_SPEED_MPS:
        reset(block._corrector)
        block._saturated = 0
        return 0.0, 0.0, desired, 0.0, 0.0, False
    feedback = corrected(block._corrector, desired - measurement.yaw_rate_radps, block._saturated)
    correction = -rear_direction(feedback) * abs(feedback)
    angle, block._saturated = cut_off(correction, block._limit_rad)
    return 0.0, angle, desired, 0.0, correction, block._saturated != 0
