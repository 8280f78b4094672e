"""Linear form of a controller about straight driving, from its equations or its frequency response.

The difference of its responses with and without a small pulse in one measurement is its impulse response. The
Fourier sum of that is its frequency response, exact for a controller that is linear about this point.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.controllers.find import is_variant, system_of
from activesteer.controllers.parameters import ControllerSetup
from activesteer.controllers.variant import read_variant
from activesteer.core.conventions import Array
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement
from activesteer.errors import ControllerError, shown
from activesteer.theory.single_track import SingleTrack

_LINEAR: Final = ("none", "ars", "afs")


@dataclass(frozen=True)
class LinearController:
    """Linear controller x[k+1] = A x[k] + B w[k], u[k] = C x[k] + D w[k], with one step of the setup per k.

    Inputs w: the driver's demand at the road wheel [rad], the yaw rate [rad/s]. Outputs u: demanded rear steer angle
    and superposition [rad].
    """

    a: Array
    b: Array
    c: Array
    d: Array


def has_linear_form(given: Any) -> bool:
    """Return whether a controller has a linear form."""
    return isinstance(given, str) and system_of(given) in _LINEAR


def linear_controller(given: str, setup: ControllerSetup, speed_mps: float) -> LinearController:
    """Return the linear form of a controller, or raise ControllerError if it has none, for instance a user's own code.

    The tolerance function is taken as 1, so that the corrector acts at all errors. Within its band only the feedforward
    is left: the car with `afs` is then the car without control.
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
    car, step_s, unit = SingleTrack(setup.single_track), setup.timestep_s, np.eye(6)
    desired, predicted, integral, filtered = range(4)  # states
    front, yaw_rate = 4, 5  # inputs, behind the states
    rows = np.zeros((4, 6))
    fraction = 1.0 - math.exp(-step_s / gains.desired_yaw_rate.delay_s)
    rows[desired, desired], rows[desired, front] = 1.0 - fraction, fraction * car.yaw_rate_gain(speed_mps)
    gain, lead_s, lag_s = car.rear_prediction(speed_mps)
    fraction = 1.0 - math.exp(-step_s / lag_s)
    rows[predicted, predicted], rows[predicted, front] = 1.0 - fraction, fraction
    error = unit[desired] - unit[yaw_rate]
    demands = np.zeros((2, 6))
    corrector = gains.afs.corrector if system == "afs" else gains.ars.corrector
    rows[integral] = unit[integral] + corrector.integral_gain * step_s * error
    change = (1.0 - math.exp(-step_s / corrector.derivative_filter_s)) * (error - unit[filtered])
    rows[filtered] = unit[filtered] + change
    angle = corrector.proportional_gain_s * error + rows[integral] + corrector.derivative_gain_s2 / step_s * change
    if system == "ars":
        prediction = gain * unit[predicted] + lead_s / lag_s * (unit[front] - unit[predicted])
        demands[0] = gains.ars.prediction_gain * prediction - angle
    elif system == "afs":
        demands[1] = angle
    return LinearController(rows[:, :4], rows[:, 4:], demands[:, :4], demands[:, 4:])


SIGNALS: Final = ("yaw_rate_radps", "ay_mps2", "rear_steer_rad", "superposition_rad")
"""Measurements of the lateral motion."""
COMMANDS: Final = ("rear_steer_demand_rad", "superposition_demand_rad")
"""Fields of a command that steer."""

_PULSE: Final = {"yaw_rate_radps": 1e-4, "ay_mps2": 1e-3, "rear_steer_rad": 1e-5, "superposition_rad": 1e-5}
"""Heights of the pulses: a hundredth of the resolution of a sensor, so that no limit is reached."""
_SETTLE_S: Final = 2.0
_LENGTH_S: Final = 8.0
_LEFT: Final = 0.02
"""Fraction of the largest response that may remain at the end: an estimator learns a sensor's offset slowly [-]."""
_NONLINEARITY: Final = 0.01
"""Tolerated error when half a pulse must give half the response [-]."""


def pulse_responses(
    controller: Any,
    rolling: Measurement,
    interval_s: float,
    name: str = "it",
    held: Mapping[str, tuple[int, int]] | None = None,
) -> Array:
    """Return the impulse responses to a unit of a sample, shape (calls, len(COMMANDS), len(SIGNALS))."""
    # `held`: for how many calls a signal's sensor holds a sample, and the offset of the first call that sees it. An
    # estimator that takes each sample once responds to the whole sample, not to one call of it.
    held = held or {}
    settled = copy.deepcopy(controller)
    _answers(settled, rolling, interval_s, round(_SETTLE_S / interval_s))
    rolling = rolling._replace(time_s=rolling.time_s + _SETTLE_S)
    count, period = round(_LENGTH_S / interval_s), max([1, *(calls for calls, _ in held.values())])
    result = np.zeros((count, len(COMMANDS), len(SIGNALS)))
    for column, signal in enumerate(SIGNALS):
        calls, first = held.get(signal, (1, 0))
        # A controller that works only every few calls may answer differently in the calls between.
        starts = range(first, first + period, calls)
        for start in starts:
            before = copy.deepcopy(settled)
            _answers(before, rolling, interval_s, start)
            seen = rolling._replace(time_s=rolling.time_s + start * interval_s)
            rest = _answers(copy.deepcopy(before), seen, interval_s, count)
            whole, half = (
                (_answers(copy.deepcopy(before), seen, interval_s, count, signal, height, calls) - rest) / height
                for height in (_PULSE[signal], 0.5 * _PULSE[signal])
            )
            largest = np.abs(whole).max()
            if np.abs(whole - half).max() > _NONLINEARITY * largest:
                raise ControllerError(
                    f"does not respond to {signal} in proportion, so it has no linear form", key=name, value=signal
                )
            if np.abs(whole[-count // 10 :]).max() > _LEFT * largest:
                raise ControllerError(
                    f"still responds to a pulse of {signal} after {_LENGTH_S:g} s", key=name, value=signal
                )
            result[:, :, column] += whole / len(starts)
    return result


def response_of(pulses: Array, interval_s: float) -> Callable[[Array], NDArray[np.complex128]]:
    """Return the frequency response of `pulse_responses`, from shape (m,) [rad/s] to shape (m, outputs, inputs)."""
    times_s = interval_s * np.arange(len(pulses))

    def response(frequencies_radps: Array) -> NDArray[np.complex128]:
        turns = np.exp(-1j * np.outer(frequencies_radps, times_s))
        return np.tensordot(turns, pulses, axes=1)

    return response


def _answers(
    controller: Any,
    rolling: Measurement,
    interval_s: float,
    count: int,
    signal: str = "",
    height: float = 0.0,
    calls: int = 1,
) -> Array:
    """Return the commands of `count` calls, shape (count, commands). The first `calls` of them receive a pulse."""
    straight = DriverCommand(front_steer_demand_rad=0.0)
    commands = np.empty((count, len(COMMANDS)))
    for call in range(count):
        seen = rolling._replace(time_s=rolling.time_s + call * interval_s)
        if call < calls and signal:
            seen = seen._replace(**{signal: getattr(seen, signal) + height})
        answer: ActuatorCommand = controller.step(straight, seen)
        commands[call] = answer.rear_steer_demand_rad, answer.superposition_demand_rad
    return commands
