"""Reader of complete, truncated or damaged MCAP files, with limits for all declared sizes."""

from __future__ import annotations

import json
import os
import stat
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import numpy as np
from google.protobuf.message import DecodeError
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, DataEnd, Metadata, Schema
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

from activesteer.core import limits
from activesteer.core.files import reading, shown_path
from activesteer.core.signals import Channel as SignalChannel
from activesteer.errors import RecordingError
from activesteer.recording.chunks import Block, BlockDecoder, Group
from activesteer.recording.contents import (
    EVENTS_TOPIC,
    FORMAT_RECORD,
    FORMAT_VERSION,
    METRICS_RECORD,
    RESULT_RECORD,
    RUN_RECORD,
    SCENE_TOPIC,
    STATE_TOPIC,
    TRANSFORMS_TOPIC,
    check_bodies,
    check_metadata,
    check_metrics,
    check_names,
    decode_event,
    decode_scene,
)
from activesteer.recording.rows import (
    BROKEN,
    FileRows,
    Place,
    Poses,
    messages_of,
    poses_of,
    read_bytes,
    values_of,
)
from activesteer.recording.schemas import ChannelTable, state_fields

_RECORD: Final = struct.Struct("<BQ")
_PIECE_BYTES: Final = 2**20
_READ: Final = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.METADATA: Metadata,
    Opcode.ATTACHMENT: Attachment,
}
"""Records that are kept. Chunks are read later, and all others repeat information."""
_REFUSED: Final = (0, Opcode.FOOTER, Opcode.MESSAGE)
"""Records that may not occur here: none, the footer, and a message outside a chunk."""


@dataclass
class Records:
    """Records of a file, with the positions of its chunks."""

    position: int = len(MCAP0_MAGIC)  # end of the last record
    crc: int = zlib.crc32(MCAP0_MAGIC)  # checksum of all bytes up to `position`
    schemas: dict[int, Schema] = field(default_factory=dict)
    topics: dict[int, Channel] = field(default_factory=dict)
    metadata: list[Metadata] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    chunks: list[tuple[int, int]] = field(default_factory=list)
    complete: bool = False  # whether the end of the data section was reached; the rest only repeats information
    damage: str = ""  # description of the damage
    reason: RecordingError | None = None  # the error behind the damage, if it is one of ours
    _bytes: int = 0
    _count: int = 0

    def read_next(self, descriptor: int, size: int) -> None:
        """Read one record, and move to its end even if it is damaged."""
        start, self.position = self.position, size + 1
        head = read_bytes(descriptor, start, min(_RECORD.size, size - start))
        opcode, length = _RECORD.unpack(head)
        first = start + _RECORD.size
        self.position = first + length
        if opcode in _REFUSED:
            raise RecordingError(f"a record has opcode {opcode}, which is not allowed at this place", value=opcode)
        if self.position > size:
            raise RecordingError(f"a record of {length} bytes reaches beyond the end")
        if opcode in _READ:
            self._bytes, self._count = self._bytes + length, self._count + 1
            if self._bytes > limits.MAX_OTHER_BYTES or self._count > limits.MAX_OTHER_RECORDS:
                raise RecordingError(
                    "attachments, schemas and metadata are too large",
                    value=self._bytes, allowed=limits.MAX_OTHER_BYTES,
                )  # fmt: skip
            self._take(opcode, read_bytes(descriptor, first, length))
        elif opcode == Opcode.CHUNK:
            self.chunks.append((first, length))
        elif opcode == Opcode.DATA_END:
            declared = DataEnd.read(ReadDataStream(BytesIO(read_bytes(descriptor, first, length)))).data_section_crc
            self.complete = True
            if declared not in (0, self.crc):
                raise RecordingError(f"the checksum of the file is {self.crc} instead of {declared}")
        self.crc = zlib.crc32(head, self.crc)
        for piece in range(first, self.position, _PIECE_BYTES):
            self.crc = zlib.crc32(read_bytes(descriptor, piece, min(_PIECE_BYTES, self.position - piece)), self.crc)

    def _take(self, opcode: int, content: bytes) -> None:
        record = _READ[Opcode(opcode)].read(ReadDataStream(BytesIO(content)))
        if isinstance(record, Schema):
            self.schemas[record.id] = record
        elif isinstance(record, Channel):
            self.topics[record.id] = record
        elif isinstance(record, Metadata):
            self.metadata.append(record)
        else:
            self.attachments[record.name] = record.data


def opened(path: Path) -> int:
    """Open a regular file and return its descriptor. Devices and pipes, which may never end, are rejected."""
    with reading(path, RecordingError):
        # Without O_NONBLOCK, opening a pipe would wait for a writer.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    mode = os.fstat(descriptor).st_mode
    if stat.S_ISREG(mode):
        return descriptor
    os.close(descriptor)
    what = "a folder; name its recordings as DIR/*.mcap" if stat.S_ISDIR(mode) else "a device or a pipe"
    raise RecordingError(f"cannot read {shown_path(path)}: it is {what}", value=path)


