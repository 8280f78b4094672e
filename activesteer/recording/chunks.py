"""MCAP chunks: encoding of rows and poses, and decoding."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from activesteer.core import limits
from activesteer.errors import RecordingError
from activesteer.recording.container import ChunkData
from activesteer.recording.contents import TRANSFORMS_TOPIC
from activesteer.recording.schemas import ChannelTable, FixedMessage, state_layout, timestamps, transforms_layout

MESSAGE_HEAD = 22
"""Length of a message record between its length and its data: channel, sequence, two times [bytes]."""

_INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])


def message_record(channel_id: int, message: FixedMessage) -> FixedMessage:
    """Frame a message as an MCAP record that starts with the sequence number and the two times [ns]."""
    record = FixedMessage()
    record.constant(struct.pack("<BQH", Opcode.MESSAGE, MESSAGE_HEAD + len(message), channel_id))
    return record.block("<u4", 1).block("<u8", 2).append(message)


def _index_record(channel_id: int, time_ns: NDArray[np.uint64], offsets: NDArray[np.int64]) -> tuple[int, bytes]:
    entries = np.empty(len(time_ns), _INDEX_ENTRY)
    entries["time"] = time_ns
    entries["offset"] = offsets
    head = struct.pack("<BQHI", Opcode.MESSAGE_INDEX, 6 + entries.nbytes, channel_id, entries.nbytes)
    return len(entries), head + entries.tobytes()


def few_messages(channel_id: int, messages: Sequence[tuple[int, bytes]]) -> ChunkData:
    """Return a chunk of messages of one topic."""
    records = []
    for time_ns, data in messages:
        record = message_record(channel_id, FixedMessage().constant(data))
        block = record.allocate(1)
        record.views(block)[1][:] = time_ns
        records.append(block.tobytes())
    times = np.array([time_ns for time_ns, _ in messages], np.uint64)
    offsets = np.cumsum([0, *map(len, records[:-1])])
    chunk = b"".join(records)
    return ChunkData(int(times[0]), int(times[-1]), chunk, {channel_id: _index_record(channel_id, times, offsets)})


class _Rows:
    """Template of a block of rows: constant bytes, and numbers that change from block to block."""

    def __init__(self, layout: FixedMessage) -> None:
        self.layout = layout
        self.block = layout.allocate(0)
        self.views: list[NDArray] = []

    def at_least(self, rows: int) -> None:
        """Make room for a number of rows."""
        if rows > len(self.block) or not self.views:
            self.block = self.layout.allocate(max(rows, 1))
            self.views = self.layout.views(self.block)


class BlockEncoder:
    """Encoder of the blocks of a file: one message per row and group, and poses between the rows."""

    def __init__(
        self,
        channels: ChannelTable,
        body_names: Sequence[str],
        group_ids: Mapping[str, int],
        transforms_id: int,
    ) -> None:
        """Prepare the layouts of the messages."""
        layout = FixedMessage()
        table = list(channels)
        self._group_offsets: list[tuple[int, int]] = []
        self._columns: list[list[int]] = []  # group -> columns of `values` in the order of its fields
        for group, columns in channels.groups().items():
            self._group_offsets.append((group_ids[group], len(layout)))
            self._columns.append(columns)
            layout.append(message_record(group_ids[group], state_layout(table[column] for column in columns)))
        self._rows = _Rows(layout)
        self._transforms_id = transforms_id
        self._poses = _Rows(message_record(transforms_id, transforms_layout(body_names)))
        self._stretches = self._column_stretches(layout)
        self._row_count = 0
        self._pose_count = 0

    @property
    def row_bytes(self) -> int:
        """Length of a row without poses [bytes]."""
        return len(self._rows.layout)

    def _column_stretches(self, layout: FixedMessage) -> list[list[tuple[slice, slice]]]:
        """Split each run of channel values into adjacent columns; numpy would first copy a list of columns."""
        stretches: list[list[tuple[slice, slice]]] = []
        runs = iter(layout.runs)
        for group in self._columns:
            _sequence, _times = next(runs), next(runs)
            used = 0
            while used < len(group):
                columns = np.array(group[used : used + next(runs).count])
                used += len(columns)
                breaks = np.flatnonzero(np.diff(columns) != 1) + 1
                bounds = [0, *breaks.tolist(), len(columns)]
                stretches.append(
                    [
                        (slice(first, last), slice(int(columns[first]), int(columns[last - 1]) + 1))
                        for first, last in pairwise(bounds)
                    ]
                )
        return stretches

    def encode(
        self,
        row_ns: NDArray[np.uint64],
        values: NDArray[np.float64],
        pose_ns: NDArray[np.uint64],
        positions_m: NDArray[np.float64],
        quaternions: NDArray[np.float64],
    ) -> ChunkData:
        """Encode a block of rows and poses."""
        rows, poses = len(row_ns), len(pose_ns)
        self._encode_rows(row_ns, values)
        self._encode_poses(pose_ns, positions_m, quaternions)
        row_length, pose_length = len(self._rows.layout), len(self._poses.layout)

        # In order of time; a pose follows the row of the same time.
        rows_before = np.searchsorted(row_ns, pose_ns, side="right")
        row_bytes = self._rows.block.reshape(-1).data
        pose_bytes = self._poses.block.reshape(-1).data
        pieces: list[memoryview] = []
        done = 0
        for pose, row in enumerate(rows_before.tolist()):
            pieces.append(row_bytes[done * row_length : row * row_length])
            pieces.append(pose_bytes[pose * pose_length : (pose + 1) * pose_length])
            done = row
        pieces.append(row_bytes[done * row_length : rows * row_length])

        indexes: dict[int, tuple[int, bytes]] = {}
        if rows:
            starts = np.arange(rows) * row_length + np.searchsorted(pose_ns, row_ns, side="left") * pose_length
            for number, offset in self._group_offsets:
                indexes[number] = _index_record(number, row_ns, starts + offset)
        if poses:
            starts = np.arange(poses) * pose_length + rows_before * row_length
            indexes[self._transforms_id] = _index_record(self._transforms_id, pose_ns, starts)
        ends = [int(time_ns[which]) for time_ns in (row_ns, pose_ns) if len(time_ns) for which in (0, -1)]
        return ChunkData(min(ends), max(ends), b"".join(pieces), indexes)

    def _encode_rows(self, row_ns: NDArray[np.uint64], values: NDArray[np.float64]) -> None:
        rows = len(row_ns)
        self._rows.at_least(rows)
        views = iter(self._rows.views)
        runs = iter(self._stretches)
        sequence = np.arange(self._row_count, self._row_count + rows, dtype=np.uint32)
        self._row_count += rows
        with np.errstate(over="ignore"):  # A value of a diverging run may exceed 32 bit and becomes infinite.
            for columns in self._columns:
                next(views)[:rows, 0] = sequence
                next(views)[:rows] = row_ns[:, None]
                used = 0
                while used < len(columns):
                    view = next(views)
                    for part, neighbours in next(runs):
                        view[:rows, part] = values[:, neighbours]
                    used += view.shape[1]

    def _encode_poses(
        self, pose_ns: NDArray[np.uint64], positions_m: NDArray[np.float64], quaternions: NDArray[np.float64]
    ) -> None:
        poses = len(pose_ns)
        self._poses.at_least(poses)
        sequence, times, *bodies = self._poses.views
        sequence[:poses, 0] = np.arange(self._pose_count, self._pose_count + poses, dtype=np.uint32)
        self._pose_count += poses
        times[:poses] = pose_ns[:, None]
        stamps = timestamps(pose_ns)
        rotations = quaternions[:, :, (1, 2, 3, 0)]  # Foxglove uses the order x y z w.
        for body in range(len(bodies) // 3):
            stamp, position, rotation = bodies[3 * body : 3 * body + 3]
            stamp[:poses] = stamps
            position[:poses] = positions_m[:, body]
            rotation[:poses] = rotations[:, body]


_RECORD: Final = struct.Struct("<BQH")
"""Opcode and length of a record, and channel id of a message."""
_RECORD_HEAD: Final = 9
_OTHERS: Final = (Opcode.SCHEMA, Opcode.CHANNEL)
"""Other records that a chunk may hold: some tools repeat schemas and channels there."""


class Group(NamedTuple):
    """Channels of one topic, and the layout of their messages."""

    topic: str  # name of the topic
    names: list[str]  # names of its fields
    columns: list[int]  # columns of its fields
    layout: FixedMessage  # layout of its messages


class Block(NamedTuple):
    """Decoded contents of a chunk."""

    row_ns: NDArray[np.uint64]  # time of each row [ns], shape (n,)
    columns: Mapping[int, NDArray]  # column -> values, 32 or 64 bit, shape (n,)
    pose_ns: NDArray[np.uint64]  # time of each set of poses [ns], shape (k,)
    positions_m: NDArray[np.float64]  # positions of the bodies [m], shape (k, number of bodies, 3)
    quaternions: NDArray[np.float64]  # orientations of the bodies, w x y z, shape (k, number of bodies, 4)
    others: Mapping[int, list[bytes]]  # MCAP channel id -> messages of other topics


class BlockDecoder:
    """Decoder of the chunks of a file."""

    def __init__(
        self, groups: Mapping[int, Group], body_names: Sequence[str], transforms_id: int | None, others: Iterable[int]
    ) -> None:
        """Prepare the layouts of the messages."""
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
        """Decode the messages of a chunk."""
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
        """Find the messages of our topics and of other topics."""
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
