"""Protobuf messages of constant length, written and read in blocks of rows with numpy.

Every message of a topic has the same fields, and `double`, `float` and padded varints have a fixed width. So all
messages of a topic form one byte array. Its constant bytes (tags, lengths, names) are filled in once, and its numbers
are strided views. A few array assignments encode or decode a block. Every protobuf library can read the result.

Source: protobuf encoding specification, https://protobuf.dev/programming-guides/encoding (padded varints are legal).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from activesteer.errors import RecordingError

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5
"""Wire types."""

STAMP_LENGTH = 12
"""Length of a google.protobuf.Timestamp made by `timestamps` [bytes]."""

_SHIFTS = np.arange(0, 35, 7, dtype=np.uint64)
_CONTINUES = np.array([0x80, 0x80, 0x80, 0x80, 0], np.uint64)
"""For a varint padded to five bytes: shifts of its seven-bit groups, and the bits that mark a following byte."""


@dataclass(frozen=True)
class Run:
    """Numbers at a constant distance in a message.

    Attributes:
        dtype: Little-endian numpy type of one number.
        offset: Position of the first number in the message [byte].
        stride: Distance from one number to the next [byte].
        count: How many there are.
    """

    dtype: str
    offset: int
    stride: int
    count: int


def varint(value: int) -> bytes:
    """Return the shortest varint of a number >= 0."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def tag(field: int, wire_type: int) -> bytes:
    """Return a field tag: number and wire type."""
    return varint(field << 3 | wire_type)


def timestamps(time_ns: NDArray[np.uint64]) -> NDArray[np.uint8]:
    """Encode times as google.protobuf.Timestamp, each number as a varint padded to five bytes.

    Args:
        time_ns: Time since zero [ns], shape (n,), below 2**35 s.

    Returns:
        Encoded messages, shape (n, STAMP_LENGTH).
    """
    out = np.empty((len(time_ns), STAMP_LENGTH), np.uint8)
    billion = np.uint64(1_000_000_000)
    for field, start, value in ((1, 0, time_ns // billion), (2, 6, time_ns % billion)):
        out[:, start] = tag(field, VARINT)[0]
        out[:, start + 1 : start + 6] = (value[:, np.newaxis] >> _SHIFTS) & np.uint64(0x7F) | _CONTINUES
    return out


class FixedMessage:
    """Message of constant length: constant bytes, and numbers at fixed places.

    Attributes:
        template: The message with all numbers zero.
        runs: Places of the numbers, in the order of addition.
    """

    def __init__(self) -> None:
        """Start with an empty message."""
        self.template = bytearray()
        self.runs: list[Run] = []

    def __len__(self) -> int:
        """Return the length of the message [byte]."""
        return len(self.template)

    def constant(self, data: bytes) -> FixedMessage:
        """Append bytes that are the same in every message."""
        self.template += data
        return self

    def number(self, field: int, dtype: str) -> FixedMessage:
        """Append a `double` (`<f8`) or `float` (`<f4`) field."""
        self.template += tag(field, FIXED64 if dtype == "<f8" else FIXED32)
        return self.raw(dtype)

    def raw(self, dtype: str) -> FixedMessage:
        """Append an untagged number; extend the last run if the distance is the same."""
        offset = len(self.template)
        if self.runs:
            last = self.runs[-1]
            stride = offset - (last.offset + (last.count - 1) * last.stride)
            if last.dtype == dtype and (last.count == 1 or last.stride == stride):
                self.runs[-1] = replace(last, stride=stride, count=last.count + 1)
                self.template += bytes(np.dtype(dtype).itemsize)
                return self
        return self.block(dtype, 1)

    def block(self, dtype: str, count: int) -> FixedMessage:
        """Append a new run of adjacent untagged numbers."""
        width = np.dtype(dtype).itemsize
        self.runs.append(Run(dtype, len(self.template), width, count))
        self.template += bytes(width * count)
        return self

    def text(self, field: int, value: str) -> FixedMessage:
        """Append a `string` field that is the same in every message."""
        data = value.encode()
        return self.constant(tag(field, BYTES) + varint(len(data)) + data)

    def nested(self, field: int, message: FixedMessage) -> FixedMessage:
        """Append a sub-message."""
        self.constant(tag(field, BYTES) + varint(len(message)))
        return self.append(message)

    def append(self, message: FixedMessage) -> FixedMessage:
        """Append the bytes and runs of another message without framing."""
        self.runs += [replace(run, offset=run.offset + len(self.template)) for run in message.runs]
        self.template += message.template
        return self

    def allocate(self, rows: int) -> NDArray[np.uint8]:
        """Return a writeable block of messages with zeros, shape (rows, length)."""
        block = np.empty((rows, len(self.template)), np.uint8)
        block[:] = np.frombuffer(self.template, np.uint8)
        return block

    def views(self, block: NDArray[np.uint8]) -> list[NDArray]:
        """Return the numbers of a contiguous block as views, one of shape (rows, count) per run."""
        length = len(self.template)
        if not len(block):  # numpy takes no offset into an empty buffer
            return [np.empty((0, run.count), run.dtype) for run in self.runs]
        return [
            np.ndarray((len(block), run.count), run.dtype, block.data, run.offset, (length, run.stride))  # type: ignore[arg-type]
            for run in self.runs
        ]

    def parse(self, block: NDArray[np.uint8], what: str) -> list[NDArray]:
        """Return the numbers of messages.

        Args:
            block: The messages, one a row, contiguous, shape (rows, length).
            what: Topic, for the error message.

        Returns:
            Views of `block`, one of shape (rows, count) for each run.

        Raises:
            RecordingError: the messages do not have this layout.
        """
        template, constant = self._constants
        wrong = np.flatnonzero(((block ^ template) & constant).any(axis=1))
        if len(wrong):
            raise RecordingError(
                f"message {wrong[0]} does not match its schema",
                key=what, value=int(wrong[0]),
            )  # fmt: skip
        return self.views(block)

    @cached_property
    def _constants(self) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Return the message with zeros, and a mask that is zero at the numbers."""
        mask = np.full(len(self.template), 255, np.uint8)
        for run in self.runs:
            width = np.dtype(run.dtype).itemsize
            for start in range(run.offset, run.offset + run.count * run.stride, run.stride):
                mask[start : start + width] = 0
        return np.frombuffer(bytes(self.template), np.uint8), mask
