"""The messages that the blocks hand to each other, once every step. Immutable; SI units; signs of `conventions`.

They are named tuples because they are made every millisecond: a frozen dataclass costs several times as much to build.
Where even the call of the class is too slow, `made` makes them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol, TypeVar, cast

if TYPE_CHECKING:
    from activesteer.road.path import Path

_Message = TypeVar("_Message", bound=tuple[Any, ...])


class _Make(Protocol):
    def __call__(self, kind: type[_Message], members: Iterable[Any], /) -> _Message: ...


made: Final = cast(_Make, tuple.__new__)
"""`made(Motion, (x_m, y_m, ...))` is a message of these members, all of them, in half the time of `Motion(x_m, ...)`:
for what is made every step."""


class Channel(NamedTuple):
    """What a recorded signal is called and means.

    Attributes:
        name: Channel name, ending in its unit (`yaw_rate_radps`).
        unit: Unit as printed in tables and plots (`rad/s`), empty for a pure number.
        meaning: One line, with the sign convention where it matters.
        group: Name of the topic that carries it in a file (`vehicle`, `control`, `fl` ...).
        single: True where 32 bit are enough in a file.
    """

    name: str
    unit: str
    meaning: str
    group: str
    single: bool = True


class WheelTorques(NamedTuple):
    """Torques of the wheels, given one by one; order of `CORNERS`.

    Attributes:
        drive_Nm: Drive torques, forward positive [Nm].
        brake_Nm: Brake torques, against the rotation [Nm].
    """

    drive_Nm: tuple[float, float, float, float]
    brake_Nm: tuple[float, float, float, float]


class Setpoint(NamedTuple):
    """What the manoeuvre asks of the driver at one instant.

    Attributes:
        steering_wheel_demand_rad: Steering wheel angle asked for [rad], left positive.
        speed_demand_mps: Speed to hold [m/s].
        brake_pedal: Brake pedal position, 0 to 1.
        hold_speed: Whether the drive holds `speed_demand_mps`; where False the car coasts.
        curvature_demand_1pm: Curvature to drive [1/m], left positive; where given, the driver finds the
            steering wheel angle.
        rack_demand_m: Rack position asked for [m], positive steers left; where given, it stands for the steering wheel
            angle.
        wheel_torques: Torques of the wheels; where given, they stand for drive and brake.
        path: Path of the centre of gravity to follow; where given, the driver finds the steering wheel angle.
        parking_brake: Parking brake, 0 released to 1 fully applied.
    """

    steering_wheel_demand_rad: float
    speed_demand_mps: float
    brake_pedal: float
    hold_speed: bool
    curvature_demand_1pm: float | None = None
    rack_demand_m: float | None = None
    wheel_torques: WheelTorques | None = None
    path: Path | None = None
    parking_brake: float = 0.0


class DriverCommand(NamedTuple):
    """What the driver does.

    Attributes:
        steering_wheel_demand_rad: Steering wheel angle demanded [rad], left positive.
        drive_torque_demand_Nm: Torque at the driven wheels together [Nm]; negative is engine braking.
        brake_pedal: Brake pedal position, 0 to 1.
        saturated: Whether the lock of the steering or a limit of the engine is active.
        wheel_torques: Torques of the wheels; where given, they stand for drive and brake.
        gear: 1 forward; -1 reverse: the engine then drives backwards and brakes forwards; 0 with the clutch open,
            whatever torque is demanded.
        front_steer_demand_rad: Steering wheel angle demanded, divided by the overall steering ratio: the angle at the
            road wheel [rad]. A driver of one's own leaves it out; the simulation fills it in.
        parking_brake: Parking brake, 0 released to 1 fully applied.
    """

    steering_wheel_demand_rad: float = 0.0
    drive_torque_demand_Nm: float = 0.0
    brake_pedal: float = 0.0
    saturated: bool = False
    wheel_torques: WheelTorques | None = None
    gear: int = 1
    front_steer_demand_rad: float = math.nan
    parking_brake: float = 0.0


class Measurement(NamedTuple):
    """What the sensors of a real car deliver, and nothing else.

    Attributes:
        time_s: Time of the measurement [s].
        speed_mps: Longitudinal speed [m/s].
        yaw_rate_radps: Yaw rate [rad/s], left positive.
        ay_mps2: Lateral acceleration [m/s2], left positive.
        ax_mps2: Longitudinal acceleration [m/s2].
        steering_wheel_rad: Steering wheel angle [rad], left positive.
        rear_steer_rad: Angle of the rear steering actuators, mean of both [rad], left positive.
        superposition_rad: Angle added by the front superposition, at the road wheel [rad].
        wheel_speed_radps: Rotational speeds of the four wheels [rad/s], order of `CORNERS`.
        brake_pressure_Pa: Pressures in the four wheel brakes [Pa], same order.
    """

    time_s: float
    speed_mps: float
    yaw_rate_radps: float
    ay_mps2: float
    ax_mps2: float
    steering_wheel_rad: float
    rear_steer_rad: float
    superposition_rad: float
    wheel_speed_radps: tuple[float, float, float, float]
    brake_pressure_Pa: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


class Motion(NamedTuple):
    """Where the car is and how it moves over the ground: what the driver sees and feels; no controller gets it.

    Attributes:
        x_m: Position of the centre of gravity, world x [m].
        y_m: The same, world y [m].
        yaw_rad: Heading [rad], left positive, within half a turn.
        speed_mps: Speed along the heading [m/s].
        lateral_speed_mps: Speed across the heading, left positive [m/s].
        yaw_rate_radps: Yaw rate [rad/s], left positive.
    """

    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    lateral_speed_mps: float
    yaw_rate_radps: float


class Estimate(NamedTuple):
    """What an estimator makes of what the sensors say: the motion of the centre of gravity over the road.

    A standard deviation is that of the error as the estimator itself expects it.

    Attributes:
        speed_mps: Speed along the car's longitudinal axis [m/s].
        lateral_speed_mps: Speed across it, left positive [m/s].
        sideslip_rad: Sideslip angle [rad], left positive; 0 at walking speed.
        yaw_rate_radps: Yaw rate [rad/s], left positive, without the sensor's offset and age.
        friction: Friction of the road relative to that of the tyres' files.
        speed_std_mps: Standard deviation of the speed [m/s].
        lateral_speed_std_mps: Of the lateral speed [m/s].
        sideslip_std_rad: Of the sideslip angle [rad].
        yaw_rate_std_radps: Of the yaw rate [rad/s].
        friction_std: Of the friction.
    """

    speed_mps: float
    lateral_speed_mps: float
    sideslip_rad: float
    yaw_rate_radps: float
    friction: float
    speed_std_mps: float
    lateral_speed_std_mps: float
    sideslip_std_rad: float
    yaw_rate_std_radps: float
    friction_std: float


NO_BRAKES: Final = (0.0, 0.0, 0.0, 0.0)
"""No brake torque at any wheel [Nm]."""


class ActuatorCommand(NamedTuple):
    """What a controller asks of the actuators, with its intermediate results for the recording.

    Attributes:
        rear_steer_demand_rad: Rear wheel angle demanded [rad], left positive.
        superposition_demand_rad: Angle to add at the front road wheels [rad], left positive.
        yaw_rate_desired_radps: Yaw rate that the controller steers for [rad/s].
        prediction_rad: Feed-forward part [rad].
        correction_rad: Feedback part [rad].
        saturated: Whether a limit of the controller is active.
        brake_torque_demand_Nm: Brake torques of the wheels beside the driver's, against the rotation, order of
            `CORNERS` [Nm]; below 0 they release what the pedal asks for.
        drive_torque_change_Nm: Change of the torque that the driver demands at the driven wheels together, forward
            positive [Nm].
        estimate: What the controller takes the motion of the car for, where it uses an estimator.
        side_difference_Pa: Brake pressure by which one side may exceed the other beyond what the anti-lock system
            leaves to the driver, since the controller steers against the moment [Pa].
    """

    rear_steer_demand_rad: float = 0.0
    superposition_demand_rad: float = 0.0
    yaw_rate_desired_radps: float = 0.0
    prediction_rad: float = 0.0
    correction_rad: float = 0.0
    saturated: bool = False
    brake_torque_demand_Nm: tuple[float, float, float, float] = NO_BRAKES
    drive_torque_change_Nm: float = 0.0
    estimate: Estimate | None = None
    side_difference_Pa: float = 0.0


def steering(
    rear_rad: float, front_rad: float, desired_radps: float, prediction_rad: float, correction_rad: float, limited: bool
) -> ActuatorCommand:
    """An `ActuatorCommand` of its first six members, by which a controller steers and does nothing else."""
    return made(
        ActuatorCommand,
        (rear_rad, front_rad, desired_radps, prediction_rad, correction_rad, limited, NO_BRAKES, 0.0, None, 0.0),
    )
