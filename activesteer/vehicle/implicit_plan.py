"""What the direct solution of the engine's implicit step needs to know of a car: `IMPLICIT_PLAN`.

The engine finds the accelerations of a step from (M + h D + h^2 K) a = f - h K v: M is the mass matrix, D and K are
damping and stiffness of tendons, servos and joints (integrator `discrete`). It factorises M along the tree of joints
and finds the rest by conjugate gradients, as it must for any model. In a car the springs join hardly more degrees of
freedom than M does already: eliminated in the right order, the whole matrix is factorised exactly for the price of M
alone. The order, and what fills the matrix, follow from the model and are found once (minimum degree: Tinney and Walker
1967).
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from mujoco import _functions
from numpy.typing import NDArray

_STAGES: Final = (
    "mj_step", "mj_fwdKinematics", "mj_makeM", "mj_transmission", "mj_sensorPos", "mj_fwdVelocity", "mj_sensorVel",
    "mj_fwdActuation", "mj_checkAcc", "mj_rnePostConstraint", "mj_sensorAcc", "mj_Euler",
)  # fmt: skip
"""The engine's own functions that a step consists of, and the whole step."""
_OF_MODEL: Final = (
    "tendon_stiffness", "tendon_stiffnesspoly", "tendon_damping", "tendon_lengthspring", "dof_damping", "jnt_range",
    "jnt_margin", "actuator_biasprm", "actuator_gear", "actuator_forcelimited", "actuator_forcerange",
)  # fmt: skip
_OF_DATA: Final = (
    "M", "ten_J", "ten_length", "ten_velocity", "actuator_velocity", "actuator_force", "qfrc_passive", "qfrc_bias",
    "qfrc_applied", "qfrc_actuator", "qfrc_smooth", "qacc_smooth", "qacc", "qpos", "qvel", "xfrc_applied",
    "cdof", "cdof_dot", "cacc",
)  # fmt: skip
"""The engine's arrays that the solution reads and writes where they lie: what changes in them counts at once."""
_TABLES: Final = (
    "place", "row", "others", "column", "update", "mass", "diagonal", "tendon_columns", "tendon_entry", "tendon_place",
    "tendon_term", "servo", "servo_place", "limited", "limited_qpos",
)  # fmt: skip
"""Tables of int32, each with its length as `n_...`. A place is that of a degree of freedom in the order of elimination.

place: Of each degree of freedom.
row, others: Of each place, where its row of the factor starts, the diagonal first, and how many come behind that.
column: Of each entry of the factor, its place.
update: In the order of elimination, the entries that change.
mass: Of each element of M, its entry.
diagonal: Of each degree of freedom, its entry.
tendon_columns: Of each tendon, how many degrees of freedom change its length.
tendon_entry, tendon_place, tendon_term: Their elements in `ten_J`, their places, and the entries of all pairs of them.
servo, servo_place: Actuators whose force depends on their joint, and its place.
limited, limited_qpos: Joints with a limit, and their elements in `qpos`.
"""
_WORDS: Final = ("model", "data", *_STAGES, *_OF_MODEL, *_OF_DATA, *_TABLES, *(f"n_{name}" for name in _TABLES))
IMPLICIT_PLAN: Final = np.dtype(
    (
        np.record,
        [
            ("direct", np.intp),
            *((name, np.intp) for name in _WORDS),
            *((name, np.intp) for name in ("n_mass_elements", "n_forces", "factor", "n_factor", "right_side")),
            *((name, np.intp) for name in ("gravity", "sensed_body", "first_dof", "n_dofs")),
            ("timestep_s", np.float64),
        ],
    )
)
"""direct: 1 where the direct solution knows everything in the model, 0 where the engine's own step must do.
sensed_body, first_dof, n_dofs: The only body whose acceleration sensors feel, and what moves it; 0 where the engine
must find the accelerations of all bodies, and the forces between them."""

_PERMITTED: Final = int(
    mujoco.mjtDisableBit.mjDSBL_CONTACT
    | mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    | mujoco.mjtDisableBit.mjDSBL_AUTORESET
    | mujoco.mjtDisableBit.mjDSBL_FILTERPARENT
)


class ImplicitPlan(NamedTuple):
    """A plan and the memory that it points to.

    Attributes:
        plan: `IMPLICIT_PLAN`, shape (1,).
        memory: What must live as long.
    """

    plan: NDArray[Any]
    memory: tuple[NDArray[Any], ...]


