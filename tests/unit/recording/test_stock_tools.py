"""Readers of other projects find everything without this package."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import MessageIndex
from mcap.stream_reader import StreamReader, get_chunk_data_stream

from activesteer.recording import Recording
from tests.unit.recording.conftest import blocks


def decoded(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Return log times and messages of each topic."""
    factory = pytest.importorskip("mcap_protobuf.decoder").DecoderFactory()
    topics: dict[str, list[tuple[int, Any]]] = {}
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[factory])
        for _, channel, message, content in reader.iter_decoded_messages():
            topics.setdefault(channel.topic, []).append((message.log_time, content))
    return topics


def test_channels_decode_to_the_same_numbers(recording: Recording, mcap_file: Path) -> None:
    topics = decoded(mcap_file)
    assert set(topics) == {"/state/vehicle", "/state/corners", "/state/links", "/tf", "/scene"}
    for channel in recording.channels:
        rows = topics[f"/state/{channel.group}"]
        assert np.array_equal([time_ns for time_ns, _ in rows], np.rint(recording.time_s * 1e9))
        expected = recording[channel.name].astype(np.float32 if channel.single else np.float64)
        assert np.array_equal([getattr(row, channel.name) for _, row in rows], expected)


def test_poses_decode_to_the_same_numbers(recording: Recording, mcap_file: Path) -> None:
    poses = recording.poses
    rows = decoded(mcap_file)["/tf"]
    assert len(rows) == len(poses.time_s)
    for (time_ns, row), time_s, positions, turns in zip(
        rows, poses.time_s, poses.positions_m, poses.quaternions, strict=True
    ):
        assert time_ns == round(time_s * 1e9)
        assert [transform.child_frame_id for transform in row.transforms] == list(poses.names)
        for transform, at, turn in zip(row.transforms, positions, turns, strict=True):
            stamp, place, rotation = transform.timestamp, transform.translation, transform.rotation
            assert stamp.seconds * 10**9 + stamp.nanos == time_ns
            assert transform.parent_frame_id == "world"
            assert [place.x, place.y, place.z] == at.tolist()
            assert [rotation.w, rotation.x, rotation.y, rotation.z] == turn.tolist()


def test_the_scene_is_locked_to_the_bodies(mcap_file: Path) -> None:
    ((time_ns, scene),) = decoded(mcap_file)["/scene"]
    assert time_ns == 0
    assert [entity.frame_id for entity in scene.entities] == ["chassis", "fl_wheel", "chassis"]
    assert all(entity.frame_locked for entity in scene.entities)
    assert all(entity.lifetime.seconds == entity.lifetime.nanos == 0 for entity in scene.entities)
    (body,) = scene.entities[0].cubes
    assert (body.size.x, body.pose.orientation.w, body.color.a) == (4.0, 1.0, 1.0)
    (wheel,) = scene.entities[1].cylinders
    assert (wheel.size.z, wheel.bottom_scale, wheel.top_scale) == (0.2, 1.0, 1.0)
    (link,) = scene.entities[2].metadata
    assert (scene.entities[2].id, link.key) == ("fl_rod", "activesteer.link")
    table = json.loads(link.value)
    assert table["points"] == [["chassis", [0.0, 0.3, 0.2]], ["fl_wheel", [0.0, 0.0, 0.1]]]
    assert (table["kind"], table["radius_m"]) == ("link", 0.012)


def test_units_meanings_metadata_and_attachments_are_within_reach(recording: Recording, mcap_file: Path) -> None:
    with mcap_file.open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        notes = {
            name: json.loads(text)
            for channel in summary.channels.values()
            if channel.topic.startswith("/state/")
            for name, text in channel.metadata.items()
        }
        for channel in recording.channels:
            assert notes[channel.name]["unit"] == channel.unit
            assert notes[channel.name]["meaning"] == channel.meaning
        records = {record.name: record.metadata for record in reader.iter_metadata()}
        assert json.loads(records["activesteer.run"]["controller"]) == "ars"
        assert float(records["activesteer.metrics"]["yaw_rate_overshoot"]) == 0.125
        attachments = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
        assert attachments == recording.attachments


def test_the_index_leads_to_every_message(recording: Recording, mcap_file: Path) -> None:
    """Statistics and message index, which Foxglove uses to jump to a time."""
    with mcap_file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        assert summary is not None
        assert summary.statistics is not None
        rows, sets = len(recording), len(recording.poses.time_s)
        assert summary.statistics.message_count == 3 * rows + sets + 1
        assert summary.statistics.message_end_time == 1_990_000_000
        assert len(summary.chunk_indexes) == 1 + len(list(blocks()))
        found = 0
        for index in summary.chunk_indexes:
            stream.seek(index.chunk_start_offset)
            records = StreamReader(stream, skip_magic=True, emit_chunks=True).records
            data, length = get_chunk_data_stream(next(records), validate_crc=True)  # type: ignore[arg-type]
            content = data.read(length)
            for channel_id, offset in index.message_index_offsets.items():
                stream.seek(offset)
                entries = next(StreamReader(stream, skip_magic=True).records)
                assert isinstance(entries, MessageIndex)
                assert entries.channel_id == channel_id
                for time_ns, start in entries.records:
                    assert content[start] == Opcode.MESSAGE
                    head = content[start + 9 : start + 31]
                    assert int.from_bytes(head[:2], "little") == channel_id
                    assert int.from_bytes(head[6:14], "little") == time_ns
                    found += 1
        assert found == summary.statistics.message_count


def rerun_binary() -> Path:
    spec = importlib.util.find_spec("rerun_cli")
    binary = Path(spec.origin).with_name("rerun") if spec and spec.origin else None
    if binary is None or not binary.exists():
        pytest.skip("this rerun-sdk brings no rerun binary")
    return binary


@pytest.mark.parametrize("killed", [False, True])
def test_rerun_imports_poses_and_channels(mcap_file: Path, *, killed: bool) -> None:
    binary, rrd = rerun_binary(), mcap_file.with_suffix(".rrd")
    environment = {**os.environ, "HOME": str(mcap_file.parent)}  # it keeps its settings out of the user's home
    if killed:
        data = mcap_file.read_bytes()
        mcap_file.write_bytes(data[: len(data) * 2 // 3])

    def rerun(*arguments: str) -> str:
        done = subprocess.run([binary, *arguments], env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    rerun("mcap", "convert", *(["--recover"] if killed else []), str(mcap_file), "-o", str(rrd))
    listing = rerun("rrd", "print", str(rrd))
    assert "/state/vehicle - data columns: [activesteer.Vehicle:message]" in listing
    assert "Transform3D:translation" in listing
