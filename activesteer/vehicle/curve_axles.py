"""Axles guided by measured curves of kinematics and compliance, and their forces in compiled code.

The wheel centre's height is free. Its other five coordinates (forwards, outwards, camber, caster, toe) follow curves
over the height and, at a steered axle, over the rack. Forces deflect the wheel from the curves against a 5 x 5
stiffness. Path and forces are consistent by virtual work: the slope of a curve passes part of the lateral force to the
springs, and the rack feels the trail.

With e = q - f(z) - g(s), the deflection of the five coordinates q from their curves over the travel z and the rack s,
and t = a . e along each hardening spring, the energy is U = e'Ke/2 + sum(s t^3/3 + t^4/4) + the integral of the load
over z. Its slopes are the forces: Q_q = -dU/de, and by the chain rule Q_z = dU/de f'(z), Q_s = dU/de g'(s). No work is
lost or gained, whatever the curves.

The engine is implicit in tendons only, so each corner has some tendons for the stiff part of K, with the slopes of the
curves in the design position (`curve_axles`). The forces here are the difference: the forces above minus the forces of
these tendons.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.config import Range, check_points
from activesteer.core.conventions import CORNERS
from activesteer.errors import ModelError, ParameterError
from activesteer.native.compilation import inlined, inlined_by_llvm
from activesteer.native.memory import records_at
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.force_block import find, tendon_arms

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


COORDINATES: Final = ("x", "y", "camber", "caster", "toe")
"""Order of the five coordinates in every array: slides along x and y, hinges about x, y and z."""
OVER_TRAVEL: Final = ("forward_m", "outwards_m", "camber_rad", "caster_rad", "toe_rad")
OVER_RACK: Final = ("rack_forward_m", "rack_outwards_m", "rack_camber_rad", "rack_caster_rad", "rack_steer_rad")
"""Fields with the curves of these coordinates versus rack travel."""
_TRAVEL_SIGNS: Final = np.array([1.0, 1.0, -1.0, -1.0, -1.0])
_RACK_SIGNS: Final = np.array([1.0, 1.0, -1.0, -1.0, 1.0])
"""Signs from the file to the left wheel's joints, where camber and toe-in are negative rotations."""
_POINTS: Final = Range(5, 41)
_ENTRIES: Final = 15


