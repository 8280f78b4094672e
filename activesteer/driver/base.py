"""Interface of a driver, and a driver's knowledge of the car."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from activesteer.driver.parameters import DriverParameters
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint
from activesteer.theory.single_track import SingleTrackParameters


class Driver(Protocol):
    """Interface of a driver: one method, called once every step of the simulation.

    A driver that acts less often counts the steps (`DriverSetup.timestep_s`) and repeats the last command in between.

    Examples:
        >>> import math
        >>> import activesteer
        >>> class Holds:
        ...     def step(self, setpoint, measurement, motion):
        ...         return activesteer.DriverCommand(steering_wheel_demand_rad=math.radians(30.0), gear=0)
        >>> recording = activesteer.simulate("straight_line", driver=Holds())
        >>> bool(recording["yaw_rate_radps"].max() > 0.1)
        True
    """

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """Return the command for the next step.

        Args:
            setpoint: Setpoint of the manoeuvre.
            measurement: Measurement of the car's sensors.
            motion: Position and motion of the car, as the driver sees them.
        """
        ...


class Drive(Protocol):
    """Engine and gearbox as a driver knows them."""

    def speed_radps(self, wheel_speeds_radps: tuple[float, float, float, float], /) -> float:
        """Return the mean speed of the driven wheels, with which the engine turns [rad/s]."""
        ...

    def limits_Nm(self, speed_radps: float, gear: int, /) -> tuple[float, float]:
        """Return the smallest and largest total wheel torque in a gear, 1 or -1; forward positive [N m]."""
        ...


@dataclass(frozen=True)
class DriverSetup:
    """Input from which a driver is made.

    Attributes:
        single_track: The car without control as a single-track model.
        parameters: The driver file; a user's own driver gets the file of the default driver.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
        steering_wheel_limit_rad: Lock angle of the steering wheel [rad].
        rack_per_steering_wheel_m: Rack travel per steering wheel angle [m/rad]; None without a rack.
        drive: Engine and gearbox.
        wheel_radius_m: Radius that relates the speed of the driven wheels to the speed of the car [m].
        timestep_s: Time between two steps [s].
        own: Overrides of the parameters of a user's driver: class -> name -> value.
    """

    single_track: SingleTrackParameters
    parameters: DriverParameters
    steering_ratio: float
    steering_wheel_limit_rad: float
    rack_per_steering_wheel_m: float | None
    drive: Drive
    wheel_radius_m: float
    timestep_s: float
    own: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
