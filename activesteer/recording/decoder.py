"""Decoder of MCAP chunks into rows of channel values and poses, the inverse of the encoder."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Final, NamedTuple

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from activesteer import limits
from activesteer.errors import RecordingError
from activesteer.recording.encoder import MESSAGE_HEAD, message_record
from activesteer.recording.format import TRANSFORMS_TOPIC
from activesteer.recording.protobuf import FixedMessage
from activesteer.recording.schemas import transforms_layout

_RECORD: Final = struct.Struct("<BQH")
"""Opcode and length of a record, and channel id of a message."""
_RECORD_HEAD: Final = 9
_OTHERS: Final = (Opcode.SCHEMA, Opcode.CHANNEL)
"""Other records that a chunk may hold: some tools repeat schemas and channels there."""


class Group(NamedTuple):
    """Channels of a topic.

    Attributes:
        topic: Name of the topic.
        names: Names of its fields.
        columns: Columns of its fields.
        layout: Layout of its messages.
    """

    topic: str
    names: list[str]
    columns: list[int]
    layout: FixedMessage


class Block(NamedTuple):
    """Contents of a chunk.

    Attributes:
        row_ns: Time of each row [ns], shape (n,).
        columns: Column -> values, 32 or 64 bit, shape (n,).
        pose_ns: Time of each set of poses [ns], shape (k,).
        positions_m: Positions of the bodies [m], shape (k, number of bodies, 3).
        quaternions: Orientations of the bodies, w x y z, shape (k, number of bodies, 4).
        others: MCAP channel id -> messages of other topics.
    """

    row_ns: NDArray[np.uint64]
    columns: Mapping[int, NDArray]
    pose_ns: NDArray[np.uint64]
    positions_m: NDArray[np.float64]
    quaternions: NDArray[np.float64]
    others: Mapping[int, list[bytes]]


class BlockDecoder:
    """Decoder of the chunks of a file."""

    def __init__(
        self, groups: Mapping[int, Group], body_names: Sequence[str], transforms_id: int | None, others: Iterable[int]
    ) -> None:
        """Prepare the layouts of the messages.

        Args:
            groups: MCAP channel id -> group.
            body_names: Names of the bodies.
            transforms_id: MCAP channel id of the poses; None without poses.
            others: MCAP channel ids of all other topics.
        """
        self.body_names = tuple(body_names)
        self._groups = {number: (group, message_record(number, group.layout)) for number, group in groups.items()}
        self._transforms_id = transforms_id
        self._poses = message_record(transforms_id or 0, transforms_layout(body_names))
        self._topics = {number: group.topic for number, group in groups.items()}
        layouts = {number: record for number, (_, record) in self._groups.items()}
        if transforms_id is not None:
            layouts[transforms_id] = self._poses
            self._topics[transforms_id] = TRANSFORMS_TOPIC
        self._lengths = {number: len(layout) for number, layout in layouts.items()}
        self._others = set(others)
        self._last_length, self._last_starts = -1, dict[int, list[int]]()

    def decode(self, data: bytes) -> Block:
        """Decode the messages of a chunk.

        Raises:
            RecordingError: a message does not match the schema of its topic, a value is implausible, or topics differ
                in their times.
        """
        # Nearly all chunks of a file have their messages at the same places. The check of a message includes its head,
        # so the places of the last chunk can be tried first.
        if len(data) == self._last_length:
            with suppress(RecordingError):
                return self._parsed(data, self._last_starts, {})
        starts, others = self._starts(data)
        if sum(self._lengths[number] * len(found) for number, found in starts.items()) == len(data):
            self._last_length, self._last_starts = len(data), starts
        return self._parsed(data, starts, others)

    def _parsed(self, data: bytes, starts: Mapping[int, Sequence[int]], others: Mapping[int, list[bytes]]) -> Block:
        row_ns: NDArray[np.uint64] | None = None
        columns: dict[int, NDArray] = {}
        first = ""
        for number, (group, layout) in self._groups.items():
            _, times, *runs = layout.parse(_messages(data, starts[number], len(layout)), group.topic)
            if row_ns is None:
                row_ns, first = times[:, 0], group.topic
            elif not np.array_equal(times[:, 0], row_ns):
                raise RecordingError(f"{group.topic} and {first} have different times")
            values = [run[:, place] for run in runs for place in range(run.shape[1])]
            columns.update(zip(group.columns, values, strict=True))
            if any(limits.too_large(run, infinite=True).any() for run in runs):
                for place, column in enumerate(values):
                    limits.check_numbers(column, RecordingError, infinite=True, key=f"channel {group.names[place]}")
        poses = [] if self._transforms_id is None else starts[self._transforms_id]
        _, times, *runs = self._poses.parse(_messages(data, poses, len(self._poses)), TRANSFORMS_TOPIC)
        positions = np.empty((len(poses), len(self.body_names), 3))
        quaternions = np.empty((len(poses), len(self.body_names), 4))
        for body in range(len(self.body_names)):
            _, position, rotation = runs[3 * body : 3 * body + 3]
            positions[:, body] = position
            quaternions[:, body, 1:] = rotation[:, :3]  # Foxglove's order is x y z w.
            quaternions[:, body, 0] = rotation[:, 3]
        row_ns = np.empty(0, np.uint64) if row_ns is None else row_ns
        return Block(row_ns, columns, times[:, 0], positions, quaternions, others)

    def _starts(self, data: bytes) -> tuple[dict[int, list[int]], dict[int, list[bytes]]]:
        """Find the messages of our topics, and those of other topics."""
        starts: dict[int, list[int]] = {number: [] for number in self._lengths}
        others: dict[int, list[bytes]] = {}
        foreign = 0
        lengths, unpack = self._lengths, _RECORD.unpack_from
        position, end = 0, len(data)
        while position < end:
            try:
                opcode, length, number = unpack(data, position)
            except struct.error:
                raise RecordingError("a record reaches beyond its chunk") from None
            if opcode == Opcode.MESSAGE and lengths.get(number) == length + _RECORD_HEAD:
                starts[number].append(position)
            else:
                if opcode not in _OTHERS and not (opcode == Opcode.MESSAGE and number in self._others):
                    raise RecordingError(self._complaint(opcode, length, number))
                foreign += 1
                limits.check_count(foreign, limits.MAX_FOREIGN_MESSAGES, "records of other tools", RecordingError)
                if opcode == Opcode.MESSAGE:
                    stop = position + _RECORD_HEAD + length
                    others.setdefault(number, []).append(data[position + _RECORD_HEAD + MESSAGE_HEAD : stop])
            position += _RECORD_HEAD + length
        if position != end:
            raise RecordingError("a record reaches beyond its chunk")
        return starts, others

    def _complaint(self, opcode: int, length: int, number: int) -> str:
        if opcode != Opcode.MESSAGE:
            return f"a chunk holds a record with opcode {opcode}"
        if number not in self._lengths:
            return f"a message belongs to topic {number}, which does not exist"
        needed = self._lengths[number] - _RECORD_HEAD
        return f"{self._topics[number]}: a message has {length} bytes instead of {needed}"


def _messages(data: bytes, starts: Sequence[int], length: int) -> NDArray[np.uint8]:
    """Return messages of equal length, one per row."""
    if not starts:
        return np.empty((0, length), np.uint8)
    whole = np.frombuffer(data, np.uint8)
    return np.lib.stride_tricks.sliding_window_view(whole, length)[np.asarray(starts)]
