"""A diverged run, and objects that must not be copied because they hold addresses of native memory."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from typing import Any, NoReturn

import mujoco
import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ParameterError, SimulationDiverged
from activesteer.vehicle.native_step import FASTEST_MPS
from activesteer.vehicle.step_bindings import CARRIED_OUT, COMMANDS, engine_arrays


@contextlib.contextmanager
def engine_warnings_held() -> Iterator[None]:
    """Leave the engine's warnings to `Vehicle.check`. By default it writes them to a file in the user's folder.

    A handler that another part of the program has installed stays in force.
    """
    if mujoco.get_mju_user_warning() is not None:
        yield
        return
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(None)


def raise_if_diverged(model: mujoco.MjModel, data: mujoco.MjData, commands: Array, speed_mps: float) -> None:
    """Look for warnings of the engine and for values that are not finite, commands first."""
    for name in CARRIED_OUT:
        value = commands[COMMANDS.index(name)]
        if not math.isfinite(value):
            raise SimulationDiverged(f"the command {name} is {value:g} at {data.time:.3f} s", value=name)
    for kind, warning in enumerate(data.warning):
        if warning.number:
            text = mujoco.mju_warningText(kind, warning.lastinfo)
            raise SimulationDiverged(f"MuJoCo warns at {data.time:.3f} s: {text}", value=mujoco.mjtWarning(kind))
    if not np.isfinite(data.qpos).all() or not np.isfinite(data.qvel).all():
        bad = np.flatnonzero(~np.isfinite(data.qvel))
        joints = sorted({model.joint(int(model.dof_jntid[dof])).name for dof in bad})
        raise SimulationDiverged(f"the state is not finite at {data.time:.3f} s; joints: {', '.join(joints)}")
    if not np.isfinite(data.act).all():
        raise SimulationDiverged(f"an activation (slip of a tyre, angle of a servo) is not finite at {data.time:.3f} s")
    if not -FASTEST_MPS < speed_mps < FASTEST_MPS:
        raise SimulationDiverged(f"the speed is {speed_mps:g} m/s at {data.time:.3f} s")
    for name, live in engine_arrays(data).items():
        if not np.isfinite(live).all():
            raise SimulationDiverged(f"the recorded {name} is not finite at {data.time:.3f} s", value=name)


class Uncopyable:
    """Base of objects that can be neither copied nor pickled."""

    def _refuse(self, *_: Any) -> NoReturn:
        raise ParameterError(
            f"a {type(self).__name__} holds native memory and cannot be copied or pickled; copy the Simulation "
            "(Simulation.copy, copy.deepcopy, pickle)"
        )

    __copy__ = __deepcopy__ = __reduce_ex__ = _refuse
