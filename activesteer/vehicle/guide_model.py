"""Puts the axles of curves into a model: tendons that hold the wheels, and the records of the native forces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import CORNERS
from activesteer.errors import ModelError
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.axle_curves import COORDINATES, AxleCurves, Curves
from activesteer.vehicle.named_parts import find, tendon_arms

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

JOINTS: Final = ("x", "y", "z", "toe", "camber", "caster")
"""Joints of a guided knuckle in the order of the model: the wheel's steer angle and inclination are `toe` and `camber`
exactly, since they turn about z first, then about x, then about y."""
GUIDE: Final = "_guide"
"""End of the names of the tendons that hold a guided wheel: CORNER_NUMBER_guide."""
_INTERVALS: Final = 32


def fit_guides(spec: mujoco.MjSpec, curves: Curves) -> None:
    """Gives each guided wheel its five tendons: the natural modes of its knuckle on the stiffness about the curves.

    Args:
        spec: The model; changed.
        curves: The curves of its axles.

    Raises:
        ModelError: the model's joints are not those of a guided knuckle.
    """
    corners = [corner for corner in CORNERS if curves.axle(corner) is not None]
    if not corners:
        return
    from scipy.linalg import eigh  # noqa: PLC0415 - slow to import, and only axles of curves need it

    model = spec.compile()
    for corner in corners:
        axle = curves.axle(corner)
        assert axle is not None
        _joints(model, corner)
        mass = _unsprung_mass(model, corner)
        squares, modes = eigh(axle.stiffness_matrix(), mass)
        by_travel, by_rack = _slopes(axle)
        side = _side(corner)
        for number, (square, along) in enumerate(zip(squares, (mass @ modes).T, strict=True)):
            tendon = spec.add_tendon(name=f"{corner}_{number}{GUIDE}", springlength=[0.0, 0.0])
            tendon.stiffness = [float(square), 0.0, 0.0]
            tendon.damping = [2.0 * axle.damping_ratio * float(np.sqrt(square)), 0.0, 0.0]
            for name, mirror, arm in zip(COORDINATES, _mirror(side), along, strict=True):
                tendon.wrap_joint(f"{corner}_{name}", float(mirror * arm))
            tendon.wrap_joint(f"{corner}_z", -float(along @ by_travel))
            if axle.is_steered:
                tendon.wrap_joint("rack", -side * float(along @ by_rack))


def guide_records(model: mujoco.MjModel, curves: Curves) -> tuple[list[NDArray[Any]], list[NDArray[np.float64]]]:
    """The records of all guided wheels, and the tables of their curves.

    Args:
        model: The car with its tendons, compiled.
        curves: The curves of its axles.

    Returns:
        `GUIDE` records, and tables to stand one behind the other; both empty where no axle is guided.
    """
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


def _joints(model: mujoco.MjModel, corner: str) -> tuple[int, int]:
    """Addresses of a corner's first coordinate and velocity; the others follow."""
    joints = [find(model, mujoco.mjtObj.mjOBJ_JOINT, f"{corner}_{name}") for name in JOINTS]
    qpos, dofs = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
    if (np.diff(qpos) != 1).any() or (np.diff(dofs) != 1).any():
        wanted = ", ".join(f"{corner}_{name}" for name in JOINTS)
        raise ModelError(f"an axle of curves needs the joints {wanted} on its knuckle, in this order, and no other")
    return int(qpos[0]), int(dofs[0])


def _side(corner: str) -> float:
    return 1.0 if corner.endswith("l") else -1.0


def _mirror(side: float) -> NDArray[np.float64]:
    """Signs that make the coordinates of a wheel those of the left one."""
    return np.array([1.0, side, side, 1.0, side])


def _spline(points: tuple[float, ...], values: NDArray[np.float64]) -> CubicSpline:
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - slow to import, and only axles of curves need it

    return CubicSpline(points, values, axis=1)


def _slopes(axle: AxleCurves) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Slopes of the five curves in the design position, over travel and over the rack."""
    by_travel = _spline(axle.travel_m, axle.over_travel())(0.0, 1)[: len(COORDINATES)]
    by_rack = _spline(axle.rack_m, axle.over_rack())(0.0, 1) if axle.is_steered else np.zeros(len(COORDINATES))
    return by_travel, by_rack


def _table(points: tuple[float, ...], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A spline through the points on even intervals, as cubics of the place in each interval."""
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
    qpos, dof = _joints(model, corner)
    side = _side(corner)
    rack, rack_dof = -1.0, -1.0
    if axle.is_steered:
        joint = find(model, mujoco.mjtObj.mjOBJ_JOINT, "rack")
        rack, rack_dof = float(model.jnt_qposadr[joint]), float(model.jnt_dofadr[joint])
    stiffness, damping = np.zeros((5, 5)), np.zeros((5, 5))
    for number in range(len(COORDINATES)):
        tendon = find(model, mujoco.mjtObj.mjOBJ_TENDON, f"{corner}_{number}{GUIDE}")
        arms = tendon_arms(model, f"{corner}_{number}{GUIDE}")
        along = _mirror(side) * [arms[f"{corner}_{name}"] for name in COORDINATES]
        stiffness += model.tendon_stiffness[tendon] * np.outer(along, along)
        damping += model.tendon_damping[tendon] * np.outer(along, along)
    by_travel, by_rack = _slopes(axle)
    return fb.filled(
        fb.GUIDE,
        qpos=qpos,
        dof=dof,
        side=side,
        rack=rack,
        rack_dof=rack_dof,
        travel_table=tables[0],
        rack_table=tables[1],
        stiffness=stiffness.ravel(),
        # The engine's step is implicit in its tendons, which is a damping of step times stiffness along them. Where a
        # curve is no longer as steep as in the design position, the difference would brake the wheel's travel: it is
        # taken along.
        damping=(damping + model.opt.timestep * stiffness).ravel(),
        square=axle.hardening_square,
        hardening=np.ravel(axle.hardening),
        travel_slope=by_travel,
        rack_slope=by_rack,
    )


def _unsprung_mass(model: mujoco.MjModel, corner: str) -> NDArray[np.float64]:
    """Inertia that a fast motion of the five guided coordinates meets, all else free to move; left wheel, shape (5, 5).

    A wheel that turns on its bearing takes no part in the rotation of its knuckle in side view.
    """
    dofs = [int(model.jnt_dofadr[model.joint(f"{corner}_{name}").id]) for name in COORDINATES]
    data, full = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, full)
    mirror = _mirror(_side(corner))
    return np.linalg.inv(np.linalg.inv(full)[np.ix_(dofs, dofs)]) * np.outer(mirror, mirror)
