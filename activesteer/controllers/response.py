"""Frequency response of any controller about driving straight ahead.

A controller gets the measurements of a car that drives straight ahead until it has settled, and then a small pulse in
one of them. The difference to its answer without the pulse is its impulse response. The Fourier sum of that is its
frequency response, exact for a controller that is linear about this point. An observer, a programme without active
limits and a user's own code thus have a frequency response like a transfer function.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import Array
from activesteer.errors import ControllerError
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement

SIGNALS: Final = ("yaw_rate_radps", "ay_mps2", "rear_steer_rad", "superposition_rad")
"""Measurements of the lateral motion."""
COMMANDS: Final = ("rear_steer_demand_rad", "superposition_demand_rad")
"""Fields of a command that steer."""

_PULSE: Final = {"yaw_rate_radps": 1e-4, "ay_mps2": 1e-3, "rear_steer_rad": 1e-5, "superposition_rad": 1e-5}
"""Heights of the pulses: a hundredth of the resolution of a sensor, so that no limit is reached."""
_SETTLE_S: Final = 2.0
_LENGTH_S: Final = 8.0
_LEFT: Final = 0.02
"""Fraction of the largest answer that may remain at the end: an estimator learns the offset of a sensor slowly [-]."""
_LINEAR: Final = 0.01
"""Tolerated error when half a pulse must give half the answer [-]."""


def pulse_responses(
    controller: Any,
    rolling: Measurement,
    interval_s: float,
    name: str = "it",
    held: Mapping[str, tuple[int, int]] | None = None,
) -> Array:
    """Return the impulse responses of a controller to its measurements.

    Args:
        controller: The controller of a run; it is copied.
        rolling: Measurement of a car that drives straight ahead at its speed.
        interval_s: Time between two calls [s].
        name: Name of the controller, for the message.
        held: Signal to two numbers of calls: for how long a sample of its sensor is held, and the offset of the first
            call that sees it. An estimator that takes each sample once answers the whole sample, not one call of it.

    Returns:
        Shape (calls, len(COMMANDS), len(SIGNALS)): answer per unit of a sample, from the call that sees it on.

    Raises:
        ControllerError: the answer to a small pulse is not proportional to it, or does not end.
    """
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
            if np.abs(whole - half).max() > _LINEAR * largest:
                raise ControllerError(
                    f"does not answer {signal} in proportion and has no linear form", key=name, value=signal
                )
            if np.abs(whole[-count // 10 :]).max() > _LEFT * largest:
                raise ControllerError(
                    f"still answers a pulse of {signal} after {_LENGTH_S:g} s", key=name, value=signal
                )
            result[:, :, column] += whole / len(starts)
    return result


def response_of(pulses: Array, interval_s: float) -> Callable[[Array], NDArray[np.complex128]]:
    """Return the frequency response of impulse responses.

    Args:
        pulses: Return value of `pulse_responses`, shape (calls, outputs, inputs).
        interval_s: Time between two calls [s].

    Returns:
        Function from frequencies [rad/s], shape (m,), to responses, shape (m, outputs, inputs).
    """
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
    """Return the commands of `count` calls, the first `calls` of them with a pulse; shape (count, len(COMMANDS))."""
    straight = DriverCommand(front_steer_demand_rad=0.0)
    commands = np.empty((count, len(COMMANDS)))
    for call in range(count):
        seen = rolling._replace(time_s=rolling.time_s + call * interval_s)
        if call < calls and signal:
            seen = seen._replace(**{signal: getattr(seen, signal) + height})
        answer: ActuatorCommand = controller.step(straight, seen)
        commands[call] = answer.rear_steer_demand_rad, answer.superposition_demand_rad
    return commands
