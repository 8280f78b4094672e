"""Metrics of the rig, by the formulas of metrics.toml, and target bands."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import mujoco
import numpy as np

from activesteer.config import Source, build, read_toml
from activesteer.core.conventions import GRAVITY_MPS2, Array
from activesteer.errors import nearest_names
from activesteer.resources import models_dir
from activesteer.rigs.kc.held_car import MOUNT_ENDINGS
from activesteer.rigs.kc.modes import TyreStiffness
from activesteer.rigs.kc.programme import INWARDS, Measured, SteeringAxis, Sweep
from activesteer.vehicle.curve_axles import HOLDING_TENDON

DEG: Final = math.degrees(1.0)
SMALL_TRAVEL_M: Final = 0.015
_SMALL: Final = {
    "parallel": SMALL_TRAVEL_M, "opposite": SMALL_TRAVEL_M, "lateral": 1000.0, "longitudinal": 1000.0,
    "aligning": 100.0,
}  # fmt: skip
"""Range about static ride of the slopes' straight line, by the first word of a sweep: travel [m], force [N], [N m]."""


class Axle(NamedTuple):
    """One axle of the measured car, with arrays of its wheels in the order left, right."""

    name: str
    measured: Measured

    @property
    def wheels(self) -> slice:
        """Columns of the axle's wheels in the per-corner arrays."""
        return {"front": slice(0, 2), "rear": slice(2, 4), "car": slice(0, 4)}[self.name]

    @property
    def axes(self) -> tuple[SteeringAxis, ...]:
        """Steering axes of both wheels."""
        return self.measured.axes[self.wheels]

    @property
    def tyre(self) -> TyreStiffness:
        """Stiffness of the tyres of this axle."""
        return self.measured.tyres[0 if self.name == "front" else 1]

    @property
    def load_N(self) -> Array:
        """Static wheel loads [N], shape (2,)."""
        return self.measured.static_load_N[self.wheels]

    def sweep(self, name: str) -> Sweep:
        """Return a sweep of the rig."""
        return self.measured.sweeps[name]

    def slope(self, sweep: str, values: Array, over: Array | None = None) -> Array:
        """Return the slope of a quantity at static ride for both wheels of the axle, shape (2,)."""
        x = self.sweep(sweep).x
        near = np.abs(x) <= _SMALL[sweep.split("_", maxsplit=1)[0]] * (1.0 + 1e-9)
        rows = values[near][:, self.wheels]
        base = np.repeat(x[near, None], rows.shape[1], axis=1) if over is None else over[near][:, self.wheels]
        base = base - base.mean(axis=0)
        return np.sum(base * (rows - rows.mean(axis=0)), axis=0) / np.sum(base * base, axis=0)

    def mean_slope(self, sweep: str, quantity: str, axis: int | None = None) -> float:
        """Return the mean slope of both wheels versus the variable of the sweep."""
        values = getattr(self.sweep(sweep), quantity)
        return float(self.slope(sweep, values if axis is None else values[..., axis]).mean())


def _standing(axle: Axle, angle: str) -> float:
    sweep = axle.sweep("parallel_travel")
    return math.degrees(getattr(sweep, angle)[sweep.zero, axle.wheels].mean())


def _track(axle: Axle) -> float:
    sweep = axle.sweep("parallel_travel")
    left, right = sweep.contact_m[sweep.zero, axle.wheels, 1]
    return 1e3 * float(left - right)


def _ride_rate(axle: Axle) -> float:
    wheel, tyre = 1e-3 * axle.mean_slope("parallel_travel", "load_N"), 1e-3 * axle.tyre.vertical_Npm
    return wheel * tyre / (wheel + tyre)


def _ride_frequency(axle: Axle) -> float:
    model = axle.measured.vehicle.model
    unsprung = np.mean([model.body_subtreemass[model.body(f"{axle.name[0]}{side}_knuckle").id] for side in "lr"])
    sprung = axle.load_N.mean() / GRAVITY_MPS2 - unsprung
    return math.sqrt(1e3 * _ride_rate(axle) / sprung) / (2.0 * math.pi)


def _track_change(axle: Axle) -> float:
    left, right = axle.slope("parallel_travel", axle.sweep("parallel_travel").contact_m[..., 1])
    return 1e3 * float(left - right)


