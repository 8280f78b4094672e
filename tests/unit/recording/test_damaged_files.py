from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from activesteer.errors import RecordingError
from activesteer.recording import Recording
from tests.raising import raises
from tests.unit.recording.conftest import BLOCK_ROWS, assert_same


def chunk_ends(path: Path) -> list[int]:
    """Return the byte offset of the end of each chunk with rows."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return [chunk.chunk_start_offset + chunk.chunk_length for chunk in summary.chunk_indexes[1:]]


def open_or_none(path: Path, *, recover: bool = False) -> Recording | None:
    """Return the recording, or None where opening it is refused with an error that names the file."""
    try:
        return Recording.open(path, recover=recover)
    except RecordingError as error:
        if str(path) not in str(error):
            raise
        return None


def test_a_file_cut_anywhere_gives_all_its_whole_blocks(recording: Recording, mcap_file: Path) -> None:
    data = mcap_file.read_bytes()
    ends = chunk_ends(mcap_file)
    cut_file = mcap_file.with_name("cut.mcap")
    before_rows = complete = 0
    for cut in [*range(0, len(data), 397), *(end + more for end in ends for more in (-1, 0, 1))]:
        cut_file.write_bytes(data[:cut])
        opened = open_or_none(cut_file)
        if opened is None:
            before_rows = max(before_rows, cut)
            continue
        rows = BLOCK_ROWS * sum(end <= cut for end in ends)
        assert len(opened) == rows
        assert np.array_equal(opened["yaw_rate_radps"], recording["yaw_rate_radps"][:rows])
        assert len(opened.poses.time_s) == rows // 5
        assert opened.metadata["controller"] == "ars"
        assert opened.attachments == recording.attachments
        complete += opened.metadata["complete"]
        assert not opened.metadata["complete"] or rows == len(recording)
    assert before_rows < ends[0]
    assert complete > 0  # cut in the summary, which only repeats what is there


def test_a_file_that_is_no_recording_says_so(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with raises(RecordingError, cause=FileNotFoundError):
        Recording.open(path)
    with raises(RecordingError, value=tmp_path):
        Recording.open(tmp_path)
    for data in (b"", b"\x89MCAP", b"no MCAP at all, but text"):
        path.write_bytes(data)
        with raises(RecordingError, value=path):
            Recording.open(path)


def test_an_mcap_file_of_another_program_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "foreign.mcap"
    writer = Writer(str(path))
    writer.start()
    channel = writer.register_channel("/state/vehicle", "json", writer.register_schema("x", "jsonschema", b"{}"))
    writer.add_message(channel, 0, b"{}", 0)
    writer.finish()
    with raises(RecordingError, value=path):
        Recording.open(path)


def test_a_later_format_is_refused(mcap_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("activesteer.recording.reader.FORMAT_VERSION", 0)
    with raises(RecordingError, value=1, allowed=0):
        Recording.open(mcap_file)


def test_a_damaged_block_is_named_and_what_comes_before_it_recovered(recording: Recording, mcap_file: Path) -> None:
    data = bytearray(mcap_file.read_bytes())
    data[chunk_ends(mcap_file)[2] - 100] ^= 0xFF  # in the third block
    mcap_file.write_bytes(data)
    with raises(RecordingError, value=mcap_file, allowed=2 * BLOCK_ROWS):
        Recording.open(mcap_file)
    recovered = Recording.open(mcap_file, recover=True)
    assert len(recovered) == 2 * BLOCK_ROWS
    assert recovered.metadata["error"].startswith("the file is damaged: the chunk in bytes ")
    assert np.array_equal(recovered["yaw_rate_radps"], recording["yaw_rate_radps"][: 2 * BLOCK_ROWS])
    assert recovered.metadata["complete"] is False


def test_damage_outside_the_blocks_is_found_too(mcap_file: Path) -> None:
    data = mcap_file.read_bytes()
    assert data.count(b"<mujoco/>") == 1
    mcap_file.write_bytes(data.replace(b"<mujoco/>", b"<mujoso/>"))
    with raises(RecordingError, value=mcap_file, allowed=200):
        Recording.open(mcap_file)


def mutations(data: bytes, count: int, rng: np.random.Generator) -> Iterator[bytes]:
    """Yield files with changed bytes, and ranges set to zero, removed or doubled."""
    for _ in range(count):
        start = int(rng.integers(len(data)))
        stop = start + int(rng.integers(1, 20))
        piece = data[start:stop]
        yield (
            data[:start]
            + (
                bytes([data[start] ^ int(rng.integers(1, 256))]) + data[start + 1 : stop],
                rng.bytes(len(piece)),
                bytes(len(piece)),
                b"",
                piece + piece,
            )[int(rng.integers(5))]
            + data[stop:]
        )


def check_mutations(recording: Recording, path: Path, count: int, rng: np.random.Generator) -> None:
    """A changed or shortened file is refused or gives exactly the recorded data; no other exception occurs."""
    data = path.read_bytes()
    changed = path.with_name("changed.mcap")
    refused = 0
    for mutated in mutations(data, count, rng):
        changed.write_bytes(mutated)
        opened = open_or_none(changed)
        if opened is None:
            refused += 1
        else:
            assert_same(recording, opened)
        open_or_none(changed, recover=True)
    assert refused > count / 2
    cut = data[: chunk_ends(path)[2] + 10]
    for mutated in mutations(cut, count, rng):
        changed.write_bytes(mutated)
        opened = open_or_none(changed)
        assert opened is None or opened.metadata["complete"] is False


def test_changed_bytes_are_found(recording: Recording, mcap_file: Path, rng: np.random.Generator) -> None:
    check_mutations(recording, mcap_file, 80, rng)


@pytest.mark.slow
def test_changed_bytes_are_found_in_four_thousand_files(
    recording: Recording, mcap_file: Path, rng: np.random.Generator
) -> None:
    check_mutations(recording, mcap_file, 2_000, rng)
