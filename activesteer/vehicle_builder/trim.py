"""Adjust the car at rest to the height, weight, ride and steering in its table.

A measured curve belongs to the loaded axle, the curve of the guide to the unloaded axle. They differ by a few
hundredths of a degree, the effect of the wheel load at its small lever arms. The curves are corrected by the difference
that the rig measures.

The load on an axle follows from the centre of gravity, so the force of each spring is independent of the others: a
wheel that stands t too high in its arch (bump) needs a force larger by (wheel rate / motion ratio) t.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from activesteer.core.conventions import GRAVITY_MPS2, Array
from activesteer.errors import ModelError
from activesteer.rigs.kc.held_car import Case, HeldCar
from activesteer.rigs.kc.modes import tyre_stiffness
from activesteer.rigs.kc.programme import INWARDS
from activesteer.scenario import load_car
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import Vehicle
from activesteer.vehicle.curve_axles import OVER_RACK, OVER_TRAVEL, AxleCurves
from activesteer.vehicle.parameters import Friction
from activesteer.vehicle.statics import mass_properties
from activesteer.vehicle_builder.completion import rack_per_steer_m
from activesteer.vehicle_builder.corner_motion import corner_motion, wheel_travel_m
from activesteer.vehicle_builder.design import Axle, CarDesign, Log, Solid, chassis_of


@dataclass
class TrimmedAxle:
    """Adjusted values of one axle, for the left side."""

    spring_rate_Npm: float = 25000.0
    spring_force_N: float = 4000.0  # spring force in the design position [N]
    wheel_x_rad: float = 0.0  # first Euler angle of the wheel: minus camber, less the contribution of the loaded links
    wheel_z_rad: float = 0.0  # third Euler angle of the wheel: minus toe-in, less the contribution of the loaded links
    # Spring length of the top mount in each direction. The standing car's load closes it [m]
    mount_m: dict[str, float] = field(default_factory=dict)
    bump_stop_m: float = 0.035  # compression of the damper to its bump stop
    rebound_stop_m: float = 0.065
    # a, b, c of the force a x + b x2 + c x3 [N/m, N/m2, N/m3]
    stop_stiffness: tuple[float, ...] = (40000.0, 2.4e6, 9e7)
    friction_N: float = 0.0  # dry friction of the damper
    damper_velocity_mps: tuple[float, ...] = (-1.0, 0.0, 1.0)
    damper_force_N: tuple[float, ...] = (-1900.0, 0.0, 1900.0)
    curves: AxleCurves | None = None  # curves of a guided axle that give the measured curves on the rig, under load


@dataclass
class Trimmed:
    """Values found by the trim."""

    front: TrimmedAxle = field(default_factory=TrimmedAxle)
    rear: TrimmedAxle = field(default_factory=TrimmedAxle)
    pinion_radius_m: float = 0.0075  # rack travel per angle of the steering wheel [m/rad]
    ratio: float = 16.0  # steering wheel angle over mean steer angle
    chassis: Solid = field(
        default_factory=lambda: Solid(1200.0, np.array([-1.1, 0.0, 0.55]), np.array([450.0, 1800.0, 1850.0]))
    )
    cg_m: tuple[float, float] = (-1.2, 0.55)  # x and height of the whole car's centre of gravity

    def axle(self, name: str) -> TrimmedAxle:
        """Return the axle `front` or `rear`."""
        return self.front if name == "front" else self.rear


NEAR_ENOUGH: Final = 5e-6
"""Correction of a curve below which the search ends [m, rad]; 50 times as much for caster, which moves no contact."""
_CASTER: Final = 0.02


def match_travel(axles: tuple[Axle, ...], trimmed: dict[str, TrimmedAxle], held: HeldCar) -> float:
    """Correct the curves versus travel of all guided axles, and return the largest correction [m, rad]."""
    heights = np.zeros((len(_measured_curves(axles[0]).travel_m), 4))
    for axle in axles:
        heights[:, _wheels(axle)] = np.array(_measured_curves(axle).travel_m)[:, None]
    cases = [Case(height_m=row) for row in heights]
    poses, loads, standing, standing_loads = _swept(held, cases, heights[:, _wheels(axles[0])][:, 0])
    greatest = 0.0
    for axle in axles:
        measured, curves = _measured_curves(axle), trimmed[axle.name].curves
        assert curves is not None
        assert axle.measured is not None
        wheels = _wheels(axle)
        now = _mean(poses[:, wheels], wheels)
        at_rest = _mean(standing[None, wheels], wheels)[0]
        now[:, [0, 1, 3]] -= at_rest[[0, 1, 3]]
        changes = {}
        for column, name in enumerate(OVER_TRAVEL):
            missing = np.array(getattr(measured, name)) - now[:, column]
            greatest = max(greatest, _size(name, missing))
            changes[name] = _corrected(curves, name, missing)
        if axle.measured.wheel_load_N is not None:
            rise = (loads[:, wheels] - standing_loads[wheels]).mean(axis=1)
            changes["load_N"] = _corrected(curves, "load_N", np.array(axle.measured.wheel_load_N) - rise)
        trimmed[axle.name].curves = dataclasses.replace(curves, **changes)
    return greatest


def match_steering(axle: Axle, trimmed: TrimmedAxle, held: HeldCar, pinion_m: float) -> float:
    """Correct the curves versus rack travel, and return the largest correction [m, rad]."""
    measured, curves = _measured_curves(axle), trimmed.curves
    assert curves is not None
    rack = np.array(measured.rack_m)
    cases = [Case("contact", steering_wheel_rad=float(at / pinion_m)) for at in rack]
    there = np.empty(len(rack))
    poses, _, standing, _ = _swept(held, cases, rack, there)
    # The column deflects slightly, so the rack is not exactly at the position of the steering wheel.
    there = 0.5 * (there - there[::-1])
    # The left wheel at s and the right wheel at -s are mirror images.
    both = np.stack([_left(poses[:, 0], 0), _left(poses[::-1, 1], 1)])
    rest = np.stack([_left(standing[None, 0], 0), _left(standing[None, 1], 1)])
    now = (both - rest).mean(axis=0)
    lifted, travel = now[:, 5], np.array(measured.travel_m)
    greatest, changes = 0.0, {}
    for column, (name, by_travel) in enumerate(zip(OVER_RACK, OVER_TRAVEL, strict=True)):
        over = np.array(getattr(measured, by_travel))
        change = now[:, column] - np.interp(lifted, travel, over) + np.interp(0.0, travel, over)
        target = CubicSpline(rack, getattr(measured, name))(there)
        missing = np.interp(rack, there, target - (-change if name == "rack_steer_rad" else change))
        greatest = max(greatest, _size(name, missing))
        changes[name] = _corrected(curves, name, missing)
    trimmed.curves = dataclasses.replace(curves, **changes)
    return greatest


def _measured_curves(axle: Axle) -> AxleCurves:
    assert axle.measured is not None
    return axle.measured.curves


def _wheels(axle: Axle) -> list[int]:
    return [0, 1] if axle.name == "front" else [2, 3]


def _swept(
    held: HeldCar, cases: list[Case], order: Array, rack: Array | None = None
) -> tuple[Array, Array, Array, Array]:
    """Return poses and loads of a sweep and of the standing car, and write the rack travel to `rack` [m]."""
    held.reset()
    standing, standing_loads = _poses(held), held.load_N.copy()
    poses, loads = np.empty((len(cases), 4, 6)), np.empty((len(cases), 4))
    middle = int(np.abs(order).argmin())
    for side in (range(middle, len(cases)), range(middle - 1, -1, -1)):
        held.reset()
        for index in side:
            held.equilibrium(cases[index])
            poses[index], loads[index] = _poses(held), held.load_N
            if rack is not None:
                rack[index] = held.data.qpos[int(held.model.joint("rack").qposadr[0])]
    held.reset()
    return poses, loads, standing, standing_loads


def _poses(held: HeldCar) -> Array:
    """Return the pose of each wheel in the coordinates of the rig, shape (4, 6)."""
    rows = []
    for corner in range(4):
        pose = held.wheel(corner)
        x, y, z = pose.rotation[:, 1]
        caster = np.arctan2(pose.rotation[2, 0], pose.rotation[0, 0])
        rows.append([
            pose.centre_m[0], pose.centre_m[1], np.arcsin(z) * INWARDS[corner], caster,
            np.arctan2(-x, y) * INWARDS[corner], pose.centre_m[2],
        ])  # fmt: skip
    return np.array(rows)


def _left(poses: Array, corner: int) -> Array:
    """Mirror the poses of a wheel to the left side."""
    return poses * np.array([1.0, -INWARDS[corner], 1.0, 1.0, 1.0, 1.0])


def _mean(poses: Array, wheels: list[int]) -> Array:
    return np.mean([_left(poses[:, index], wheel) for index, wheel in enumerate(wheels)], axis=0)


def _size(name: str, missing: Array) -> float:
    return float(np.abs(missing).max()) * (_CASTER if name.endswith("caster_rad") else 1.0)


def _corrected(curves: AxleCurves, name: str, missing: Array) -> tuple[float, ...]:
    return tuple(float(f"{value:.7g}") for value in np.array(getattr(curves, name)) + missing)


Write = Callable[[Trimmed], Path]
"""Function that writes the files of the car and returns the vehicle file."""

_ROUNDS: Final = 25
_MATCHES: Final = 8
_TRAVEL_M: Final = 1e-5
_ANGLE_RAD: Final = 2e-6
_RATE_FRACTION: Final = 1e-4
_SWEEP_M: Final = np.linspace(-0.015, 0.015, 7)
"""Wheel travels of the rig's definition of the wheel rate [m]."""
_STEER_RAD: Final = np.radians(np.linspace(-20.0, 20.0, 9))
_RATIO: Final = 16.0
_STOPS_M: Final = (0.035, 0.065)
"""Default wheel travel to the stops: bump, rebound [m]."""
_STOP_AT_WHEEL: Final = (40000.0, 2.4e6, 9e7)
"""Force of a stop at the wheel: a x + b x2 + c x3 [N/m, N/m2, N/m3]."""
_CURVE_MPS: Final = (-1.5, -0.6, -0.3, -0.13, -0.05, 0.0, 0.05, 0.13, 0.3, 0.6, 1.5)
_CURVE_N: Final = (-1750.0, -950.0, -620.0, -320.0, -130.0, 0.0, 60.0, 155.0, 310.0, 500.0, 950.0)
_CURVE_NSPM: Final = 1900.0
"""Front damper of the compact, and mean of its slopes on both sides of rest [N s/m]."""


