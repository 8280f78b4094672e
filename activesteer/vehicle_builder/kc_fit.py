"""Fit of the curves and the compliance of an axle to samples of a K&C rig.

Directions without a load in the tests get the compliance of the compact (a weak pull towards it). The stiffness is
symmetric and positive definite, because the search is for a product of triangles.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import least_squares

from activesteer.core.conventions import Array
from activesteer.errors import ParameterError
from activesteer.vehicle.curve_axles import COORDINATES, AxleCurves, upper_triangle
from activesteer.vehicle_builder.kc_tables import KcTables, Samples, check_signs, smoothed, unusual

_SCALE: Final = np.array([1e-4, 1e-4, 2e-4, 2e-4, 2e-4])
"""Units of the residuals: 0.1 mm and 0.01 deg."""
_PULL: Final = 0.3
"""Weight of the usual compliance against one sample."""
_USUAL: Final = np.diag([2.2e-6, 1.0e-7, 1.8e-6, 6.0e-5, 8.0e-5])
"""Compliance of a wheel at its centre [m/N, rad/(N m)]: about the compact's, 2.2 mm/kN along and 0.1 mm/kN across the
car, 0.03 deg of camber, 1 deg of wind-up and 0.5 deg of toe per 100 N m or 0.3 kN at the road."""
_FLOOR: Final = np.diag([4e-9, 4e-9, 1e-7, 1e-7, 1e-7])
"""Smallest compliance [m/N, rad/(N m)]. With a smaller value rounding would matter."""
_WHEEL: Final = np.diag([35.0, 35.0, 0.9, 0.26, 0.4])
"""Inertia of a wheel with hub and knuckle [kg, kg m2]."""
_FASTEST: Final = (2.0 * np.pi * 320.0) ** 2
"""Square of a wheel's highest natural frequency [1/s2]; higher ones cost iterations without visible effect."""
_UNITS: Final = np.sqrt(np.outer(np.diag(_USUAL), np.diag(_USUAL)))
_LOWER: Final = np.tril_indices(5)
_LINEAR: Final = 15
"""Number of entries of a triangle, before the entries of the hardening springs."""
_SPRING: Final = 250.0 * np.array([1.0, 1.0, 0.3, 0.3, 0.3])
"""Unit of the hardening springs: 4e9 N/m3 along the car."""
_FIRST_SPRINGS: Final = np.array([1.0, 0.0, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0, -0.5, 0.0, 0.0, 0.0])


@dataclass(frozen=True)
class Load:
    """One compliance test of the left wheel."""

    name: str
    direction: Array  # load at the wheel centre per unit of x: forces along x and y, moments about x, y and z
    x: Array  # values of the variable [N, N m]
    moved: dict[str, Array | None]  # coordinate to its change [m, rad]; None if not measured
    # Compliance in series with the wheel's own, shape (5, 5): the rack that both wheels push in the same direction, or
    # the servo of the rear steering.
    beside: Array


