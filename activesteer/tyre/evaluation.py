"""`MagicFormula`: forces of a tyre at one operating point or at arrays of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from activesteer.errors import ParameterError
from activesteer.tyre.kernels.magic_formula import (
    FORCE_COLUMNS,
    INPUT_COLUMNS,
    ROLLING_COLUMNS,
    Limit,
    evaluate_rows,
    rolling_rows,
)
from activesteer.tyre.tyre_parameters import TyreParameters

Values = NDArray[np.float64]
_MF52 = 52


class _Column:
    """Descriptor of a column of `TyreForces`, in the shape of the inputs."""

    def __init__(self, table: str, columns: tuple[str, ...]) -> None:
        self._table, self._columns = table, columns

    def __set_name__(self, owner: type, name: str) -> None:
        self._index = self._columns.index(name)

    def __get__(self, forces: TyreForces, owner: type | None = None) -> Values:
        return getattr(forces, self._table)[:, self._index].reshape(forces.shape)


def _force() -> _Column:
    return _Column("_forces", FORCE_COLUMNS)


def _roll() -> _Column:
    return _Column("_rolling", ROLLING_COLUMNS)


@dataclass(frozen=True)
class TyreForces:
    """Forces and moments in ISO-W axes at the contact point, with intermediate quantities.

    Every quantity has the common shape of the inputs. Relaxation lengths, radii and contact patch are computed on first
    use.
    """

    _tyre: NDArray[np.record] = field(repr=False)
    _inputs: Values = field(repr=False)
    _forces: Values = field(repr=False)
    _flags: NDArray[np.int64] = field(repr=False)
    shape: tuple[int, ...]

    fx_N = _force()
    """Longitudinal force [N], positive drives."""
    fy_N = _force()
    """Lateral force [N], negative for a positive slip angle."""
    mx_Nm = _force()
    """Overturning moment [Nm]."""
    my_Nm = _force()
    """Rolling resistance moment [Nm], negative rolling forward."""
    mz_Nm = _force()
    """Aligning moment [Nm]."""
    friction_x = _force()
    """Peak longitudinal friction mu_x."""
    friction_y = _force()
    """Peak lateral friction mu_y."""
    trail_m = _force()
    """Pneumatic trail [m]."""
    residual_moment_Nm = _force()
    """Residual part of the aligning moment [Nm]."""
    slip_stiffness_N = _force()
    """Slope of the longitudinal force over slip at zero slip [N]."""
    cornering_stiffness_Nprad = _force()
    """Slope of the lateral force over slip angle at zero slip [N/rad], negative."""
    relaxation_length_x_m = _roll()
    """Relaxation length of longitudinal slip [m]."""
    relaxation_length_y_m = _roll()
    """Relaxation length of lateral slip [m]."""
    effective_radius_m = _roll()
    """Effective rolling radius [m]."""
    loaded_radius_m = _roll()
    """Distance from wheel centre to road [m]."""
    deflection_m = _roll()
    """Vertical deflection [m]."""
    spin_radps = _roll()
    """Rotational speed of the wheel at this slip [rad/s]."""
    contact_length_m = _roll()
    """Length of the contact patch [m]."""
    contact_width_m = _roll()
    """Width of the contact patch [m]."""

    @cached_property
    def _rolling(self) -> Values:
        """Values of `ROLLING_COLUMNS` for all inputs."""
        rolling = np.empty((len(self._inputs), len(ROLLING_COLUMNS)))
        rolling_rows(self._tyre, self._inputs, self._forces, rolling)
        return rolling

    @property
    def limits(self) -> NDArray[np.int64]:
        """Flags of inputs that were evaluated at their limit: sums of `Limit` values."""
        return self._flags.reshape(self.shape)

    def saturated(self, limit: Limit) -> NDArray[np.bool_]:
        """True if an input was evaluated at its limit."""
        return (self.limits & int(limit)) != 0


class MagicFormula:
    """A tyre in steady state.

    Attributes:
        parameters: Its coefficients.

    Examples:
        >>> import numpy as np
        >>> from activesteer.resources import models_dir
        >>> from activesteer.tyre.evaluation import MagicFormula
        >>> from activesteer.tyre.file.tir import load_tir
        >>> tyre = MagicFormula(load_tir(models_dir() / "tyres" / "compact_205_55R16.tir"))
        >>> alpha_rad = np.radians([0.0, 2.0, 4.0])
        >>> tyre.evaluate(fz_N=4000.0, kappa=0.0, alpha_rad=alpha_rad).fy_N.round(-2)
        array([  100., -2400., -3600.])
    """

    def __init__(self, parameters: TyreParameters) -> None:
        self.parameters = parameters
        self._tyre = np.atleast_1d(parameters.record)

    def evaluate(
        self,
        fz_N: ArrayLike,
        kappa: ArrayLike,
        alpha_rad: ArrayLike,
        gamma_rad: ArrayLike = 0.0,
        pressure_Pa: ArrayLike | None = None,
        vx_mps: ArrayLike | None = None,
        *,
        road_friction: ArrayLike = 1.0,
        turn_slip_1pm: ArrayLike = 0.0,
    ) -> TyreForces:
        """Return forces and moments at one operating point, or at arrays of them, which broadcast.

        Args:
            fz_N: Load [N]; zero or less gives no forces.
            kappa: Longitudinal slip, positive drives, -1 is a locked wheel.
            alpha_rad: Slip angle [rad], ISO-W: positive gives a negative lateral force.
            gamma_rad: Camber [rad], positive about +x.
            pressure_Pa: Inflation pressure [Pa]; None for the pressure in the file.
            vx_mps: Speed along the heading [m/s]; None for the speed of the measurement.
            road_friction: Friction of the road relative to the friction of the file.
            turn_slip_1pm: Yaw rate over speed [1/m], positive to the left; MF 6.x only.

        Returns:
            Forces, moments and intermediate quantities in the common shape of the inputs.

        Raises:
            ParameterError: an input is not finite, shapes do not broadcast, or turn slip is given for an MF 5.2 tyre.

        Validity: the ranges of the file. Beyond them, the value at the limit is returned and `limits` says so.
        Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, section 4.3.2.
        """
        pressure = self.parameters["INFLPRES"] if pressure_Pa is None else pressure_Pa
        speed = self.parameters["LONGVL"] if vx_mps is None else vx_mps
        given = (fz_N, kappa, alpha_rad, gamma_rad, pressure, speed, road_friction, turn_slip_1pm)
        try:
            columns = np.broadcast_arrays(*(np.asarray(value, dtype=np.float64) for value in given))
        except ValueError as error:
            shapes = ", ".join(f"{name} {np.shape(value)}" for name, value in zip(INPUT_COLUMNS, given, strict=True))
            raise ParameterError(f"the inputs do not broadcast: {shapes}") from error
        shape = columns[0].shape
        inputs = np.empty((columns[0].size, len(INPUT_COLUMNS)))
        for place, (name, column) in enumerate(zip(INPUT_COLUMNS, columns, strict=True)):
            inputs[:, place] = column.ravel()
            if not np.isfinite(inputs[:, place]).all():
                raise ParameterError(f"{np.count_nonzero(~np.isfinite(column))} values are not finite", key=name)
        if self.parameters.version == _MF52 and inputs[:, -1].any():
            raise ParameterError("is not zero, but MF 5.2 has no turn slip; use a 6.x tyre", key="turn_slip_1pm")
        forces = np.empty((len(inputs), len(FORCE_COLUMNS)))
        flags = np.empty(len(inputs), dtype=np.int64)
        evaluate_rows(self._tyre, inputs, forces, flags)
        return TyreForces(self._tyre, inputs, forces, flags, shape)
