"""Sweep of the rig: pose of every wheel and force of its pad, at each point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from activesteer.conventions import CORNERS, Array
from activesteer.rigs.kc.held_car import Case, HeldCar

INWARDS: Final = np.array([-1.0, 1.0, -1.0, 1.0])
"""Sign of y towards the middle of the car, by corner."""


@dataclass(frozen=True)
class Sweep:
    """One sweep of the rig, n points in increasing order of its variable.

    Vehicle axes of the standing car: x forward, y left, z up, origin on the road below the middle of the front axle.
    Arrays have the shape (n, 4) or (n, 4, 3), by corner.
    """

    title: str
    """Title of the sweep."""
    variable: str
    """Variable of the sweep, with its sign."""
    unit: str
    """SI unit of the variable."""
    x: Array
    """Values of the variable, shape (n,)."""
    centre_m: Array
    """Wheel centres."""
    axle: Array
    """Unit vectors along the wheels' axles, to the left."""
    contact_m: Array
    """Contact points: the lowest points of the wheels."""
    patch_m: Array
    """Points of the wheels, locked to their knuckles, that are the contact points at x = 0."""
    load_N: Array
    """Vertical forces of the pads."""
    wind_up_rad: Array
    """Rotation of the knuckles about y, positive in the sense of forward rolling."""
    damper_m: Array
    """Lengths of the dampers; for a strut its extension from the design position."""
    rack_m: Array
    """Travel of the rack, positive steers left, shape (n,)."""
    steering_wheel_rad: Array
    """Steering wheel angle, shape (n,)."""
    steering_wheel_torque_Nm: Array
    """Torque that holds the steering wheel, positive to the left, shape (n,)."""

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
        """Heights of the wheel centres above those at x = 0, positive in bump, shape (n, 4)."""
        return self.centre_m[..., 2] - self.centre_m[self.zero, :, 2]

    @property
    def zero(self) -> int:
        """Index of the point of the standing car, x = 0."""
        return int(np.abs(self.x).argmin())

    def as_table(self) -> dict[str, object]:
        """Return all arrays as lists for JSON, with the angles of the wheels."""
        table: dict[str, object] = {"title": self.title, "variable": self.variable, "unit": self.unit}
        arrays = {item.name: getattr(self, item.name) for item in fields(self) if item.name not in table}
        arrays |= {"toe_rad": self.toe_rad, "camber_rad": self.camber_rad, "steer_rad": self.steer_rad}
        return table | {name: value.tolist() for name, value in arrays.items()}


def _read(car: HeldCar) -> dict[str, Array]:
    """Return one point of a sweep by the names of the fields of `Sweep`, with the rotations of the wheels."""
    model, data = car.model, car.data
    poses = [car.wheel(corner) for corner in range(4)]
    wheel = model.joint("steering_wheel")
    return {
        "centre_m": np.array([pose.centre_m for pose in poses]) - car.origin_m,
        "rotation": np.array([pose.rotation for pose in poses]),
        "contact_m": np.array([pose.contact_m for pose in poses]) - car.origin_m,
        "load_N": car.load_N.copy(),
        "damper_m": np.array([data.ten_length[model.tendon(f"{corner}_damper").id] for corner in CORNERS]),
        "rack_m": data.qpos[model.joint("rack").qposadr[0]],
        "steering_wheel_rad": data.qpos[wheel.qposadr[0]],
        "steering_wheel_torque_Nm": data.qfrc_actuator[wheel.dofadr[0]],
    }


def run(car: HeldCar, title: str, variable: str, unit: str, cases: Mapping[float, Case]) -> Sweep:
    """Measure the points of a sweep, from zero outwards to either side.

    Args:
        car: The car on the rig; returned to its first equilibrium.
        title: Title of the sweep.
        variable: Variable of the sweep.
        unit: SI unit of the variable.
        cases: Loads and positions that the rig imposes, by value of the variable; 0 must be among them.

    Raises:
        ModelError: a point has no equilibrium.
    """
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
