"""Steer angle of a rear wheel over the length of its toe link, solved from the model's own hardpoints.

The chassis is fixed, and the damper and all other links keep their lengths. For each length of the toe link, Newton's
method finds the position of the corner in which no link carries a force.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.errors import ModelError

DEGREE: Final = 5
"""Degree of the polynomials; they have no constant term."""
_POINTS: Final = 15
_DIFFERENCE: Final = 1e-7
_ITERATIONS: Final = 30
_TOLERANCE_M: Final = 1e-10
_BEYOND: Final = 1.05
"""Range of the solution over the limit."""
_FIT: Final = 2e-3
"""Largest error of the polynomials, over the range."""


class ToeLinkMap(NamedTuple):
    """Steer angle and length of a toe link, both from the design position.

    Attributes:
        travel_of_angle: Coefficients of the change of length over the angle, its square ... [m], shape (DEGREE,).
        angle_of_travel: Coefficients of the inverse map [rad].
        travel_m: Largest change of length within the limit, to either side [m].
    """

    travel_of_angle: NDArray[np.float64]
    angle_of_travel: NDArray[np.float64]
    travel_m: float

    def mirrored(self) -> ToeLinkMap:
        """Return the map of the other side, where angles have the opposite sign."""
        signs = np.array([(-1.0) ** (power + 1) for power in range(DEGREE)])
        # travel(-angle), and minus the angle that belongs to a travel.
        return ToeLinkMap(self.travel_of_angle * signs, -self.angle_of_travel, self.travel_m)


def evaluated(coefficients: NDArray[np.float64], x: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Evaluate a polynomial without a constant term."""
    return np.asarray(np.polynomial.polynomial.polyval(x, np.concatenate(([0.0], coefficients))), dtype=np.float64)


def toe_link_map(model: mujoco.MjModel, corner: str, link: str, limit_rad: float) -> ToeLinkMap:
    """Solve the map of a corner.

    Args:
        model: The car, compiled, without a hinge between knuckle and wheel.
        corner: `rl` or `rr`.
        link: Name of the tendon of the toe link.
        limit_rad: Largest angle on either side [rad].

    Returns:
        The map.

    Raises:
        ModelError: the link does not steer the wheel so far.
    """
    solver = _Corner(model, corner, link)
    slope = (solver.angle(1e-4) - solver.angle(-1e-4)) / 2e-4
    if abs(slope) < 0.5:
        raise ModelError(f"the tendon {link!r} does not steer its wheel: {slope:.3g} rad/m, at least 0.5 are needed")
    reach = _BEYOND * limit_rad / abs(slope)
    minimum = 0.0
    for _ in range(4):
        travels = reach * np.linspace(-1.0, 1.0, _POINTS)
        angles = solver.angles(travels)
        minimum = min(abs(angles[0]), abs(angles[-1]))
        if minimum >= limit_rad and (np.diff(angles) * slope > 0.0).all():
            break
        reach *= 1.02 * limit_rad / max(minimum, 0.5 * limit_rad)
    else:
        raise ModelError(
            f"the tendon {link!r} steers its wheel by {np.degrees(minimum):.2g} deg at most; "
            f"{np.degrees(limit_rad):.3g} deg are demanded (rear_actuator.limit_deg)"
        )
    ways = [_fit(angles, travels), _fit(travels, angles)]
    for coefficients, x, y in zip(ways, (angles, travels), (travels, angles), strict=True):
        if np.abs(evaluated(coefficients, x) - y).max() > _FIT * np.ptp(y):
            raise ModelError(f"the tendon {link!r}: steer angle over length is not a smooth curve up to the limit")
    ends = np.abs(evaluated(ways[0], np.array([-limit_rad, limit_rad])))
    return ToeLinkMap(ways[0], ways[1], float(ends.max()))


def _fit(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    scale = np.abs(x).max()
    powers = np.arange(1, DEGREE + 1)
    columns = (x[:, None] / scale) ** powers
    return np.linalg.lstsq(columns, y, rcond=None)[0] / scale**powers


class _Corner:
    """The coordinates of a corner and the lengths that constrain them."""

    def __init__(self, model: mujoco.MjModel, corner: str, link: str) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        spin = model.joint(f"{corner}_spin").id
        self._dofs = [
            dof
            for dof in range(model.nv)
            if model.joint(int(model.dof_jntid[dof])).name.startswith(f"{corner}_") and model.dof_jntid[dof] != spin
        ]
        self._tendons, weights = [], []
        for tendon in range(model.ntendon):
            name = model.tendon(tendon).name
            if not name.startswith(f"{corner}_") or name.endswith(("_spring", "_viewer_damper")):
                continue
            if name.endswith("_damper") or model.tendon_stiffness[tendon] > 0.0:
                self._tendons.append(tendon)
                weights.append(1.0)
        self._link = self._tendons.index(model.tendon(link).id)
        self._wheel, self._chassis = model.body(f"{corner}_wheel").id, model.body("chassis").id
        self._restart()
        self._lengths = self._data.ten_length[self._tendons].copy()
        self._design_rad = self._steer()

    def _restart(self) -> None:
        mujoco.mj_resetData(self._model, self._data)
        mujoco.mj_fwdPosition(self._model, self._data)

    def _steer(self) -> float:
        data = self._data
        axis = data.xmat[self._chassis].reshape(3, 3).T @ data.xmat[self._wheel].reshape(3, 3)[:, 1]
        return float(np.arctan2(-axis[0], axis[1]))

    def _missing(self, travel_m: float) -> NDArray[np.float64]:
        mujoco.mj_fwdPosition(self._model, self._data)
        missing = self._data.ten_length[self._tendons] - self._lengths
        missing[self._link] -= travel_m
        return missing

    def angles(self, travels_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the steer angles at several lengths [rad]; each search starts from the previous solution."""
        middle = len(travels_m) // 2
        outwards = [self._along(travels_m[middle:]), self._along(travels_m[middle::-1])]
        return np.concatenate([outwards[1][:0:-1], outwards[0]])

    def _along(self, travels_m: NDArray[np.float64]) -> list[float]:
        self._restart()
        return [self._solved(float(travel)) for travel in travels_m]

    def angle(self, travel_m: float) -> float:
        """Return the steer angle relative to the design position, left positive [rad]."""
        self._restart()
        return self._solved(travel_m)

    def _solved(self, travel_m: float) -> float:
        model, data = self._model, self._data
        move = np.zeros(model.nv)
        missing = self._missing(travel_m)
        for _ in range(_ITERATIONS):
            if np.abs(missing).max() < _TOLERANCE_M:
                return self._steer() - self._design_rad
            start = data.qpos.copy()
            slopes = np.empty((len(self._tendons), len(self._dofs)))
            for column, dof in enumerate(self._dofs):
                move[:] = 0.0
                move[dof] = _DIFFERENCE
                mujoco.mj_integratePos(model, data.qpos, move, 1.0)
                slopes[:, column] = (self._missing(travel_m) - missing) / _DIFFERENCE
                data.qpos[:] = start
            move[:] = 0.0
            move[self._dofs] = np.linalg.lstsq(slopes, -missing, rcond=1e-9)[0]
            mujoco.mj_integratePos(model, data.qpos, move, 1.0)
            missing = self._missing(travel_m)
        raise ModelError(f"the corner has no position in which its toe link is longer by {1e3 * travel_m:.3g} mm")
