from __future__ import annotations

import math
import pickle
from pathlib import Path, PurePath

import numpy as np
import pytest

from activesteer.core.signals import Channel
from activesteer.errors import RecordingError
from activesteer.recording import Link, McapWriter, Poses, Primitive, Recording
from activesteer.recording.contents import check_metrics
from activesteer.recording.recording import run_names
from tests.raising import raises
from tests.unit.recording.conftest import assert_same


def test_saved_and_opened_it_is_the_same(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recording.save(path)
    opened = Recording.open(path)
    assert_same(recording, opened)
    assert opened.metadata["complete"] is True


def test_written_in_blocks_it_is_the_same(recording: Recording, mcap_file: Path) -> None:
    assert_same(recording, Recording.open(mcap_file))


def test_saved_again_nothing_is_lost(mcap_file: Path, tmp_path: Path) -> None:
    once = Recording.open(mcap_file)
    again = tmp_path / "again.mcap"
    once.save(again)
    assert_same(once, Recording.open(again))


def test_more_rows_than_a_chunk_holds_come_back_in_order(tmp_path: Path, rng: np.random.Generator) -> None:
    table = [Channel(f"signal_{column}", "m", "", "vehicle", single=False) for column in range(40)]
    time_s = np.arange(2345) * 1e-3
    pose_s = np.sort(rng.uniform(0.0, 3.0, 333))  # between the rows and after the last
    poses = Poses(pose_s, ("chassis",), rng.normal(size=(333, 1, 3)), rng.normal(size=(333, 1, 4)))
    recording = Recording(table, time_s, rng.normal(size=(2345, 40)), poses=poses)
    recording.save(tmp_path / "long.mcap")
    assert_same(recording, Recording.open(tmp_path / "long.mcap"))


def test_time_has_the_resolution_of_the_file(recording: Recording) -> None:
    summed = np.cumsum(np.full(200, 0.01)) - 0.01
    assert not np.array_equal(summed, np.arange(200) / 100)
    assert np.array_equal(recording.time_s, np.arange(200) / 100)


def test_without_poses_scene_and_rows(channels: list[Channel], tmp_path: Path) -> None:
    path = tmp_path / "empty.mcap"
    empty = Recording(channels, [], np.empty((0, len(channels))))
    empty.save(path)
    opened = Recording.open(path)
    assert_same(empty, opened)
    assert len(opened) == 0
    assert opened["yaw_rate_radps"].shape == (0,)


def test_without_channels_it_opens_too(tmp_path: Path) -> None:
    """Its only chunk is empty, because rows without channels cannot be written."""
    Recording([], np.arange(2) / 20.0, np.empty((2, 0))).save(tmp_path / "nothing.mcap")
    assert len(Recording.open(tmp_path / "nothing.mcap").channels) == 0


def test_values_that_are_not_finite_are_kept_and_those_beyond_the_limit_are_infinite(tmp_path: Path) -> None:
    """The last rows of a run that diverged."""
    table = [Channel("single_m", "m", "", "vehicle"), Channel("double_m", "m", "", "vehicle", single=False)]
    path = tmp_path / "diverged.mcap"
    Recording(table, [0.0, 0.1, 0.2], [[1e200, 1e13], [np.nan, np.nan], [-np.inf, -np.inf]]).save(path)
    opened = Recording.open(path)
    assert np.array_equal(opened["single_m"], [np.inf, np.nan, -np.inf], equal_nan=True)
    assert np.array_equal(opened["double_m"], [np.inf, np.nan, -np.inf], equal_nan=True)


def test_a_channel_is_a_read_only_float64_array(mcap_file: Path) -> None:
    opened = Recording.open(mcap_file)
    channel = opened["fl_tyre_fx_N"]
    assert channel.dtype == np.float64
    assert channel.shape == opened.time_s.shape
    assert not channel.flags.writeable
    assert "fl_tyre_fx_N" in opened
    assert "fl_tyre" not in opened


def test_an_unknown_channel_names_the_nearest(recording: Recording) -> None:
    with raises(RecordingError, value="yaw_rate"):
        recording["yaw_rate"]


def test_metrics_are_taken_from_metadata(channels: list[Channel]) -> None:
    made = Recording(channels, [], [], metadata={"metrics": {"a_s": 1.0, "b_s": 2.0}}, metrics={"b_s": 3.0})
    assert made.metrics == {"a_s": 1.0, "b_s": 3.0}


def test_a_run_has_the_class_and_the_parameters_of_its_controller_as_name(channels: list[Channel]) -> None:
    given = {"none": "none", "a/mine.py:Mine": "Mine", 'mine.py:Mine?side="a:b"&gain=2': 'Mine?side="a:b"&gain=2'}
    runs = [Recording(channels, [], [], metadata={"controller": name}) for name in given]
    assert run_names(["a.mcap", "b.mcap", "c.mcap"], runs) == list(given.values())


def test_a_wrong_metric_is_answered_with_the_nearest(channels: list[Channel]) -> None:
    made = Recording(channels, [], [], metrics={"tb_s": 1.0, "yaw_rate_overshoot": 0.1})
    for copied in (made, pickle.loads(pickle.dumps(made))):
        with raises(RecordingError, value="yaw_overshoot") as caught:
            copied.metrics["yaw_overshoot"]
        assert isinstance(caught.value, KeyError)
        assert str(caught.value) == "no metric 'yaw_overshoot' in this recording: did you mean 'yaw_rate_overshoot'?"
        assert copied.metrics.get("yaw_overshoot") is None
    assert made.metadata == {"complete": True}


def test_numpy_values_in_metadata_become_plain_ones(channels: list[Channel], tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    metadata = {"mass_kg": np.float32(1400), "gains": np.arange(3), "nested": {"steps": np.int64(5)}}
    Recording(channels, [], [], metadata=metadata).save(path)
    opened = Recording.open(path).metadata
    assert opened == {"mass_kg": 1400.0, "gains": [0, 1, 2], "nested": {"steps": 5}, "complete": True}


def test_metadata_that_json_cannot_hold_is_refused_before_the_file_is_touched(
    recording: Recording, tmp_path: Path
) -> None:
    recording.metadata["file"] = {"vehicle": PurePath("compact.toml")}
    with raises(RecordingError, file="the metadata", key="file"):
        recording.save(tmp_path / "run.mcap")
    assert not (tmp_path / "run.mcap").exists()


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"time_s": [0.0, 0.1]}, "values"),
        ({"time_s": [0.0, 0.2, 0.2]}, "time_s"),
        ({"time_s": [-0.1, 0.2, 0.3]}, "time_s"),
        ({"time_s": [0.0, np.nan, 0.3]}, "time_s"),
        ({"time_s": [[0.0, 0.1, 0.3]]}, "time_s"),
        ({"values": [["a"], ["b"], ["c"]]}, "values"),
        ({"metadata": {"metrics": 3}}, "metrics"),
        ({"poses": Poses(np.zeros(1), ("chassis",), np.zeros((1, 1, 2)), np.zeros((1, 1, 4)))}, "poses.positions_m"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(change: dict, key: str) -> None:
    arguments = {"time_s": [0.0, 0.1, 0.2], "values": [[1.0], [2.0], [3.0]], **change}
    with raises(RecordingError, key=key):
        Recording([Channel("v_mps", "m/s", "Speed", "vehicle")], **arguments)


def test_unusable_primitives_and_bodies_are_refused(channels: list[Channel], tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with raises(RecordingError, key="chassis", value="cone"):
        McapWriter(path, channels, scene=[Primitive("chassis", "cone", (1.0, 1.0, 1.0))])
    with raises(RecordingError, key="chassis"):
        McapWriter(path, channels, scene=[Primitive("chassis", "box", (1.0, 1.0))])  # type: ignore[arg-type]
    ends = (("chassis", (0.0, 0.0, 0.0)), ("fl_wheel", (0.0, 0.0, 1.0)))
    with raises(RecordingError, key="arm", value="rope"):
        McapWriter(path, channels, scene=[Link("arm", "rope", ends)])
    for points in (ends[:1], (ends[0], ("fl_wheel", (0.0, 1.0))), (ends[0], ("fl_wheel", "abc"))):
        with raises(RecordingError, key="arm"):
            McapWriter(path, channels, scene=[Link("arm", "link", points)])  # type: ignore[arg-type]
    for names in (("chassis", "chassis"), ("world", "chassis")):
        with raises(RecordingError, value=names):
            McapWriter(path, channels, names)
    assert not path.exists()


@pytest.mark.parametrize("value", [1e308, -1e308, 1.1e12])
def test_a_value_above_the_limit_is_written_as_infinity_and_refused_where_a_file_holds_it(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, value: float
) -> None:
    values = recording.values.copy()
    values[150, 0] = value
    large = Recording(recording.channels, recording.time_s, values, metrics={"peak_rad": value})
    path = tmp_path / "run.mcap"
    large.save(path)
    opened = Recording.open(path)
    assert opened["yaw_rate_radps"][150] == opened.metrics["peak_rad"] == math.copysign(math.inf, value)
    large.metrics.clear()
    with monkeypatch.context() as lifted:
        lifted.setattr("activesteer.core.limits.MAX_NUMBER", math.inf)
        large.save(path)
    with pytest.raises(RecordingError) as refused:
        Recording.open(path)
    said = f"channel yaw_rate_radps: is {value:g}; the largest number allowed in a file is 1e+12"
    assert said in str(refused.value)
    assert len(Recording.open(path, recover=True)) < 150


def test_a_metric_above_the_limit_is_refused() -> None:
    with raises(RecordingError, key="peak_rad", allowed=1e12):
        check_metrics({"peak_rad": -1e308})
