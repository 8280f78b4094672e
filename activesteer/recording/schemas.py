"""Channels of a recording and the schemas of their messages.

Every message of a topic has the same fields, and `double`, `float` and padded varints have a fixed width. So all
messages of a topic form one byte array. Its constant bytes (tags, lengths, names) are filled in once, and its numbers
are strided views. A few array assignments encode or decode a block. Every protobuf library can read the result.

Source: protobuf encoding specification, https://protobuf.dev/programming-guides/encoding (padded varints are legal).

Each topic carries its schema as a protobuf `FileDescriptorSet`, so other tools can decode it without this package.

Source of the `foxglove` messages: foxglove-sdk, schemas/proto (names and field numbers).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from google.protobuf import duration_pb2, timestamp_pb2
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from numpy.typing import ArrayLike, NDArray

from activesteer.core import limits
from activesteer.core.signals import Channel
from activesteer.errors import RecordingError, nearest_names

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5
"""Wire types of protobuf."""

STAMP_LENGTH = 12
"""Length of a google.protobuf.Timestamp made by `timestamps` [bytes]."""

_SHIFTS = np.arange(0, 35, 7, dtype=np.uint64)
_CONTINUES = np.array([0x80, 0x80, 0x80, 0x80, 0], np.uint64)
"""For a varint padded to five bytes: shifts of its seven-bit groups, and the bits that mark a following byte."""


@dataclass(frozen=True)
class ColumnRun:
    """Run of numbers at a constant distance in a message."""

    dtype: str  # little-endian numpy type of one number
    offset: int  # position of the first number in the message [byte]
    stride: int  # distance from one number to the next [byte]
    count: int  # how many there are


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
    """Encode times as google.protobuf.Timestamp with varints padded to five bytes."""
    out = np.empty((len(time_ns), STAMP_LENGTH), np.uint8)
    billion = np.uint64(1_000_000_000)
    for field, start, value in ((1, 0, time_ns // billion), (2, 6, time_ns % billion)):
        out[:, start] = tag(field, VARINT)[0]
        out[:, start + 1 : start + 6] = (value[:, np.newaxis] >> _SHIFTS) & np.uint64(0x7F) | _CONTINUES
    return out


class FixedMessage:
    """Layout of a message of constant length: its bytes, and the positions of its numbers."""

    def __init__(self) -> None:
        """Start with an empty message."""
        self.template = bytearray()
        self.runs: list[ColumnRun] = []

    def __len__(self) -> int:
        """Return the length of the message [byte]."""
        return len(self.template)

    def constant(self, data: bytes) -> FixedMessage:
        """Append constant bytes."""
        self.template += data
        return self

    def number(self, field: int, dtype: str) -> FixedMessage:
        """Append a `double` (`<f8`) or `float` (`<f4`) field."""
        self.template += tag(field, FIXED64 if dtype == "<f8" else FIXED32)
        return self.raw(dtype)

    def raw(self, dtype: str) -> FixedMessage:
        """Append an untagged number, which extends the last run if the distance is the same."""
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
        self.runs.append(ColumnRun(dtype, len(self.template), width, count))
        self.template += bytes(width * count)
        return self

    def text(self, field: int, value: str) -> FixedMessage:
        """Append a constant `string` field."""
        data = value.encode()
        return self.constant(tag(field, BYTES) + varint(len(data)) + data)

    def nested(self, field: int, message: FixedMessage) -> FixedMessage:
        """Append a sub-message with its own layout."""
        self.constant(tag(field, BYTES) + varint(len(message)))
        return self.append(message)

    def append(self, message: FixedMessage) -> FixedMessage:
        """Append the bytes and runs of another message without framing."""
        self.runs += [replace(run, offset=run.offset + len(self.template)) for run in message.runs]
        self.template += message.template
        return self

    def allocate(self, rows: int) -> NDArray[np.uint8]:
        """Return a writeable block of empty messages, shape (rows, length)."""
        block = np.empty((rows, len(self.template)), np.uint8)
        block[:] = np.frombuffer(self.template, np.uint8)
        return block

    def views(self, block: NDArray[np.uint8]) -> list[NDArray]:
        """Return views of the numbers of a contiguous block, one of shape (rows, count) for each run."""
        length = len(self.template)
        if not len(block):  # numpy takes no offset into an empty buffer
            return [np.empty((0, run.count), run.dtype) for run in self.runs]
        return [
            np.ndarray((len(block), run.count), run.dtype, block.data, run.offset, (length, run.stride))  # type: ignore[arg-type]
            for run in self.runs
        ]

    def parse(self, block: NDArray[np.uint8], what: str) -> list[NDArray]:
        """Return the numbers of messages."""
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
        """Return an empty message, and the mask of its constant bytes."""
        mask = np.full(len(self.template), 255, np.uint8)
        for run in self.runs:
            width = np.dtype(run.dtype).itemsize
            for start in range(run.offset, run.offset + run.count * run.stride, run.stride):
                mask[start : start + width] = 0
        return np.frombuffer(bytes(self.template), np.uint8), mask


TRANSFORMS_SCHEMA = "foxglove.FrameTransforms"
SCENE_SCHEMA = "foxglove.SceneUpdate"
LOG_SCHEMA = "foxglove.Log"
WORLD = "world"
"""Name of the frame of all poses."""

_SCALARS = {
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "float": FieldDescriptorProto.TYPE_FLOAT,
    "bool": FieldDescriptorProto.TYPE_BOOL,
    "string": FieldDescriptorProto.TYPE_STRING,
    "bytes": FieldDescriptorProto.TYPE_BYTES,
    "fixed32": FieldDescriptorProto.TYPE_FIXED32,
}
_FIELD = re.compile(r"(repeated )?([\w.]+) (\w+) = (\d+)")

_FOXGLOVE = {
    "Vector3": "double x = 1, double y = 2, double z = 3",
    "Point3": "double x = 1, double y = 2, double z = 3",
    "Quaternion": "double x = 1, double y = 2, double z = 3, double w = 4",
    "Color": "double r = 1, double g = 2, double b = 3, double a = 4",
    "Pose": "foxglove.Vector3 position = 1, foxglove.Quaternion orientation = 2",
    "KeyValuePair": "string key = 1, string value = 2",
    "FrameTransform": "google.protobuf.Timestamp timestamp = 1, string parent_frame_id = 2, "
    "string child_frame_id = 3, foxglove.Vector3 translation = 4, foxglove.Quaternion rotation = 5",
    "FrameTransforms": "repeated foxglove.FrameTransform transforms = 1",
    "ArrowPrimitive": "foxglove.Pose pose = 1, double shaft_length = 2, double shaft_diameter = 3, "
    "double head_length = 4, double head_diameter = 5, foxglove.Color color = 6",
    "CubePrimitive": "foxglove.Pose pose = 1, foxglove.Vector3 size = 2, foxglove.Color color = 3",
    "SpherePrimitive": "foxglove.Pose pose = 1, foxglove.Vector3 size = 2, foxglove.Color color = 3",
    "CylinderPrimitive": "foxglove.Pose pose = 1, foxglove.Vector3 size = 2, double bottom_scale = 3, "
    "double top_scale = 4, foxglove.Color color = 5",
    "LinePrimitive": "Type type = 1, foxglove.Pose pose = 2, double thickness = 3, bool scale_invariant = 4, "
    "repeated foxglove.Point3 points = 5, foxglove.Color color = 6, repeated foxglove.Color colors = 7, "
    "repeated fixed32 indices = 8",
    "TriangleListPrimitive": "foxglove.Pose pose = 1, repeated foxglove.Point3 points = 2, foxglove.Color color = 3, "
    "repeated foxglove.Color colors = 4, repeated fixed32 indices = 5",
    "TextPrimitive": "foxglove.Pose pose = 1, bool billboard = 2, double font_size = 3, bool scale_invariant = 4, "
    "foxglove.Color color = 5, string text = 6",
    "ModelPrimitive": "foxglove.Pose pose = 1, foxglove.Vector3 scale = 2, foxglove.Color color = 3, "
    "bool override_color = 4, string url = 5, string media_type = 6, bytes data = 7",
    "SceneEntityDeletion": "google.protobuf.Timestamp timestamp = 1, Type type = 2, string id = 3",
    "SceneEntity": "google.protobuf.Timestamp timestamp = 1, string frame_id = 2, string id = 3, "
    "google.protobuf.Duration lifetime = 4, bool frame_locked = 5, repeated foxglove.KeyValuePair metadata = 6, "
    "repeated foxglove.ArrowPrimitive arrows = 7, repeated foxglove.CubePrimitive cubes = 8, "
    "repeated foxglove.SpherePrimitive spheres = 9, repeated foxglove.CylinderPrimitive cylinders = 10, "
    "repeated foxglove.LinePrimitive lines = 11, repeated foxglove.TriangleListPrimitive triangles = 12, "
    "repeated foxglove.TextPrimitive texts = 13, repeated foxglove.ModelPrimitive models = 14",
    "Log": "google.protobuf.Timestamp timestamp = 1, Type level = 2, string message = 3, string name = 4, "
    "string file = 5, fixed32 line = 6",
    "SceneUpdate": "repeated foxglove.SceneEntityDeletion deletions = 1, repeated foxglove.SceneEntity entities = 2",
}
_FOXGLOVE_ENUMS = {
    "LinePrimitive": ("LINE_STRIP", "LINE_LOOP", "LINE_LIST"),
    "SceneEntityDeletion": ("MATCHING_ID", "ALL"),
    "Log": ("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"),
}


def _define(package: str, name: str, fields: str, enum: Sequence[str] = ()) -> DescriptorProto:
    """Return the descriptor of a message from fields in the notation of .proto."""
    message = DescriptorProto(name=name)
    for repeated, kind, field_name, number in _FIELD.findall(fields):
        # An explicit JSON name separates names that differ in case only (`a_n`, `a_N`).
        field = message.field.add(name=field_name, number=int(number), json_name=field_name)
        field.label = FieldDescriptorProto.LABEL_REPEATED if repeated else FieldDescriptorProto.LABEL_OPTIONAL
        if kind in _SCALARS:
            field.type = _SCALARS[kind]
        elif kind == "Type":
            field.type, field.type_name = FieldDescriptorProto.TYPE_ENUM, f".{package}.{name}.Type"
        else:
            field.type, field.type_name = FieldDescriptorProto.TYPE_MESSAGE, f".{kind}"
    if enum:
        kinds = message.enum_type.add(name="Type")
        for number, value in enumerate(enum):
            kinds.value.add(name=value, number=number)
    return message


@cache
def foxglove_schema() -> bytes:
    """Return a serialised `FileDescriptorSet` with the Foxglove messages for poses and scene."""
    files = FileDescriptorSet()
    timestamp_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    duration_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    foxglove = FileDescriptorProto(name="foxglove.proto", package="foxglove", syntax="proto3")
    foxglove.dependency.extend(entry.name for entry in files.file)
    for name, fields in _FOXGLOVE.items():
        foxglove.message_type.append(_define("foxglove", name, fields, _FOXGLOVE_ENUMS.get(name, ())))
    files.file.append(foxglove)
    return files.SerializeToString()


@cache
def message_class(name: str) -> Any:
    """Return the class of a Foxglove message, which protobuf creates at run time."""
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(foxglove_schema()).file:
        pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName(name))


def state_schema(group: str, channels: Iterable[Channel]) -> tuple[str, bytes]:
    """Return name and serialised `FileDescriptorSet` of a group: one field per channel, numbered from 1."""
    fields = ", ".join(
        f"{'float' if channel.single else 'double'} {channel.name} = {number}"
        for number, channel in enumerate(channels, start=1)
    )
    file = FileDescriptorProto(name=f"activesteer/{group}.proto", package="activesteer", syntax="proto3")
    file.message_type.append(_define("activesteer", group.capitalize(), fields))
    return f"activesteer.{group.capitalize()}", FileDescriptorSet(file=[file]).SerializeToString()


def state_fields(schema: bytes, schema_name: str) -> tuple[list[str], FixedMessage]:
    """Parse a schema of `state_schema`, and return its field names and the layout of its messages."""
    files = FileDescriptorSet.FromString(schema).file
    messages = [each for file in files for each in file.message_type if f"{file.package}.{each.name}" == schema_name]
    if not messages:
        raise RecordingError(f"the schema of {schema_name} does not define it")
    layout = FixedMessage()
    kinds = {FieldDescriptorProto.TYPE_FLOAT: "<f4", FieldDescriptorProto.TYPE_DOUBLE: "<f8"}
    for field in messages[0].field:
        if field.type not in kinds or field.label == FieldDescriptorProto.LABEL_REPEATED:
            raise RecordingError(f"field {field.name} of {messages[0].name} is neither float nor double")
        layout.number(field.number, kinds[field.type])
    return [field.name for field in messages[0].field], layout


def state_layout(channels: Iterable[Channel]) -> FixedMessage:
    """Return the layout of the message of a group (see `state_schema`)."""
    layout = FixedMessage()
    for number, channel in enumerate(channels, start=1):
        layout.number(number, "<f4" if channel.single else "<f8")
    return layout


def transforms_layout(body_names: Iterable[str]) -> FixedMessage:
    """Return the layout of `foxglove.FrameTransforms`: timestamp, x y z, x y z w for each body in `world`."""
    layout = FixedMessage()
    for name in body_names:
        transform = FixedMessage().nested(1, FixedMessage().block("u1", STAMP_LENGTH))
        transform.text(2, WORLD).text(3, name)
        for field, numbers in ((4, 3), (5, 4)):
            vector = FixedMessage()
            for number in range(1, numbers + 1):
                vector.number(number, "<f8")
            transform.nested(field, vector)
        layout.nested(1, transform)
    return layout


_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,254}")
_GROUP = re.compile(r"[a-z][a-z0-9_]{0,254}")
TIME = "time_s"
"""Name of the time column in every export. No channel may have it."""


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
                    f"channel name {channel.name!r:.300}: use letters, digits and '_', a letter first, but not "
                    f"{TIME!r}",
                    value=channel.name,
                )
            for text in (channel.unit, channel.meaning):
                if not isinstance(text, str) or len(text) > limits.MAX_DESCRIPTION_LETTERS or not text.isprintable():
                    raise RecordingError(
                        f"channel {channel.name!r}: unit and meaning must each be one line of text, not {text!r:.100}"
                    )
            if not _GROUP.fullmatch(channel.group):
                raise RecordingError(
                    f"group {channel.group!r:.300} of channel {channel.name!r}: use a to z, 0 to 9 and '_', "
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
        """Return the columns of each group, in the order of the groups' first channels."""
        columns: dict[str, list[int]] = {}
        for column, channel in enumerate(self._channels):
            columns.setdefault(channel.group, []).append(column)
        return columns

    def __getitem__(self, name: str) -> Channel:
        """Return a channel by its name, or raise `RecordingError` if there is none."""
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
        """Show the channel names."""
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
            f"must increase: row {row} is at {times[row]} s, but the row before it at {before_s} s",
            key=what,
            value=float(times[row]),
        )
    return result.view(np.uint64)


def shaped(array: ArrayLike, what: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return values as a float array of a given shape."""
    try:
        numbers = np.asarray(array, np.float64)
    except (TypeError, ValueError) as error:
        raise RecordingError(str(error), key=what) from None
    if numbers.size == 0 and 0 in shape:
        return numbers.reshape(shape)
    if numbers.shape != shape:
        raise RecordingError(f"has shape {numbers.shape} in place of {shape}", key=what)
    return numbers