def fitted(loads: list[Load]) -> tuple[dict[str, tuple[float, ...]], str]:
    """Fit stiffness and hardening to the measured compliance, and return them with a remark."""
    # Directions that are rigid in the tests, as most are in an axle with few soft bushings, keep a small compliance: a
    # wheel oscillates on them at 320 Hz, which is 0.007 mm/kN across the car, or 0.005 deg of wind-up per 100 N m.
    forces = np.concatenate([np.outer(load.x, load.direction) for load in loads] or [np.zeros((0, 5))])
    wanted = np.concatenate([_wanted(load) for load in loads] or [np.zeros((0, 5))])
    weight = np.concatenate([np.full((len(load.x), 1), len(load.x) ** -0.5) for load in loads] or [np.zeros((0, 1))])
    known = np.isfinite(wanted)
    floor = _FLOOR
    root = _start(forces, wanted - forces @ _FLOOR, weight)

    def parts(numbers: Array) -> tuple[Array, Array, Array]:
        triangle = np.zeros((5, 5))
        triangle[_LOWER] = numbers[:15]
        springs, square = np.zeros((2, 5)), np.zeros(2)
        if len(numbers) > _LINEAR:
            springs, square = numbers[15:25].reshape(2, 5) * _SPRING, numbers[25:]
        return floor + (triangle @ triangle.T) * _UNITS, springs, square

    def missing(numbers: Array) -> Array:
        return ((deflections(forces, *parts(numbers)) - wanted) / _SCALE * weight)[known]

    def refined(start: Array) -> Array:
        solution = least_squares(
            lambda numbers: np.concatenate([missing(numbers), _PULL * (numbers - start)]), start, x_scale="jac",
            ftol=1e-4, max_nfev=30,
        )  # fmt: skip
        return np.asarray(solution.x, dtype=np.float64)

    numbers = root if not loads else refined(root)
    hardens = bool(loads) and float(np.sum(missing(numbers) ** 2)) > len(loads)
    if hardens:
        numbers = refined(np.concatenate([numbers, _FIRST_SPRINGS]))
    compliance, springs, square = parts(numbers)
    squares, modes = eigh(np.linalg.inv(compliance), _WHEEL)
    if (fast := squares > _FASTEST).any():
        floor = _FLOOR + modes[:, fast] @ modes[:, fast].T / _FASTEST
        compliance, springs, square = parts(refined(numbers) if loads else numbers)
    names = ", ".join(load.name for load in loads)
    elastic = {
        "stiffness": upper_triangle(np.asarray(np.linalg.inv(compliance), dtype=np.float64)),
        "hardening": tuple(float(f"{value:.6g}") for value in springs.ravel()) if hardens else (),
        "hardening_square": tuple(float(f"{value:.6g}") for value in square),
    }
    return elastic, f"measured: {names}; usual values for other loads" if names else "not measured: usual values"


def _start(forces: Array, wanted: Array, weight: Array) -> Array:
    """Return the nearest positive definite compliance, by least squares, as a triangle."""
    places, rows, right = list(zip(*_LOWER, strict=True)), [], []
    for index in range(5):
        known = np.isfinite(wanted[:, index])
        columns = np.zeros((int(known.sum()), len(places)))
        for column, (i, j) in enumerate(places):
            unit = _UNITS[i, j] * weight[known, 0] / _SCALE[index]
            if i == index:
                columns[:, column] += forces[known, j] * unit
            if j == index and i != j:
                columns[:, column] += forces[known, i] * unit
        rows.append(columns)
        right.append(wanted[known, index] * weight[known, 0] / _SCALE[index])
    rows.append(_PULL * np.eye(len(places)))
    right.append(_PULL * np.eye(5)[_LOWER])
    solution = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0]
    matrix = np.zeros((5, 5))
    matrix[_LOWER] = solution
    values, vectors = np.linalg.eigh(matrix + np.tril(matrix, -1).T)
    held = vectors * np.sqrt(np.maximum(values, 1e-6))
    # The triangle of a product: QR of its other factor.
    triangle = np.linalg.qr(held.T)[1].T
    return np.asarray((triangle * np.sign(np.diag(triangle)))[_LOWER], dtype=np.float64)


def _wanted(load: Load) -> Array:
    """Return the measured motion minus the compliance in series, shape (n, 5), with nan where not measured."""
    moved = [np.full(len(load.x), np.nan) if (row := load.moved[name]) is None else row for name in COORDINATES]
    return np.stack(moved, axis=1) - np.outer(load.x, load.direction) @ load.beside.T


