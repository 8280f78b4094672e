"""Interface of a driver, a driver's knowledge of the car, and the keys of a driver file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, Protocol

from activesteer.config import Range
from activesteer.core.signals import DriverCommand, Measurement, Motion, Setpoint
from activesteer.theory.single_track import SingleTrackParameters


@dataclass(frozen=True, kw_only=True)
class DriverParameters:
    """Driver parameters that do not depend on the car: steering along a path, and speed control."""

    name: str = ""
    """Short name, for tables. Default: the file's name."""
    title: str = ""
    """Title in one line, for lists."""
    preview_s: Annotated[float, Range(0.2, 5.0)]
    """Time ahead for which the driver sees the path [s]. Beyond this time, the driver assumes a straight path."""
    preview_points: Literal["all", "one"] = "all"
    """Points of the path that the driver looks at: `all` within the preview, or the `one` at its end, as in simple
    driver models. The `one` point has the sum of all gains."""
    reaction_delay_s: Annotated[float, Range(0.0, 1.0)]
    """Delay from seeing to acting, a multiple of the 10 ms between two looks [s]."""
    neuromuscular_lag_s: Annotated[float, Range(0.0, 0.5)]
    """First-order lag of arms and hands [s]."""
    return_time_s: Annotated[float, Range(0.0, 5.0)]
    """Weight of the drift off the path: a drift costs as much as the offset that it causes in this time. If steering
    costs nothing, an offset decays with this time constant [s]."""
    steering_rate_per_metre_radps: Annotated[float, Range(0.01, 100.0)]
    """Weight of the steering: steering wheel rate that costs as much as an offset of one metre from the path
    [rad/s]."""
    steering_rate_limit_radps: Annotated[float, Range(0.1, 50.0)]
    """Largest steering wheel rate [rad/s]."""
    steering_torque_limit_Nm: Annotated[float, Range(0.5, 200.0)] | None = None
    """Largest torque of the hands at the steering wheel, counted as `hand_torque_Nm` [N m]. Default: no limit."""

    speed_gain_1ps: Annotated[float, Range(0.0)] = 3.4
    """Acceleration per speed error [1/s]: about 0.9 m/s2 for an error of 1 km/h."""
    speed_integral_gain_1ps2: Annotated[float, Range(0.0)] = 1.36
    """Acceleration per integrated speed error [1/s2]: it compensates drag within a few seconds."""

    spin_mps: Annotated[float, Range(0.1)] = 2.0
    """Speed of the driven wheels above the speed of the car at which the foot lifts [m/s]; the driver hears the
    engine."""
    spin_slip: Annotated[float, Range(0.01)] = 0.2
    """Fraction of the car's speed that is added to `spin_mps` [-]: beyond the slip of the largest force, 0.1 to
    0.15."""
    foot_lag_s: Annotated[float, Range(0.01, 2.0)] = 0.15
    """Time constant with which the foot lifts [s]."""
    foot_return_per_s: Annotated[float, Range(0.01, 10.0)] = 0.5
    """Rate at which the foot presses down again, in pedal strokes per second [1/s]."""


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


class Drivetrain(Protocol):
    """Engine and gearbox, as known to a driver."""

    def speed_radps(self, wheel_speeds_radps: tuple[float, float, float, float], /) -> float:
        """Return the mean speed of the driven wheels, which turns the engine [rad/s]."""
        ...

    def limits_Nm(self, speed_radps: float, gear: int, /) -> tuple[float, float]:
        """Return the smallest and largest total wheel torque in a gear, 1 or -1, forward positive [N m]."""
        ...


@dataclass(frozen=True)
class DriverSetup:
    """Input for the creation of a driver.

    Attributes:
        single_track: The car without control as a single-track model.
        parameters: The driver file; a user's own driver gets the file of the default driver.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
        steering_wheel_limit_rad: Lock angle of the steering wheel [rad].
        rack_per_steering_wheel_m: Rack travel per steering wheel angle [m/rad]; None without a rack.
        drive: Engine and gearbox.
        wheel_radius_m: Radius that relates the speed of the driven wheels to the speed of the car [m].
        timestep_s: Time between two steps [s].
        user_parameters: Overrides of the parameters of a user's driver: class -> name -> value.
    """

    single_track: SingleTrackParameters
    parameters: DriverParameters
    steering_ratio: float
    steering_wheel_limit_rad: float
    rack_per_steering_wheel_m: float | None
    drive: Drivetrain
    wheel_radius_m: float
    timestep_s: float
    user_parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
