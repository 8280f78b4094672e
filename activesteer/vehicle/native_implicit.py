"""Step of the engine with a direct solution of the accelerations (see `implicit_plan`).

Everything but the solution is the engine's: its own functions for positions, mass matrix, tendons, forces, sensors and
integration are called one by one. The engine's own step does it all while a joint touches its limit, while a force acts
on a body, and where the matrix is not positive definite.
"""

from __future__ import annotations

from typing import Final

import mujoco
from llvmlite import ir
from numba import from_dtype, types
from numba.extending import intrinsic

from activesteer.native.compilation import inlined, inlined_by_llvm
from activesteer.native.memory import f64_pointer, pointer_to
from activesteer.vehicle.implicit_plan import IMPLICIT_PLAN

_N_BIAS: Final = int(mujoco.mjNBIAS)
_N_GEAR: Final = 6

implicit_plan_pointer = pointer_to(from_dtype(IMPLICIT_PLAN))
_indices = pointer_to(types.int32)
_flags = pointer_to(types.uint8)


@intrinsic
def _call(_typing_context, function, model, data):
    """Call a C function at an address with two pointers."""
    signature = types.void(types.intp, types.intp, types.intp)

    def generate(context, builder: ir.IRBuilder, _signature, arguments):
        address, *pointers = arguments
        kind = ir.FunctionType(ir.VoidType(), [pointer.type for pointer in pointers])
        builder.call(builder.inttoptr(address, kind.as_pointer()), pointers)
        return context.get_dummy_value()

    return signature, generate


@inlined
def _engine(function, plan):
    _call(function, plan.model, plan.data)  # pyright: ignore[reportCallIssue] - numba adds the context


@inlined
def _engine_must(plan):
    """Return whether this step needs the engine's solution: a joint touches its limit, or a force acts on a body."""
    if plan.direct == 0:
        return True
    limited, places = _indices(plan.limited), _indices(plan.limited_qpos)
    ranges, margins, qpos = f64_pointer(plan.jnt_range), f64_pointer(plan.jnt_margin), f64_pointer(plan.qpos)
    must = False
    for index in range(plan.n_limited):
        joint, position = limited[index], qpos[places[index]]
        margin = margins[joint]
        must |= position - ranges[2 * joint] < margin or ranges[2 * joint + 1] - position < margin
    forces = f64_pointer(plan.xfrc_applied)
    for index in range(plan.n_forces):
        must |= forces[index] != 0.0
    return must


@inlined
def _stiffness(a, b, c, x):
    """Return the slope of the force a x + b x^2 + c x^3, limited to at least 0."""
    return max(0.0, a + x * (2.0 * b + x * 3.0 * c))


@inlined_by_llvm
def _assemble(plan):
    """Write the matrix M + h D + h^2 K and the right-hand side f - h K v, in the order of elimination."""
    # Negative damping and stiffness count as 0 in D and K, as in the engine; the forces contain them anyway.
    h = plan.timestep_s
    entries, elements, mass = f64_pointer(plan.factor), f64_pointer(plan.M), _indices(plan.mass)
    for index in range(plan.n_factor):
        entries[index] = 0.0
    for index in range(plan.n_mass_elements):
        entries[mass[index]] = elements[index]

    passive, bias = f64_pointer(plan.qfrc_passive), f64_pointer(plan.qfrc_bias)
    applied, actuator = f64_pointer(plan.qfrc_applied), f64_pointer(plan.qfrc_actuator)
    right, place, diagonal = f64_pointer(plan.right_side), _indices(plan.place), _indices(plan.diagonal)
    damping = f64_pointer(plan.dof_damping)
    for dof in range(plan.n_place):
        right[place[dof]] = passive[dof] - bias[dof] + applied[dof] + actuator[dof]
        entries[diagonal[dof]] += h * max(0.0, damping[dof])

    jacobian, length, rate = f64_pointer(plan.ten_J), f64_pointer(plan.ten_length), f64_pointer(plan.ten_velocity)
    a, b_and_c = f64_pointer(plan.tendon_stiffness), f64_pointer(plan.tendon_stiffnesspoly)
    slack, dampers = f64_pointer(plan.tendon_lengthspring), f64_pointer(plan.tendon_damping)
    columns, elements_of = _indices(plan.tendon_columns), _indices(plan.tendon_entry)
    places, terms = _indices(plan.tendon_place), _indices(plan.tendon_term)
    first = term = 0
    for tendon in range(plan.n_tendon_columns):
        count, x = columns[tendon], length[tendon]
        x = x - slack[2 * tendon + 1] if x > slack[2 * tendon + 1] else min(x - slack[2 * tendon], 0.0)
        k = 0.0
        if x != 0.0:
            k = _stiffness(a[tendon], b_and_c[2 * tendon], b_and_c[2 * tendon + 1], x)
        scale, shift = h * (h * k + max(0.0, dampers[tendon])), h * k * rate[tendon]
        if scale != 0.0:
            for i in range(first, first + count):
                element = jacobian[elements_of[i]]
                right[places[i]] -= shift * element
                for j in range(i, first + count):
                    entries[terms[term]] += scale * element * jacobian[elements_of[j]]
                    term += 1
        else:
            term += count * (count + 1) // 2
        first += count

    servo, at = _indices(plan.servo), _indices(plan.servo_place)
    laws, gears, rates = (
        f64_pointer(plan.actuator_biasprm),
        f64_pointer(plan.actuator_gear),
        f64_pointer(plan.actuator_velocity),
    )
    is_limited, limits = _flags(plan.actuator_forcelimited), f64_pointer(plan.actuator_forcerange)
    force, row = f64_pointer(plan.actuator_force), _indices(plan.row)
    for index in range(plan.n_servo):
        which = servo[index]
        if is_limited[which] and (force[which] <= limits[2 * which] or force[which] >= limits[2 * which + 1]):
            continue  # a force at its limit does not change with the angle
        k, d = max(0.0, -laws[_N_BIAS * which + 1]), max(0.0, -laws[_N_BIAS * which + 2])
        gear = gears[_N_GEAR * which]
        entries[row[at[index]]] += h * (h * k + d) * gear * gear
        right[at[index]] -= h * k * rates[which] * gear


