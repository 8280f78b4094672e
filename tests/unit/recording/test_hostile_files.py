"""Files made to fill memory or time, or to look like recordings: refused with bounded time and memory."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk, McapRecord, Metadata
from mcap.records import Channel as Topic

from activesteer.core.limits import MAX_CHUNK_BYTES, MAX_EXPANSION, MAX_FILE_BYTES, MAX_OTHER_BYTES
from activesteer.core.signals import Channel
from activesteer.errors import RecordingError
from activesteer.recording import McapWriter, Recording
from tests.raising import raises
from tests.unit.recording.conftest import assert_same
from tests.unit.recording.records import chunk, encoded, message, records_of, write_records

GIB = 2**30
EMPTY_MESSAGES = 300_000


def described(records: list[McapRecord]) -> list[McapRecord]:
    """Return the records before the first rows."""
    return [record for record in records if not isinstance(record, Chunk)]


def declaring(size: int, compression: str = "zstd") -> Chunk:
    """Return a chunk that declares and contains so many zero bytes."""
    if compression == "zstd":
        # Zeros of any length cost next to nothing; a mebibyte stands for them.
        return chunk(bytes(2**20), size=size)
    packed = lz4.frame.compress(bytes(2**20))
    return Chunk("lz4", packed, 0, 0, 0, size)


BOMBS: dict[str, Callable[[int], list[McapRecord]]] = {
    "a gibibyte of zeros": lambda _: [declaring(GIB)],
    "a gibibyte of zeros by lz4": lambda _: [declaring(GIB, "lz4")],
    "more than it declares": lambda _: [chunk(bytes(2**20), size=2**16)],
    "more than it declares by lz4": lambda _: [declaring(2**16, "lz4")],
    "nothing but opcode 0": lambda _: [chunk(bytes(2**15), "")],
    "empty messages": lambda number: [chunk(encoded([message(number)]) * EMPTY_MESSAGES, "")],
    "messages of no topic": lambda _: [chunk(encoded([message(999)]) * EMPTY_MESSAGES, "")],
    "unknown compression": lambda _: [Chunk("bzip2", b"BZh9", 0, 0, 0, 100)],
}


@pytest.mark.parametrize("name", BOMBS)
def test_chunk_that_is_a_bomb_is_damage(mcap_file: Path, tmp_path: Path, name: str) -> None:
    records = described(records_of(mcap_file))
    number = next(record.id for record in records if isinstance(record, Topic) and record.topic == "/state/vehicle")
    path = write_records(tmp_path / "bomb.mcap", [*records, *BOMBS[name](number)])
    with raises(RecordingError, value=path):
        Recording.open(path)
    assert len(Recording.open(path, recover=True)) == 0


def test_messages_of_other_tools_are_passed_over_up_to_a_limit(
    recording: Recording, mcap_file: Path, tmp_path: Path
) -> None:
    records = records_of(mcap_file)
    foreign = Topic(id=50, topic="/notes", message_encoding="json", metadata={}, schema_id=0)
    notes = encoded([message(50, b"{}")])
    opened = Recording.open(write_records(tmp_path / "notes.mcap", [foreign, *records, chunk(notes * 100)]))
    assert_same(recording, opened)
    path = write_records(tmp_path / "many.mcap", [foreign, *records, chunk(notes * EMPTY_MESSAGES, "")])
    with raises(RecordingError, value=path):
        Recording.open(path)


@pytest.mark.parametrize("opcode", [0, int(Opcode.MESSAGE), int(Opcode.FOOTER)])
def test_records_that_cannot_stand_there_are_damage(mcap_file: Path, opcode: int) -> None:
    data = mcap_file.read_bytes()
    header_end = 8 + 9 + int.from_bytes(data[9:17], "little")
    mcap_file.write_bytes(data[:header_end] + bytes([opcode]) + bytes(8) + data[header_end:])
    with raises(RecordingError, value=opcode):
        Recording.open(mcap_file)


def test_attachments_and_metadata_have_a_budget(
    mcap_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    records = records_of(mcap_file)
    monkeypatch.setattr("activesteer.core.limits.MAX_OTHER_BYTES", 200_000)
    Recording.open(mcap_file)
    attachment = Attachment(create_time=0, log_time=0, name="large", media_type="", data=bytes(200_000))
    for more in ([attachment], [Metadata(name="x", metadata={str(key): "y" * 100 for key in range(2000)})]):
        with raises(RecordingError, allowed=200_000):
            Recording.open(write_records(tmp_path / "large.mcap", [*more, *records]))


def test_what_compresses_beyond_the_limit_is_written_so_that_it_can_be_read(tmp_path: Path) -> None:
    """Wide rows of zeros compress a thousandfold."""
    channels = [Channel(f"c{column}_m", "m", "", "vehicle", single=False) for column in range(2000)]
    path = tmp_path / "zeros.mcap"
    Recording(channels, np.arange(200) * 1e-3, np.zeros((200, 2000))).save(path)
    opened = Recording.open(path)
    assert opened.values.shape == (200, 2000)
    assert not opened.values.any()
    chunks = [record for record in records_of(path) if isinstance(record, Chunk)]
    assert all(record.uncompressed_size <= MAX_EXPANSION * len(record.data) for record in chunks)
    assert all(record.uncompressed_size <= MAX_CHUNK_BYTES for record in chunks)


@pytest.mark.parametrize("make", [os.mkfifo, lambda path: path.symlink_to("/dev/zero")])
def test_what_never_ends_is_no_recording(tmp_path: Path, make: Callable[[Path], None]) -> None:
    path = tmp_path / "endless.mcap"
    make(path)
    with raises(RecordingError, value=path):
        Recording.open(path)


@pytest.mark.parametrize(("size", "most"), [(2**40, MAX_FILE_BYTES), (2**34, MAX_OTHER_BYTES)])
def test_file_of_holes_is_refused(mcap_file: Path, size: int, most: int) -> None:
    with mcap_file.open("r+b") as stream:
        stream.truncate(size)
        stream.seek(8)
        stream.write(bytes([int(Opcode.ATTACHMENT)]) + (size - 100).to_bytes(8, "little"))
    with raises(RecordingError, allowed=most):
        Recording.open(mcap_file)


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[2]), int(sys.argv[2])))
from activesteer.recording import Recording
from activesteer.errors import RecordingError
try:
    Recording.open(sys.argv[1])
except RecordingError as error:
    print(error)
"""