@dataclass(frozen=True)
class _Stand:
    """State of the standing car."""

    vehicle: Vehicle
    held: HeldCar
    travel_m: Array
    toe_rad: Array
    camber_rad: Array

    def mount_m(self, corner: str) -> dict[str, float]:
        """Return the displacement of a top mount along each of its slides [m]."""
        model, start = self.vehicle.model, f"{corner}_mount_"
        joints = [model.joint(index) for index in range(model.njnt) if model.joint(index).name.startswith(start)]
        qpos = self.held.data.qpos
        return {joint.name.removeprefix(start): float(qpos[int(joint.qposadr[0])]) for joint in joints}


def trim(car: CarDesign, write: Write, log: Log) -> Trimmed:
    """Find all values of `Trimmed`, and write the files of the car with them."""
    guided = tuple(axle for axle in car.axles if axle.measured is not None)
    trimmed = Trimmed(pinion_radius_m=car.table.steering.pinion_radius_m or rack_per_steer_m(car.front) / _RATIO)
    for axle in guided:
        assert axle.measured is not None
        trimmed.axle(axle.name).curves = axle.measured.curves
    mjcf = write(trimmed).with_suffix(".xml")
    model = compiled_model(mjcf)
    trimmed.chassis = chassis_of(car, model, log)
    write(trimmed)
    model = compiled_model(mjcf)
    body = mass_properties(model)
    trimmed.cg_m = float(body.cg_m[0]), float(body.cg_m[2])
    fraction = float(body.cg_m[0] - car.rear.wheel_centre_m[0]) / car.wheelbase_m
    loads = {
        "front": 0.5 * body.mass_kg * fraction * GRAVITY_MPS2,
        "rear": 0.5 * body.mass_kg * (1 - fraction) * GRAVITY_MPS2,
    }
    if min(loads.values()) <= 0.0:
        raise ModelError(
            f"the centre of gravity, at x {body.cg_m[0]:.3f} m, is not between the axles: the car falls over"
        )
    ratios: dict[str, tuple[float, float]] = {}
    rates: dict[str, float | None] = {}
    sprung: dict[str, float] = {}
    for axle in car.axles:
        motion, _ = corner_motion(model, axle.corner)
        ratios[axle.name] = motion[f"{axle.corner}_spring"], motion[f"{axle.corner}_damper"]
        for part, ratio in zip(("spring", "damper"), ratios[axle.name], strict=True):
            if not 0.15 < ratio < 1.6:
                raise ModelError(
                    f"the {part} shortens by {ratio:.2f} of the wheel's travel in bump; 0.15 to 1.6 are possible in a "
                    f"car. Are {part}_inner (chassis) and {part}_outer (suspension) swapped, or is {part}_on wrong?",
                    key=axle.name,
                )
        unsprung = float(model.body_subtreemass[model.body(f"{axle.corner}_knuckle").id])
        sprung[axle.name] = loads[axle.name] / GRAVITY_MPS2 - unsprung
        rates[axle.name] = _target_rate(axle, loads[axle.name], sprung[axle.name])
        _first_guess(axle, trimmed.axle(axle.name), ratios[axle.name], rates[axle.name], sprung[axle.name], log)
    wheel_rates = _let_stand(car, trimmed, write, ratios, rates)
    if guided:
        _match_curves(car, guided, trimmed, write)
        wheel_rates = _let_stand(car, trimmed, write, ratios, rates)
    _fit_steering(car, trimmed, write, log)
    for axle in car.axles:
        tyre = tyre_rate_Npm(axle.tyre_parameters, loads[axle.name])
        rate = wheel_rates[axle.name]
        _fit_damper(axle, trimmed.axle(axle.name), ratios[axle.name][1], rate * tyre / (rate + tyre), sprung[axle.name])
    write(trimmed)
    return trimmed


