"""A controller as a linear system about driving straight, with a fully active corrector and without limits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from activesteer.controllers.find import is_variant, system_of
from activesteer.controllers.parameters import ControllerParameters, ControllerSetup, CorrectorParameters
from activesteer.controllers.variant import read_variant
from activesteer.conventions import Array
from activesteer.errors import ControllerError, shown
from activesteer.theory.single_track import SingleTrack

_LINEAR: Final = ("none", "ars", "afs")


@dataclass(frozen=True)
class LinearController:
    """x[k+1] = A x[k] + B w[k], u[k] = C x[k] + D w[k], one step of the setup between k and k+1.

    Inputs w: the driver's demand at the road wheel [rad], the yaw rate [rad/s]. Outputs u: rear steer angle and
    superposition demanded [rad].

    Attributes:
        a: Shape (n, n).
        b: Shape (n, 2).
        c: Shape (2, n).
        d: Shape (2, 2).
    """

    a: Array
    b: Array
    c: Array
    d: Array


def has_linear_form(given: Any) -> bool:
    """Return whether a controller has a linear form."""
    return isinstance(given, str) and system_of(given) in _LINEAR


def linear_controller(given: str, setup: ControllerSetup, speed_mps: float) -> LinearController:
    """Return the linear form of a controller.

    The tolerance function is taken as 1, so that the corrector acts at all errors. Within its band only the feedforward
    is left: the car with `afs` is then the car without control.

    Args:
        given: `none`, `ars`, `afs`, or a variant.
        setup: Input of the controller.
        speed_mps: Speed [m/s].

    Raises:
        ControllerError: the controller has no linear form, for instance a user's own code.
    """
    gains, system = setup.gains, given
    if is_variant(given):
        variant = read_variant(given)
        gains, system = variant.gains_in(setup), variant.system
    if system not in _LINEAR:
        raise ControllerError(
            f"{shown(given)} has no linear form; only {', '.join(_LINEAR)} and their variants have one",
            value=given,
        )
    return _linear_form(system, gains, SingleTrack(setup.single_track), speed_mps, setup.timestep_s)


def _linear_form(
    system: str, gains: ControllerParameters, car: SingleTrack, speed_mps: float, step_s: float
) -> LinearController:
    desired, predicted, integral, filtered = range(4)  # states
    front, yaw_rate = 4, 5  # inputs, behind the states
    rows = np.zeros((4, 6))
    fraction = 1.0 - math.exp(-step_s / gains.desired_yaw_rate.delay_s)
    rows[desired, desired], rows[desired, front] = 1.0 - fraction, fraction * car.yaw_rate_gain(speed_mps)
    gain, lead_s, lag_s = car.rear_prediction(speed_mps)
    fraction = 1.0 - math.exp(-step_s / lag_s)
    rows[predicted, predicted], rows[predicted, front] = 1.0 - fraction, fraction
    error = _unit(desired) - _unit(yaw_rate)
    demands = np.zeros((2, 6))
    corrector: CorrectorParameters = gains.afs.corrector if system == "afs" else gains.ars.corrector
    rows[integral] = _unit(integral) + corrector.integral_gain * step_s * error
    change = (1.0 - math.exp(-step_s / corrector.derivative_filter_s)) * (error - _unit(filtered))
    rows[filtered] = _unit(filtered) + change
    angle = corrector.proportional_gain_s * error + rows[integral] + corrector.derivative_gain_s2 / step_s * change
    if system == "ars":
        prediction = gain * _unit(predicted) + lead_s / lag_s * (_unit(front) - _unit(predicted))
        demands[0] = gains.ars.prediction_gain * prediction - angle
    elif system == "afs":
        demands[1] = angle
    return LinearController(rows[:, :4], rows[:, 4:], demands[:, :4], demands[:, 4:])


def _unit(index: int) -> Array:
    row: Any = np.zeros(6)
    row[index] = 1.0
    return row
