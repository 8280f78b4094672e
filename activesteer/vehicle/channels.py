"""From the engine's raw rows to the recorded channels: units, axes, signs. The only place that says what each is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.brakes.records import PER_WHEEL, PLACES
from activesteer.conventions import CORNERS, Array
from activesteer.errors import ModelError, nearest_names
from activesteer.sensors.block import MEASURED
from activesteer.signals import Channel
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.car_motion import MOTION_SENSORS, CarMotion
from activesteer.vehicle.command_row import COMMAND_CHANNELS
from activesteer.vehicle.estimate_row import ESTIMATE_CHANNELS
from activesteer.vehicle.guide_model import GUIDE
from activesteer.vehicle.named_parts import find, tendon_arms
from activesteer.vehicle.native_channels import (
    Actuator,
    AxialForce,
    axial_forces,
    copy_columns,
    record_of,
    saturations,
)
from activesteer.vehicle.parameters import VehicleParameters
from activesteer.vehicle.superposition_actuator import MOTOR, NAME
from activesteer.vehicle.toe_link_screws import SCREW

_CORNER_WORDS: Final = {"fl": "front left", "fr": "front right", "rl": "rear left", "rr": "rear right"}

_BRAKES: Final = (
    ("demand_Pa", "brake_pressure_demand_Pa", "Pa", "brake pressure that driver and controller ask for", "corners"),
    ("pressure_Pa", "brake_pressure_Pa", "Pa", "pressure in the wheel brake", "corners"),
    ("phase", "abs_phase", "", "anti-lock control: 0 off, 1 releases, 2 recovers, 3 builds up pressure", "corners"),
    ("reference_mps", "abs_speed_mps", "m/s", "speed of the car as the brakes' control unit estimates it", "vehicle"),
    ("tcs_active", "tcs_active", "", "1 while traction control limits the drive", "vehicle"),
)
"""Field of `BRAKE_STATE` -> its channels: name, unit, meaning, group."""


class RawRows(NamedTuple):
    """Copies of the engine's arrays and the commands, one row a step, all of the same instant."""

    sensordata: Array
    userdata: Array
    ten_length: Array
    ten_velocity: Array
    act: Array
    actuator_force: Array
    ctrl: Array
    commands: Array
    """What driver and controller asked for, as `write_commands` leaves it."""
    measured: Array
    """What the sensors said when driver and controller decided; empty with ideal sensors."""
    brakes: Array
    """A `BRAKE_STATE`."""
    estimate: Array
    """The members of an `Estimate`; empty where no controller makes one."""


class Column(NamedTuple):
    """A column of one of the arrays of `RawRows`, recorded as it is."""

    array: str
    column: int


class Signal(NamedTuple):
    """A channel and how to get it from raw rows: by compiled code, or block by block."""

    channel: Channel
    values: Column | AxialForce | Actuator | Callable[[RawRows], Array]