def implicit_plan(model: mujoco.MjModel, data: mujoco.MjData) -> ImplicitPlan:
    """Finds the order of elimination and looks up all addresses.

    Args:
        model: The car.
        data: Its state; both must outlive the plan.
    """
    plan = np.zeros(1, IMPLICIT_PLAN)
    engine = ctypes.CDLL(_functions.__file__)
    for name in _STAGES:
        plan[name] = ctypes.cast(getattr(engine, name), ctypes.c_void_p).value
    plan["model"], plan["data"] = model._address, data._address
    for names, source in ((_OF_MODEL, model), (_OF_DATA, data)):
        for name in names:
            plan[name] = getattr(source, name).ctypes.data
    plan["timestep_s"], plan["n_mass_elements"], plan["n_forces"] = model.opt.timestep, model.nC, data.xfrc_applied.size
    if not knows(model):
        return ImplicitPlan(plan, ())
    tables, size = _tables(model)
    memory = tuple(np.array(tables[name], np.int32) for name in _TABLES)
    for name, table in zip(_TABLES, memory, strict=True):
        plan[name], plan[f"n_{name}"] = table.ctypes.data, table.size
    factor, right_side = np.zeros(size), np.zeros(model.nv)
    plan["factor"], plan["n_factor"], plan["right_side"] = factor.ctypes.data, size, right_side.ctypes.data
    plan["direct"], plan["gravity"] = 1, model.opt.gravity.ctypes.data
    if body := _sensed_body(model):
        plan["sensed_body"], plan["first_dof"], plan["n_dofs"] = body, model.body_dofadr[body], model.body_dofnum[body]
    return ImplicitPlan(plan, (*memory, factor, right_side))


