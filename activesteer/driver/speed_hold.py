"""Speed hold: a PI controller of the drive torque, within the limits of engine and driven wheels."""

from __future__ import annotations

from typing import Final

from activesteer.driver.base import Drive
from activesteer.driver.parameters import DriverParameters
from activesteer.signals import Measurement

_STANDSTILL_MPS: Final = 0.05
"""Below this speed standing still needs no torque [m/s]."""


class SpeedHold:
    """Speed control by drive torque and engine braking; the integral stands still while a limit is active.

    A negative speed engages the reverse gear: the engine then drives backwards and brakes forwards.

    If the driven wheels are too fast for the speed of the car, they spin. The driver takes the foot back while they
    spin, and presses down again slowly when they roll.

    Attributes:
        saturated: Whether the last step reached a limit of the engine or took the foot back.
    """

    def __init__(
        self, parameters: DriverParameters, drive: Drive, mass_kg: float, wheel_radius_m: float, timestep_s: float
    ) -> None:
        """Make the speed control of one run.

        Args:
            parameters: Gains.
            drive: Limits of the engine.
            mass_kg: Mass of the car, as the driver knows it [kg].
            wheel_radius_m: Radius that relates the speed of the driven wheels to the speed of the car [m].
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

    def step(self, speed_demand_mps: float, measurement: Measurement) -> float:
        """Return the total torque at the driven wheels for a speed [N m].

        Args:
            speed_demand_mps: Speed to hold [m/s].
            measurement: Measurement of the car's sensors.
        """
        speed = measurement.speed_mps
        if speed_demand_mps == 0.0 and abs(speed) < _STANDSTILL_MPS:
            self.reset()
            return 0.0
        gear = 1 if speed_demand_mps >= 0.0 else -1
        error = speed_demand_mps - speed
        torque = self._gain_Nmspm * error + self._integral_Nm
        engine_radps = self._drive.speed_radps(measurement.wheel_speed_radps)
        low, high = self._drive.limits_Nm(engine_radps, gear)
        overspeed = gear * (engine_radps * self._wheel_radius_m - speed)
        spins = overspeed > self._spin_mps + self._spin_slip * abs(speed)
        if spins or self._pedal < 1.0:
            most, demand = (high, torque) if gear > 0 else (-low, -torque)
            self._move_foot(demand / most if most > 0.0 else 1.0, back=spins)
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

    def _move_foot(self, demand: float, *, back: bool) -> None:
        """Take the foot back from the demanded pedal position, or let it return to the floor."""
        if back:
            # The foot starts from its position, not from the floor.
            self._pedal = self._keep * max(min(self._pedal, demand), 0.0)
        else:
            self._pedal = min(1.0, self._pedal + self._return)

    def reset(self) -> None:
        """Reset the integral, as for a driver who takes the foot off."""
        self._integral_Nm = 0.0
        self._pedal = 1.0
        self.saturated = False
