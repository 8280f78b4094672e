"""The recording of a drive in tools that do not know this package: MCAP readers, Foxglove's rules, rerun."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from rerun.chunk import RrdReader
from scipy.spatial.transform import Rotation

from activesteer.core.conventions import CORNERS
from activesteer.playback.viewer import viewer_binary

Messages = dict[str, list[tuple[int, Any]]]

UNITS = {
    "": "", "m": "_m", "rad": "_rad", "rad/s": "_radps", "m/s": "_mps", "m/s2": "_mps2", "N": "_N",
    "Nm": "_Nm", "Pa": "_Pa",
}  # fmt: skip
"""Unit of a signal, and what its name ends in."""


@pytest.fixture(scope="module")
def messages(driven: Path) -> Messages:
    """Return log times [ns] and decoded messages of each topic."""
    topics: Messages = {}
    with driven.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, content in reader.iter_decoded_messages():
            topics.setdefault(channel.topic, []).append((message.log_time, content))
    return topics


class Frames:
    """Transforms as Foxglove resolves them: a chain of parents up to the root."""

    def __init__(self, message: Any) -> None:
        self._of = {transform.child_frame_id: transform for transform in message.transforms}

    def __contains__(self, frame: str) -> bool:
        return frame in self._of

    def to_world(self, frame: str) -> Callable[[Any], np.ndarray]:
        """Transform points of a frame to the world, along the chain of parents."""
        steps = []
        while frame != "world":
            transform = self._of[frame]
            steps.append(transform)
            frame = transform.parent_frame_id
            assert len(steps) <= len(self._of), "the frames form a ring"

        def convert(point: Any) -> np.ndarray:
            point = np.asarray(point, float)
            for step in steps:
                q, t = step.rotation, step.translation
                point = Rotation.from_quat([q.x, q.y, q.z, q.w]).apply(point) + np.array([t.x, t.y, t.z])
            return point

        return convert


def series(messages: Messages, group: str, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return time [s] and values of a signal, as in a plot of `/state/GROUP.NAME`."""
    rows = messages[f"/state/{group}"]
    return np.array([time for time, _ in rows]) / 1e9, np.array([getattr(row, name) for _, row in rows])


def test_the_car_moves_along_the_track(messages: Messages) -> None:
    poses = messages["/tf"]
    time_s = np.array([time for time, _ in poses]) / 1e9
    assert np.allclose(np.diff(time_s), 0.01)
    at = np.array([Frames(message).to_world("chassis")((0.0, 0.0, 0.0)) for _, message in poses])
    speed_mps = np.hypot(*np.diff(at[:, :2], axis=0).T) / 0.01
    assert np.allclose(speed_mps, 80.0 / 3.6, atol=0.5)
    assert at[:, 1].max() > 2.0  # it changes the lane
    assert abs(at[-1, 1]) < 0.5
    x_time_s, x_m = series(messages, "vehicle", "front_axle_x_m")
    assert np.allclose(at[:, 0], np.interp(time_s, x_time_s, x_m), atol=0.05)  # the axle's middle is 0.3 m above it


def test_the_wheels_stay_at_the_car_and_roll_on_the_road(messages: Messages) -> None:
    poses = messages["/tf"][::10]
    for corner in CORNERS:
        left = 0.76 if corner[1] == "l" else -0.76
        ahead = 0.0 if corner[0] == "f" else -2.637
        for _, message in poses:
            frames = Frames(message)
            wheel, car = frames.to_world(f"{corner}_wheel"), frames.to_world("chassis")
            assert np.linalg.norm(wheel((0.0, 0.0, 0.0)) - car((ahead, left, 0.3))) < 0.1
    # A mark on the tread is as often at the top as the distance has circumferences.
    fast = messages["/tf"]
    angle = []
    for _, message in fast:
        frames = Frames(message)
        mark = frames.to_world("rl_wheel")((0.0, 0.0, 0.3)) - frames.to_world("rl_wheel")((0.0, 0.0, 0.0))
        forward = frames.to_world("chassis")((1.0, 0.0, 0.0)) - frames.to_world("chassis")((0.0, 0.0, 0.0))
        angle.append(np.arctan2(mark @ forward, mark[2]))
    turned = np.unwrap(angle)[-1] - angle[0]
    time_s, spin = series(messages, "corners", "rl_wheel_speed_radps")
    assert turned == pytest.approx(np.trapezoid(spin, time_s), rel=2e-3)
    assert turned > 2.0 * np.pi * 50


