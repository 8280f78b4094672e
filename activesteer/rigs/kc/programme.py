"""The rig's programme: all sweeps and steering axes of a car, in SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from activesteer.config import read_toml
from activesteer.core.conventions import CORNERS, Array
from activesteer.errors import ModelError
from activesteer.rigs.kc.held_car import Case, HeldCar, WheelPose
from activesteer.rigs.kc.modes import Modes, TyreStiffness, modes, parking_moment_Nm, tyre_stiffness
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import Vehicle
from activesteer.vehicle import force_block as fb

INWARDS: Final = np.array([-1.0, 1.0, -1.0, 1.0])
"""Sign of y towards the middle of the car, by corner."""


@dataclass(frozen=True)
class Sweep:
    """One sweep of the rig, with points in increasing order of its variable.

    Vehicle axes of the standing car: x forward, y left, z up, origin on the road below the middle of the front axle.
    Arrays have the shape (n, 4) or (n, 4, 3), by corner.
    """

    title: str  # title of the sweep
    variable: str  # variable of the sweep, with its sign
    unit: str  # SI unit of the variable
    x: Array  # values of the variable, shape (n,)
    centre_m: Array  # wheel centres
    axle: Array  # unit vectors along the wheels' axles, to the left
    contact_m: Array  # contact points: the lowest points of the wheels
    patch_m: Array  # points of the wheels, locked to their knuckles, that are the contact points at x = 0
    load_N: Array  # vertical forces of the pads
    wind_up_rad: Array  # rotation of the knuckles about y, positive in the sense of forward rolling
    damper_m: Array  # lengths of the dampers; for a strut its extension from the design position
    rack_m: Array  # travel of the rack, positive steers left, shape (n,)
    steering_wheel_rad: Array  # steering wheel angle, shape (n,)
    steering_wheel_torque_Nm: Array  # torque that holds the steering wheel, positive to the left, shape (n,)

    @property
    def steer_rad(self) -> Array:
        """Steer angles: heading of the wheel planes, positive to the left, shape (n, 4)."""
        return np.arctan2(-self.axle[..., 0], self.axle[..., 1])

    @property
    def toe_rad(self) -> Array:
        """Toe angles, positive toe-in (front edge towards the middle of the car), shape (n, 4)."""
        return self.steer_rad * INWARDS

    @property
    def camber_rad(self) -> Array:
        """Camber angles, negative with the top towards the middle of the car, shape (n, 4)."""
        return np.arcsin(self.axle[..., 2]) * INWARDS

    @property
    def travel_m(self) -> Array:
        """Heights of the wheel centres relative to x = 0, positive in bump, shape (n, 4)."""
        return self.centre_m[..., 2] - self.centre_m[self.zero, :, 2]

    @property
    def zero(self) -> int:
        """Index of the point of the standing car, x = 0."""
        return int(np.abs(self.x).argmin())


def _read(car: HeldCar) -> dict[str, Array]:
    """Return one point of a sweep as the fields of `Sweep`, with the rotations of the wheels."""
    model, data = car.model, car.data
    poses = [_in_vehicle_axes(car, corner) for corner in range(4)]
    wheel = model.joint("steering_wheel")
    return {
        "centre_m": np.array([pose.centre_m for pose in poses]),
        "rotation": np.array([pose.rotation for pose in poses]),
        "contact_m": np.array([pose.contact_m for pose in poses]),
        "load_N": car.load_N.copy(),
        "damper_m": np.array([data.ten_length[model.tendon(f"{corner}_damper").id] for corner in CORNERS]),
        "rack_m": data.qpos[model.joint("rack").qposadr[0]],
        "steering_wheel_rad": data.qpos[wheel.qposadr[0]],
        "steering_wheel_torque_Nm": data.qfrc_actuator[wheel.dofadr[0]],
    }


def run(car: HeldCar, title: str, variable: str, unit: str, cases: Mapping[float, Case]) -> Sweep:
    """Measure the points of a sweep, from zero outwards in both directions."""
    points: dict[float, dict[str, Array]] = {}
    for side in (sorted(x for x in cases if x >= 0.0), sorted((x for x in cases if x < 0.0), reverse=True)):
        car.reset()
        for x in side:
            car.equilibrium(cases[x])
            points[x] = _read(car)
    car.reset()
    order = sorted(points)
    zero = points[min(points, key=abs)]
    columns = {name: np.stack([points[x][name] for x in order]) for name in zero}
    rotation = columns.pop("rotation")
    at_zero = np.einsum("cji,cj->ci", zero["rotation"], zero["contact_m"] - zero["centre_m"])
    return Sweep(
        title, variable, unit,
        x=np.array(order),
        axle=rotation[..., 1],
        patch_m=columns["centre_m"] + np.einsum("ncij,cj->nci", rotation, at_zero),
        wind_up_rad=np.arctan2(-rotation[..., 2, 0], rotation[..., 0, 0]),
        **columns,
    )  # fmt: skip


@dataclass(frozen=True)
class SteeringAxis:
    """A steering axis, and its offsets from the wheel of the standing car."""

    point_m: Array  # point of the axis at the height of the contact point, vehicle axes, shape (3,)
    direction: Array  # unit vector along it, upwards, shape (3,)
    caster_rad: float  # angle to the vertical in side view, positive with the top to the rear (ISO 8855)
    # Angle to the vertical in front view, positive with the top towards the middle of the car (ISO 8855)
    inclination_rad: float
    trail_m: float  # distance from the contact point forwards to the axis on the ground: positive if the axis is ahead
    # Distance from the axis on the ground outwards to the contact point: positive if the axis is inside
    scrub_radius_m: float
    centre_trail_m: float  # distance from the wheel centre forwards to the axis, at the height of the wheel centre
    # Distance from the axis outwards to the wheel centre, at the height of the wheel centre (disturbing force lever)
    centre_offset_m: float


def steering_axis(right: WheelPose, left: WheelPose, standing: WheelPose, inwards: float) -> SteeringAxis:
    """Return the screw axis of a wheel steered slightly right, then equally left; `inwards`: sign of y to the middle.

    Source: Chasles' theorem; the point is the solution of least norm of (I - R) p = t.
    """
    turn = left.rotation @ right.rotation.T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    axis /= np.linalg.norm(axis)
    axis *= math.copysign(1.0, axis[2])
    shift = left.centre_m - turn @ right.centre_m
    point = np.linalg.lstsq(np.eye(3) - turn, shift - axis * (axis @ shift), rcond=1e-9)[0]

    def at_height(height_m: float) -> Array:
        return point + axis * ((height_m - point[2]) / axis[2])

    ground, beside = at_height(standing.contact_m[2]), at_height(standing.centre_m[2])
    return SteeringAxis(
        ground,
        axis,
        math.atan2(-axis[0], axis[2]),
        math.atan2(inwards * axis[1], axis[2]),
        float(ground[0] - standing.contact_m[0]),
        float(inwards * (ground[1] - standing.contact_m[1])),
        float(beside[0] - standing.centre_m[0]),
        float(inwards * (beside[1] - standing.centre_m[1])),
    )


_STEERING_POINTS: Final = 24
"""Points of the steering sweep to either side."""
_AXIS_STEER_RAD: Final = math.radians(5.0)
"""Steering wheel angle to either side for the search of the steering axis: a third of a degree at the wheel."""
_STEERED_BUMP_M: Final = 0.04
"""Bump and rebound at which the rear wheels are steered too, for screws in the toe links [m]."""
_AXIS_REAR_RAD: Final = math.radians(0.3)


@dataclass(frozen=True)
class Measured:
    """All results of the rig for a car."""

    vehicle: Vehicle
    sweeps: dict[str, Sweep]
    axes: tuple[SteeringAxis, ...]  # steering axes by corner; at the rear the axes of the steering hinges
    tyres: tuple[TyreStiffness, TyreStiffness]  # front and rear tyres
    static_load_N: Array  # wheel loads of the standing car, shape (4,)
    modes: Modes


def measure(vehicle: Vehicle, tyres: tuple[TyreParameters, TyreParameters]) -> Measured:
    """Measure all sweeps and steering axes of a car on the rig."""
    load_N = fb.wheel_outputs(vehicle.data, 4)["fz_N"].copy()
    stiffness = (
        tyre_stiffness(tyres[0], vehicle.parameters.tyres.front_pressure_Pa, float(load_N[:2].mean())),
        tyre_stiffness(tyres[1], vehicle.parameters.tyres.rear_pressure_Pa, float(load_N[2:].mean())),
    )
    car = HeldCar(vehicle)
    return Measured(
        vehicle,
        _sweeps(vehicle, car, load_N, stiffness),
        _axes(vehicle, car),
        stiffness,
        load_N,
        modes(vehicle, load_N, stiffness),
    )


def _sweeps(
    vehicle: Vehicle, car: HeldCar, load_N: Array, tyres: tuple[TyreStiffness, TyreStiffness]
) -> dict[str, Sweep]:
    table, _ = read_toml(Path(__file__).with_name("sweeps.toml"))
    free = HeldCar(vehicle, springs="out")
    sweeps = {}
    for name, row in table.items():
        signs = INWARDS if row.get("opposed") else np.ones(4)
        unit = np.outer(signs, row["direction"]) if "direction" in row else signs
        first, last, count = row["points"]
        cases = {x: Case(**{row["load"]: x * unit}) for x in np.linspace(first, last, count).tolist()}
        sweeps[name] = run(car if row.get("springs", True) else free, row["title"], row["variable"], row["unit"], cases)
    scrub = parking_moment_Nm(load_N[:2].mean(), tyres[0]) * np.array([1.0, 1.0, 0.0, 0.0])
    for ending, title, moment in (
        ("rolling", "steering wheel sweep, pads without friction", 0.0 * scrub),
        ("at_rest_left", "steering wheel turned to the left on a dry road, at rest", -scrub),
        ("at_rest_right", "steering wheel turned to the right on a dry road, at rest", scrub),
    ):
        moment_Nm = np.outer(moment, [0.0, 0.0, 1.0])
        cases = {
            angle: Case("contact", steering_wheel_rad=angle, moment_Nm=moment_Nm)
            for angle in _steering_angles(vehicle).tolist()
        }
        sweeps[f"steering_{ending}"] = run(car, title, "steering wheel angle, positive to the left", "rad", cases)
    rear_limit_rad = vehicle.model.actuator("rl_steer").ctrlrange[1]
    heights = {"": 0.0}
    if vehicle.parameters.rear_actuator.has_motor:
        heights |= {"_bump": _STEERED_BUMP_M, "_rebound": -_STEERED_BUMP_M}
    for ending, height_m in heights.items():
        title = "rear steering" + (f" with {ending[1:]} of {1e3 * abs(height_m):.0f} mm" if ending else "")
        cases = {
            angle: Case("contact", height_m * np.ones(4), rear_steer_rad=angle)
            for angle in (np.linspace(-1.0, 1.0, 13) * rear_limit_rad).tolist()
        }
        variable = "angle of the rear steering actuators, positive to the left"
        sweeps[f"rear_steering{ending}"] = run(car, title, variable, "rad", cases)
    return sweeps


def rear_screw_travel_m(vehicle: Vehicle, angles_rad: Array) -> Array:
    """Return the extension of the left toe link by its screw at given actuator angles [m]."""
    address = int(vehicle.model.actuator_actadr[vehicle.model.actuator("rl_steer").id])
    return np.array([vehicle.actuators.rear_states_at(float(angle))[address] for angle in angles_rad])


def _steering_angles(vehicle: Vehicle) -> Array:
    """Return steering wheel angles up to the nearer limit of wheel and rack, closely spaced near straight ahead."""
    model = vehicle.model
    rack = float(model.jnt_range[model.joint("rack").id, 1])
    per_angle = vehicle.rack_per_steering_wheel_m
    if per_angle is None:
        raise ModelError("no tendon 'steering_column' couples rack and steering wheel")
    lock = min(vehicle.parameters.steering.steering_wheel_limit_rad, rack / abs(per_angle))
    small = np.radians([2.5, 5.0, 10.0, 15.0, 20.0])
    half = np.concatenate([small[small < lock], np.linspace(0.0, lock, _STEERING_POINTS)[2:]])
    half = np.unique(half)
    return np.concatenate([-half[::-1], [0.0], half])


def _axes(vehicle: Vehicle, car: HeldCar) -> tuple[SteeringAxis, ...]:
    """Return the steering axes of the unloaded links, with dampers of fixed length."""
    locked = HeldCar(vehicle, springs="locked")

    def poses(sign: float) -> list[WheelPose]:
        locked.reset()
        locked.equilibrium(
            Case("nothing", steering_wheel_rad=sign * _AXIS_STEER_RAD, rear_steer_rad=sign * _AXIS_REAR_RAD)
        )
        return [_in_vehicle_axes(locked, corner) for corner in range(4)]

    right, left = poses(-1.0), poses(1.0)
    return tuple(
        steering_axis(right[corner], left[corner], _in_vehicle_axes(car, corner), float(INWARDS[corner]))
        for corner in range(len(CORNERS))
    )


def _in_vehicle_axes(car: HeldCar, corner: int) -> WheelPose:
    pose = car.wheel(corner)
    return WheelPose(pose.centre_m - car.origin_m, pose.rotation, pose.contact_m - car.origin_m)