@dataclass(frozen=True)
class AxleCurves:
    """Curves of the left wheel of an axle: cubic splines, straight beyond their ends."""

    travel_m: tuple[float, ...]
    """Height of the wheel centre above the design position, positive in bump, increasing [m]."""
    toe_rad: tuple[float, ...]
    """Toe angle of one wheel, positive toe-in, static toe included [rad]."""
    camber_rad: tuple[float, ...]
    """Camber, negative with the top inwards, static camber included [rad]."""
    outwards_m: tuple[float, ...]
    """Displacement of the wheel centre outwards: half of the track change at the wheel centres [m]."""
    forward_m: tuple[float, ...]
    """Displacement of the wheel centre forwards [m]."""
    caster_rad: tuple[float, ...]
    """Rotation of the knuckle in side view, positive with the top to the rear, from the design position [rad]."""
    load_N: tuple[float, ...]
    """Measured wheel load minus the loads of spring, stops and anti-roll bar [N]."""
    stiffness: tuple[float, ...]
    """Stiffness of the left wheel at its centre, against forces along x and y and moments about x, y and z: upper
    triangle of the symmetric 5 x 5 matrix, row by row [N/m, N, N m/rad]."""
    hardening: tuple[float, ...] = ()
    """Directions a of additional hardening springs, none or two, five numbers each. A wheel displacement e lengthens
    such a spring by t = a . e, and the spring pushes back with a (s t2 + t3), as a soft bushing along a does."""
    hardening_square: tuple[float, ...] = (0.0, 0.0)
    """Coefficient s of both springs. It makes them softer to one side than to the other."""
    damping_ratio: Annotated[float, Range(0.0, 0.5)] = 0.2
    """Damping ratio of each mode of the wheel on the elastic part. Rubber and joints of the compact have 0.1 to 0.35.
    """
    rack_m: tuple[float, ...] = ()
    """Travel of the rack, positive steers left, increasing, or empty if the rack does not steer the axle [m]."""
    rack_steer_rad: tuple[float, ...] = ()
    """Steer angle of the left wheel from straight ahead, positive to the left [rad]."""
    rack_camber_rad: tuple[float, ...] = ()
    """Change of the left wheel's camber [rad]."""
    rack_outwards_m: tuple[float, ...] = ()
    """Displacement of the left wheel's centre outwards [m]."""
    rack_forward_m: tuple[float, ...] = ()
    """Displacement of the left wheel's centre forwards [m]."""
    rack_caster_rad: tuple[float, ...] = ()
    """Rotation of the left knuckle in side view [rad]."""

    def __post_init__(self) -> None:
        """Check lengths and order of the curves, and that the stiffness is positive definite."""
        _check_curves(self, "travel_m", (*OVER_TRAVEL, "load_N"))
        if self.is_steered or any(getattr(self, name) for name in OVER_RACK):
            _check_curves(self, "rack_m", OVER_RACK)
        for name, counts in (("stiffness", (_ENTRIES,)), ("hardening", (0, 10)), ("hardening_square", (2,))):
            given = getattr(self, name)
            if len(given) not in counts:
                raise ParameterError(f"{len(given)} numbers given; {counts[-1]} are needed", key=name)
        least = float(np.linalg.eigvalsh(_scaled(self.stiffness_matrix())).min())
        if least <= 0.0:
            raise ParameterError(
                "does not hold the wheel: the matrix is not positive definite "
                f"(least eigenvalue {least:.3g} N/m with rotations at 0.3 m)",
                key="stiffness",
            )

    @property
    def is_steered(self) -> bool:
        """True if the rack steers the axle."""
        return bool(self.rack_m)

    def stiffness_matrix(self) -> NDArray[np.float64]:
        """Stiffness of the left wheel in the order of `COORDINATES`, shape (5, 5)."""
        matrix = np.zeros((5, 5))
        matrix[np.triu_indices(5)] = self.stiffness
        return matrix + np.triu(matrix, 1).T

    def over_travel(self) -> NDArray[np.float64]:
        """Return the left wheel's joints, and `load_N`, at the points of travel, shape (6, n)."""
        return np.array([*_joints(self, OVER_TRAVEL, _TRAVEL_SIGNS), self.load_N])

    def over_rack(self) -> NDArray[np.float64]:
        """Return the left wheel's joints at the points of the rack, shape (5, n)."""
        return np.array(_joints(self, OVER_RACK, _RACK_SIGNS))


