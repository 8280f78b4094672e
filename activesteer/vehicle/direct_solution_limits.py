"""Which models the direct solution of the engine's implicit step covers; see `implicit_plan`.

All features of MuJoCo 4.0's models, and who computes a step that has them. "Engine" is the engine's own `mj_step`.

| Feature | Step |
| --- | --- |
| bodies, masses, armature, gravity, gravity compensation, mocap bodies | direct: the engine's M and bias force |
| a free body without jointed descendants | engine: solves it again with gyroscopic terms |
| joints of all types; damping of a joint | direct; negative damping counts in the force only, as in the engine |
| spring, plasticity, dry friction or damping polynomial of a joint | engine |
| limit of a hinge or slide | direct while the limit is open, engine while the limit is touched |
| limit of a ball joint | engine |
| force limit of the actuators at a joint (`actuatorfrcrange`) | engine |
| tendons over sites, geoms, pulleys and joints: spring (polynomial, dead band), linear damping | direct |
| limit, armature, friction, plasticity or damping polynomial of a tendon | engine |
| actuators of fixed gain without bias, with any transmission, dynamics or delay | direct |
| position and velocity servos at a hinge or slide, with a force limit | direct |
| servos at other transmissions, other gains and biases, passive damping of an actuator | engine |
| force on a body (`xfrc_applied`) | engine while the force acts |
| force on a joint (`qfrc_applied`) | direct |
| equality constraints, contacts, flexes, plugins, fluid forces | engine |
| sensors of limits and of potential energy | engine: they read what only its own step computes |
| all other sensors, also with delay | direct |
| solver `PGS`, an integrator other than `discrete`, enable flags, disabled groups of actuators | engine |
| disable flags | direct with contact and eulerdamp, which must be set, autoreset and filterparent; otherwise engine |
| `mjcb_control` of a user | engine |
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

_REQUIRED: Final = int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
_PERMITTED: Final = _REQUIRED | int(mujoco.mjtDisableBit.mjDSBL_AUTORESET | mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
_OWN_SENSORS: Final = [
    int(getattr(mujoco.mjtSensor, f"mjSENS_{name}"))
    for name in (
        "JOINTLIMITPOS", "JOINTLIMITVEL", "JOINTLIMITFRC", "TENDONLIMITPOS", "TENDONLIMITVEL", "TENDONLIMITFRC",
        "E_POTENTIAL",
    )
]  # fmt: skip

OPTIONS: Final = (
    "timestep", "integrator", "solver", "density", "viscosity", "enableflags", "disableflags", "disableactuator",
)  # fmt: skip
"""Options of the engine that decide whether and how the direct solution steps."""
ARRAYS: Final = (
    "jnt_type", "jnt_stiffness", "jnt_stiffnesspoly", "jnt_limited", "jnt_actfrclimited", "dof_dampingpoly",
    "dof_frictionloss", "tendon_dampingpoly", "tendon_frictionloss", "tendon_limited", "tendon_armature",
    "actuator_gaintype", "actuator_biastype", "actuator_outnum", "actuator_trntype", "actuator_trnid",
    "actuator_damping", "actuator_dampingpoly", "sensor_type", "sensor_needstage", "sensor_objid",
)  # fmt: skip
"""Arrays of the model that do so, but for the sizes and the tree of joints, which cannot change."""


def servos(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Return the actuators whose force depends on their length or velocity."""
    return np.flatnonzero(model.actuator_biastype == int(mujoco.mjtBias.mjBIAS_AFFINE))


def _hinged(model: mujoco.MjModel) -> NDArray[np.bool_]:
    return np.isin(model.jnt_type, (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE))


def _free_alone(model: mujoco.MjModel) -> bool:
    free = model.jnt_bodyid[model.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE)]
    return bool((model.tree_dofnum[model.body_treeid[free]] == 6).any())


def _other_servos(model: mujoco.MjModel) -> bool:
    at_joints = model.actuator_trntype[servos(model)] == int(mujoco.mjtTrn.mjTRN_JOINT)
    joints = model.actuator_trnid[servos(model), 0]
    return not (at_joints.all() and _hinged(model)[joints].all())


_HANDED_OVER: Final[dict[str, Callable[[mujoco.MjModel], Any]]] = {
    "integrator": lambda m: m.opt.integrator != int(mujoco.mjtIntegrator.mjINT_DISCRETE),
    "solver PGS": lambda m: m.opt.solver == int(mujoco.mjtSolver.mjSOL_PGS),
    "contacts or eulerdamp": lambda m: m.opt.disableflags & _REQUIRED != _REQUIRED,
    "disable flags": lambda m: m.opt.disableflags & ~_PERMITTED,
    "enable flags": lambda m: m.opt.enableflags,
    "disabled actuators": lambda m: m.opt.disableactuator,
    "fluid": lambda m: m.opt.density or m.opt.viscosity,
    "equality constraints, flexes, plugins or plasticity": lambda m: m.neq or m.nflex or m.nplugin or m.nplastic,
    "free body alone": _free_alone,
    "spring of a joint": lambda m: m.jnt_stiffness.any() or m.jnt_stiffnesspoly.any(),
    "damping polynomial of a joint": lambda m: m.dof_dampingpoly.any(),
    "dry friction": lambda m: m.dof_frictionloss.any() or m.tendon_frictionloss.any(),
    "limit of a ball joint": lambda m: (m.jnt_limited.astype(bool) & ~_hinged(m)).any(),
    "actuatorfrcrange of a joint": lambda m: m.jnt_actfrclimited.any(),
    "damping polynomial of a tendon": lambda m: m.tendon_dampingpoly.any(),
    "limit of a tendon": lambda m: m.tendon_limited.any(),
    "armature of a tendon": lambda m: m.tendon_armature.any(),
    "damping of an actuator": lambda m: m.actuator_damping.any() or m.actuator_dampingpoly.any(),
    "gain of an actuator": lambda m: (m.actuator_gaintype != int(mujoco.mjtGain.mjGAIN_FIXED)).any(),
    "bias of an actuator": lambda m: (m.actuator_biastype > int(mujoco.mjtBias.mjBIAS_AFFINE)).any(),
    "several outputs of an actuator": lambda m: (m.actuator_outnum != 1).any(),
    "servo elsewhere than at a hinge or slide": _other_servos,
    "sensor of limits or potential energy": lambda m: np.isin(m.sensor_type, _OWN_SENSORS).any(),
}  # fmt: skip


def handed_over(model: mujoco.MjModel) -> list[str]:
    """Return the features of a model for which the engine's own step is needed; empty if the direct solution steps."""
    found = [name for name, has in _HANDED_OVER.items() if has(model)]
    return found if mujoco.get_mjcb_control() is None else [*found, "mjcb_control"]