@inlined_by_llvm
def _factorise(plan):
    """Factorise in place (unit upper triangular, diagonal), and store the reciprocals of the diagonal."""
    entries, row, others = f64_pointer(plan.factor), _indices(plan.row), _indices(plan.others)
    update = _indices(plan.update)
    target = 0
    bad = -1
    for place in range(plan.n_row):
        start, count = row[place], others[place]
        if entries[start] <= 0.0:
            bad = place
        reciprocal = 1.0 / entries[start]
        entries[start] = reciprocal
        for i in range(start + 1, start + 1 + count):
            scaled = entries[i] * reciprocal
            for j in range(i, start + 1 + count):
                entries[update[target]] -= scaled * entries[j]
                target += 1
            entries[i] = scaled
    return bad


@inlined
def _warn(plan, bad):
    """Count a warning of the engine for an indefinite matrix."""
    place, warning = _indices(plan.place), _indices(plan.inertia_warning)
    for dof in range(plan.n_place):
        if place[dof] == bad:
            warning[0] = dof
    warning[1] += 1


@inlined_by_llvm
def _solve(plan):
    """Solve for the accelerations with the factor."""
    entries, row, others = f64_pointer(plan.factor), _indices(plan.row), _indices(plan.others)
    column, x = _indices(plan.column), f64_pointer(plan.right_side)
    for place in range(plan.n_row):
        start, value = row[place], x[place]
        for i in range(start + 1, start + 1 + others[place]):
            x[column[i]] -= entries[i] * value
        x[place] = value * entries[start]
    for back in range(plan.n_row):
        place = plan.n_row - 1 - back
        start, value = row[place], x[place]
        for i in range(start + 1, start + 1 + others[place]):
            value -= entries[i] * x[column[i]]
        x[place] = value
    acceleration, smooth, place_of = f64_pointer(plan.qacc), f64_pointer(plan.qacc_smooth), _indices(plan.place)
    for dof in range(plan.n_place):
        acceleration[dof] = smooth[dof] = x[place_of[dof]]


@inlined_by_llvm
def _accelerate(plan):
    """Compute the sensed accelerations, including gravity, because the engine does not compute them again."""
    if plan.sensed_body == 0:
        _engine(plan.mj_rnePostConstraint, plan)
        return
    felt, axes, turning = f64_pointer(plan.cacc), f64_pointer(plan.cdof), f64_pointer(plan.cdof_dot)
    speed, acceleration, gravity = f64_pointer(plan.qvel), f64_pointer(plan.qacc), f64_pointer(plan.gravity)
    for part in range(6):
        value = 0.0 if part < 3 else -gravity[part - 3]
        for dof in range(plan.first_dof, plan.first_dof + plan.n_dofs):
            value += turning[6 * dof + part] * speed[dof] + axes[6 * dof + part] * acceleration[dof]
        felt[6 * plan.sensed_body + part] = value


@inlined_by_llvm
def advance(plan):
    """Make one step of the engine."""
    if _engine_must(plan):
        _engine(plan.mj_step, plan)
        return
    _engine(plan.mj_fwdKinematics, plan)
    _engine(plan.mj_makeM, plan)
    _engine(plan.mj_transmission, plan)
    _engine(plan.mj_sensorPos, plan)
    _engine(plan.mj_fwdVelocity, plan)
    _engine(plan.mj_sensorVel, plan)
    _engine(plan.mj_fwdActuation, plan)
    _assemble(plan)
    bad = _factorise(plan)
    if bad >= 0:
        _warn(plan, bad)
        _engine(plan.mj_step, plan)
    else:
        _solve(plan)
        _engine(plan.mj_checkAcc, plan)
        _accelerate(plan)
        _engine(plan.mj_sensorAcc, plan)
        _engine(plan.mj_Euler, plan)