def _damper_ratio(axle: Axle) -> float:
    damper = axle.sweep("parallel_travel").damper_m[:, axle.wheels]
    # A longer damper is rebound, as in every car; the stops tell.
    sense = -1.0 if (damper[-1] > damper[0]).all() else 1.0
    return -sense * axle.mean_slope("parallel_travel", "damper_m")


def _contact(axle: Axle, end: int) -> float:
    """Travel at which a damper reaches an end of its free range between the stops [mm]."""
    model = axle.measured.vehicle.model
    limit = float(model.tendon_lengthspring[model.tendon(f"{axle.name[0]}l_damper").id, end])
    sweep = axle.sweep("parallel_travel")
    length, travel = sweep.damper_m[:, axle.wheels][:, 0], sweep.travel_m[:, axle.wheels][:, 0]
    order = np.argsort(length)
    at = float(np.interp(limit, length[order], travel[order], left=math.nan, right=math.nan))
    return 1e3 * abs(at)


def _roll_centre_height(axle: Axle) -> float:
    sweep = axle.sweep("parallel_travel")
    slopes = axle.slope("parallel_travel", sweep.contact_m[..., 1], over=sweep.contact_m[..., 2])
    return 1e3 * float(np.mean(slopes * sweep.contact_m[sweep.zero, axle.wheels, 1]))


def _roll_centre_height_by_force(axle: Axle) -> float:
    sweep = axle.sweep("lateral_in_phase")
    slopes = axle.slope("lateral_in_phase", sweep.load_N)
    return -1e3 * float(np.mean(slopes * sweep.contact_m[sweep.zero, axle.wheels, 1]))


def roll_angle_rad(axle: Axle) -> Array:
    """Roll angle of the body relative to the wheel centres in opposite travel, positive to the right."""
    sweep = axle.sweep("opposite_travel")
    centre = sweep.centre_m[:, axle.wheels]
    rise = sweep.travel_m[:, axle.wheels]
    return np.arctan2(rise[:, 1] - rise[:, 0], centre[:, 0, 1] - centre[:, 1, 1])


def _per_roll(axle: Axle, values: Array) -> float:
    """Slope of values versus the roll angle, within 15 mm of travel."""
    roll = roll_angle_rad(axle)
    near = np.abs(axle.sweep("opposite_travel").x) <= SMALL_TRAVEL_M * (1.0 + 1e-9)
    return float(np.polyfit(roll[near], values[near], 1)[0])


def _outer_per_roll(axle: Axle, angle: str) -> float:
    return _per_roll(axle, getattr(axle.sweep("opposite_travel"), angle)[:, axle.wheels][:, 1])


def _roll_stiffness(axle: Axle) -> float:
    sweep = axle.sweep("opposite_travel")
    load, y = sweep.load_N[:, axle.wheels], sweep.contact_m[:, axle.wheels, 1]
    return -1e-3 * _per_roll(axle, np.sum(load * y, axis=1))


def _front_roll_stiffness_fraction(axle: Axle) -> float:
    front, rear = (_roll_stiffness(Axle(name, axle.measured)) for name in ("front", "rear"))
    return 100.0 * front / (front + rear)


def _roll_understeer(axle: Axle) -> float:
    """Roll understeer: positive if the front wheels steer out of the turn, or the rear wheels into it."""
    steer = _per_roll(axle, axle.sweep("opposite_travel").steer_rad[:, axle.wheels].mean(axis=1))
    return -steer if axle.name == "front" else steer


def _left_right_difference(axle: Axle) -> float:
    sweep = axle.sweep("parallel_travel")
    angles = np.stack([sweep.toe_rad, sweep.camber_rad])
    return math.degrees(float(np.abs(angles[..., 0::2] - angles[..., 1::2]).max()))


def _support(axle: Axle, point: str) -> float:
    """Slope of a point's path in side view (forwards per upwards) times wheelbase over centre of gravity height [%]."""
    sweep = axle.sweep("parallel_kinematic")
    slopes = axle.slope("parallel_kinematic", getattr(sweep, point)[..., 0], over=sweep.centre_m[..., 2])
    return 100.0 * wheelbase_mm(axle) / _cg_height(axle) * float(slopes.mean())


def _brake_fraction(axle: Axle) -> float:
    brakes = axle.measured.vehicle.parameters.brakes
    torque = brakes.front_torque_Nm if axle.name == "front" else brakes.rear_torque_Nm
    total = brakes.front_torque_Nm + brakes.rear_torque_Nm
    return torque / total if total > 0.0 else math.nan