class ChannelMap:
    """All channels of a vehicle, evaluated block by block.

    Attributes:
        channels: Their table, in the order of the columns.
    """

    def __init__(self, model: mujoco.MjModel, parameters: VehicleParameters) -> None:
        """Looks up everything by name, once.

        Args:
            model: The car.
            parameters: Its parameters.

        Raises:
            ModelError: a sensor, tendon or actuator is missing.
        """
        self._model = model
        self._parameters = parameters
        self._sensors = {model.sensor(index).name: index for index in range(model.nsensor)}
        for name in MOTION_SENSORS:
            # They are read block by block; a missing one is to show now.
            self._sensor(name)
        self._signals = [
            *self._motion(), *self._steering(), *self._corners(), *self._links(), *self._actuators(), *self._motors(),
            *(Signal(channel, Column("commands", place)) for channel, place in COMMAND_CHANNELS.items()),
            *self._measured(), *self._brakes(),
        ]  # fmt: skip
        self._signals.append(
            Signal(
                Channel("active_faults", "", "how many faults of actuators and sensors act", "vehicle"),
                Column("userdata", model.nuserdata - 1),
            )
        )
        self._arrange()

    def add_estimate(self) -> None:
        """Adds the channels of what a controller estimates."""
        self._signals += [Signal(channel, Column("estimate", place)) for place, channel in enumerate(ESTIMATE_CHANNELS)]
        self._arrange()

    def _arrange(self) -> None:
        signals = self._signals
        self.channels = tuple(signal.channel for signal in signals)
        wanted = [(place, signal.values) for place, signal in enumerate(signals)]
        self._computed = [(place, values) for place, values in wanted if callable(values)]
        self._forces, self._limits = _of_kind(AxialForce, wanted), _of_kind(Actuator, wanted)
        self._copied = []
        for array in RawRows._fields:
            here = [(v.column, place) for place, v in wanted if isinstance(v, Column) and v.array == array]
            if here:
                self._copied.append((array, *np.array(here, np.intp).T.copy()))

    def evaluate(self, rows: RawRows, out: Array, last_yaw_rad: float = 0.0) -> None:
        """Values of all channels.

        Args:
            rows: Raw rows of n steps, n > 0.
            out: Where the values go, shape (n, len(channels)).
            last_yaw_rad: Yaw angle of the row before the first one, which the angle is unwrapped from [rad].
        """
        # The last rows of a run that diverged are not finite; they are to be recorded, not complained about.
        with np.errstate(invalid="ignore", over="ignore"):
            for array, columns, places in self._copied:
                copy_columns(getattr(rows, array), columns, out, places)
            laws, places = self._forces
            axial_forces(rows.ten_length, rows.ten_velocity, laws, out, places)
            laws, places = self._limits
            saturations(rows.ctrl, rows.act, rows.actuator_force, laws, out, places)
            # What follows works on whole columns, many times.
            rows = rows._replace(sensordata=np.asfortranarray(rows.sensordata))
            self._car_motion = CarMotion(rows.sensordata, self._sensor, self._model.opt.gravity, last_yaw_rad)
            for place, values in self._computed:
                out[:, place] = values(rows)

    def _sensor(self, name: str) -> slice:
        index = self._sensors.get(name)
        if index is None:
            raise ModelError(f"the model has no sensor {name!r}; {nearest_names(name, self._sensors)}", value=name)
        start = int(self._model.sensor_adr[index])
        return slice(start, start + int(self._model.sensor_dim[index]))

    def _motion(self) -> list[Signal]:
        def of(name: str, unit: str, meaning: str, *, exact: bool = False) -> Signal:
            return Signal(Channel(name, unit, meaning, "vehicle", not exact), lambda _: getattr(self._car_motion, name))

        return [
            of("x_m", "m", "position of the centre of gravity, world x", exact=True),
            of("y_m", "m", "position of the centre of gravity, world y (left)", exact=True),
            of("z_m", "m", "height of the centre of gravity above the road"),
            of("yaw_rad", "rad", "yaw angle, left positive, unwrapped", exact=True),
            of("roll_rad", "rad", "roll angle, positive to the right"),
            of("pitch_rad", "rad", "pitch angle, positive nose down"),
            of("vx_mps", "m/s", "longitudinal velocity of the centre of gravity, in the road plane"),
            of("vy_mps", "m/s", "lateral velocity of the centre of gravity, in the road plane, left positive"),
            of("vz_mps", "m/s", "vertical velocity of the centre of gravity"),
            of("speed_mps", "m/s", "speed of the centre of gravity over the road"),
            of("yaw_rate_radps", "rad/s", "yaw rate, left positive"),
            of("roll_rate_radps", "rad/s", "roll rate, body-fixed"),
            of("pitch_rate_radps", "rad/s", "pitch rate, body-fixed"),
            of("ax_mps2", "m/s2", "longitudinal acceleration, in the road plane"),
            of("ay_mps2", "m/s2", "lateral acceleration, in the road plane, left positive"),
            of("az_mps2", "m/s2", "vertical acceleration"),
            of("sideslip_rad", "rad", "sideslip angle at the centre of gravity, atan(vy/vx)"),
            of("front_axle_x_m", "m", "position of the middle of the front axle, world x", exact=True),
            of("front_axle_y_m", "m", "position of the middle of the front axle, world y", exact=True),
        ]

    def _steering(self) -> list[Signal]:
        ratio = self._parameters.steering.ratio
        wheel, added = self._sensor("steering_wheel_angle").start, self._sensor("superposition_angle").start
        rack = self._sensor("rack_travel").start
        rear = [self._sensor(f"{corner}_steer_angle").start for corner in ("rl", "rr")]
        front = [self._sensor(f"{corner}_wheel_axis") for corner in ("fl", "fr")]
        demand = find(self._model, mujoco.mjtObj.mjOBJ_ACTUATOR, "steering_wheel")
        felt = 1.0 - self._parameters.steering.assist_fraction

        def channel(name: str, unit: str, meaning: str) -> Channel:
            return Channel(name, unit, meaning, "vehicle")

        return [
            Signal(
                channel("steering_wheel_rad", "rad", "steering wheel angle, left positive, not wrapped"),
                Column("sensordata", wheel),
            ),
            Signal(
                channel("steering_wheel_demand_rad", "rad", "steering wheel angle that the driver demands"),
                Column("ctrl", demand),
            ),
            Signal(
                channel("hand_torque_Nm", "Nm", "torque of the hands at the steering wheel, left positive"),
                self._column_torque(felt) or (lambda rows: felt * rows.actuator_force[:, demand]),
            ),
            Signal(
                channel("front_steer_rad", "rad", "mean steer angle of the front wheels against the chassis"),
                lambda rows: 0.5 * (_toe(rows.sensordata[:, front[0]]) + _toe(rows.sensordata[:, front[1]])),
            ),
            Signal(
                channel("superposition_rad", "rad", "angle added by the front superposition, at the road wheel"),
                lambda rows: rows.sensordata[:, added] / ratio,
            ),
            Signal(
                channel("rear_steer_rad", "rad", "mean angle of the rear steering actuators"),
                lambda rows: 0.5 * (rows.sensordata[:, rear[0]] + rows.sensordata[:, rear[1]]),
            ),
            Signal(channel("rack_m", "m", "rack travel, positive steers left"), Column("sensordata", rack)),
        ]

    def _column_torque(self, felt: float) -> AxialForce | None:
        """A fraction of the torque that the column carries [N m]; None where there is no column.

        The actuator that stands for the hands does not say it: its force is that of the demand of this step against the
        angle at its beginning, and the engine carries out what is left of it at the end.
        """
        arms = tendon_arms(self._model, "steering_column")
        if "steering_wheel" not in arms:
            return None
        tension = self._axial_force(self._model.tendon("steering_column").id)
        scale = felt * arms["steering_wheel"]
        return tension._replace(
            stiffness_Npm=scale * tension.stiffness_Npm, second_Npm2=scale * tension.second_Npm2,
            third_Npm3=scale * tension.third_Npm3, damping_Nspm=scale * tension.damping_Nspm,
        )  # fmt: skip

    def _axial_force(self, tendon: int) -> AxialForce:
        """The law of a tendon's own stiffness."""
        model = self._model
        stiffness = model.tendon_stiffness[tendon], *model.tendon_stiffnesspoly[tendon]
        return AxialForce._make((tendon, *stiffness, model.tendon_damping[tendon], *model.tendon_lengthspring[tendon]))

    def _corners(self) -> list[Signal]:
        signals: list[Signal] = []
        for index, corner in enumerate(CORNERS):
            words = _CORNER_WORDS[corner]

            def user(
                field: str, name: str, unit: str, meaning: str, *, index: int = index, corner: str = corner,
                words: str = words,
            ) -> Signal:  # fmt: skip
                channel = Channel(f"{corner}_{name}", unit, f"{meaning}, {words}", "corners")
                return Signal(channel, Column("userdata", fb.output_slot(index, field)))

            signals += [
                user("fx_N", "tyre_fx_N", "N", "longitudinal tyre force at the contact point, ISO-W"),
                user("fy_N", "tyre_fy_N", "N", "lateral tyre force at the contact point, ISO-W, left positive"),
                user("fz_N", "tyre_fz_N", "N", "vertical tyre force"),
                user("mx_Nm", "tyre_mx_Nm", "Nm", "overturning moment"),
                user("my_Nm", "tyre_my_Nm", "Nm", "rolling resistance moment, negative rolling forward"),
                user("mz_Nm", "tyre_mz_Nm", "Nm", "aligning moment"),
                user("slip_ratio", "slip_ratio", "", "transient longitudinal slip, positive drives"),
                user("slip_angle_rad", "slip_angle_rad", "rad", "transient slip angle, positive gives negative force"),
                user("inclination_rad", "inclination_rad", "rad", "inclination of the wheel against the road about +x"),
                user("loaded_radius_m", "loaded_radius_m", "m", "distance of wheel centre and contact point"),
                user("limited", "tyre_limited", "", "1 where the tyre is outside its file's range of validity"),
                user("contact_x_m", "contact_x_m", "m", "contact point with the road, world x"),
                user("contact_y_m", "contact_y_m", "m", "contact point with the road, world y"),
                user("mu", "mu", "", "friction of the road at the contact point"),
                user(
                    "friction_utilisation",
                    "friction_utilisation",
                    "",
                    "fraction of the tyre's peak friction at its load that is used",
                ),
            ]
            signals += self._wheel(corner, words, index)
        return signals

    def _wheel(self, corner: str, words: str, index: int) -> list[Signal]:
        height = self._sensor(f"{corner}_wheel_position").start + 2
        axis = self._sensor(f"{corner}_wheel_axis")
        spin = self._sensor(f"{corner}_wheel_speed").start
        design_m = self._design_height(corner)
        damper = len(CORNERS) * fb.USERDATA_PER_WHEEL + index

        def channel(name: str, unit: str, meaning: str) -> Channel:
            return Channel(f"{corner}_{name}", unit, f"{meaning}, {words}", "corners")

        return [
            Signal(channel("wheel_speed_radps", "rad/s", "rotational speed"), Column("sensordata", spin)),
            Signal(
                channel("travel_m", "m", "wheel travel from the design position, bump positive"),
                lambda rows: rows.sensordata[:, height] - design_m,
            ),
            Signal(
                channel("steer_rad", "rad", "steer angle of the wheel against the chassis, left positive"),
                lambda rows: _toe(rows.sensordata[:, axis]),
            ),
            Signal(
                channel("camber_rad", "rad", "inclination of the wheel against the chassis about +x"),
                lambda rows: np.arcsin(rows.sensordata[:, axis.start + 2]),
            ),
            Signal(
                channel("damper_force_N", "N", "damper force, positive resists compression"),
                Column("userdata", damper),
            ),
        ]

    def _design_height(self, corner: str) -> float:
        """Height of a wheel centre in vehicle axes in the design position [m]."""
        data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, data)
        chassis = self._model.body("chassis").id
        offset = data.xpos[self._model.body(f"{corner}_wheel").id] - data.xpos[chassis]
        return float((data.xmat[chassis].reshape(3, 3).T @ offset)[2])

    def _links(self) -> list[Signal]:
        """Axial forces of everything that is a tendon with a stiffness of its own; tension positive."""
        model = self._model
        signals = []
        for index in range(model.ntendon):
            if model.tendon_stiffness[index] == 0.0 and not model.tendon_stiffnesspoly[index].any():
                continue
            if model.tendon(index).name.endswith(GUIDE):
                # Five springs that stand for all links of a wheel; none of them is a part of the car.
                continue
            # What a damper's tendon has of a spring are the stops at both ends of its travel.
            name = model.tendon(index).name.replace("_damper", "_stop")
            law = self._axial_force(index)
            channel = Channel(f"{name}_force_N", "N", f"axial force of {name}, tension positive", "links")
            signals.append(Signal(channel, self._screwed(index, law) or law))
        return signals

    def _screwed(self, tendon: int, law: AxialForce) -> Callable[[RawRows], Array] | None:
        """The force of a link whose length a screw changes; None of any other."""
        model = self._model
        along = model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON)
        found = np.flatnonzero(along & (model.actuator_trnid[:, 0] == tendon) & (model.actuator_gainprm[:, 0] > 0.0))
        if not found.size:
            return None
        actuator = int(found[0])

        def force(rows: RawRows) -> Array:
            stretch = rows.ten_length[:, tendon] - law.low_m
            passive = law.stiffness_Npm * stretch + law.damping_Nspm * rows.ten_velocity[:, tendon]
            return passive - rows.actuator_force[:, actuator]

        return force

    def _motors(self) -> list[Signal]:
        """What the motors of screws in the toe links, and of the superposition, do."""
        model, signals = self._model, []
        for name, words in (
            ("rl", "of the left toe link"), ("rr", "of the right toe link"), ("rear", "of both toe links"),
            (NAME, "of the superposition"),
        ):  # fmt: skip
            if name + MOTOR not in self._sensors:
                continue
            place = self._sensor(name + MOTOR).start

            def channel(what: str, unit: str, meaning: str, *, name: str = name, words: str = words) -> Channel:
                return Channel(f"{name}_{what}", unit, f"{meaning} {words}", "vehicle")

            def state(ending: str, *, name: str = name) -> Column:
                return Column("act", int(model.actuator_actadr[model.actuator(name + ending).id]))

            if name != NAME:
                signals.append(Signal(channel("screw_m", "m", "travel of the screw"), state(SCREW)))
            signals += [
                Signal(channel("motor_speed_radps", "rad/s", "speed of the motor"), state(MOTOR)),
                Signal(channel("motor_torque_Nm", "Nm", "torque of the motor"), Column("sensordata", place)),
                Signal(
                    channel(
                        "saturated" if name == NAME else "steer_saturated", "",
                        "1 at a limit of angle, speed, torque or supply of the motor",
                    ),
                    Column("sensordata", place + 1),
                ),
            ]  # fmt: skip
        return signals

    def _actuators(self) -> list[Signal]:
        """Torques of drive and brakes, and flags that say where an actuator is at a limit."""
        model = self._model
        signals: list[Signal] = []
        for index in range(model.nu):
            name = model.actuator(index).name
            if name.endswith(("_drive", "_brake")):
                signals.append(
                    Signal(
                        Channel(f"{name}_torque_Nm", "Nm", f"torque of {name} on the wheel", "vehicle"),
                        Column("actuator_force", index),
                    )
                )
            elif name.endswith("_friction"):
                part = name.removesuffix("_friction")
                sign = "positive resists compression" if part.endswith("damper") else "positive pushes to the left"
                signals.append(
                    Signal(
                        Channel(f"{name}_N", "N", f"dry friction of {part}, {sign}", "links"),
                        Column("actuator_force", index),
                    )
                )
            elif (
                model.actuator_actadr[index] >= 0
                and model.actuator_gainprm[index, 0] > 0.0
                and model.actuator_trntype[index] != int(mujoco.mjtTrn.mjTRN_TENDON)
                and name + MOTOR not in self._sensors
            ):
                signals.append(
                    Signal(
                        Channel(
                            f"{name}_saturated",
                            "",
                            f"1 where {name} is at its angle, rate or torque limit",
                            "vehicle",
                        ),
                        self._limits_of(index),
                    )
                )
        return signals

    def _measured(self) -> list[Signal]:
        """What the sensors say, where that is not the truth."""
        if self._parameters.sensors.is_ideal:
            return []
        return [
            Signal(
                Channel(f"measured_{name}", unit, f"{meaning} as the sensors say it", "measured"),
                Column("measured", index),
            )
            for index, (name, unit, meaning) in enumerate(MEASURED)
        ]

    def _brakes(self) -> list[Signal]:
        """Pressures, and what the control unit of the brakes knows and does."""
        signals = []
        for field, name, unit, meaning, group in _BRAKES:
            first = PLACES[field]
            if field in PER_WHEEL:
                signals += [
                    Signal(
                        Channel(f"{corner}_{name}", unit, f"{meaning}, {words}", group), Column("brakes", first + index)
                    )
                    for index, (corner, words) in enumerate(_CORNER_WORDS.items())
                ]
            else:
                signals.append(Signal(Channel(name, unit, meaning, group), Column("brakes", first)))
        return signals

    def _limits_of(self, index: int) -> Actuator:
        model = self._model
        force = model.actuator_forcerange[index] if model.actuator_forcelimited[index] else (-np.inf, np.inf)
        lag_and_rate, angle = model.actuator_dynprm[index, :2], model.actuator_ctrlrange[index]
        return Actuator._make((index, model.actuator_actadr[index], *lag_and_rate, *angle, *force))


def _of_kind(kind: type[AxialForce | Actuator], wanted: list[tuple[int, Any]]) -> tuple[NDArray[Any], NDArray[np.intp]]:
    """What compiled code takes of a kind of channel: the laws, and the places of the channels."""
    here = [(values, place) for place, values in wanted if isinstance(values, kind)]
    return np.array([law for law, _ in here], record_of(kind)), np.array([place for _, place in here], np.intp)


def _toe(axis: Array) -> Array:
    """Steer angle of a wheel from its spin axis in chassis axes, shape (n, 3)."""
    return np.arctan2(-axis[:, 0], axis[:, 1])