def drop_metric(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Has the engine forget what it prepared for its own solution; else it would renew a part of that in every step.

    Args:
        model: A car that steps with a plan.
        data: Its state; positions and what follows from them are as the engine finds them.
    """
    integrator = model.opt.integrator
    model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_EULER)
    mujoco.mj_fwdPosition(model, data)
    model.opt.integrator = integrator


def knows(model: mujoco.MjModel) -> bool:
    """Whether there is nothing in a model that the direct solution does not know.

    It knows what the cars of the package have: tendons with springs and dampers, damping of joints, servos at joints,
    limits of joints, the latter as something that the engine itself sees to when one is touched.
    """
    servos = _servos(model)
    hinged = np.isin(model.jnt_type, (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE))
    at_joints = model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)
    fixed_gain = model.actuator_gaintype == int(mujoco.mjtGain.mjGAIN_FIXED)
    plain_bias = np.isin(model.actuator_biastype, (mujoco.mjtBias.mjBIAS_NONE, mujoco.mjtBias.mjBIAS_AFFINE))
    unknown = (
        model.jnt_stiffness, model.jnt_stiffnesspoly, model.dof_dampingpoly, model.tendon_dampingpoly,
        model.dof_frictionloss, model.tendon_frictionloss, model.tendon_limited, model.tendon_armature,
        model.actuator_damping, model.actuator_dampingpoly, model.jnt_limited.astype(bool) & ~hinged,
        model.opt.density, model.opt.viscosity, model.opt.enableflags, model.opt.disableactuator,
        model.opt.disableflags & ~_PERMITTED, model.neq, model.nflex, model.nplugin,
    )  # fmt: skip
    return (
        model.opt.integrator == int(mujoco.mjtIntegrator.mjINT_DISCRETE)
        and model.opt.solver != int(mujoco.mjtSolver.mjSOL_PGS)
        and bool(model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CONTACT))
        and bool(model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP))
        and not any(np.any(value) for value in unknown)
        and bool(fixed_gain.all() and plain_bias.all() and (model.actuator_outnum == 1).all())
        and bool(at_joints[servos].all() and hinged[model.actuator_trnid[servos, 0]].all())
    )


def _sensed_body(model: mujoco.MjModel) -> int:
    """The only body whose acceleration is sensed, if it hangs on nothing but the world, and no force is; else 0."""
    late = np.flatnonzero(model.sensor_needstage == int(mujoco.mjtStage.mjSTAGE_ACC))
    if (model.sensor_type[late] != int(mujoco.mjtSensor.mjSENS_ACCELEROMETER)).any():
        return 0
    bodies = {int(body) for body in model.site_bodyid[model.sensor_objid[late]]}
    body = bodies.pop() if bodies else 0
    return 0 if bodies or model.body_parentid[body] else body


def _servos(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Actuators whose force depends on where they are, or how fast."""
    return np.flatnonzero(model.actuator_biastype == int(mujoco.mjtBias.mjBIAS_AFFINE))


def _tables(model: mujoco.MjModel) -> tuple[dict[str, Sequence[int] | NDArray[Any]], int]:
    """The tables by name, and how many entries the factor has."""
    tendons = [_tendon_entries(model, tendon) for tendon in range(model.ntendon)]
    shared = [model.ten_J_colind[entries] for entries in tendons]
    masses = [_mass_columns(model, dof) for dof in range(model.nv)]
    order, later = _elimination([np.append(columns, dof) for dof, columns in enumerate(masses)] + shared, model.nv)
    place = np.argsort(order)
    rows = [np.sort(place[dofs]) for dofs in later]
    starts = np.cumsum([0, *(1 + len(row) for row in rows)])
    entry = np.full((model.nv, model.nv), -1)
    for first, (start, row) in enumerate(zip(starts[:-1], rows, strict=True)):
        entry[first, first] = start
        entry[first, row] = entry[row, first] = start + 1 + np.arange(len(row))
    upper = [np.triu_indices(len(columns)) for columns in shared]
    servos = _servos(model)
    limited = np.flatnonzero(model.jnt_limited)
    return {
        "place": place,
        "row": starts[:-1],
        "others": [len(row) for row in rows],
        "column": np.concatenate([np.append(first, row) for first, row in enumerate(rows)]),
        "update": np.concatenate([entry[np.ix_(row, row)][np.triu_indices(len(row))] for row in rows]),
        "mass": np.concatenate([entry[place[dof], place[columns]] for dof, columns in enumerate(masses)]),
        "diagonal": entry[place, place],
        "tendon_columns": [len(columns) for columns in shared],
        "tendon_entry": np.concatenate(tendons),
        "tendon_place": np.concatenate([place[columns] for columns in shared]),
        "tendon_term": np.concatenate(
            [entry[place[c[i]], place[c[j]]] for c, (i, j) in zip(shared, upper, strict=True)]
        ),
        "servo": servos,
        "servo_place": place[model.jnt_dofadr[model.actuator_trnid[servos, 0]]],
        "limited": limited,
        "limited_qpos": model.jnt_qposadr[limited],
    }, int(starts[-1])  # fmt: skip


def _mass_columns(model: mujoco.MjModel, dof: int) -> NDArray[Any]:
    start = model.M_rowadr[dof]
    return model.M_colind[start : start + model.M_rownnz[dof]]


def _tendon_entries(model: mujoco.MjModel, tendon: int) -> NDArray[np.intp]:
    """The elements of `ten_J` of a tendon that are not always zero.

    The engine keeps those of all joints between its ends and the world; what moves both ends as one body, as the
    motion of the chassis does, leaves the length of the tendon as it is.
    """
    start = int(model.ten_J_rowadr[tendon])
    entries = np.arange(start, start + model.ten_J_rownnz[tendon])
    first = model.tendon_adr[tendon]
    parts = range(first, first + model.tendon_num[tendon])
    if any(model.wrap_type[part] != int(mujoco.mjtWrap.mjWRAP_SITE) for part in parts):
        return entries
    chains = [set(_chain(model, int(model.site_bodyid[model.wrap_objid[part]]))) for part in parts]
    common = set.intersection(*chains)
    return np.array([entry for entry in entries if model.ten_J_colind[entry] not in common], np.intp)


def _chain(model: mujoco.MjModel, body: int) -> list[int]:
    """The degrees of freedom that move a body."""
    dofs: list[int] = []
    while body:
        dofs.extend(range(model.body_dofadr[body], model.body_dofadr[body] + model.body_dofnum[body]))
        body = int(model.body_parentid[body])
    return dofs


def _elimination(cliques: Sequence[NDArray[Any]], size: int) -> tuple[NDArray[np.intp], list[NDArray[np.intp]]]:
    """An order of elimination that fills the matrix little: always what has the fewest neighbours left.

    Args:
        cliques: Sets of unknowns that meet in the matrix, each with each.
        size: How many unknowns there are.

    Returns:
        The unknowns in their order, and for each of them those that come later and meet it.
    """
    meets = np.eye(size, dtype=bool)
    for clique in cliques:
        meets[np.ix_(clique, clique)] = True
    left, order, later = np.ones(size, bool), [], []
    for _ in range(size):
        neighbours = np.where(left, (meets & left).sum(1), size + 1)
        # Of several the last: the chassis, with which everything meets, comes first in the engine's order.
        unknown = size - 1 - int(np.argmin(neighbours[::-1]))
        left[unknown] = False
        rest = np.flatnonzero(meets[unknown] & left)
        meets[np.ix_(rest, rest)] = True
        order.append(unknown)
        later.append(rest)
    return np.array(order), later