def wheelbase_mm(axle: Axle) -> float:
    """Distance between the front and rear contact points along the standing car [mm]."""
    sweep = axle.sweep("parallel_travel")
    x = sweep.contact_m[sweep.zero, :, 0]
    return 1e3 * float(x[:2].mean() - x[2:].mean())


def _cg_height(axle: Axle) -> float:
    return 1e3 * float(axle.measured.vehicle.data.subtree_com[0, 2])


_ON_CENTRE_RAD: Final = math.radians(20.0)
_TRAIL_M: Final = 0.03
_NOT_LINKS: Final = ("_spring", "_damper", HOLDING_TENDON, *MOUNT_ENDINGS)


def mean_steer_rad(axle: Axle, sweep: str = "steering_rolling") -> Array:
    """Mean steer angle of the front wheels, shape (n,)."""
    return axle.sweep(sweep).steer_rad[:, :2].mean(axis=1)


def ratio_curve(axle: Axle) -> tuple[Array, Array]:
    """Mean steer angle of the front wheels [rad], and the local steering ratio."""
    mean = mean_steer_rad(axle)
    return mean, np.gradient(axle.sweep("steering_rolling").x, mean, edge_order=2)


def _steering_ratio(axle: Axle) -> float:
    wheel = axle.sweep("steering_rolling").x
    near = np.abs(wheel) <= _ON_CENTRE_RAD * (1.0 + 1e-9)
    return 1.0 / float(np.polyfit(wheel[near], mean_steer_rad(axle)[near], 1)[0])


def _ratio_at(axle: Axle, steer_deg: float) -> float:
    """Steering ratio at a mean steer angle, from the total angles."""
    mean = mean_steer_rad(axle)
    sides = [np.interp(sign * math.radians(steer_deg), mean, axle.sweep("steering_rolling").x) for sign in (1.0, -1.0)]
    return math.degrees(float(sides[0] - sides[1]) / 2.0) / steer_deg


def _rack_travel(axle: Axle) -> float:
    sweep = axle.sweep("steering_rolling")
    near = np.abs(sweep.x) <= _ON_CENTRE_RAD * (1.0 + 1e-9)
    return 2e3 * math.pi * float(np.polyfit(sweep.steering_wheel_rad[near], sweep.rack_m[near], 1)[0])


def _from_straight(axle: Axle) -> Array:
    """Steer angles of both front wheels from straight ahead [rad], shape (n, 2)."""
    sweep = axle.sweep("steering_rolling")
    steer = sweep.steer_rad[:, :2]
    return steer - steer[sweep.zero]


def _at_lock(axle: Axle) -> tuple[float, float]:
    steer = _from_straight(axle)
    return math.degrees(steer[-1, 0]), math.degrees(steer[-1, 1])


def _ackermann(axle: Axle) -> float:
    steer = _from_straight(axle)
    inner = math.radians(20.0)
    if steer[-1, 0] < inner:
        return math.nan
    left_turn = steer[:, 0] > 0.0
    outer = float(np.interp(inner, steer[left_turn, 0], steer[left_turn, 1]))
    left, right = (axis.point_m[1] for axis in axle.axes)
    base = 1e-3 * wheelbase_mm(axle)
    ideal = math.atan(1.0 / (1.0 / math.tan(inner) + (left - right) / base))
    return 100.0 * (inner - outer) / (inner - ideal)


def _turning_circle(axle: Axle) -> float:
    inner, outer = (math.radians(angle) for angle in _at_lock(axle))
    contact = axle.sweep("steering_rolling").contact_m[-1]
    base = float(contact[:2, 0].mean() - contact[2:, 0].mean())
    radius = base * 0.5 * (1.0 / math.tan(inner) + 1.0 / math.tan(outer))
    reach = math.hypot(radius + abs(float(contact[1, 1])), base)
    return 2.0 * (reach + 0.5 * axle.tyre.width_m)


def _parking_lost_angle(axle: Axle) -> float:
    names = ("steering_at_rest_left", "steering_at_rest_right")
    left, right = (float(np.interp(0.0, mean_steer_rad(axle, name), axle.sweep(name).x)) for name in names)
    return math.degrees(left - right) / 2.0


def _rear_steer_range(axle: Axle) -> float:
    sweep = axle.sweep("rear_steering")
    steer = sweep.steer_rad[:, 2:]
    return math.degrees(float(np.abs(steer - steer[sweep.zero]).max()))