def compiled_model(mjcf: Path) -> mujoco.MjModel:
    """Return the compiled model of a file."""
    try:
        return mujoco.MjModel.from_xml_path(str(mjcf))
    except ValueError as reason:
        raise ModelError(str(reason), file=mjcf.name) from reason


def tyre_rate_Npm(tyre: TyreParameters, load_N: float) -> float:
    """Return the vertical stiffness of a tyre under a load [N/m]."""
    return tyre_stiffness(tyre, None, load_N).vertical_Npm


def _target_rate(axle: Axle, load_N: float, sprung_kg: float) -> float | None:
    """Return the wheel rate, or None if the table gives the spring rate."""
    if axle.measured is not None and axle.measured.wheel_load_N is not None:
        return None
    if axle.table.wheel_rate_Npm is not None or axle.ride_frequency_Hz is None:
        return axle.table.wheel_rate_Npm
    ride = sprung_kg * (2.0 * math.pi * axle.ride_frequency_Hz) ** 2
    tyre = tyre_rate_Npm(axle.tyre_parameters, load_N)
    if ride > 0.8 * tyre:
        raise ModelError(
            f"{axle.ride_frequency_Hz:g} Hz of {sprung_kg:.0f} kg needs {ride:.0f} N/m, but the tyre has only "
            f"{tyre:.0f} N/m",
            key=f"{axle.name}.ride_frequency_Hz",
            value=axle.ride_frequency_Hz,
        )
    return ride * tyre / (tyre - ride)