def test_every_solid_is_locked_to_a_frame_that_moves(messages: Messages) -> None:
    ((time_ns, scene),) = messages["/scene"]
    assert time_ns == 0
    assert len({entity.id for entity in scene.entities}) == len(scene.entities)
    solids = 0
    for entity in scene.entities:
        assert entity.frame_locked
        assert entity.lifetime.seconds == entity.lifetime.nanos == 0  # for ever
        assert all(entity.frame_id in Frames(message) for _, message in messages["/tf"][::50])
        solids += len(entity.cubes) + len(entity.cylinders) + len(entity.spheres)
    assert solids > 30
    drawn = {entity.frame_id for entity in scene.entities if len(entity.cylinders)}
    assert {f"{corner}_wheel" for corner in CORNERS} <= drawn


def test_the_ends_of_the_links_are_where_the_bodies_are(messages: Messages) -> None:
    """Metadata of a link's entity; its length changes by the deflection of bushings and by steering."""
    ((_, scene),) = messages["/scene"]
    tables = [json.loads(pair.value) for entity in scene.entities for pair in entity.metadata]
    links = {table["name"]: table for table in tables}
    assert len([name for name in links if name.endswith("_spring")]) == 4
    for name in ("fl_lca_front", "rr_camber_link"):
        lengths = []
        for _, message in messages["/tf"][::20]:
            ends = [Frames(message).to_world(body)(point) for body, point in links[name]["points"]]
            lengths.append(np.linalg.norm(ends[1] - ends[0]))
        assert 0.2 < np.mean(lengths) < 0.6
        assert np.ptp(lengths) < 2e-3


def test_every_signal_is_a_number_with_its_unit_in_the_name(driven: Path, messages: Messages) -> None:
    with driven.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    signals = 0
    for channel in summary.channels.values():
        if not channel.topic.startswith("/state/"):
            continue
        _, row = messages[channel.topic][-1]
        fields = {field.name: field for field in row.DESCRIPTOR.fields}
        assert set(fields) == set(channel.metadata)
        for name, notes in channel.metadata.items():
            assert fields[name].cpp_type in (fields[name].CPPTYPE_FLOAT, fields[name].CPPTYPE_DOUBLE)
            assert name.endswith(UNITS[json.loads(notes)["unit"]]), name
            assert np.isfinite(getattr(row, name))
            signals += 1
    assert signals > 150


def test_a_signal_and_the_transforms_tell_the_same(messages: Messages) -> None:
    poses = messages["/tf"]
    yaw = []
    for _, message in poses:
        car = Frames(message).to_world("chassis")
        forward = car((1.0, 0.0, 0.0)) - car((0.0, 0.0, 0.0))
        yaw.append(np.arctan2(forward[1], forward[0]))
    time_s, rate = series(messages, "vehicle", "yaw_rate_radps")
    middle_s = (np.arange(len(yaw) - 1) + 0.5) * 0.01
    assert np.allclose(np.diff(yaw) / 0.01, np.interp(middle_s, time_s, rate), atol=2e-3)
    assert np.abs(rate).max() > 0.1


def test_reruns_own_importer_finds_transforms_and_signals(driven: Path, tmp_path: Path, messages: Messages) -> None:
    out = tmp_path / "run.rrd"
    command = [str(viewer_binary()), "mcap", "convert", str(driven), "-o", str(out)]
    done = subprocess.run(
        command, env={**os.environ, "HOME": str(tmp_path)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    transforms: list[tuple[str, list[float]]] = []
    signals: dict[str, dict[str, list[float]]] = {}
    for chunk in RrdReader(out).stream().to_chunks():
        batch = chunk.to_record_batch()
        entity, names = str(chunk.entity_path), batch.schema.names
        if entity == "/tf" and "Transform3D:translation" in names:
            frames = (value[0] for value in batch.column("Transform3D:child_frame").to_pylist())
            places = (value[0] for value in batch.column("Transform3D:translation").to_pylist())
            transforms += zip(frames, places, strict=True)
        for name in names:
            if entity.startswith("/state/") and name.startswith("activesteer.") and name.endswith(":message"):
                for message in batch.column(name).to_pylist():
                    for key, value in message[0].items():
                        signals.setdefault(entity, {}).setdefault(key, []).append(value)
    expected = {t.child_frame_id for _, message in messages["/tf"] for t in message.transforms}
    assert {frame for frame, _ in transforms} == expected
    chassis = [place for frame, place in transforms if frame == "chassis"]
    recorded = [Frames(message).to_world("chassis")((0.0, 0.0, 0.0)) for _, message in messages["/tf"]]
    assert np.allclose(chassis, recorded, atol=1e-4)
    for group, name in (("vehicle", "yaw_rate_radps"), ("corners", "fl_tyre_fy_N"), ("links", "rl_toe_link_force_N")):
        assert np.allclose(signals[f"/state/{group}"][name], series(messages, group, name)[1])