def _per_side_force(axle: Axle, angle: str) -> float:
    """Slope of an angle versus a side force that points inwards at the wheel, within 1 kN."""
    slopes = axle.slope("lateral_in_phase", getattr(axle.sweep("lateral_in_phase"), angle))
    return 1e3 * math.degrees(float(np.mean(INWARDS[axle.wheels] * slopes)))


def _side_force_toe_with_trail(axle: Axle) -> float:
    moment = axle.mean_slope("aligning_in_phase", "steer_rad")
    # A force to the right, behind the left wheel's contact point, turns the wheel to the left: toe-out.
    return _per_side_force(axle, "toe_rad") - 1e3 * _TRAIL_M * math.degrees(moment)


def _braking_recession(axle: Axle) -> float:
    sweep = axle.sweep("longitudinal_patch")
    return 1e3 * float((sweep.centre_m[sweep.zero, axle.wheels, 0] - sweep.centre_m[0, axle.wheels, 0]).mean())


def _bushes_Npmm(axle: Axle) -> Array:
    """Stiffness of one of two equal bushings in series in each unloaded link [N/mm]."""
    model = axle.measured.vehicle.model
    rates = []
    for index in range(model.ntendon):
        name = model.tendon(index).name
        if name.startswith(f"{axle.name[0]}l_") and not name.endswith(_NOT_LINKS):
            rates.append(2e-3 * float(model.tendon_stiffness[index]))
    return np.array(rates or [np.nan])


def _top_mount_Npmm(axle: Axle, direction: str) -> float:
    """Stiffness of the left top mount, or nan for a rigid mount [N/mm]."""
    model = axle.measured.vehicle.model
    tendon = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, f"{axle.name[0]}l_mount_{direction}")
    return 1e-3 * float(model.tendon_stiffness[tendon]) if tendon >= 0 else math.nan


def _damper_asymmetry(axle: Axle) -> float:
    dampers = axle.measured.vehicle.parameters.dampers
    curve = dampers.front if axle.name == "front" else dampers.rear
    bump, rebound = (abs(float(np.interp(speed, curve.velocity_mps, curve.force_N))) for speed in (0.3, -0.3))
    return rebound / bump if bump > 0.0 else math.inf


def _per_g(gradient_radps2pm: float) -> float:
    return math.degrees(gradient_radps2pm) * GRAVITY_MPS2


FORMULAS: Final[dict[str, Callable[[Axle], float]]] = {
    "wheel_load": lambda axle: float(axle.load_N.mean()),
    "track": _track,
    "static_toe": lambda axle: _standing(axle, "toe_rad"),
    "static_camber": lambda axle: _standing(axle, "camber_rad"),
    "ride_rate": _ride_rate,
    "ride_frequency": _ride_frequency,
    "track_change": _track_change,
    "damper_ratio": _damper_ratio,
    "bump_stop_contact": lambda axle: _contact(axle, 0),
    "rebound_stop_contact": lambda axle: _contact(axle, 1),
    "roll_centre_height": _roll_centre_height,
    "roll_centre_height_by_force": _roll_centre_height_by_force,
    "roll_stiffness": _roll_stiffness,
    "front_roll_stiffness_fraction": _front_roll_stiffness_fraction,
    "roll_steer_outer": lambda axle: _outer_per_roll(axle, "toe_rad"),
    "roll_understeer": _roll_understeer,
    "roll_camber": lambda axle: _outer_per_roll(axle, "camber_rad"),
    "left_right_difference": _left_right_difference,
    "anti_dive": lambda axle: _brake_fraction(axle) * _support(axle, "patch_m"),
    "anti_lift": lambda axle: -_brake_fraction(axle) * _support(axle, "patch_m"),
    "anti_lift_drive": lambda axle: _support(axle, "centre_m"),
    "anti_squat": lambda axle: -_support(axle, "centre_m"),
    "wheelbase": wheelbase_mm,
    "cg_height": _cg_height,
    "mass": lambda axle: float(axle.measured.vehicle.model.body_subtreemass[0]),
    "front_load_fraction": lambda axle: 100.0 * float(axle.load_N[:2].sum() / axle.load_N.sum()),
    "steering_ratio": _steering_ratio,
    "steering_ratio_10deg": lambda axle: _ratio_at(axle, 10.0),
    "steering_ratio_25deg": lambda axle: _ratio_at(axle, 25.0),
    "rack_travel": _rack_travel,
    "greatest_inner_angle": lambda axle: _at_lock(axle)[0],
    "greatest_outer_angle": lambda axle: _at_lock(axle)[1],
    "ackermann": _ackermann,
    "turning_circle": _turning_circle,
    "parking_lost_angle": _parking_lost_angle,
    "rear_steer_range": _rear_steer_range,
    "side_force_toe": lambda axle: _per_side_force(axle, "toe_rad"),
    "side_force_toe_with_trail": _side_force_toe_with_trail,
    "side_force_camber": lambda axle: _per_side_force(axle, "camber_rad"),
    "braking_recession": _braking_recession,
    "softest_bush": lambda axle: 1e-3 * float(_bushes_Npmm(axle).min()),
    "stiffest_bush": lambda axle: 1e-3 * float(_bushes_Npmm(axle).max()),
    "top_mount_radial_stiffness": lambda axle: _top_mount_Npmm(axle, "y"),
    "top_mount_axial_stiffness": lambda axle: _top_mount_Npmm(axle, "z"),
    "body_roll_frequency_sliding": lambda axle: axle.measured.modes.body_roll_sliding.frequency_Hz,
    "roll_gradient": lambda axle: _per_g(axle.measured.modes.roll_gradient_radps2pm),
    "braking_pitch_gradient": lambda axle: _per_g(axle.measured.modes.pitch_gradient_radps2pm),
    "damper_asymmetry": _damper_asymmetry,
}
"""Functions from an axle to a value, by characteristic of metrics.toml. All others are slopes, axes or modes."""