def _first_guess(
    axle: Axle, axle_trim: TrimmedAxle, ratios: tuple[float, float], rate: float | None, sprung_kg: float, log: Log
) -> None:
    spring, damper = ratios
    measured = None if axle.measured is None else axle.measured.wheel_rate_Npm
    axle_trim.spring_rate_Npm = axle.table.spring_rate_Npm or (measured or rate or 24000.0) / spring**2
    axle_trim.spring_force_N = sprung_kg * GRAVITY_MPS2 / spring
    if axle_trim.curves is None:
        axle_trim.wheel_x_rad, axle_trim.wheel_z_rad = -axle.camber_rad, -axle.toe_rad
    if axle.kind.strut and axle.table.anti_roll_bar_Nmprad is not None:
        # The bar acts along the strut, whose travel is smaller than the wheel travel.
        axle.anti_roll_bar_Npm /= damper**2
    name, table = axle.name, axle.table
    axle_trim.bump_stop_m = log.take(name, table, "bump_stop_m", _STOPS_M[0] * damper, "35 mm at the wheel")
    axle_trim.rebound_stop_m = log.take(name, table, "rebound_stop_m", _STOPS_M[1] * damper, "65 mm at the wheel")
    if measured is not None and axle.table.stop_stiffness is None:
        # The measured wheel load includes them.
        axle_trim.stop_stiffness = (0.0, 0.0, 0.0)
    elif axle.table.stop_stiffness is None:
        # The force at the wheel is r F(r z): for the stop force of the compact at the wheel, divide by r2, r3, r4.
        axle_trim.stop_stiffness = tuple(
            float(f"{value / damper ** (power + 2):.3g}") for power, value in enumerate(_STOP_AT_WHEEL)
        )
        words = ", ".join(f"{value:g}" for value in axle_trim.stop_stiffness)
        log.note(f"{axle.name}.stop_stiffness", words, "cellular rubber, at the wheel as the compact's")
    else:
        axle_trim.stop_stiffness = axle.table.stop_stiffness
    axle_trim.friction_N = log.take(name, table, "damper_friction_N", round(30.0 / damper), "30 N at the wheel")