def _joints(curves: AxleCurves, names: tuple[str, ...], signs: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    return [sign * np.array(getattr(curves, name)) for name, sign in zip(names, signs, strict=True)]


def _scaled(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale rotations by an arm of 0.3 m, so that all entries have one unit."""
    arms = np.array([1.0, 1.0, 0.3, 0.3, 0.3])
    return matrix / np.outer(arms, arms)


def upper_triangle(matrix: NDArray[np.float64]) -> tuple[float, ...]:
    """Return a symmetric 5 x 5 matrix in the form of `AxleCurves.stiffness`."""
    return tuple(float(f"{value:.7g}") for value in matrix[np.triu_indices(5)])


def _check_curves(curves: AxleCurves, over: str, names: tuple[str, ...]) -> None:
    points = getattr(curves, over)
    check_points(over, points, {name: getattr(curves, name) for name in names}, _POINTS)
    if not points[0] < 0.0 < points[-1]:
        raise ParameterError(f"runs from {points[0]:g} to {points[-1]:g} m; it must contain 0", key=over)


@dataclass(frozen=True)
class Curves:
    """Curve axles of a car."""

    front: AxleCurves | None = None
    """Curves of the front axle; default the links of the model."""
    rear: AxleCurves | None = None
    """Curves of the rear axle; default the links of the model."""

    def __post_init__(self) -> None:
        """Check that the rack steers in front."""
        if self.front is not None and not self.front.is_steered:
            raise ParameterError("the rack must steer the front wheels: curves over rack_m are needed", key="front")
        if self.rear is not None and self.rear.is_steered:
            raise ParameterError("the rack steers the front wheels only", key="rear.rack_m")

    def axle(self, corner: str) -> AxleCurves | None:
        """Return the curves of a corner's axle."""
        return self.front if corner.startswith("f") else self.rear


JOINTS: Final = ("x", "y", "z", "toe", "camber", "caster")
"""Joints of a curve axle's knuckle. They turn about z, x, y: `toe` and `camber` are exactly steer and inclination."""
HOLDING_TENDON: Final = "_guide"
"""Suffix of the tendons that hold a wheel of a curve axle: CORNER_NUMBER_guide."""
_HELD: Final = 0.05  # 36 Hz at 1 ms; below it the explicit native forces are stable and as accurate
"""Square of natural frequency times step above which a mode is held by a tendon of the engine, which costs time."""
_INTERVALS: Final = 32


def fit_curve_axles(spec: mujoco.MjSpec, curves: Curves) -> None:
    """Add tendons to each wheel of a curve axle, for the fast natural modes of its knuckle."""
    corners = [corner for corner in CORNERS if curves.axle(corner) is not None]
    model = spec.compile()
    for corner in corners:
        axle = curves.axle(corner)
        assert axle is not None
        squares, along = _modes(model, corner, axle)
        rows = along @ _strains(model, corner, axle)
        # Frequency with everything else free to move, above all the light rack.
        fast = squares * np.sum((rows @ _mobility(model)) * rows, axis=1) * model.opt.timestep**2
        for number in np.flatnonzero(fast >= _HELD):
            tendon = spec.add_tendon(name=f"{corner}_{number}{HOLDING_TENDON}", springlength=[0.0, 0.0])
            tendon.stiffness = [float(squares[number]), 0.0, 0.0]
            tendon.damping = [_damping(axle, squares[number]), 0.0, 0.0]
            for dof in np.flatnonzero(rows[number]):
                tendon.wrap_joint(model.joint(int(model.dof_jntid[dof])).name, float(rows[number, dof]))


def curve_axle_records(model: mujoco.MjModel, curves: Curves) -> tuple[list[NDArray[Any]], list[NDArray[np.float64]]]:
    """Return the records of the wheels of curve axles, and the tables of their curves."""
    records: list[NDArray[Any]] = []
    tables: list[NDArray[np.float64]] = []
    places: dict[str, tuple[int, int]] = {}
    for corner in CORNERS:
        axle = curves.axle(corner)
        if axle is None:
            continue
        if corner[0] not in places:
            start = sum(table.size for table in tables)
            travel, rack = _table(axle.travel_m, axle.over_travel()), _table(axle.rack_m, axle.over_rack())
            places[corner[0]] = start, start + travel.size
            tables += [travel, rack]
        records.append(_record(model, corner, axle, places[corner[0]]))
    return records, tables


def _joints_of_model(model: mujoco.MjModel, corner: str) -> tuple[int, int]:
    """Return the addresses of a corner's first coordinate and first velocity. The others follow in order."""
    joints = [find(model, mujoco.mjtObj.mjOBJ_JOINT, f"{corner}_{name}") for name in JOINTS]
    qpos, dofs = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
    if (np.diff(qpos) != 1).any() or (np.diff(dofs) != 1).any():
        wanted = ", ".join(f"{corner}_{name}" for name in JOINTS)
        raise ModelError(f"a curve axle needs the joints {wanted} on its knuckle, in this order, and no other")
    return int(qpos[0]), int(dofs[0])


def _side(corner: str) -> float:
    return 1.0 if corner.endswith("l") else -1.0


def _mirror(side: float) -> NDArray[np.float64]:
    """Return the signs that convert the coordinates of a wheel to a left wheel."""
    return np.array([1.0, side, side, 1.0, side])


def _spline(points: tuple[float, ...], values: NDArray[np.float64]) -> CubicSpline:
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - slow to import, and only curve axles need it

    return CubicSpline(points, values, axis=1)


def _slopes(axle: AxleCurves) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the slopes of the curves in the design position, versus travel and rack."""
    by_travel = _spline(axle.travel_m, axle.over_travel())(0.0, 1)[: len(COORDINATES)]
    by_rack = _spline(axle.rack_m, axle.over_rack())(0.0, 1) if axle.is_steered else np.zeros(len(COORDINATES))
    return by_travel, by_rack


def _table(points: tuple[float, ...], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Resample a spline through points to cubics on even intervals."""
    if not points:
        return np.zeros(0)
    spline = _spline(points, values)
    ends = np.linspace(points[0], points[-1], _INTERVALS + 1)
    step = ends[1] - ends[0]
    value, slope = spline(ends), step * spline(ends, 1)
    rise = np.diff(value, axis=1)
    first, last = slope[:, :-1], slope[:, 1:]
    cubics = np.stack([value[:, :-1], first, 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise], axis=-1)
    head = fb.filled(fb.CURVE_TABLE, start_m=points[0], per_m=1.0 / step, intervals=_INTERVALS, count=len(values))
    return np.concatenate([head.view(np.float64), cubics.transpose(1, 0, 2).ravel()])


def _record(model: mujoco.MjModel, corner: str, axle: AxleCurves, tables: tuple[int, int]) -> NDArray[Any]:
    qpos, dof = _joints_of_model(model, corner)
    side = _side(corner)
    rack, rack_dof = -1.0, -1.0
    if axle.is_steered:
        joint = find(model, mujoco.mjtObj.mjOBJ_JOINT, "rack")
        rack, rack_dof = float(model.jnt_qposadr[joint]), float(model.jnt_dofadr[joint])
    held, held_damping, damping = np.zeros((5, 5)), np.zeros((5, 5)), np.zeros((5, 5))
    for number, (square, along) in enumerate(zip(*_modes(model, corner, axle), strict=True)):
        arms = tendon_arms(model, name := f"{corner}_{number}{HOLDING_TENDON}")
        if not arms:
            damping += _damping(axle, square) * np.outer(along, along)
            continue
        tendon = find(model, mujoco.mjtObj.mjOBJ_TENDON, name)
        row = _mirror(side) * [arms[f"{corner}_{name}"] for name in COORDINATES]
        held += model.tendon_stiffness[tendon] * np.outer(row, row)
        held_damping += model.tendon_damping[tendon] * np.outer(row, row)
    # The engine's step is implicit in its tendons, which is a damping of step times stiffness along them. Where a curve
    # is no longer as steep as in the design position, the difference would damp the wheel's travel, so it is included.
    held_damping += model.opt.timestep * held
    by_travel, by_rack = _slopes(axle)
    return fb.filled(
        fb.CURVE_AXLE_WHEEL,
        qpos=qpos,
        dof=dof,
        side=side,
        rack=rack,
        rack_dof=rack_dof,
        travel_table=tables[0],
        rack_table=tables[1],
        stiffness=axle.stiffness_matrix().ravel(),
        damping=(damping + held_damping).ravel(),
        held_stiffness=held.ravel(),
        held_damping=held_damping.ravel(),
        square=axle.hardening_square,
        hardening=np.ravel(axle.hardening),
        travel_slope=by_travel,
        rack_slope=by_rack,
    )


def _damping(axle: AxleCurves, square: float) -> float:
    """Return the damping of a mode from the square of its frequency, for unit inertia."""
    return 2.0 * axle.damping_ratio * float(np.sqrt(square))


def _mobility(model: mujoco.MjModel) -> NDArray[np.float64]:
    """Return the inverse mass matrix of all degrees of freedom in the design position, shape (nv, nv)."""
    data, full = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, full)
    return np.asarray(np.linalg.inv(full), dtype=np.float64)


def _strains(model: mujoco.MjModel, corner: str, axle: AxleCurves) -> NDArray[np.float64]:
    """Return the deflections from the curves per degree of freedom, as for a left wheel, shape (5, nv)."""
    rows, side = np.zeros((len(COORDINATES), model.nv)), _side(corner)
    _, first = _joints_of_model(model, corner)
    by_travel, by_rack = _slopes(axle)
    rows[:, [first + JOINTS.index(name) for name in COORDINATES]] = np.diag(_mirror(side))
    rows[:, first + JOINTS.index("z")] = -by_travel
    if axle.is_steered:
        rows[:, model.jnt_dofadr[find(model, mujoco.mjtObj.mjOBJ_JOINT, "rack")]] = -side * by_rack
    return rows


def _modes(model: mujoco.MjModel, corner: str, axle: AxleCurves) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return squared frequencies and deflections of a knuckle's modes on its stiffness, the rest free to move."""
    from scipy.linalg import eigh  # noqa: PLC0415 - slow to import, and only curve axles need it

    # A wheel that turns on its bearing takes no part in the rotation of its knuckle in side view.
    _, first = _joints_of_model(model, corner)
    dofs = [first + JOINTS.index(name) for name in COORDINATES]
    mirror = _mirror(_side(corner))
    mass = np.linalg.inv(_mobility(model)[np.ix_(dofs, dofs)]) * np.outer(mirror, mirror)
    squares, modes = eigh(axle.stiffness_matrix(), mass)
    return squares, (mass @ modes).T


_wheels_at: Final = records_at(fb.CURVE_AXLE_WHEEL)
_tables_at: Final = records_at(fb.CURVE_TABLE)
_numbers_at: Final = records_at(np.dtype(np.float64))
_HEAD: Final = fb.CURVE_TABLE.itemsize // 8


@inlined
def _place(table, position):
    """Return a position on a spline: interval, fraction within it, and excess in intervals beyond an end."""
    at = (position - table.start_m) * table.per_m
    count = table.intervals
    inside = min(max(at, 0.0), count)
    interval = min(int(inside), int(count) - 1)
    return interval, inside - interval, at - inside


@inlined
def _curve(table, cubics, index, place):
    """Return the value of a curve and its slope."""
    interval, t, beyond = place
    start = 4 * (interval * int(table.count) + index)
    a, b, c, d = cubics[start], cubics[start + 1], cubics[start + 2], cubics[start + 3]
    slope = b + t * (2.0 * c + 3.0 * d * t)
    return a + t * (b + t * (c + d * t)) + beyond * slope, slope * table.per_m


@inlined
def _strain(record, travel, tc, rack, rc, index, q, v, moved, on_travel, on_rack):
    """Return deflection, rate and slopes, then deflection and rate with linear curves, all as for a left wheel."""
    z, vz, s, vs = moved
    f, slope_z = _curve(travel, tc, index, on_travel)
    g, slope_s = 0.0, 0.0
    if record.rack >= 0.0:
        g, slope_s = _curve(rack, rc, index, on_rack)
    straight_z, straight_s = record.travel_slope[index], record.rack_slope[index]
    return (
        q - f - g,
        v - slope_z * vz - slope_s * vs,
        slope_z,
        slope_s,
        q - straight_z * z - straight_s * s,
        v - straight_z * vz - straight_s * vs,
    )


@inlined
def _row(matrix, start, e0, e1, e2, e3, e4):
    m = matrix[start:]
    return m[0] * e0 + m[1] * e1 + m[2] * e2 + m[3] * e3 + m[4] * e4


@inlined
def _hardened(record, spring, e0, e1, e2, e3, e4):
    """Return the force of a hardening spring as a factor of its direction a (see `AxleCurves.hardening`)."""
    t = _row(record.hardening, 5 * spring, e0, e1, e2, e3, e4)
    return t * t * (record.square[spring] + t)


@inlined_by_llvm
def add_curve_axle_forces(block, header, qpos, qvel, qfrc):
    """Add the forces of all wheels of curve axles."""
    records = _wheels_at(block, header.curve_axle_wheels, header.n_curve_axle_wheels)
    curves = _numbers_at(block, header.curves, header.n_curves)
    for index in range(records.size):
        record = records[index]
        travel = _tables_at(block, header.curves + record.travel_table, 1)[0]
        rack = _tables_at(block, header.curves + record.rack_table, 1)[0]
        tc, rc = curves[int(record.travel_table) + _HEAD :], curves[int(record.rack_table) + _HEAD :]
        p, d, side = int(record.qpos), int(record.dof), record.side
        z, vz, s, vs = qpos[p + 2], qvel[d + 2], 0.0, 0.0
        on_travel, on_rack = _place(travel, z), (0, 0.0, 0.0)
        if record.rack >= 0.0:
            s, vs = side * qpos[int(record.rack)], side * qvel[int(record.rack_dof)]
            on_rack = _place(rack, s)
        moved = z, vz, s, vs
        e0, r0, z0, s0, l0, m0 = _strain(record, travel, tc, rack, rc, 0, qpos[p], qvel[d], moved, on_travel, on_rack)
        e1, r1, z1, s1, l1, m1 = _strain(
            record, travel, tc, rack, rc, 1, side * qpos[p + 1], side * qvel[d + 1], moved, on_travel, on_rack
        )
        e2, r2, z2, s2, l2, m2 = _strain(
            record, travel, tc, rack, rc, 2, side * qpos[p + 4], side * qvel[d + 4], moved, on_travel, on_rack
        )
        e3, r3, z3, s3, l3, m3 = _strain(
            record, travel, tc, rack, rc, 3, qpos[p + 5], qvel[d + 5], moved, on_travel, on_rack
        )
        e4, r4, z4, s4, l4, m4 = _strain(
            record, travel, tc, rack, rc, 4, side * qpos[p + 3], side * qvel[d + 3], moved, on_travel, on_rack
        )
        k, c, h = record.stiffness, record.damping, record.hardening
        kh, ch = record.held_stiffness, record.held_damping
        f1 = _hardened(record, 0, e0, e1, e2, e3, e4)
        f2 = _hardened(record, 1, e0, e1, e2, e3, e4)
        w0 = _row(kh, 0, l0, l1, l2, l3, l4) + _row(ch, 0, m0, m1, m2, m3, m4)
        u0 = _row(k, 0, e0, e1, e2, e3, e4) + _row(c, 0, r0, r1, r2, r3, r4) + h[0] * f1 + h[5] * f2
        w1 = _row(kh, 5, l0, l1, l2, l3, l4) + _row(ch, 5, m0, m1, m2, m3, m4)
        u1 = _row(k, 5, e0, e1, e2, e3, e4) + _row(c, 5, r0, r1, r2, r3, r4) + h[1] * f1 + h[6] * f2
        w2 = _row(kh, 10, l0, l1, l2, l3, l4) + _row(ch, 10, m0, m1, m2, m3, m4)
        u2 = _row(k, 10, e0, e1, e2, e3, e4) + _row(c, 10, r0, r1, r2, r3, r4) + h[2] * f1 + h[7] * f2
        w3 = _row(kh, 15, l0, l1, l2, l3, l4) + _row(ch, 15, m0, m1, m2, m3, m4)
        u3 = _row(k, 15, e0, e1, e2, e3, e4) + _row(c, 15, r0, r1, r2, r3, r4) + h[3] * f1 + h[8] * f2
        w4 = _row(kh, 20, l0, l1, l2, l3, l4) + _row(ch, 20, m0, m1, m2, m3, m4)
        u4 = _row(k, 20, e0, e1, e2, e3, e4) + _row(c, 20, r0, r1, r2, r3, r4) + h[4] * f1 + h[9] * f2
        load, _ = _curve(travel, tc, 5, on_travel)
        zs, ss = record.travel_slope, record.rack_slope
        qfrc[d] -= u0 - w0
        qfrc[d + 1] -= side * (u1 - w1)
        qfrc[d + 2] += u0 * z0 + u1 * z1 + u2 * z2 + u3 * z3 + u4 * z4 - _row(zs, 0, w0, w1, w2, w3, w4) - load
        qfrc[d + 3] -= side * (u4 - w4)
        qfrc[d + 4] -= side * (u2 - w2)
        qfrc[d + 5] -= u3 - w3
        if record.rack >= 0.0:
            handed_on = u0 * s0 + u1 * s1 + u2 * s2 + u3 * s3 + u4 * s4 - _row(ss, 0, w0, w1, w2, w3, w4)
            qfrc[int(record.rack_dof)] += side * handed_on
