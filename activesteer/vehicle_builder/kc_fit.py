"""From samples of a K&C rig to the curves and the compliance of an axle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ParameterError
from activesteer.vehicle.curve_axles import AxleCurves, upper_triangle
from activesteer.vehicle_builder.kc_checks import check_signs, unusual
from activesteer.vehicle_builder.kc_compliance import Load, fitted
from activesteer.vehicle_builder.kc_tables import KcTables, Samples, smoothed

_POINTS: Final = 33
"""Number of points of a curve in the vehicle file."""
_NEAR_M: Final = 0.015
"""Travel within which a rate is evaluated, as for the metrics of the rig."""
_DIGITS: Final = 7


@dataclass(frozen=True)
class MeasuredAxle:
    """Measurements of an axle, for one wheel.

    Attributes:
        curves: Measured curves, and the stiffness.
        wheel_load_N: Load over `curves.travel_m`, relative to the standing car [N]; None if not measured.
        anti_roll_bar_Npm: Rate from opposite and parallel travel; None if they do not show it.
        damper_ratio: Shortening of the damper per wheel travel; None if not measured.
        rack_lift: Rise of the left wheel centre per travel of the rack to the left, at a fixed spring length: the work
            of the wheel load as caster raises one wheel and lowers the other.
        roughness: Channel to the largest distance of a sample from the curve through all samples, in SI units.
        stiffness_remark: Basis of the elastic part.
        questions: Unusual measurements.
    """

    curves: AxleCurves
    wheel_load_N: tuple[float, ...] | None
    anti_roll_bar_Npm: float | None
    damper_ratio: float | None
    rack_lift: float
    roughness: dict[str, float]
    stiffness_remark: str
    questions: tuple[str, ...]

    @property
    def wheel_rate_Npm(self) -> float | None:
        """Slope of the wheel load about the standing car."""
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
    """Return curves and compliance of an axle.

    Args:
        axle: `front` or `rear`.
        tables: All tests.
        wheel_centre_m: Left wheel centre in the standing car; its height is the arm of forces on the road [m].
        kingpin_m: Lower and upper point of the rear steering axis.
        in_series: Stiffnesses in series with the compliance of the wheel: steering column at the rack [N/m], and rear
            steering servo [N m/rad].

    Raises:
        ParameterError: a necessary channel was not measured, or the stiffness is not positive definite.
    """
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
    elastic = fitted(_loads(axle, tests, rolling_radius_m, beside))
    load = tests["parallel_travel"].moved("load")
    wheel_load = None if load is None else smoothed(tests["parallel_travel"].x, load, travel)
    curves = replace(
        placeholder,
        stiffness=elastic.stiffness,
        hardening=elastic.hardening,
        hardening_square=elastic.hardening_square,
    )
    return MeasuredAxle(
        curves,
        None if wheel_load is None else _listed(wheel_load),
        _anti_roll_bar(tests, travel, wheel_load),
        _damper_ratio(tests["parallel_travel"]),
        _rack_lift(tests),
        rough,
        elastic.remark,
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
    """Return the path of the wheel centre outwards and forwards; default: from the path of the contact point."""
    outwards, forward = samples.moved("centre_outwards"), samples.moved("centre_forward")
    contact = samples.moved("contact_outwards")
    if outwards is None and contact is not None:
        camber = samples.moved("camber")
        # The contact point lies below the centre in the wheel plane: more camber (top outwards) moves it inwards.
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
    """Return the curves over the rack, less the effect of the wheel travel during the sweep."""
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
    """Return the tests of compliance: load at the wheel centre per unit of the variable, and motion."""
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
    """Return the compliance of a wheel by the steering column, with both wheels loaded alike, shape (5, 5)."""
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
    """Return the rack lift from the change of wheel load in steering; 0 if not measured."""
    steered, opposite = tests.get("steering"), tests.get("opposite_travel")
    if steered is None or opposite is None:
        return 0.0
    load, lifted, sprung = steered.moved("load"), steered.moved("travel"), opposite.moved("load")
    if load is None or lifted is None or sprung is None:
        return 0.0
    rate, reach_m = _slope(opposite, sprung), 0.4 * float(np.abs(steered.x).max())
    rise, push = (_slope(steered, value, reach_m, 2) for value in (lifted, load))
    return float(f"{rise - push / rate:.6g}")


def _damper_ratio(samples: Samples) -> float | None:
    length = samples.moved("damper")
    if length is None:
        return None
    return abs(_slope(samples, length))


def _slope(samples: Samples, values: Array, reach_m: float = 1.01 * _NEAR_M, degree: int = 1) -> float:
    """Return the slope at 0 of a polynomial through the samples near 0."""
    near = np.abs(samples.x) <= reach_m
    if (count := len(np.unique(samples.x[near]))) <= degree:
        problem = f"has {count} positions within {1e3 * reach_m:.3g} mm of the middle; at least {degree + 1} are needed"
        raise ParameterError(problem, file=samples.file)
    return float(np.polyfit(samples.x[near], values[near], degree)[degree - 1])
