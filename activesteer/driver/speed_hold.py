"""Speed hold: a PI controller on drive torque, limited by the engine."""

from __future__ import annotations

from typing import Final

from activesteer.driver.parameters import DriverParameters

_STANDSTILL_MPS: Final = 0.05
"""Below this, a wish to stand still needs no torque [m/s]."""


class SpeedHold:
    """Holds a speed by drive torque and engine braking; the integral stands still while a limit is active.

    A speed below zero engages the reverse gear: the engine then drives backwards and brakes forwards.

    Attributes:
        saturated: Whether the engine's limit was reached in the last step.
    """

    def __init__(
        self, parameters: DriverParameters, max_torque_Nm: float, engine_brake_torque_Nm: float, timestep_s: float
    ) -> None:
        """Takes gains and limits.

        Args:
            parameters: Gains.
            max_torque_Nm: Most drive torque [N m].
            engine_brake_torque_Nm: Most braking torque of the engine, positive [N m].
            timestep_s: Time between two steps [s].
        """
        self._gain = parameters.speed_gain_Nmspm
        self._integral_gain = parameters.speed_integral_gain_Nmpm
        self._forward = -engine_brake_torque_Nm, max_torque_Nm
        self._reverse = -max_torque_Nm, engine_brake_torque_Nm
        self._timestep_s = timestep_s
        self._integral_Nm = 0.0
        self.saturated = False

    def step(self, wanted_mps: float, speed_mps: float) -> float:
        """Drive torque for a speed.

        Args:
            wanted_mps: Speed to hold [m/s].
            speed_mps: Speed measured [m/s].

        Returns:
            Torque at the driven wheels together [N m].
        """
        if wanted_mps == 0.0 and abs(speed_mps) < _STANDSTILL_MPS:
            self.reset()
            return 0.0
        error = wanted_mps - speed_mps
        torque = self._gain * error + self._integral_Nm
        low, high = self._forward if wanted_mps >= 0.0 else self._reverse
        if torque > high:
            self.saturated = True
            return high
        if torque < low:
            self.saturated = True
            return low
        self.saturated = False
        self._integral_Nm += self._integral_gain * error * self._timestep_s
        return torque

    def reset(self) -> None:
        """Forgets the trim, as when the driver takes his foot off."""
        self._integral_Nm = 0.0
        self.saturated = False