def read_records(descriptor: int, size: int) -> Records:
    """Collect all records up to the end of the data section."""
    records = Records()
    while not records.complete:
        start = records.position
        try:
            records.read_next(descriptor, size)
        except (RecordingError, *BROKEN) as error:
            # A killed process leaves a record that reaches beyond the end of the file. A file that continues after
            # the record, or ends properly, is damaged.
            ended = os.pread(descriptor, len(MCAP0_MAGIC), size - len(MCAP0_MAGIC)) == MCAP0_MAGIC
            if records.position <= size or ended:
                records.damage = f"bytes {start} to {min(records.position, size)} cannot be read: {words_of(error)}"
                records.reason = error if isinstance(error, RecordingError) else None
            break
    return records


def words_of(error: BaseException) -> str:
    """Describe an error of this package or of a library."""
    if isinstance(error, RecordingError):
        return str(error)
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__


MAX_LOADED_VALUES: Final = 2**25
"""Largest number of values that are loaded at once, 256 MiB; a longer recording stays in the file until needed."""
_END_OF_TIME_NS: Final = 2**35 * 10**9


def read_mcap(path: Path) -> tuple[dict[str, Any], str]:
    """Read a file of `McapWriter`, and return the arguments of `Recording` and a description of the damage."""
    # A file that ends too early, as after a killed process, gives its complete blocks, and a damaged file the part
    # before the damage. The values of a long recording are its rows, still in the file; its poses are then None.
    descriptor = opened(path)
    kept = False
    try:
        size = os.fstat(descriptor).st_size
        if os.pread(descriptor, len(MCAP0_MAGIC), 0) != MCAP0_MAGIC:
            raise RecordingError(
                f"{shown_path(path)} is not an MCAP file; `activesteer import` converts measured data", value=path
            )
        limits.check_count(size, limits.MAX_FILE_BYTES, "bytes", RecordingError, file=shown_path(path))
        records = read_records(descriptor, size)
        try:
            contents = _decode(descriptor, records)
            kept = isinstance(contents["values"], FileRows)
        except RecordingError as error:
            damage = f" ({records.damage})" if records.damage else ""
            reason = records.reason or error
            value = path if reason.value is None else reason.value
            raise RecordingError(f"{shown_path(path)}: {error}{damage}", value=value, allowed=reason.allowed) from None
    except (*BROKEN, DecodeError, LookupError, TypeError, AttributeError) as error:
        raise RecordingError(f"{shown_path(path)} is damaged: {words_of(error)}", value=path) from None
    finally:
        if not kept:
            os.close(descriptor)
    return contents, records.damage


def _decode(descriptor: int, records: Records) -> dict[str, Any]:
    metadata, metrics = _metadata(records)
    topics: dict[str, Channel] = {}
    for topic in records.topics.values():
        if topic.topic in topics:
            raise RecordingError(f"two topics have the name {topic.topic!r:.100}")
        topics[topic.topic] = topic
    channels, groups = _channels(records, topics)
    transforms, scene, log = (topics.get(name) for name in (TRANSFORMS_TOPIC, SCENE_TOPIC, EVENTS_TOPIC))
    bodies = _bodies(transforms)
    known = {*groups, *([] if transforms is None else [transforms.id])}
    decoder = BlockDecoder(
        groups,
        bodies,
        None if transforms is None else transforms.id,
        [other for other in records.topics if other not in known],
    )
    check_names(list(records.attachments), "attachments", limits.MAX_OTHER_RECORDS)
    rows = _Rows(len(channels), len(records.chunks))
    scenes: list[bytes] = []
    events: list[bytes] = []
    for start, length in records.chunks:
        try:
            limits.check_count(length, limits.MAX_CHUNK_BYTES, "bytes", RecordingError)
            data, crc = messages_of(read_bytes(descriptor, start, length))
            block = rows.add(Place(start, length, crc), data, decoder)
        except (RecordingError, *BROKEN) as error:
            records.damage = f"the chunk in bytes {start} to {start + length} cannot be read: {words_of(error)}"
            metadata["complete"] = False
            break
        scenes += block.others.get(scene.id, ()) if scene else ()
        events += block.others.get(log.id, ()) if log else ()
        limits.check_count(len(events), limits.MAX_EVENTS, "events", RecordingError)
    if len(scenes) > 1:
        raise RecordingError(f"there are {len(scenes)} scenes")
    parts = decode_scene(scenes[0]) if scenes else ()
    if events:
        metadata["events"] = [decode_event(event)._asdict() for event in events]
    values, poses = rows.collected(descriptor, decoder, list(channels))
    return {
        "channels": channels, "time_s": rows.time_s(), "values": values, "poses": poses, "metadata": metadata,
        "metrics": metrics, "attachments": records.attachments, "scene": parts,
    }  # fmt: skip


