from __future__ import annotations

import numpy as np
import pytest
from google.protobuf.timestamp_pb2 import Timestamp

from activesteer.core.signals import Channel
from activesteer.errors import RecordingError
from activesteer.recording.schemas import (
    FixedMessage,
    state_fields,
    state_layout,
    state_schema,
    timestamps,
    varint,
)
from tests.raising import raises


@pytest.mark.parametrize(
    ("value", "encoded"), [(0, b"\x00"), (127, b"\x7f"), (128, b"\x80\x01"), (300, b"\xac\x02"), (2**32, None)]
)
def test_varints_are_those_of_the_specification(value: int, encoded: bytes | None) -> None:
    data = varint(value)
    assert encoded is None or data == encoded
    assert sum((byte & 0x7F) << 7 * place for place, byte in enumerate(data)) == value


def test_the_reference_library_reads_padded_timestamps() -> None:
    times = np.array([0, 1, 999_999_999, 1_000_000_000, 12_345_678_901_234], np.uint64)
    for time_ns, encoded in zip(times, timestamps(times), strict=True):
        stamp = Timestamp.FromString(encoded.tobytes())
        assert stamp.seconds * 10**9 + stamp.nanos == time_ns


def test_neighbours_of_one_type_are_one_run() -> None:
    """Twenty floats: fifteen with a tag of one byte, five with a tag of two; then a double."""
    layout = FixedMessage()
    for number in range(1, 21):
        layout.number(number, "<f4")
    layout.number(21, "<f8")
    assert [(run.count, run.stride) for run in layout.runs] == [(15, 5), (5, 6), (1, 8)]
    assert len(layout) == 15 * 5 + 5 * 6 + 10


def test_what_is_written_to_the_views_is_parsed_back(rng: np.random.Generator) -> None:
    layout = FixedMessage().number(1, "<f8").text(2, "constant").number(3, "<f4").number(4, "<f4")
    block = layout.allocate(10)
    numbers = [rng.normal(size=(10, run.count)).astype(run.dtype) for run in layout.runs]
    for view, values in zip(layout.views(block), numbers, strict=True):
        view[:] = values
    for view, values in zip(layout.parse(block, "/state/x"), numbers, strict=True):
        assert np.array_equal(view, values)


def test_messages_of_another_layout_are_refused() -> None:
    layout = FixedMessage().number(1, "<f8").number(2, "<f8")
    other = layout.allocate(3)
    other[1, 9] ^= 0x08  # the second tag of the second message
    with raises(RecordingError, key="/state/x", value=1):
        layout.parse(other, "/state/x")


def test_the_layout_follows_from_the_schema_alone(channels: list[Channel]) -> None:
    name, schema = state_schema("vehicle", channels)
    names, layout = state_fields(schema, name)
    assert names == [channel.name for channel in channels]
    assert layout.runs == state_layout(channels).runs
    assert layout.template == state_layout(channels).template