def _stand(vehicle_file: Path) -> _Stand:
    car = load_car(vehicle_file)
    vehicle = dataclasses.replace(car, config=dataclasses.replace(car.config, friction=Friction())).on()
    held = HeldCar(vehicle)
    toe, camber = [], []
    for corner, inwards in enumerate(INWARDS):
        # On the rig, without the moments of asymmetric tyres: static toe and camber are those that `kc` measures.
        x, y, z = held.wheel(corner).rotation[:, 1]
        toe.append(math.atan2(-x, y) * inwards)
        camber.append(math.asin(z) * inwards)
    return _Stand(vehicle, held, wheel_travel_m(vehicle), np.array(toe), np.array(camber))


def wheel_rates_Npm(held: HeldCar) -> dict[str, float]:
    """Return the wheel rates by axle, as defined for the rig [N/m]."""
    loads = []
    for travel in _SWEEP_M:
        held.equilibrium(Case(height_m=np.full(4, travel)))
        loads.append(held.load_N.copy())
    held.reset()
    slopes = np.polyfit(_SWEEP_M, np.array(loads), 1)[0]
    return {"front": float(slopes[:2].mean()), "rear": float(slopes[2:].mean())}


def _let_stand(
    car: CarDesign,
    trimmed: Trimmed,
    write: Write,
    ratios: dict[str, tuple[float, float]],
    targets: dict[str, float | None],
) -> dict[str, float]:
    """Find the standing position by Newton's method for each axle, and return the wheel rates."""
    left_m = np.zeros(4)
    for _ in range(_ROUNDS):
        stand = _stand(write(trimmed))
        rates = wheel_rates_Npm(stand.held)
        left_m, done = stand.travel_m, True
        for index, axle in ((0, car.front), (2, car.rear)):
            axle_trim, ratio, rate = trimmed.axle(axle.name), ratios[axle.name][0], targets[axle.name]
            travel = float(stand.travel_m[index : index + 2].mean())
            toe = float(stand.toe_rad[index : index + 2].mean()) - axle.toe_rad
            camber = float(stand.camber_rad[index : index + 2].mean()) - axle.camber_rad
            mounts = stand.mount_m(axle.corner)
            off = 0.0 if rate is None else rates[axle.name] / rate - 1.0
            if axle_trim.curves is not None:
                # The curves are matched as a whole.
                toe = camber = 0.0
            done &= max(map(abs, mounts.values()), default=0.0) < _TRAVEL_M
            done &= abs(travel) < _TRAVEL_M and max(abs(toe), abs(camber)) < _ANGLE_RAD and abs(off) < _RATE_FRACTION
            stiffness = max(rates[axle.name], 0.3 * axle_trim.spring_rate_Npm * ratio**2)
            axle_trim.spring_force_N += travel * stiffness / ratio
            for name, moved in mounts.items():
                axle_trim.mount_m[name] = axle_trim.mount_m.get(name, 0.0) - moved
            axle_trim.wheel_x_rad += camber
            axle_trim.wheel_z_rad += toe
            # Only near the design position: beyond it stops and progressive links act too.
            if rate is not None and abs(travel) < 0.01:
                axle_trim.spring_rate_Npm -= off * rate / ratio**2
                if axle_trim.spring_rate_Npm <= 0.0:
                    raise ModelError(
                        f"the links already give a wheel rate above the desired {rate:.0f} N/m", key=axle.name
                    )
        if done:
            return rates
    where = ", ".join(f"{1e3 * value:.2f}" for value in left_m)
    raise ModelError(
        f"the car does not settle in its design position within {_ROUNDS} rounds: wheels at {where} mm of "
        "travel; are spring rates and stops possible?"
    )