class _Rows:
    """Collector of chunks: positions, times, and the decoded blocks of a small file."""

    def __init__(self, channels: int, chunks: int) -> None:
        self._width = max(channels, 1)
        self._chunks = chunks
        self._places: list[Place] = []
        self._blocks: list[Block] | None = []
        self._times: list[NDArray[np.uint64]] = []
        self._rows = 0
        self._last_ns = [-1, -1]

    def add(self, place: Place, data: bytes, decoder: BlockDecoder) -> Block:
        """Check a chunk, and store its contents under its position."""
        block = decoder.decode(data)
        for kind, time_ns in enumerate((block.row_ns, block.pose_ns)):
            if not len(time_ns):
                continue
            if int(time_ns[0]) <= self._last_ns[kind] or (time_ns[1:] <= time_ns[:-1]).any():
                raise RecordingError("times do not increase")
            if int(time_ns[-1]) >= _END_OF_TIME_NS:
                raise RecordingError(f"a time is {time_ns[-1] / 1e9:g} s")
        limits.check_count(self._rows + len(block.row_ns), limits.MAX_ROWS, "rows", RecordingError)
        for kind, time_ns in enumerate((block.row_ns, block.pose_ns)):
            self._last_ns[kind] = int(time_ns[-1]) if len(time_ns) else self._last_ns[kind]
        self._rows += len(block.row_ns)
        self._places.append(place._replace(rows=len(block.row_ns), poses=len(block.pose_ns)))
        self._times.append(block.row_ns.copy())
        # The chunks of a run have equally many rows: a long recording is known by its first ones.
        if self._rows * self._width * self._chunks > MAX_LOADED_VALUES * len(self._places):
            self._blocks = None
        elif self._blocks is not None:
            self._blocks.append(block)
        return block

    def time_s(self) -> NDArray[np.float64]:
        return np.concatenate(self._times or [np.empty(0, np.uint64)]) / 1e9

    def collected(
        self, descriptor: int, decoder: BlockDecoder, channels: list[SignalChannel]
    ) -> tuple[NDArray[np.float64] | FileRows, Poses | None]:
        """Return all values and poses, read at once or on demand."""
        if self._blocks is None:
            return FileRows(descriptor, decoder, channels, self._places), None
        sets = sum(place.poses for place in self._places)
        return values_of(self._blocks, self._rows, len(channels)), poses_of(self._blocks, sets, decoder.body_names)


def _channels(records: Records, topics: Mapping[str, Channel]) -> tuple[ChannelTable, dict[int, Group]]:
    described: dict[int, SignalChannel] = {}
    groups: dict[int, Group] = {}
    for name, topic in topics.items():
        if not name.startswith(STATE_TOPIC):
            continue
        schema = records.schemas[topic.schema_id]
        names, layout = state_fields(schema.data, schema.name)
        limits.check_count(len(described) + len(names), limits.MAX_CHANNELS, "channels", RecordingError)
        if not names:
            raise RecordingError(f"topic {name!r:.100} has no channels")
        singles = [run.dtype == "<f4" for run in layout.runs for _ in range(run.count)]
        columns: list[int] = []
        for field_name, single in zip(names, singles, strict=True):
            notes = json.loads(topic.metadata[field_name])
            column, unit, meaning = notes["column"], notes["unit"], notes["meaning"]
            if column.__class__ is not int or column in described:
                raise RecordingError(f"channel {field_name!r:.100} has column {column!r:.40}")
            columns.append(column)
            described[column] = SignalChannel(field_name, unit, meaning, name.removeprefix(STATE_TOPIC), single)
        groups[topic.id] = Group(name, names, columns, layout)
    if sorted(described) != list(range(len(described))):
        raise RecordingError("the columns of its channels are not numbered 0, 1, 2 ...")
    return ChannelTable(described[column] for column in sorted(described)), groups


def _metadata(records: Records) -> tuple[dict[str, Any], dict[str, float]]:
    found: int | None = None
    texts: dict[str, str] = {}
    metrics: dict[str, float] = {}
    for record in records.metadata:
        if record.name == FORMAT_RECORD:
            found = int(record.metadata["version"])
        elif record.name in (RUN_RECORD, RESULT_RECORD):
            texts.update(record.metadata)
        elif record.name == METRICS_RECORD:
            metrics.update((name, float(number)) for name, number in record.metadata.items())
    if found is None:
        raise RecordingError("not a recording of activesteer, or cut off before its first row")
    if found > FORMAT_VERSION:
        raise RecordingError(
            f"format version {found}; this version of activesteer reads up to {FORMAT_VERSION}",
            value=found,
            allowed=FORMAT_VERSION,
        )
    metadata = {key: json.loads(text) for key, text in texts.items() if key != "metrics"}
    check_metadata(metadata)
    check_metrics(metrics)
    metadata["complete"] = metadata.get("complete", True) and records.complete
    return metadata, metrics


def _bodies(topic: Channel | None) -> tuple[str, ...]:
    if topic is None:
        return ()
    names = json.loads(topic.metadata["bodies"])
    if not isinstance(names, list):
        raise RecordingError("its bodies are not a list")
    check_bodies(names)
    return tuple(names)
