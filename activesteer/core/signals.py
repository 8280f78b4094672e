"""Immutable messages that the blocks exchange in every step, in SI units with the signs of `conventions`.

Messages are named tuples because the loop creates them every millisecond, and a frozen dataclass takes several times
as long to create. Where even the call of the class takes too long, use `new_message`.

The fields of a message are the one description of it. The channels of a recording and the memory layout of native code
are derived from them; see `numbers_of` and `native.memory`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from itertools import accumulate
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple, Protocol, TypeAlias, TypeVar, cast, get_type_hints

from activesteer.core.conventions import CORNERS

if TYPE_CHECKING:
    from activesteer.core.path import Path

_Message = TypeVar("_Message", bound=tuple[Any, ...])


class _Make(Protocol):
    def __call__(self, kind: type[_Message], members: Iterable[Any], /) -> _Message: ...


new_message: Final = cast(_Make, tuple.__new__)
"""Fast constructor: `new_message(Motion, (x_m, ...))` takes half the time of `Motion(x_m, ...)`. All values are
needed."""

CORNERS_IN_WORDS: Final = dict(zip(CORNERS, ("front left", "front right", "rear left", "rear right"), strict=True))
"""Names of the corners in a sentence."""
PerWheel: TypeAlias = tuple[float, float, float, float]
"""One number for each wheel, in the order of `CORNERS`."""


class Channel(NamedTuple):
    """Name and description of a recorded signal.

    Attributes:
        name: Channel name, ending in its unit (`yaw_rate_radps`).
        unit: Unit as printed in tables and plots (`rad/s`), empty for a pure number.
        meaning: One line, with the sign convention where it matters.
        group: Name of the topic that carries the channel in a file (`vehicle`, `control`, `fl` ...).
        single: Whether a file stores the channel with 32 bits.
    """

    name: str
    unit: str
    meaning: str
    group: str
    single: bool = True


class Recorded(NamedTuple):
    """Annotation of a recorded field of a message.

    Attributes:
        unit: Unit of its channel.
        meaning: Meaning of its channel.
        acts: Whether the car acts on the field; otherwise it is for the recording only.
    """

    unit: str
    meaning: str
    acts: bool = True


class Number(NamedTuple):
    """A number within a message.

    Attributes:
        name: Name of the field; for a number of a wheel with its corner in front (`fl_wheel_speed_radps`).
        field: Name of the field.
        recorded: Unit and meaning; None if the number is not recorded as part of this message.
    """

    name: str
    field: str
    recorded: Recorded | None


@functools.cache
def numbers_of(message: type[tuple[Any, ...]]) -> tuple[Number, ...]:
    """Return the numbers of a message, in the order of its fields.

    Args:
        message: A message class. Fields of type float, int or bool hold one number; `PerWheel` holds four. Fields of
            other types, such as messages within the message, hold none.
    """
    numbers = []
    for field, hint in get_type_hints(message, include_extras=True).items():
        recorded = next((about for about in getattr(hint, "__metadata__", ()) if isinstance(about, Recorded)), None)
        kind = hint.__origin__ if hasattr(hint, "__metadata__") else hint
        if kind in (float, int, bool):
            numbers.append(Number(field, field, recorded))
        elif kind == PerWheel:
            for corner, place in CORNERS_IN_WORDS.items():
                of_wheel = recorded and recorded._replace(meaning=f"{recorded.meaning}, {place}")
                numbers.append(Number(f"{corner}_{field}", field, of_wheel))
    return tuple(numbers)


@functools.cache
def widths_of(message: type[tuple[Any, ...]]) -> tuple[int, ...]:
    """Return the count of numbers in each field of a message (see `numbers_of`)."""
    fields = [number.field for number in numbers_of(message)]
    return tuple(fields.count(field) for field in get_type_hints(message))


@functools.cache
def record_fields(message: type[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
    """Return the fields of a float64 record for the numbers of a message."""
    widths = zip(get_type_hints(message), widths_of(message), strict=True)
    return [(name, "f8") if width == 1 else (name, "f8", (width,)) for name, width in widths if width]


@functools.cache
def nested_fields(message: type[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
    """Return the fields of `record_fields`, where the wheels form a record of four numbers."""
    widths = zip(get_type_hints(message), widths_of(message), strict=True)
    wheels = [(corner, "f8") for corner in CORNERS]
    return [(name, "f8" if width == 1 else wheels) for name, width in widths if width]


def numbers_in(message: tuple[Any, ...]) -> list[float]:
    """Return all numbers of a message as a flat list (see `numbers_of`)."""
    row: list[float] = []
    for width, value in zip(widths_of(type(message)), message, strict=True):
        if width == 1:
            row.append(value)
        elif width:
            row.extend(value)
    return row


@functools.cache
def _types_of(message: type[tuple[Any, ...]]) -> tuple[Any, ...]:
    return tuple(get_type_hints(message).values())


def message_of(kind: type[_Message], row: Iterable[float]) -> _Message:
    """Return a message from its numbers, with None for fields without numbers."""
    numbers, fields = iter(row), []
    for width, hint in zip(widths_of(kind), _types_of(kind), strict=True):
        if width == 1:
            fields.append(hint(next(numbers)))
        else:
            fields.append(tuple(next(numbers) for _ in range(width)) or None)
    return new_message(kind, fields)


def arrays_of(kind: type[_Message], rows: Any) -> _Message:
    """Return a message whose fields are arrays, from rows of its numbers.

    A field without numbers is None.

    Args:
        kind: Class of the message.
        rows: Shape (n, numbers).

    Returns:
        The message; a field has shape (n,), or (n, 4) for the wheels.
    """
    ends = accumulate(widths_of(kind))
    parts = [
        None if not width else rows[:, end - 1] if width == 1 else rows[:, end - width : end]
        for end, width in zip(ends, widths_of(kind), strict=True)
    ]
    return new_message(kind, parts)


class WheelTorques(NamedTuple):
    """Torques of the individual wheels, in the order of `CORNERS`.

    Attributes:
        drive_Nm: Drive torques, forward positive [Nm].
        brake_Nm: Brake torques, against the rotation [Nm].
    """

    drive_Nm: PerWheel
    brake_Nm: PerWheel


class Setpoint(NamedTuple):
    """Demand of the manoeuvre on the driver at one time.

    Attributes:
        steering_wheel_demand_rad: Steering wheel angle [rad], left positive.
        speed_demand_mps: Speed to hold [m/s].
        brake_pedal: Brake pedal position, 0 to 1.
        hold_speed: Whether the drive holds `speed_demand_mps`; otherwise the car coasts.
        curvature_demand_1pm: Curvature to drive [1/m], left positive. If given, the driver finds the steering wheel
            angle.
        rack_demand_m: Rack position [m], positive steers left. If given, it replaces the steering wheel angle.
        wheel_torques: Torques of the wheels. If given, they replace drive and brake.
        path: Path for the centre of gravity. If given, the driver finds the steering wheel angle.
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
    """Command of the driver: steering, pedals, and the demand of the manoeuvre.

    Attributes:
        steering_wheel_demand_rad: Steering wheel angle [rad], left positive.
        drive_torque_demand_Nm: Torque of all driven wheels together [Nm]; negative is engine braking.
        brake_pedal: Brake pedal position, 0 to 1.
        saturated: Whether the steering lock or a limit of the engine is active.
        wheel_torques: Torques of the wheels. If given, they replace drive and brake.
        gear: 1 forward; -1 reverse, in which the engine drives backwards and brakes forwards; 0 with the clutch open,
            which transmits no torque.
        front_steer_demand_rad: Steering wheel angle divided by the overall steering ratio: the angle at the road
            wheels [rad]. Your own driver leaves it out; the simulation fills it in.
        parking_brake: Parking brake, 0 released to 1 fully applied.
    """

    steering_wheel_demand_rad: float = 0.0  # recorded as an input of the engine
    drive_torque_demand_Nm: Annotated[float, Recorded("Nm", "drive torque demand, all wheels together")] = 0.0
    brake_pedal: Annotated[float, Recorded("", "brake pedal position, 0 to 1")] = 0.0
    saturated: Annotated[
        bool, Recorded("", "1 if the steering is at its lock or the engine at its limit", acts=False)
    ] = False
    wheel_torques: WheelTorques | None = None
    gear: int = 1
    front_steer_demand_rad: Annotated[
        float, Recorded("rad", "driver's steering demand at the road wheels", acts=False)
    ] = math.nan
    parking_brake: Annotated[float, Recorded("", "parking brake, 0 to 1")] = 0.0


