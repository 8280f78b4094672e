"""What the simulation asks of a driver, and what a driver may know of his car."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from activesteer.driver.parameters import DriverParameters
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint
from activesteer.theory.single_track import SingleTrackParameters


class Driver(Protocol):
    """What a driver must have: one method, called once every step of the simulation.

    A driver who acts less often counts the steps (`DriverSetup.timestep_s`) and repeats the last command in between.

    Example:
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
        """What the driver does now.

        Args:
            setpoint: What the manoeuvre asks for.
            measurement: What the car's sensors say.
            motion: Where the car is and how it moves, as the driver sees it.

        Returns:
            The command for the next step.
        """
        ...


class Drive(Protocol):
    """What a driver knows of engine and gearbox."""

    def speed_radps(self, wheel_speeds_radps: tuple[float, float, float, float], /) -> float:
        """Mean speed of the driven wheels [rad/s], which is what the engine turns with."""
        ...

    def limits_Nm(self, speed_radps: float, gear: int, /) -> tuple[float, float]:
        """Least and greatest torque at all wheels together in a gear, 1 or -1; forward positive [N m]."""
        ...


@dataclass(frozen=True)
class DriverSetup:
    """What a driver gets when he is made.

    Attributes:
        single_track: The car as a single-track model sees it, without control.
        parameters: The driver file: who drives; for a driver of one's own it is that of the default driver.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
        steering_wheel_limit_rad: Lock angle of the steering wheel [rad].
        rack_per_steering_wheel_m: Rack travel per steering wheel angle [m/rad]; None where there is no rack.
        drive: What engine and gearbox can give.
        wheel_radius_m: Radius by which the engine's speed belongs to the car's [m].
        timestep_s: Time between two steps [s].
    """

    single_track: SingleTrackParameters
    parameters: DriverParameters
    steering_ratio: float
    steering_wheel_limit_rad: float
    rack_per_steering_wheel_m: float | None
    drive: Drive
    wheel_radius_m: float
    timestep_s: float
