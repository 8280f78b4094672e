"""A small synthetic recording: two seconds at 100 Hz, three groups with interleaved columns."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from activesteer.core.signals import Channel
from activesteer.recording import Link, McapWriter, Poses, Primitive, Recording

BLOCK_ROWS = 50


@pytest.fixture
def channels() -> list[Channel]:
    table = [Channel("yaw_rate_radps", "rad/s", "Yaw rate, left positive", "vehicle", single=False)]
    for corner in ("fl", "fr", "rl", "rr"):
        table += [Channel(f"{corner}_tyre_f{axis}_N", "N", f"Tyre force {axis}", "corners") for axis in "xyz"]
        table.append(Channel(f"{corner}_travel_m", "m", "Wheel travel, up positive", "corners", single=False))
        table.append(Channel(f"{corner}_link_N", "N", "Link force, tension positive", "links"))
    table.append(Channel("rear_steer_saturated", "", "1 where the limit is reached (≥ 3°)", "vehicle"))
    return table


@pytest.fixture
def recording(channels: list[Channel], rng: np.random.Generator) -> Recording:
    rows, names = 200, ("chassis", "fl_wheel", "fr_wheel")
    time_s = np.cumsum(np.full(rows, 0.01)) - 0.01  # with the rounding of a summed time
    poses = Poses(
        time_s[::5], names, rng.normal(size=(rows // 5, len(names), 3)), rng.normal(size=(rows // 5, len(names), 4))
    )
    return Recording(
        channels,
        time_s,
        rng.normal(size=(rows, len(channels))) * 10.0 ** rng.integers(-6, 6, len(channels)),
        poses=poses,
        metadata={
            "maneuver": {"name": "step_steer"},
            "controller": "ars",
            "parameters": {"mass_kg": 1400.0, "list": [1, None]},
        },
        metrics={"yaw_rate_overshoot": 0.125, "tb_s": float("nan")},
        attachments={"compact.xml": b"<mujoco/>", "empty.tir": b""},
        scene=[
            Primitive("chassis", "box", (4.0, 1.7, 0.5)),
            Primitive("fl_wheel", "cylinder", (0.6, 0.6, 0.2)),
            Link("fl_rod", "link", (("chassis", (0.0, 0.3, 0.2)), ("fl_wheel", (0.0, 0.0, 0.1))), 0.012),
        ],
    )


@pytest.fixture
def mcap_file(recording: Recording, tmp_path: Path) -> Path:
    """Write the recording in four blocks of half a second."""
    path = tmp_path / "run.mcap"
    poses = recording.poses
    with McapWriter(
        path, recording.channels, poses.names, recording.metadata, recording.attachments, recording.scene
    ) as writer:
        for rows, sets in blocks():
            writer.write(
                recording.time_s[rows],
                recording.values[rows],
                poses.time_s[sets],
                poses.positions_m[sets],
                poses.quaternions[sets],
            )
        writer.close({"metrics": recording.metrics})
    return path


def blocks() -> Iterator[tuple[slice, slice]]:
    """Yield rows and sets of poses of each block."""
    for start in range(0, 200, BLOCK_ROWS):
        yield slice(start, start + BLOCK_ROWS), slice(start // 5, (start + BLOCK_ROWS) // 5)


def assert_same(one: Recording, other: Recording) -> None:
    """Require equality of everything: 32-bit channels to their precision, the rest exactly."""
    assert one.channels == other.channels
    assert np.array_equal(one.time_s, other.time_s)
    for channel in one.channels:
        expected = one[channel.name].astype(np.float32) if channel.single else one[channel.name]
        assert np.array_equal(other[channel.name], expected, equal_nan=True), channel.name
    assert one.metadata == other.metadata
    assert repr(one.metrics) == repr(other.metrics)  # NaN equals NaN in words
    assert one.attachments == other.attachments
    assert one.scene == other.scene
    assert one.poses.names == other.poses.names
    for mine, theirs in zip(one.poses, other.poses, strict=True):
        assert np.array_equal(mine, theirs)