class Measurement(NamedTuple):
    """Signals of the sensors of a car.

    The field of a sensor has the name of the sensor in a vehicle file, followed by the unit.

    Attributes:
        time_s: Time of the measurement [s].
        speed_mps: Longitudinal speed [m/s].
        yaw_rate_radps: Yaw rate [rad/s], left positive.
        ay_mps2: Lateral acceleration [m/s2], left positive.
        ax_mps2: Longitudinal acceleration [m/s2].
        steering_wheel_rad: Steering wheel angle [rad], left positive.
        rear_steer_rad: Angle of the rear steering actuators, mean of both [rad], left positive.
        superposition_rad: Angle added by the front superposition, at the road wheels [rad].
        wheel_speed_radps: Rotational speeds of the four wheels [rad/s], in the order of `CORNERS`.
        brake_pressure_Pa: Pressures in the four wheel brakes [Pa], in the order of `CORNERS`.
    """

    time_s: float
    speed_mps: Annotated[float, Recorded("m/s", "longitudinal speed")]
    yaw_rate_radps: Annotated[float, Recorded("rad/s", "yaw rate")]
    ay_mps2: Annotated[float, Recorded("m/s2", "lateral acceleration")]
    ax_mps2: Annotated[float, Recorded("m/s2", "longitudinal acceleration")]
    steering_wheel_rad: Annotated[float, Recorded("rad", "steering wheel angle")]
    rear_steer_rad: Annotated[float, Recorded("rad", "position of the rear steering actuators")]
    superposition_rad: Annotated[float, Recorded("rad", "position of the front superposition, at the road wheels")]
    wheel_speed_radps: Annotated[PerWheel, Recorded("rad/s", "wheel speed")]
    brake_pressure_Pa: Annotated[PerWheel, Recorded("Pa", "brake pressure")] = (0.0, 0.0, 0.0, 0.0)