@dataclass(frozen=True)
class Definition:
    """A characteristic, as declared in a table of metrics.toml."""

    name: str
    unit: str
    text: str
    axles: Sequence[str] = ("front", "rear")
    slope: Sequence[str] = ()
    steering_axis: str = ""
    mode: Sequence[str] = ()
    factor: float = 1.0

    def evaluate(self, axle: Axle) -> float:
        """Return the value of an axle, in its unit."""
        if self.mode:
            name = self.mode[0] if axle.name == "car" else f"{self.mode[0]}_{axle.name}"
            return getattr(axle.measured.modes.by_name[name], self.mode[1])
        if self.steering_axis:
            mean = float(np.mean([getattr(axis, self.steering_axis) for axis in axle.axes]))
            return self._factor(self.steering_axis) * mean
        if self.slope:
            sweep, (quantity, _, along) = self.slope[0], self.slope[1].partition(".")
            return self._factor(quantity) * axle.mean_slope(sweep, quantity, "xyz".index(along) if along else None)
        return FORMULAS[self.name](axle)

    def _factor(self, quantity: str) -> float:
        return self.factor * (DEG if quantity.endswith("_rad") else 1.0)


DEFINITIONS: Final = tuple(
    Definition(name, **table) for name, table in read_toml(Path(__file__).with_name("metrics.toml"))[0].items()
)
"""All characteristics, in the order of the table."""


@dataclass(frozen=True)
class Target:
    """Target band of a metric."""

    band: tuple[float, ...]  # lowest and highest value, in the metric's unit
    source: str  # source of the band
    remark: str = ""  # remark about a value outside the band


def load_targets(vehicle: str, path: str | os.PathLike[str] | None = None) -> dict[tuple[str, str], Target]:
    """Read the target bands of a vehicle, by axle and metric."""
    file = Path(path) if path is not None else models_dir() / "targets" / f"{vehicle}_kc.toml"
    if path is None and not file.is_file():
        return {}
    table, source = read_toml(file)
    known = {(axle, definition.name) for definition in DEFINITIONS for axle in definition.axles}
    targets = {}
    for axle, metrics in table.items():
        if not isinstance(metrics, dict):
            raise source.fail([axle], "a table [axle.metric] is needed")
        for name, entry in metrics.items():
            if (axle, name) not in known:
                words = nearest_names(f"{axle}.{name}", [".".join(pair) for pair in known])
                raise source.fail([axle, name], f"there is no such metric; {words}")
            targets[axle, name] = _target(entry, source, (axle, name))
    return targets


def _target(entry: object, source: Source, path: tuple[str, str]) -> Target:
    if not isinstance(entry, dict):
        raise source.fail(path, "a table with band and source is needed")
    target = build(Target, entry, source, path)
    if len(target.band) != 2 or not target.band[0] <= target.band[1]:
        raise source.fail([*path, "band"], f"{list(target.band)} given; a lowest and a highest value are needed")
    return target
