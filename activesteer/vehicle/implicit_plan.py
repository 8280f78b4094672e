"""Plan of the implicit solution, and detection of changes in the engine's data.

All features of MuJoCo 4.0's models, and which solution computes a step that has them. "Engine" is the engine's own
`mj_step`.

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

The engine finds the accelerations of a step from (M + h D + h^2 K) a = f - h K v: M is the mass matrix, D and K are
damping and stiffness of tendons, servos and joints (integrator `discrete`). It factorises M along the tree of joints
and finds the rest by conjugate gradients, which suits any model. In a car the springs join hardly more degrees of
freedom than M already does. With the right order of elimination, factorising the whole matrix exactly costs no more
than factorising M. The order and the pattern of the matrix follow from the model and are found once (minimum degree:
Tinney and Walker 1967).

The direct solution is what the engine's iteration converges to. From the same state, both give the same accelerations
within 1e-14 of the largest one (tolerance of the engine 1e-14). Over many steps the difference grows to that of two
runs of the engine whose first positions differ in the last digit: 7e-10 m/s^2 for the compact at standstill, 2e-8 for
the sedan. The reason is the last digit of a link's length (6e-17 m of 0.5 m). Times the stiffest link (1e7 N/m in the
compact, 1e9 N/m in the sedan) it is a force of 5e-10 N or 6e-8 N. At speed the same absolute difference is smaller
relative to the accelerations.
"""

from __future__ import annotations

import ctypes
import operator
from collections.abc import Callable, Sequence
from typing import Any, Final

import mujoco
import numpy as np
from mujoco import _functions
from numba import carray, types
from numpy.typing import NDArray

from activesteer.errors import ModelError
from activesteer.native.compilation import compiled_call
from activesteer.native.memory import f64_pointer, pointer_to, word_pointer
from activesteer.native.records import numbers_type

UNCHANGED: Final = 0
CHANGED: Final = 1
NEGATIVE: Final = 2
_bytes: Final = pointer_to(types.uint8)


@compiled_call(types.intp, types.intp, types.intp, types.intp, types.intp, others_run=False)
def watch(copies, n_copies, positive, n_positive):
    """Compare arrays with their copies, and check for negative numbers."""
    changed = negative = False
    rows = word_pointer(copies)
    for index in range(n_copies):
        size = rows[3 * index + 2]
        now, then = carray(_bytes(rows[3 * index]), (size,)), carray(_bytes(rows[3 * index + 1]), (size,))
        for place in range(size):
            changed |= now[place] != then[place]
    rows = word_pointer(positive)
    for index in range(n_positive):
        values = f64_pointer(rows[2 * index])
        for place in range(rows[2 * index + 1]):
            negative |= values[place] < 0.0
    return 2 if negative else 1 if changed else 0


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
"""Arrays of the model that decide this, except the sizes and the tree of joints, which cannot change."""


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
    """Return the features of a model that only the engine's own step supports, empty if there are none."""
    found = [name for name, has in _HANDED_OVER.items() if has(model)]
    return found if mujoco.get_mjcb_control() is None else [*found, "mjcb_control"]


