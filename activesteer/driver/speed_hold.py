"""Speed hold: a PI controller on drive torque, within what the engine gives and the driven wheels transmit."""

from __future__ import annotations

from typing import Final

from activesteer.driver.base import Drive
from activesteer.driver.parameters import DriverParameters
from activesteer.signals import Measurement

_STANDSTILL_MPS: Final = 0.05
"""Below this, a wish to stand still needs no torque [m/s]."""


class SpeedHold:
    """Holds a speed by drive torque and engine braking; the integral stands still while a limit is active.

    A speed below zero engages the reverse gear: the engine then drives backwards and brakes forwards.

    Where the engine runs away from the speed of the car, wheels spin: the driver takes the foot back while they do, and
    presses further down again slowly when they roll.

    Attributes:
        saturated: Whether the engine's limit was reached, or the foot taken back, in the last step.
    """

    def __init__(
        self, parameters: DriverParameters, drive: Drive, mass_kg: float, wheel_radius_m: float, timestep_s: float
    ) -> None:
        """Makes the speed control of one run.

        Args:
            parameters: Gains.
            drive: What the engine can give.
            mass_kg: Mass of the car, as the driver knows it [kg].
            wheel_radius_m: Radius by which the driver relates the engine's speed to the car's [m].
            timestep_s: Time between two steps [s].
        """
        self._gain_Nmspm = parameters.speed_gain_1ps * mass_kg * wheel_radius_m
        self._integral_gain_Nmpm = parameters.speed_integral_gain_1ps2 * mass_kg * wheel_radius_m
        self._drive = drive
        self._wheel_radius_m = wheel_radius_m
        self._spin_mps = parameters.spin_mps
        self._spin_slip = parameters.spin_slip
        self._keep = max(0.0, 1.0 - timestep_s / parameters.foot_lag_s)
        self._return = parameters.foot_return_per_s * timestep_s
        self._timestep_s = timestep_s
        self._integral_Nm = 0.0
        self._pedal = 1.0
        self.saturated = False

    def step(self, wanted_mps: float, measurement: Measurement) -> float:
        """Drive torque for a speed.

        Args:
            wanted_mps: Speed to hold [m/s].
            measurement: What the car's sensors say: its speed, and those of its wheels.

        Returns:
            Torque at the driven wheels together [N m].
        """
        speed = measurement.speed_mps
        if wanted_mps == 0.0 and abs(speed) < _STANDSTILL_MPS:
            self.reset()
            return 0.0
        gear = 1 if wanted_mps >= 0.0 else -1
        error = wanted_mps - speed
        torque = self._gain_Nmspm * error + self._integral_Nm
        engine_radps = self._drive.speed_radps(measurement.wheel_speed_radps)
        low, high = self._drive.limits_Nm(engine_radps, gear)
        overspeed = gear * (engine_radps * self._wheel_radius_m - speed)
        spins = overspeed > self._spin_mps + self._spin_slip * abs(speed)
        if spins or self._pedal < 1.0:
            most, asked = (high, torque) if gear > 0 else (-low, -torque)
            self._move_foot(asked / most if most > 0.0 else 1.0, back=spins)
            if gear > 0:
                high *= self._pedal
            else:
                low *= self._pedal
        if torque > high:
            self.saturated = True
            return high
        if torque < low:
            self.saturated = True
            return low
        self.saturated = False
        self._integral_Nm += self._integral_gain_Nmpm * error * self._timestep_s
        return torque

    def _move_foot(self, asked: float, *, back: bool) -> None:
        """Takes the foot back from a pedal position that is asked for, or lets it return to the floor."""
        if back:
            # The foot comes back from where it is, not from the floor.
            self._pedal = self._keep * max(min(self._pedal, asked), 0.0)
        else:
            self._pedal = min(1.0, self._pedal + self._return)

    def reset(self) -> None:
        """Forgets the trim, as when the driver takes his foot off."""
        self._integral_Nm = 0.0
        self._pedal = 1.0
        self.saturated = False