def _match_curves(car: CarDesign, guided: tuple[Axle, ...], trimmed: Trimmed, write: Write) -> None:
    """Find the curves of the unloaded axle that give the measured curves under load."""
    left = 0.0
    for _ in range(_MATCHES):
        held = _stand(write(trimmed)).held
        left = match_travel(guided, {axle.name: trimmed.axle(axle.name) for axle in guided}, held)
        if car.front in guided:
            left = max(left, match_steering(car.front, trimmed.front, held, trimmed.pinion_radius_m))
        if left < NEAR_ENOUGH:
            return
    raise ModelError(
        f"the curves do not converge within {_MATCHES} rounds: {1e3 * left:.3g} mrad or mm remain; is the compliance "
        "so large that the wheel load bends the axle by more than its curves?"
    )


def _fit_steering(car: CarDesign, trimmed: Trimmed, write: Write, log: Log) -> None:
    """Find the pinion radius for a steering ratio, or the ratio for a pinion radius."""
    target = car.table.steering.ratio
    if target is None and car.table.steering.pinion_radius_m is None:
        target = _RATIO
        log.note("steering.ratio", f"{_RATIO:g}", "passenger car, 14 to 18")
    for _ in range(4):
        trimmed.ratio = _ratio(_stand(write(trimmed)).held)
        if target is None or abs(trimmed.ratio / target - 1.0) < 1e-4:
            return
        trimmed.pinion_radius_m *= trimmed.ratio / target
        trimmed.ratio = target


def _ratio(held: HeldCar) -> float:
    """Return the steering ratio about straight ahead, within 20 deg and without load."""
    steer = []
    for angle in _STEER_RAD:
        held.equilibrium(Case("contact", steering_wheel_rad=float(angle)))
        axles = [held.wheel(corner).rotation[:, 1] for corner in (0, 1)]
        steer.append(np.mean([math.atan2(-axis[0], axis[1]) for axis in axles]))
    held.reset()
    return 1.0 / float(np.polyfit(_STEER_RAD, steer, 1)[0])


def _fit_damper(axle: Axle, axle_trim: TrimmedAxle, ratio: float, ride_Npm: float, sprung_kg: float) -> None:
    table = axle.table
    if table.damper_velocity_mps is not None and table.damper_force_N is not None:
        axle_trim.damper_velocity_mps, axle_trim.damper_force_N = table.damper_velocity_mps, table.damper_force_N
        return
    damping = table.damper_Nspm
    if damping is None:
        damping = 2.0 * (axle.damping_ratio or 0.28) * math.sqrt(ride_Npm * sprung_kg) / ratio**2
    axle_trim.damper_velocity_mps = _CURVE_MPS
    axle_trim.damper_force_N = tuple(round(force * damping / _CURVE_NSPM, 1) for force in _CURVE_N)
