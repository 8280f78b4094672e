"""Kinematics of the held car against the reference: wheel travel at centred rack, and rack travel."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from activesteer.core.conventions import Array
from activesteer.rigs.kc.held_car import Case, HeldCar
from activesteer.vehicle import Vehicle
from tests.reference.chrono.comparison import Comparison, absolute, relative
from tests.reference.chrono.reference import ReferenceData, Table

_MAX_TRAVEL_MM: Final = 65.0
_STEP_MM: Final = 5.0
_TRAVEL_TOLERANCES: Final = {
    "toe_in": ("deg", 0.03),
    "camber": ("deg", 0.03),
    "dx": ("mm", 0.3),
    "track": ("mm", 0.3),
    "spring_length": ("mm", 0.3),
    "damper_length": ("mm", 0.3),
}
"""Quantity -> unit, tolerance."""
_FORCE_TOLERANCE: Final = 0.01
_STEER_TOLERANCE: Final = 0.005
_STEER_FROM_MM: Final = 5.0
"""Least rack travel at which the relative error of the steer angle is evaluated [mm]."""


class Curves(NamedTuple):
    """Our curve and the reference over a common abscissa, for a picture.

    Attributes:
        title: Title.
        label: Label of the ordinate.
        x_label: Label of the abscissa.
        x: Abscissa.
        ours: Our values.
        reference: Values of the reference.
        tolerance: Half width of the corridor around the reference.
    """

    title: str
    label: str
    x_label: str
    x: Array
    ours: Array
    reference: Array
    tolerance: Array


class _Rig:
    """The car on the rig without springs, with the measurements that the reference contains."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.held = HeldCar(vehicle, springs="out")
        model, data = self.held.model, self.held.data
        self._vehicle = vehicle
        self._chassis = model.body("chassis").id
        self._wheels = [model.body(f"{corner}_wheel").id for corner in ("fl", "rl")]
        at_design = mujoco.MjData(model)
        at_design.qpos[:] = model.qpos0
        mujoco.mj_kinematics(model, at_design)
        self._design = [self._in_chassis(at_design, body) for body in self._wheels]
        mujoco.mj_kinematics(model, data)
        self.standing_mm = 1e3 * np.repeat(
            [float(self._in_chassis(vehicle.data, body)[2] - design[2]) for body, design in
             zip(self._wheels, self._design, strict=True)], 2,
        )  # fmt: skip

    def _in_chassis(self, data: mujoco.MjData, body: int) -> Array:
        rotation = data.xmat[self._chassis].reshape(3, 3)
        return rotation.T @ (data.xpos[body] - data.xpos[self._chassis])

    def axis(self, corner: str) -> Array:
        """Return the spin axis of a wheel in chassis axes."""
        data = self.held.data
        wheel = data.xmat[self.held.model.body(f"{corner}_wheel").id].reshape(3, 3)
        return data.xmat[self._chassis].reshape(3, 3).T @ wheel[:, 1]

    def set(self, travel_mm: float, steering_wheel_rad: float = 0.0) -> None:
        """Move all wheels to a travel [mm]."""
        height_m = 1e-3 * (travel_mm - self.standing_mm)
        self.held.equilibrium(Case(height_m=height_m, steering_wheel_rad=steering_wheel_rad))

    def left(self, axle: int) -> dict[str, float]:
        """Return position, angles and element lengths of the left wheel of an axle [mm, deg]."""
        moved = 1e3 * (self._in_chassis(self.held.data, self._wheels[axle]) - self._design[axle])
        corner = ("fl", "rl")[axle]
        axis = self.axis(corner)
        lengths = self.held.data.ten_length
        model = self.held.model
        return {
            "travel": float(moved[2]),
            "toe_in": -math.degrees(math.atan2(-axis[0], axis[1])),
            "camber": -math.degrees(math.asin(axis[2])),
            "dx": float(moved[0]),
            "track": 2.0 * float(moved[1]),
            "spring_length": 1e3 * float(lengths[model.tendon(f"{corner}_spring").id]),
            "damper_length": 1e3 * float(lengths[model.tendon(f"{corner}_damper").id]),
        }

    def spring_force_N(self, axle: int, length_mm: Array) -> Array:
        """Return the force of the driven model's spring over its length, positive in compression."""
        model = self._vehicle.model
        tendon = model.tendon(f"{('fl', 'rl')[axle]}_spring").id
        free_mm = 1e3 * model.tendon_lengthspring[tendon, 0]
        return model.tendon_stiffness[tendon] * 1e-3 * (free_mm - length_mm)


def compare_kinematics(vehicle: Vehicle, data: ReferenceData) -> tuple[list[Comparison], list[Curves]]:
    """Compare sweeps of wheel travel and rack.

    Args:
        vehicle: The car, in static ride.
        data: The reference.

    Returns:
        Comparisons, and the curves behind them.
    """
    rig = _Rig(vehicle)
    rows, curves = _travel(rig, data.table("travel_sweep"))
    more, pictures = _rack(rig, data.table("rack_sweep"), vehicle.rack_per_steering_wheel_m or math.nan)
    return rows + more, curves + pictures