def deflections(forces: Array, compliance: Array, springs: Array, square: Array) -> Array:
    """Return deflections under loads, by Newton's method."""
    moved, stiffness = forces @ compliance, np.linalg.inv(compliance)
    if not springs.any():
        return moved
    for _ in range(40):
        along = moved @ springs.T
        missing = moved @ stiffness + (along**2 * (square + along)) @ springs - forces
        rise = along * (2.0 * square + 3.0 * along)
        slope = stiffness + np.einsum("nk,ki,kj->nij", np.maximum(rise, 0.0), springs, springs)
        step = np.linalg.solve(slope, missing[..., None])[..., 0]
        moved = moved - step
        if np.abs(step / _SCALE).max() < 1e-4:
            break
    return moved


_POINTS: Final = 33
"""Number of points of a curve in the vehicle file."""
_NEAR_M: Final = 0.015
"""Travel within which a rate is evaluated, as for the metrics of the rig."""
_DIGITS: Final = 7


@dataclass(frozen=True)
class MeasuredAxle:
    """Measurements of an axle for one wheel, with None for missing measurements."""

    curves: AxleCurves  # measured curves, and the stiffness
    wheel_load_N: tuple[float, ...] | None  # over `curves.travel_m`, relative to the standing car
    anti_roll_bar_Npm: float | None  # from opposite and parallel travel
    damper_ratio: float | None  # shortening of the damper per wheel travel
    # Rise of the left wheel centre per travel of the rack to the left, at a fixed spring length: the work of the wheel
    # load as caster raises one wheel and lowers the other.
    rack_lift: float
    roughness: dict[str, float]  # channel to the largest distance of a sample from the curve, SI units
    stiffness_remark: str  # basis of the elastic part
    questions: tuple[str, ...]  # unusual measurements

    @property
    def wheel_rate_Npm(self) -> float | None:
        """Slope of the wheel load at the standing car."""
        if self.wheel_load_N is None:
            return None
        travel = np.array(self.curves.travel_m)
        near = np.abs(travel) <= 1.01 * _NEAR_M
        return float(np.polyfit(travel[near], np.array(self.wheel_load_N)[near], 1)[0])


def measured_axle(
    axle: str,
    tables: KcTables,
    wheel_centre_m: Array,
    kingpin_m: tuple[Array, Array],
    in_series: tuple[float, float],
) -> MeasuredAxle:
    """Return curves and compliance of an axle."""
    tests, rolling_radius_m = tables.tests[axle], float(wheel_centre_m[2])
    check_signs(tests)
    rough: dict[str, float] = {}
    travel, over_travel = _over_travel(tests["parallel_travel"], rolling_radius_m, rough)
    rack = _over_rack(tests["steering"], rolling_radius_m, over_travel, travel, rough) if "steering" in tests else {}
    if axle == "front" and not rack:
        raise ParameterError("front_steering.csv (or .toml) is needed, with the steering of the wheels by the rack")
    fields: dict[str, Any] = {**over_travel, **rack, "stiffness": upper_triangle(1e5 * np.eye(5))}
    placeholder = AxleCurves(**fields)
    column_Npm, servo_Nmprad = in_series
    beside = (
        _rack_compliance(placeholder, column_Npm)
        if axle == "front"
        else _servo(wheel_centre_m, kingpin_m) / servo_Nmprad
    )
    elastic, remark = fitted(_loads(axle, tests, rolling_radius_m, beside))
    load, damper = (tests["parallel_travel"].moved(name) for name in ("load", "damper"))
    wheel_load = None if load is None else smoothed(tests["parallel_travel"].x, load, travel)
    return MeasuredAxle(
        replace(placeholder, **elastic),
        None if wheel_load is None else _listed(wheel_load),
        _anti_roll_bar(tests, travel, wheel_load),
        None if damper is None else abs(_slope(tests["parallel_travel"], damper)),
        _rack_lift(tests),
        rough,
        remark,
        tuple(unusual(axle, tests)),
    )


def _listed(values: Array) -> tuple[float, ...]:
    return tuple(float(f"{value:.{_DIGITS}g}") for value in values)