_STAGES: Final = (
    "mj_step", "mj_fwdKinematics", "mj_makeM", "mj_transmission", "mj_sensorPos", "mj_fwdVelocity", "mj_sensorVel",
    "mj_fwdActuation", "mj_checkAcc", "mj_rnePostConstraint", "mj_sensorAcc", "mj_Euler",
)  # fmt: skip
"""The engine's own functions that make up a step, and the whole step."""
_OF_MODEL: Final = (
    "tendon_stiffness", "tendon_stiffnesspoly", "tendon_damping", "tendon_lengthspring", "dof_damping", "jnt_range",
    "jnt_margin", "actuator_biasprm", "actuator_gear", "actuator_forcelimited", "actuator_forcerange",
)  # fmt: skip
_OF_DATA: Final = (
    "M", "ten_J", "ten_length", "ten_velocity", "actuator_velocity", "actuator_force", "qfrc_passive", "qfrc_bias",
    "qfrc_applied", "qfrc_actuator", "qfrc_smooth", "qacc_smooth", "qacc", "qpos", "qvel", "xfrc_applied",
    "cdof", "cdof_dot", "cacc",
)  # fmt: skip
"""The engine's arrays that the solution reads and writes in place: a change in them counts at once."""
_POSITIVE: Final = ("body_mass", "body_inertia", "dof_armature")
_TABLES: Final = (
    "place", "row", "others", "column", "update", "mass", "diagonal", "tendon_columns", "tendon_entry", "tendon_place",
    "tendon_term", "servo", "servo_place", "limited", "limited_qpos",
)  # fmt: skip
"""Tables of int32, each with its length as `n_...`. A place is the position of a degree of freedom in the elimination.

place: Place of each degree of freedom.
row, others: Start of each place's row of the factor, the diagonal first, and the number of entries behind it.
column: Place of each entry of the factor.
update: Entries that change, in the order of elimination.
mass: Entry of each element of M.
diagonal: Entry of each degree of freedom.
tendon_columns: Number of degrees of freedom that change the length of each tendon.
tendon_entry, tendon_place, tendon_term: Their elements in `ten_J`, their places, and the entries of all pairs of them.
servo, servo_place: Actuators whose force depends on their joint, and the place of that joint.
limited, limited_qpos: Joints with a limit, and their elements in `qpos`.
"""
_STRUCTURE: Final = (
    "ten_J_rowadr", "ten_J_rownnz", "ten_J_colind", "tendon_adr", "tendon_num", "wrap_type", "wrap_objid",
    "site_bodyid", "body_parentid", "body_dofadr", "body_dofnum", "M_rowadr", "M_rownnz", "M_colind",
    "actuator_biastype", "actuator_trnid", "jnt_dofadr", "jnt_limited", "jnt_qposadr",
)  # fmt: skip
"""Arrays of the model that decide the tables."""
_MAX_STRUCTURES: Final = 64
_WORDS: Final = (
    "direct", "model", "data", *_STAGES, *_OF_MODEL, *_OF_DATA, *_TABLES, *(f"n_{name}" for name in _TABLES),
    "n_mass_elements", "n_forces", "factor", "n_factor", "right_side", "gravity", "sensed_body", "first_dof", "n_dofs",
    "inertia_warning",
)  # fmt: skip
IMPLICIT_PLAN: Final = numbers_type("timestep_s", words=_WORDS)
"""direct: 1 if the direct solution covers everything in the model, 0 if the engine's own step is needed.
sensed_body, first_dof, n_dofs: The only body whose acceleration is sensed, and its degrees of freedom. 0 if the engine
must find the accelerations of all bodies, and the forces between them.
inertia_warning: Address of the engine's warning for an indefinite matrix: last information, count (int32)."""


class ImplicitPlan:
    """Plan of one car, `IMPLICIT_PLAN` at an address that stays, with the memory that it points to."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Find the order of elimination and look up all addresses."""
        self._model, self._data = model, data
        self.plan = np.zeros(1, IMPLICIT_PLAN)
        self._make()

    def _make(self) -> None:
        model, data, plan = self._model, self._data, self.plan
        engine = ctypes.CDLL(_functions.__file__)
        words: dict[str, Any] = {
            **{name: ctypes.cast(getattr(engine, name), ctypes.c_void_p).value for name in _STAGES},
            **{name: getattr(model, name).ctypes.data for name in _OF_MODEL},
            **{name: getattr(data, name).ctypes.data for name in _OF_DATA},
            "model": model._address,
            "data": data._address,
            "timestep_s": model.opt.timestep,
            "n_mass_elements": model.nC,
            "n_forces": data.xfrc_applied.size,
            "gravity": model.opt.gravity.ctypes.data,
            "inertia_warning": data.warning.lastinfo.ctypes.data + 8 * int(mujoco.mjtWarning.mjWARN_INERTIA),
            "direct": not handed_over(model),
        }
        memory: list[NDArray[Any]] = []
        if words["direct"]:
            tables, size = _known_tables(model)
            memory = [table.copy() for table in tables]
            for name, table in zip(_TABLES, memory, strict=True):
                words[name], words[f"n_{name}"] = table.ctypes.data, table.size
            factor, right_side = np.zeros(size), np.zeros(model.nv)
            words |= {"factor": factor.ctypes.data, "n_factor": size, "right_side": right_side.ctypes.data}
            memory += [factor, right_side]
            if body := _sensed_body(model):
                words |= {"sensed_body": body, "first_dof": model.body_dofadr[body], "n_dofs": model.body_dofnum[body]}
        plan[:] = 0
        for name, value in words.items():
            plan[name] = value
        self._memory = memory
        self._freeze()

    def parts(self) -> dict[str, NDArray[Any]]:
        """Return the plan and the memory that it points to, by name."""
        names = [*_TABLES, "factor", "right_side"] if self._memory else []
        return {"plan": self.plan, **{f"plan_{name}": part for name, part in zip(names, self._memory, strict=True)}}

    def _freeze(self) -> None:
        """Keep a copy of the data on which the plan depends."""
        model = self._model
        self._settings = self._current_settings()
        self._copies = [getattr(model, name).copy() for name in ARRAYS]
        rows = [
            (getattr(model, name).ctypes.data, copy.ctypes.data, copy.nbytes)
            for name, copy in zip(ARRAYS, self._copies, strict=True)
        ]
        positive = [(getattr(model, name).ctypes.data, getattr(model, name).size) for name in _POSITIVE]
        self._rows = np.array(rows, np.intp), np.array(positive, np.intp)
        self._watch = self._rows[0].ctypes.data, len(rows), self._rows[1].ctypes.data, len(positive)

    def _current_settings(self) -> tuple[Any, ...]:
        return (*_options(self._model.opt), mujoco.get_mjcb_control())

    def follow(self) -> None:
        """Renew the plan if its data have changed. Without changes, this takes two microseconds."""
        state = watch(*self._watch)
        if state == UNCHANGED and self._current_settings() == self._settings:
            return
        if state == NEGATIVE:
            name = next(name for name in _POSITIVE if (getattr(self._model, name) < 0.0).any())
            least = float(getattr(self._model, name).min())
            raise ModelError(f"{name} of the model holds {least:g}; 0 or more is needed", value=least, allowed=">= 0")
        frozen_s, now_s = float(self.plan["timestep_s"][0]), self._model.opt.timestep
        if now_s != frozen_s:
            problem = f"the time step of the model was changed from {frozen_s:g} to {now_s:g} s"
            raise ModelError(f"{problem}; build the car again with that step", value=now_s, allowed=frozen_s)
        self._make()