def _travel(rig: _Rig, reference: Table) -> tuple[list[Comparison], list[Curves]]:
    points: list[list[dict[str, float]]] = [[], []]
    for travel in np.arange(-_MAX_TRAVEL_MM, _MAX_TRAVEL_MM + 0.1, _STEP_MM):
        rig.set(float(travel))
        for axle in (0, 1):
            points[axle].append(rig.left(axle))
    rows: list[Comparison] = []
    curves = []
    x = reference["travel_mm"]
    columns = {"toe_in": "toe_in_deg", "camber": "camber_deg", "dx": "dx_mm", "track": "outboard_dy_mm",
               "spring_length": "spring_len_mm", "damper_length": "shock_len_mm"}  # fmt: skip
    for axle, name in enumerate(("front", "rear")):
        measured = {key: np.array([point[key] for point in points[axle]]) for key in points[axle][0]}
        splines = {key: CubicSpline(measured["travel"], values) for key, values in measured.items()}
        for key, (unit, tolerance) in _TRAVEL_TOLERANCES.items():
            theirs = reference[f"{columns[key]}_{name}"] * (2.0 if key == "track" else 1.0)
            ours = splines[key](x)
            worst = int(np.abs(ours - theirs).argmax())
            what = f"{name}_{key}_within_60mm"
            rows.append(absolute("wheel_travel", what, unit, float(ours[worst]), float(theirs[worst]), tolerance))
            if key in ("toe_in", "camber", "track"):
                label = f"{key.replace('_', '-')} [{unit}]"
                curves.append(
                    Curves(
                        f"{name} axle", label, "wheel travel [mm] (+ bump)", x, ours, theirs, np.full_like(x, tolerance)
                    )
                )
        # Virtual work: the force at the wheel centre is the spring force times the motion ratio.
        ours = -rig.spring_force_N(axle, splines["spring_length"](x)) * splines["spring_length"](x, 1)
        theirs = reference[f"F_vert_spring_N_{name}"]
        worst = int(np.abs(ours / theirs - 1.0).argmax())
        what = f"{name}_spring_force_at_wheel_within_60mm"
        rows.append(relative("wheel_travel", what, "N", float(ours[worst]), float(theirs[worst]), _FORCE_TOLERANCE))
    return rows, curves


def _rack(rig: _Rig, reference: Table, rack_per_rad_m: float) -> tuple[list[Comparison], list[Curves]]:
    x = reference["rack_mm"]
    held_mm = float(reference["travel_mm_fl"][np.abs(x).argmin()])
    steer: dict[str, list[float]] = {"fl": [], "fr": []}
    inclination: dict[str, list[float]] = {"fl": [], "fr": []}
    # From the centre outwards, so that the search never starts far away.
    order = np.argsort(np.abs(x), kind="stable")
    for index in order:
        rig.set(held_mm, 1e-3 * float(x[index]) / rack_per_rad_m)
        for corner, angles in steer.items():
            axis = rig.axis(corner)
            angles.append(math.degrees(math.atan2(-axis[0], axis[1])))
            inclination[corner].append(math.degrees(math.asin(axis[2])))
    back = np.argsort(order)
    rows: list[Comparison] = []
    curves = []
    for corner, angles in steer.items():
        ours, theirs = np.array(angles)[back], reference[f"steer_deg_{corner}"]
        centre = int(np.abs(x).argmin())
        gain = [float(np.polyfit(x[np.abs(x) <= 6.1], v[np.abs(x) <= 6.1], 3)[2]) for v in (ours, theirs)]
        rows.append(
            relative("rack", f"{corner}_steer_per_rack_at_centre", "deg/mm", gain[0], gain[1], _STEER_TOLERANCE)
        )
        turned = [v - v[centre] for v in (ours, theirs)]
        far = np.flatnonzero(np.abs(x) >= _STEER_FROM_MM)
        worst = int(far[np.abs(turned[0][far] / turned[1][far] - 1.0).argmax()])
        rows.append(
            relative("rack", f"{corner}_steer_within_36mm", "deg", float(turned[0][worst]), float(turned[1][worst]),
                     _STEER_TOLERANCE)
        )  # fmt: skip
        lean, lean_theirs = np.array(inclination[corner])[back], reference[f"incl_deg_{corner}"]
        worst = int(np.abs(lean - lean_theirs).argmax())
        rows.append(
            absolute(
                "rack", f"{corner}_inclination_within_36mm", "deg", float(lean[worst]), float(lean_theirs[worst]), 0.03
            )
        )
        label = f"steer angle {corner} [deg]"
        curves.append(
            Curves("rack", label, "rack [mm] (+ steers left)", x, ours, theirs, _STEER_TOLERANCE * np.abs(theirs))
        )
    return rows, curves
