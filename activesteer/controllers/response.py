"""What a controller answers, as a frequency response about driving straight on, whatever it is made of.

A controller is driven with the measurements of a car that rolls straight on until it has settled, and then gets a small
pulse in one of them. What it answers beyond what it answers without the pulse is its impulse response, whose Fourier
sum is its frequency response, exact for a controller that is linear about that point. So an observer, a programme with
limits that are not reached, and a user's own code have one as well as a written-down transfer function.
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
"""Measurements that move with the lateral motion."""
COMMANDS: Final = ("rear_steer_demand_rad", "superposition_demand_rad")
"""Members of a command that steer."""

_PULSE: Final = {"yaw_rate_radps": 1e-4, "ay_mps2": 1e-3, "rear_steer_rad": 1e-5, "superposition_rad": 1e-5}
"""Heights of the pulses: a hundredth of what a sensor resolves, so that no limit is reached."""
_SETTLE_S: Final = 2.0
_LENGTH_S: Final = 8.0
_LEFT: Final = 0.02
"""Part of the largest answer that may be left at the end: an estimator learns the offset of a sensor slowly [-]."""
_LINEAR: Final = 0.01
"""By how much half a pulse may be answered otherwise than by half [-]."""


def pulse_responses(
    controller: Any,
    rolling: Measurement,
    interval_s: float,
    name: str = "it",
    held: Mapping[str, tuple[int, int]] | None = None,
) -> Array:
    """Impulse responses of a controller to its measurements.

    Args:
        controller: The controller, as made for a run; it is copied.
        rolling: What the sensors say of a car that rolls straight on, at its speed.
        interval_s: Time between two calls [s].
        name: What the controller is called, for the message.
        held: Signal -> calls for which a sample of its sensor is held, and calls after a multiple of that in which it
            is first seen. An estimator that takes each sample once answers to the whole sample, not to one call of it.

    Returns:
        Shape (calls, len(COMMANDS), len(SIGNALS)): answer per unit of a sample, the first in the call that sees it.

    Raises:
        ControllerError: it does not answer a small pulse in proportion, or its answer does not end, so that it has no
            such response.
    """
    held = held or {}
    settled = copy.deepcopy(controller)
    _answers(settled, rolling, interval_s, round(_SETTLE_S / interval_s))
    rolling = rolling._replace(time_s=rolling.time_s + _SETTLE_S)
    count, period = round(_LENGTH_S / interval_s), max([1, *(calls for calls, _ in held.values())])
    found = np.zeros((count, len(COMMANDS), len(SIGNALS)))
    for column, signal in enumerate(SIGNALS):
        calls, first = held.get(signal, (1, 0))
        # What takes in something else only every so many calls may answer otherwise in those between.
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
                    f"does not answer {signal} in proportion, so that it has no linear form", key=name, value=signal
                )
            if np.abs(whole[-count // 10 :]).max() > _LEFT * largest:
                raise ControllerError(
                    f"still answers a pulse of {signal} after {_LENGTH_S:g} s", key=name, value=signal
                )
            found[:, :, column] += whole / len(starts)
    return found


def response_of(pulses: Array, interval_s: float) -> Callable[[Array], NDArray[np.complex128]]:
    """The frequency response that belongs to impulse responses.

    Args:
        pulses: As from `pulse_responses`, shape (calls, outputs, inputs).
        interval_s: Time between two calls [s].

    Returns:
        Function of frequencies [rad/s], shape (m,), to responses, shape (m, outputs, inputs).
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
    """What is demanded in so many calls, the first of which get a pulse; shape (count, len(COMMANDS))."""
    straight = DriverCommand(front_steer_demand_rad=0.0)
    found = np.empty((count, len(COMMANDS)))
    for call in range(count):
        seen = rolling._replace(time_s=rolling.time_s + call * interval_s)
        if call < calls and signal:
            seen = seen._replace(**{signal: getattr(seen, signal) + height})
        answer: ActuatorCommand = controller.step(straight, seen)
        found[call] = answer.rear_steer_demand_rad, answer.superposition_demand_rad
    return found