_options: Final = operator.attrgetter(*OPTIONS)


def drop_metric(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Remove the data that the engine prepared for its own solution, and would update in every step."""
    integrator = model.opt.integrator
    model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_EULER)
    mujoco.mj_fwdPosition(model, data)
    model.opt.integrator = integrator


def _sensed_body(model: mujoco.MjModel) -> int:
    """Return the only body with a sensed acceleration, or 0 without one."""
    late = np.flatnonzero(model.sensor_needstage == int(mujoco.mjtStage.mjSTAGE_ACC))
    if (model.sensor_type[late] != int(mujoco.mjtSensor.mjSENS_ACCELEROMETER)).any():
        return 0
    bodies = {int(body) for body in model.site_bodyid[model.sensor_objid[late]]}
    body = bodies.pop() if bodies else 0
    return 0 if bodies or model.body_parentid[body] else body


_structures: dict[bytes, tuple[list[NDArray[np.int32]], int]] = {}


def _known_tables(model: mujoco.MjModel) -> tuple[list[NDArray[np.int32]], int]:
    """Return the tables of the plan and the size of the factor, cached by structure."""
    structure = b"|".join(getattr(model, name).tobytes() for name in _STRUCTURE)
    if structure not in _structures:
        if len(_structures) >= _MAX_STRUCTURES:
            _structures.clear()
        tables, size = _tables(model)
        _structures[structure] = [np.array(tables[name], np.int32) for name in _TABLES], size
    return _structures[structure]


def _tables(model: mujoco.MjModel) -> tuple[dict[str, Sequence[int] | NDArray[Any]], int]:
    """Return the tables by name, and the number of entries of the factor."""
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
    joints = model.actuator_trnid[servos(model), 0]
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
        "tendon_entry": np.concatenate([[], *tendons]),
        "tendon_place": np.concatenate([[], *(place[columns] for columns in shared)]),
        "tendon_term": np.concatenate(
            [[], *(entry[place[c[i]], place[c[j]]] for c, (i, j) in zip(shared, upper, strict=True))]
        ),
        "servo": servos(model),
        "servo_place": place[model.jnt_dofadr[joints]],
        "limited": limited,
        "limited_qpos": model.jnt_qposadr[limited],
    }, int(starts[-1])  # fmt: skip


def _mass_columns(model: mujoco.MjModel, dof: int) -> NDArray[Any]:
    start = model.M_rowadr[dof]
    return model.M_colind[start : start + model.M_rownnz[dof]]


def _tendon_entries(model: mujoco.MjModel, tendon: int) -> NDArray[np.intp]:
    """Return the elements of `ten_J` of a tendon that may differ from zero."""
    # The engine keeps all joints between the tendon's ends and the world. A joint that moves both ends as one body,
    # such as the free joint of the chassis, does not change the length.
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
    """Return the degrees of freedom that move a body."""
    dofs: list[int] = []
    while body:
        dofs.extend(range(model.body_dofadr[body], model.body_dofadr[body] + model.body_dofnum[body]))
        body = int(model.body_parentid[body])
    return dofs


def _elimination(cliques: Sequence[NDArray[Any]], size: int) -> tuple[NDArray[np.intp], list[NDArray[np.intp]]]:
    """Return an order of elimination with little fill-in: the unknown with the fewest neighbours comes next."""
    meets = np.eye(size, dtype=bool)
    for clique in cliques:
        meets[np.ix_(clique, clique)] = True
    left, order, later = np.ones(size, bool), [], []
    for _ in range(size):
        neighbours = np.where(left, (meets & left).sum(1), size + 1)
        # The last of several: the chassis, which is coupled with everything, comes first in the engine's order.
        unknown = size - 1 - int(np.argmin(neighbours[::-1]))
        left[unknown] = False
        rest = np.flatnonzero(meets[unknown] & left)
        meets[np.ix_(rest, rest)] = True
        order.append(unknown)
        later.append(rest)
    return np.array(order), later
