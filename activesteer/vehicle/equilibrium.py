"""Static ride: the position in which the standing car is in equilibrium."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.errors import ModelError

_ITERATIONS: Final = 40
_DIFFERENCE: Final = 1e-7
"""Step of the finite differences [m, rad]: links of 1e7 N/m change their force by 1 N."""
_LARGEST_STEP: Final = 0.02
"""Largest change of a coordinate in one iteration [m, rad], so that stops are approached from outside."""
_ROUNDING_N: Final = 1e-4
"""Residual force below which a step without improvement ends the search [N, N m]."""
_TOLERANCE_N: Final = 1e-7
"""Residual force at which the search ends [N, N m]; weight is 1.4e4."""


def static_ride(model: mujoco.MjModel, data: mujoco.MjData, held: NDArray[np.intp]) -> None:
    """Move the car into static equilibrium, by Newton's method on the forces at rest.

    The car must stand near the equilibrium. Velocities and activations are set to zero: the tyres carry their load, and
    no lateral force except that of their own asymmetry.

    Args:
        model: The model.
        data: Its state; `qpos` is the first guess and becomes the result.
        held: Fixed degrees of freedom: position and heading on the road, rotation of the wheels.

    Raises:
        ModelError: no equilibrium was found.
    """
    free = np.setdiff1d(np.arange(model.nv), held)
    data.qvel[:] = 0.0
    if model.na:
        data.act[:] = 0.0
    residual = _residual(model, data, free)
    for _ in range(_ITERATIONS):
        if np.abs(residual).max() < _TOLERANCE_N:
            return
        start = data.qpos.copy()
        stiffness = np.empty((free.size, free.size))
        move = np.zeros(model.nv)
        for column, dof in enumerate(free):
            move[:] = 0.0
            move[dof] = _DIFFERENCE
            mujoco.mj_integratePos(model, data.qpos, move, 1.0)
            stiffness[:, column] = (_residual(model, data, free) - residual) / _DIFFERENCE
            data.qpos[:] = start
        try:
            step = np.linalg.lstsq(stiffness, -residual, rcond=None)[0]
        except np.linalg.LinAlgError as reason:
            bad = free[~np.isfinite(residual + stiffness.sum(axis=1))]
            joint = model.joint(int(model.dof_jntid[bad[0]])).name if bad.size else "unknown"
            raise ModelError(f"no static equilibrium: the force at joint {joint!r} is not finite") from reason
        largest = np.abs(step).max()
        step *= min(1.0, _LARGEST_STEP / largest) if largest > 0.0 else 0.0
        move[:] = 0.0
        move[free] = step
        mujoco.mj_integratePos(model, data.qpos, move, 1.0)
        smaller = _residual(model, data, free)
        if np.abs(residual).max() < _ROUNDING_N and (
            largest < 1e-12 or np.abs(smaller).max() >= np.abs(residual).max()
        ):
            # Only rounding is left; no step improves the result.
            return
        residual = smaller
    worst = int(free[np.abs(residual).argmax()])
    joint = model.joint(int(model.dof_jntid[worst])).name
    raise ModelError(
        f"no static equilibrium found in {_ITERATIONS} iterations: {np.abs(residual).max():.3g} N (or N m) remain at "
        f"joint {joint!r}; are the springs' free lengths right for the car's weight?",
        value=joint,
    )


def _residual(model: mujoco.MjModel, data: mujoco.MjData, free: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the generalised force that is not balanced, at rest, shape (free.size,)."""
    mujoco.mj_forward(model, data)
    return data.qfrc_smooth[free].copy()