def _curve(samples: Samples, values: Array | None, at: Array, name: str, rough: dict[str, float]) -> Array:
    if values is None:
        return np.zeros(len(at))
    rough[f"{name} over {samples.file}"] = float(np.abs(smoothed(samples.x, values, samples.x) - values).max())
    return smoothed(samples.x, values, at)


def _wheel_paths(samples: Samples, radius_m: float) -> tuple[Array | None, Array | None]:
    """Return the lateral and longitudinal path of the wheel centre."""
    outwards, forward = samples.moved("centre_outwards"), samples.moved("centre_forward")
    contact = samples.moved("contact_outwards")
    if outwards is None and contact is not None:
        camber = samples.moved("camber")
        # The contact point is below the centre in the wheel plane: more camber (top outwards) moves it inwards.
        outwards = contact if camber is None else contact + radius_m * camber
    if forward is None:
        forward = samples.moved("contact_forward")
    return outwards, forward


def _over_travel(
    samples: Samples, radius_m: float, rough: dict[str, float]
) -> tuple[Array, dict[str, tuple[float, ...]]]:
    for needed in ("toe", "camber"):
        if needed not in samples.channels:
            raise ParameterError(f"the {needed} of the wheels was not measured", file=samples.file)
    travel = np.round(np.linspace(samples.x.min(), samples.x.max(), _POINTS), 5)
    outwards, forward = _wheel_paths(samples, radius_m)
    values = {
        "toe_rad": samples.channels["toe"],
        "camber_rad": samples.channels["camber"],
        "outwards_m": outwards,
        "forward_m": forward,
        "caster_rad": samples.moved("caster"),
    }
    curves = {key: _listed(_curve(samples, value, travel, key, rough)) for key, value in values.items()}
    return travel, {"travel_m": _listed(travel), **curves, "load_N": (0.0,) * _POINTS}


def _over_rack(
    samples: Samples, radius_m: float, over_travel: dict[str, tuple[float, ...]], travel: Array, rough: dict[str, float]
) -> dict[str, tuple[float, ...]]:
    """Return the curves versus rack travel, minus the effect of the wheel travel during the sweep."""
    rack = np.round(np.linspace(samples.x.min(), samples.x.max(), _POINTS), 6)
    lifted = samples.moved("travel")

    def by_travel(key: str) -> Array:
        if lifted is None:
            return np.zeros(len(samples.x))
        values = np.array(over_travel[key])
        return np.interp(lifted, travel, values) - np.interp(0.0, travel, values)

    outwards, forward = _wheel_paths(samples, radius_m)
    toe, camber, caster = (samples.moved(name) for name in ("toe", "camber", "caster"))
    if toe is None:
        raise ParameterError("the toe of the wheels was not measured", file=samples.file)
    values = {
        "rack_steer_rad": -(toe - by_travel("toe_rad")),
        "rack_camber_rad": None if camber is None else camber - by_travel("camber_rad"),
        "rack_outwards_m": None if outwards is None else outwards - by_travel("outwards_m"),
        "rack_forward_m": None if forward is None else forward - by_travel("forward_m"),
        "rack_caster_rad": None if caster is None else caster - by_travel("caster_rad"),
    }
    curves = {}
    for key, value in values.items():
        curve = _curve(samples, value, rack, key, rough)
        curves[key] = _listed(curve - smoothed(rack, curve, np.zeros(1))[0])
    return {"rack_m": _listed(rack), **curves}


