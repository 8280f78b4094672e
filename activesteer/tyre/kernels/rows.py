"""The kernels over rows of a table, compiled, for the vectorised call."""

from __future__ import annotations

from activesteer.compilation import compiled
from activesteer.tyre.kernels.limits import limit_flags
from activesteer.tyre.kernels.magic_formula import SteadyState, steady_state
from activesteer.tyre.kernels.relaxation import rolling_relaxation_lengths
from activesteer.tyre.kernels.turn_slip import rolling_speed
from activesteer.tyre.kernels.vertical import contact_patch, deflection_under_load, free_radius

INPUT_COLUMNS = ("fz_N", "kappa", "alpha_rad", "gamma_rad", "pressure_Pa", "vx_mps", "mu", "turn_slip_1pm")
FORCE_COLUMNS = SteadyState._fields
ROLLING_COLUMNS = (
    "relaxation_length_x_m", "relaxation_length_y_m", "effective_radius_m", "loaded_radius_m", "deflection_m",
    "spin_radps", "contact_length_m", "contact_width_m",
)  # fmt: skip


@compiled
def evaluate_rows(tyre, inputs, forces, flags) -> None:
    """Evaluate `steady_state` and `limit_flags` for every row.

    Args:
        tyre: Record of the tyre, shape (1,): a call with an array costs less than one with a record.
        inputs: Columns of INPUT_COLUMNS, shape (n, 8).
        forces: Filled with the columns of FORCE_COLUMNS, shape (n, 11).
        flags: Filled with the limit flags, int64, shape (n,).
    """
    p = tyre[0]
    for i in range(inputs.shape[0]):
        fz, kappa, alpha, gamma = inputs[i, 0], inputs[i, 1], inputs[i, 2], inputs[i, 3]
        pressure = inputs[i, 4]
        result = steady_state(p, fz, kappa, alpha, gamma, pressure, inputs[i, 5], inputs[i, 6], inputs[i, 7])
        for k in range(len(result)):
            forces[i, k] = result[k]
        flags[i] = limit_flags(p, fz, kappa, alpha, gamma, pressure)


@compiled
def rolling_rows(tyre, inputs, forces, rolling) -> None:
    """Compute relaxation lengths, radii and contact patch for every row.

    Args:
        tyre: Record of the tyre, shape (1,): a call with an array costs less than one with a record.
        inputs: Columns of INPUT_COLUMNS, shape (n, 8).
        forces: Columns of FORCE_COLUMNS, shape (n, 11).
        rolling: Filled with the columns of ROLLING_COLUMNS, shape (n, 8).
    """
    p = tyre[0]
    for i in range(inputs.shape[0]):
        fz, kappa, gamma, pressure = inputs[i, 0], inputs[i, 1], inputs[i, 3], inputs[i, 4]
        omega, radius = rolling_speed(p, fz, kappa, pressure, inputs[i, 5])
        deflection = deflection_under_load(p, fz, omega, pressure, forces[i, 0], forces[i, 1], gamma)
        rolling[i, 0], rolling[i, 1] = rolling_relaxation_lengths(p, fz, gamma, pressure)
        rolling[i, 2] = radius
        rolling[i, 3] = max(free_radius(p, omega) - deflection, 0.0)
        rolling[i, 4] = deflection
        rolling[i, 5] = omega
        rolling[i, 6], rolling[i, 7] = contact_patch(p, fz, pressure)
        if fz <= 0.0:
            rolling[i, 3] = free_radius(p, omega)
