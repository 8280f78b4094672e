"""Checks of arrays that enter a recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from activesteer.errors import RecordingError


def nanoseconds(time_s: ArrayLike, what: str, after_ns: int = -1) -> NDArray[np.uint64]:
    """Convert times to whole nanoseconds.

    Args:
        time_s: Times [s], shape (n,).
        what: Name of the argument, for the error message.
        after_ns: Time before the first one [ns].

    Raises:
        RecordingError: a time is not finite, is negative, above 2**35 s, or not later than its predecessor.
    """
    times = np.asarray(time_s, np.float64)
    if times.ndim != 1:
        raise RecordingError(f"has shape {times.shape} in place of (n,)", key=what)
    # NaN compares as false, and is what `min` and `max` return where there is one.
    if times.size and not (times.min() >= 0.0 and times.max() < 2.0**35):
        usable = (times >= 0.0) & (times < 2.0**35)
        raise RecordingError(f"is {times[~usable][0]} s: it must be finite and not negative", key=what)
    result = np.rint(times * 1e9).astype(np.int64)
    if times.size and not (result[0] > after_ns and (result[1:] > result[:-1]).all()):
        steps = np.diff(result, prepend=after_ns)
        row = int(np.argmax(steps <= 0))
        before_s = (result[row] - steps[row]) * 1e-9
        raise RecordingError(
            f"must increase: row {row} is at {times[row]} s, the one before it at {before_s} s",
            key=what,
            value=float(times[row]),
        )
    return result.view(np.uint64)


def shaped(array: ArrayLike, what: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return a float array of a given shape.

    Raises:
        RecordingError: the shape differs, or a value is not a number.
    """
    try:
        numbers = np.asarray(array, np.float64)
    except (TypeError, ValueError) as error:
        raise RecordingError(str(error), key=what) from None
    if numbers.size == 0 and 0 in shape:
        return numbers.reshape(shape)
    if numbers.shape != shape:
        raise RecordingError(f"has shape {numbers.shape} in place of {shape}", key=what)
    return numbers
