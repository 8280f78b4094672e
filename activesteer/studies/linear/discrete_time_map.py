"""One step of the engine as a differentiable function, and the steady state of that function."""

from __future__ import annotations

from typing import Final

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ModelError
from activesteer.signals import ActuatorCommand, DriverCommand
from activesteer.vehicle import Vehicle
from activesteer.vehicle.linear_state import LocalState

INPUTS: Final = ("steering_wheel_rad", "rear_steer_rad", "superposition_rad")
"""Demands: steering wheel [rad], rear steering [rad], and superposition at the road wheel [rad]."""
OUTPUTS: Final = ("yaw_rate_radps", "ay_mps2", "roll_rad", "sideslip_rad")
"""Channels of a recording that are the outputs."""
ACTUATORS: Final = ("rear_steer_rad", "superposition_rad")
"""Channels of the positions of a controller's actuators."""

_DIFFERENCE: Final = 1e-6
"""Step of the central differences [m, rad, m/s, rad/s]: eigenvalues agree between 1e-7 and 1e-4 to four digits."""
_TORQUE_DIFFERENCE_Nm: Final = 1.0
_TRIM_ITERATIONS: Final = 10
_TRIM_TOLERANCE: Final = 1e-11
"""Largest change of a steady state over a step [m, rad, m/s, rad/s]; rounding leaves 1e-14."""
_SOLVER_TOLERANCE: Final = 1e-14
"""Tolerance of MuJoCo's own solver, if a car needs it: an error of 1e-8 would be divided by the small difference."""


class DiscreteTimeMap:
    """One step of the engine about a reference state, as a function of state x, inputs u and drive torque."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        vehicle.model.opt.tolerance = _SOLVER_TOLERANCE
        self.torque_Nm = 0.0
        self.local = LocalState(vehicle)
        names = [channel.name for channel in vehicle.channels.channels]
        self._columns = [names.index(name) for name in (*OUTPUTS, *ACTUATORS)]

    def __call__(self, x: Array, u: Array, more_torque_Nm: float = 0.0) -> Array:
        """Return the state after the step, as a difference from the reference."""
        self.local.write(x)
        steering_wheel, rear, added = (float(value) for value in u)
        command = DriverCommand(steering_wheel, self.torque_Nm + more_torque_Nm)
        self.vehicle.step(command, ActuatorCommand(rear, added))
        return self.local.read()

    def trim(self, speed_mps: float) -> None:
        """Make steady straight driving the reference, with its drive torque."""
        size, rest = len(self.local.names), np.zeros(len(INPUTS))
        speed = self.local.names.index("d_x")
        x = np.zeros(size)
        x[speed] = speed_mps - float(self.vehicle.data.qvel[0])
        self._rebase(x)
        residual = self(np.zeros(size), rest)
        for _ in range(_TRIM_ITERATIONS):
            if np.abs(residual).max() < _TRIM_TOLERANCE:
                return
            jacobian = self.derivatives("x")[0] - np.eye(size)
            # The speed is given; the torque that holds it is the unknown in its place.
            torque = _TORQUE_DIFFERENCE_Nm
            jacobian[:, speed] = (self(np.zeros(size), rest, torque) - self(np.zeros(size), rest, -torque)) / (
                2 * torque
            )
            if not np.isfinite(jacobian).all():
                break
            move: Array = np.linalg.lstsq(jacobian, -residual, rcond=None)[0].astype(np.float64)
            self.torque_Nm += float(move[speed])
            move[speed] = 0.0
            self._rebase(move)
            residual = self(np.zeros(size), rest)
        worst = self.local.names[int(np.abs(residual).argmax())]
        raise ModelError(
            f"the car does not roll steadily straight ahead at {speed_mps:g} m/s: in a step of the engine {worst} "
            f"still changes by {np.abs(residual).max():.3g} (allowed {_TRIM_TOLERANCE:g})"
        )

    def _rebase(self, x: Array) -> None:
        self.local.write(x)
        self.local.take_reference()

    def derivatives(self, of: str) -> tuple[Array, Array]:
        """Return the derivatives of the state after the step and of the outputs before it."""
        size, rest = len(self.local.names), (np.zeros(len(self.local.names)), np.zeros(len(INPUTS)))
        count = size if of == "x" else len(INPUTS)
        following = np.empty((2 * count, size))
        rows = self.vehicle.rows.empty(2 * count)
        for row in range(2 * count):
            x, u = (part.copy() for part in rest)
            (x if of == "x" else u)[row % count] = _DIFFERENCE if row < count else -_DIFFERENCE
            following[row] = self(x, u)
            for block, live in zip(rows, self.vehicle.rows.live(), strict=True):
                block[row] = live
        outputs = self.vehicle.channels.evaluate(rows)[:, self._columns]
        return tuple((part[:count] - part[count:]).T / (2.0 * _DIFFERENCE) for part in (following, outputs))  # type: ignore[return-value]