def test_bomb_takes_little_memory(mcap_file: Path, tmp_path: Path) -> None:
    """Endless zeros, in chunks that are each within the limits; the process has one GiB."""
    bombs = [chunk(bytes(2**16))] * 5000
    path = write_records(tmp_path / "bomb.mcap", [*described(records_of(mcap_file)), *bombs])
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # of this process: only shown where the test fails
    words = [sys.executable, "-c", LIMITED, str(path), str(2 * GIB)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, ""), used
    assert "a chunk holds a record with opcode 0" in done.stdout


def test_second_writer_of_a_file_is_told_so(tmp_path: Path, mcap_file: Path) -> None:
    speed = [Channel("v_mps", "m/s", "Speed", "vehicle")]
    with McapWriter(mcap_file, speed) as first:
        first.write([0.0], [[1.0]])
        with raises(RecordingError, value=mcap_file):
            McapWriter(mcap_file, speed)
        first.write([1.0], [[2.0]])
    assert Recording.open(mcap_file)["v_mps"].tolist() == [1.0, 2.0]
    McapWriter(mcap_file, speed).close()
    assert len(Recording.open(mcap_file)) == 0


@pytest.mark.parametrize("instead", [None, b"something else"])
def test_file_that_is_gone_at_the_end_is_an_error(tmp_path: Path, instead: bytes | None) -> None:
    path = tmp_path / "run.mcap"
    writer = McapWriter(path, [Channel("v_mps", "m/s", "Speed", "vehicle")])
    writer.write([0.0], [[1.0]])
    path.unlink()
    if instead is not None:
        path.write_bytes(instead)
    with raises(RecordingError, value=path):
        writer.close()


@pytest.fixture
def long_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each file is too large for memory, so one channel is read at a time."""
    monkeypatch.setattr("activesteer.recording.reader.MAX_LOADED_VALUES", 0)
    monkeypatch.setattr("activesteer.recording.rows._READ_BYTES", 1)


@pytest.mark.usefixtures("long_files")
def test_long_file_is_read_where_it_is_needed(recording: Recording, mcap_file: Path, tmp_path: Path) -> None:
    opened = Recording.open(mcap_file)
    assert_same(recording, opened)
    assert not opened["yaw_rate_radps"].flags.writeable
    assert np.array_equal(opened.values[:, 0], opened["yaw_rate_radps"])
    opened.save(tmp_path / "again.mcap")
    assert_same(recording, Recording.open(tmp_path / "again.mcap"))


@pytest.mark.usefixtures("long_files")
def test_long_file_stays_readable_while_it_is_replaced(recording: Recording, mcap_file: Path) -> None:
    opened = Recording.open(mcap_file)
    McapWriter(mcap_file, [Channel("v_mps", "m/s", "Speed", "vehicle")]).close()
    assert_same(recording, opened)
    opened.save(mcap_file)
    assert_same(recording, Recording.open(mcap_file))


@pytest.mark.usefixtures("long_files")
def test_long_file_that_is_changed_is_an_error_and_not_another_run(mcap_file: Path) -> None:
    opened = Recording.open(mcap_file)
    data = mcap_file.read_bytes()
    with mcap_file.open("r+b") as stream:
        stream.truncate(len(data) // 2)
    with raises(RecordingError):
        opened["yaw_rate_radps"]
