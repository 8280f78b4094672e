"""Ordered table of recorded channels, and checks of the arrays that enter a recording."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from activesteer import limits
from activesteer.errors import RecordingError, nearest_names
from activesteer.signals import Channel

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,254}")
_GROUP = re.compile(r"[a-z][a-z0-9_]{0,254}")
TIME = "time_s"
"""Name of the time column in every export; no channel may have it."""


class ChannelTable:
    """Channels in the order of their columns.

    Iteration yields `Channel` objects, `table["yaw_rate_radps"]` returns a channel, and `"yaw_rate_radps" in table`
    tests whether it exists.
    """

    def __init__(self, channels: Iterable[Channel]) -> None:
        """Create the table from channels in column order.

        Raises:
            RecordingError: a name occurs twice, or a name or group cannot be a field or message name in a file.
        """
        self._channels = tuple(channels)
        self._index = {channel.name: column for column, channel in enumerate(self._channels)}
        for column, channel in enumerate(self._channels):
            if not _NAME.fullmatch(channel.name) or channel.name == TIME:
                raise RecordingError(
                    f"channel name {channel.name!r:.300}: allowed are letters, digits, '_', a letter first, but not "
                    f"{TIME!r}",
                    value=channel.name,
                )
            for text in (channel.unit, channel.meaning):
                if not isinstance(text, str) or len(text) > limits.MAX_DESCRIPTION_LETTERS or not text.isprintable():
                    raise RecordingError(
                        f"channel {channel.name!r}: unit and meaning are texts of one line, not {text!r:.100}"
                    )
            if not _GROUP.fullmatch(channel.group):
                raise RecordingError(
                    f"group {channel.group!r:.300} of channel {channel.name!r}: allowed are a to z, 0 to 9 and '_', "
                    "a letter first",
                    value=channel.group,
                )
            if self._index[channel.name] != column:
                other = self._index[channel.name]
                raise RecordingError(
                    f"channel name {channel.name!r} occurs twice, in columns {column} and {other}", value=channel.name
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Channel names in column order."""
        return tuple(self._index)

    def index(self, name: str) -> int:
        """Return the column of a channel.

        Raises:
            RecordingError: there is no such channel; the message names similar ones.
        """
        try:
            return self._index[name]
        except (KeyError, TypeError):
            raise RecordingError(
                f"no channel {name!r} in this recording: {nearest_names(str(name), self._index)}", value=name
            ) from None

    def groups(self) -> dict[str, list[int]]:
        """Return the columns of each group, ordered by the first channel of the group."""
        columns: dict[str, list[int]] = {}
        for column, channel in enumerate(self._channels):
            columns.setdefault(channel.group, []).append(column)
        return columns

    def __getitem__(self, name: str) -> Channel:
        """Return a channel by its name; raise `RecordingError` if there is none."""
        return self._channels[self.index(name)]

    def __iter__(self) -> Iterator[Channel]:
        """Iterate over the channels in column order."""
        return iter(self._channels)

    def __len__(self) -> int:
        """Return the number of channels."""
        return len(self._channels)

    def __contains__(self, name: object) -> bool:
        """Return whether a channel exists."""
        return name in self._index

    def __eq__(self, other: object) -> bool:
        """Compare channels and their order."""
        return isinstance(other, ChannelTable) and self._channels == other._channels

    def __hash__(self) -> int:
        """Hash channels and their order."""
        return hash(self._channels)

    def __repr__(self) -> str:
        """Show the names."""
        return f"ChannelTable({', '.join(self._index)})"


def nanoseconds(time_s: ArrayLike, what: str, after_ns: int = -1) -> NDArray[np.uint64]:
    """Convert times to whole nanoseconds."""
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
    """Return a float array of a given shape."""
    try:
        numbers = np.asarray(array, np.float64)
    except (TypeError, ValueError) as error:
        raise RecordingError(str(error), key=what) from None
    if numbers.size == 0 and 0 in shape:
        return numbers.reshape(shape)
    if numbers.shape != shape:
        raise RecordingError(f"has shape {numbers.shape} in place of {shape}", key=what)
    return numbers