class Motion(NamedTuple):
    """Position and motion of the car over the ground, as the driver sees and feels them.

    No controller receives it.

    Attributes:
        x_m: Position of the centre of gravity, world x [m].
        y_m: Position of the centre of gravity, world y [m].
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
    """Motion of the centre of gravity over the road, as estimated from the sensors.

    A standard deviation describes the error that the estimator itself expects.

    Attributes:
        speed_mps: Speed along the car's longitudinal axis [m/s].
        lateral_speed_mps: Speed across the longitudinal axis, left positive [m/s].
        sideslip_rad: Sideslip angle [rad], left positive; 0 at walking speed.
        yaw_rate_radps: Yaw rate [rad/s], left positive, without the sensor's offset and delay.
        friction: Friction of the road relative to the friction in the tyre files, at the axle where it is lower.
        speed_std_mps: Standard deviation of the speed [m/s].
        lateral_speed_std_mps: Standard deviation of the lateral speed [m/s].
        sideslip_std_rad: Standard deviation of the sideslip angle [rad].
        yaw_rate_std_radps: Standard deviation of the yaw rate [rad/s].
        friction_std: Standard deviation of the friction.
        front_stiffness: Stiffness of the front tyres relative to new tyres under the known load.
        rear_stiffness: The same of the rear tyres.
        front_stiffness_std: Standard deviation of the stiffness of the front tyres.
        rear_stiffness_std: The same of the rear tyres.
    """

    speed_mps: Annotated[float, Recorded("m/s", "speed along the car")]
    lateral_speed_mps: Annotated[float, Recorded("m/s", "speed across the car, left positive")]
    sideslip_rad: Annotated[float, Recorded("rad", "sideslip angle")]
    yaw_rate_radps: Annotated[float, Recorded("rad/s", "yaw rate")]
    friction: Annotated[float, Recorded("", "friction of the weaker axle relative to the friction in the tyre files")]
    speed_std_mps: Annotated[float, Recorded("m/s", "standard deviation of the speed")]
    lateral_speed_std_mps: Annotated[float, Recorded("m/s", "standard deviation of the lateral speed")]
    sideslip_std_rad: Annotated[float, Recorded("rad", "standard deviation of the sideslip angle")]
    yaw_rate_std_radps: Annotated[float, Recorded("rad/s", "standard deviation of the yaw rate")]
    friction_std: Annotated[float, Recorded("", "standard deviation of the friction")]
    front_stiffness: Annotated[float, Recorded("", "stiffness of the front tyres relative to new tyres")] = 1.0
    rear_stiffness: Annotated[float, Recorded("", "stiffness of the rear tyres relative to new tyres")] = 1.0
    front_stiffness_std: Annotated[float, Recorded("", "standard deviation of the stiffness of the front tyres")] = 0.0
    rear_stiffness_std: Annotated[float, Recorded("", "standard deviation of the stiffness of the rear tyres")] = 0.0


NO_BRAKES: Final = (0.0, 0.0, 0.0, 0.0)
"""No brake torque at any wheel [Nm]."""
NO_TORQUES: Final = (0.0, 0.0, 0.0, 0.0)
"""No additional drive torque at any wheel [Nm]."""


class ActuatorCommand(NamedTuple):
    """Command of a controller to the actuators, with intermediate results for the recording.

    Attributes:
        rear_steer_demand_rad: Rear wheel angle [rad], left positive.
        superposition_demand_rad: Angle to add at the front road wheels [rad], left positive.
        yaw_rate_desired_radps: Yaw rate that the controller aims for [rad/s].
        prediction_rad: Feedforward part [rad].
        correction_rad: Feedback part [rad].
        saturated: Whether a limit of the controller is active.
        brake_torque_demand_Nm: Brake torques of the wheels in addition to the driver's, against the rotation, order of
            `CORNERS` [Nm]; negative torques release what the pedal applies.
        drive_torque_change_Nm: Change of the driver's torque demand, all driven wheels together, forward positive
            [Nm].
        estimate: Estimated motion of the car, if the controller uses an estimator.
        side_difference_Pa: Additional difference of the brake pressure between left and right that the anti-lock
            system may allow, because the controller steers against the yaw moment [Pa].
        wheel_torque_demand_Nm: Drive torques at the wheels in addition to the driver's demand, forward positive, order
            of `CORNERS` [Nm]. Motors carry them out within their limits. Where an open differential drives both wheels
            of an axle, only the sum of the two torques counts; an engine gets the sum of all wheels that it drives.
    """

    rear_steer_demand_rad: Annotated[float, Recorded("rad", "rear angle demand of the controller")] = 0.0
    superposition_demand_rad: Annotated[
        float, Recorded("rad", "angle that the controller adds at the front wheels")
    ] = 0.0
    yaw_rate_desired_radps: Annotated[float, Recorded("rad/s", "yaw rate that the controller aims for", acts=False)] = (
        0.0
    )
    prediction_rad: Annotated[float, Recorded("rad", "feedforward part of the controller's angle", acts=False)] = 0.0
    correction_rad: Annotated[float, Recorded("rad", "feedback part of the controller's angle", acts=False)] = 0.0
    saturated: Annotated[bool, Recorded("", "1 if a limit of the controller is active", acts=False)] = False
    brake_torque_demand_Nm: Annotated[PerWheel, Recorded("Nm", "brake torque that the controller adds")] = NO_BRAKES
    drive_torque_change_Nm: Annotated[float, Recorded("Nm", "change of the drive torque demand by the controller")] = (
        0.0
    )
    estimate: Estimate | None = None
    side_difference_Pa: Annotated[
        float, Recorded("Pa", "additional brake pressure difference between the sides that the controller allows")
    ] = 0.0
    wheel_torque_demand_Nm: Annotated[PerWheel, Recorded("Nm", "drive torque that the controller adds")] = NO_TORQUES


def steering(
    first: tuple[float, float, float, float, float, bool], estimate: Estimate | None = None
) -> ActuatorCommand:
    """Return the `ActuatorCommand` of a steering controller, from its first six fields and its estimate."""
    return new_message(ActuatorCommand, (*first, NO_BRAKES, 0.0, estimate, 0.0, NO_TORQUES))