def _loads(axle: str, tests: dict[str, Samples], radius_m: float, in_series: Array) -> list[Load]:
    """Return the compliance tests: load at the wheel centre per unit of the variable, and motion."""
    camber = tests["parallel_travel"]
    # The contact point of a cambered wheel is not below its centre.
    beside_m = -radius_m * float(np.sin(smoothed(camber.x, camber.channels["camber"], np.zeros(1))[0]))
    per_unit = {
        "side_force": (0.0, 1.0, radius_m, 0.0, 0.0),
        "side_force_opposed": (0.0, 1.0, radius_m, 0.0, 0.0),
        "braking_force": (1.0, 0.0, 0.0, -radius_m, -beside_m),
        "drive_force": (1.0, 0.0, 0.0, 0.0, 0.0),
        "aligning_moment": (0.0, 0.0, 0.0, 0.0, 1.0),
        "aligning_moment_opposed": (0.0, 0.0, 0.0, 0.0, 1.0),
    }
    loads = []
    for name, direction in per_unit.items():
        if name not in tests:
            continue
        if f"{name}_opposed" in tests:
            # Both tests load a wheel in the same way; out of phase, the rack plays no part.
            continue
        samples = tests[name]
        outwards, forward = _wheel_paths(samples, radius_m)
        moved = {"x": forward, "y": outwards}
        for coordinate in ("camber", "caster", "toe"):
            value = samples.moved(coordinate)
            moved[coordinate] = None if value is None else -value
        pushes_rack = name in ("side_force", "aligning_moment")
        beside = in_series if axle == "rear" or pushes_rack else np.zeros((5, 5))
        loads.append(Load(name, np.array(direction), samples.x, moved, beside))
    return loads


def _rack_compliance(curves: AxleCurves, column_Npm: float) -> Array:
    """Return the compliance of a wheel due to the steering column, with equal loads on both wheels, shape (5, 5)."""
    rack, over = np.array(curves.rack_m), curves.over_rack()
    near = np.argsort(np.abs(rack))[:5]
    slopes = np.array([np.polyfit(rack[near], row[near], 1)[0] for row in over])
    return 2.0 * np.outer(slopes, slopes) / column_Npm


def _servo(wheel_centre_m: Array, kingpin_m: tuple[Array, Array]) -> Array:
    """Return the motion of a rear wheel per compliance of its steering servo, shape (5, 5)."""
    axis = kingpin_m[1] - kingpin_m[0]
    axis = axis / np.linalg.norm(axis)
    way = np.cross(axis, wheel_centre_m - kingpin_m[0])
    motion = np.array([way[0], way[1], *axis])
    return np.outer(motion, motion)


def _anti_roll_bar(tests: dict[str, Samples], travel: Array, parallel: Array | None) -> float | None:
    """Return the anti-roll bar rate: half the stiffness difference of opposite and parallel travel."""
    if parallel is None or "opposite_travel" not in tests or (load := tests["opposite_travel"].moved("load")) is None:
        return None
    about = np.abs(travel) <= 1.01 * _NEAR_M
    opposite = _slope(tests["opposite_travel"], load)
    return max(0.0, 0.5 * (opposite - float(np.polyfit(travel[about], parallel[about], 1)[0])))


def _rack_lift(tests: dict[str, Samples]) -> float:
    """Return the rack lift from the change of wheel load with steering, or 0 if not measured."""
    steered, opposite = tests.get("steering"), tests.get("opposite_travel")
    if steered is None or opposite is None:
        return 0.0
    load, lifted, sprung = steered.moved("load"), steered.moved("travel"), opposite.moved("load")
    if load is None or lifted is None or sprung is None:
        return 0.0
    rate, reach_m = _slope(opposite, sprung), 0.4 * float(np.abs(steered.x).max())
    rise, push = (_slope(steered, value, reach_m, 2) for value in (lifted, load))
    return float(f"{rise - push / rate:.6g}")


def _slope(samples: Samples, values: Array, reach_m: float = 1.01 * _NEAR_M, degree: int = 1) -> float:
    """Return the slope at 0 of a polynomial through the samples near 0."""
    near = np.abs(samples.x) <= reach_m
    if (count := len(np.unique(samples.x[near]))) <= degree:
        problem = f"has {count} positions within {1e3 * reach_m:.3g} mm of the middle; at least {degree + 1} are needed"
        raise ParameterError(problem, file=samples.file)
    return float(np.polyfit(samples.x[near], values[near], degree)[degree - 1])
