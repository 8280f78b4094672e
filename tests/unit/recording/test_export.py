"""Exports for other programs: the same numbers, with names and units."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from activesteer.core.signals import Channel
from activesteer.errors import RecordingError
from activesteer.recording import Recording
from tests.raising import raises


def in_the_file(recording: Recording, name: str) -> np.ndarray:
    """Return a channel as stored in an MCAP file."""
    return recording[name].astype(np.float32 if recording.channels[name].single else np.float64)


def with_channel(name: str) -> Recording:
    return Recording([Channel(name, "m", "", "vehicle")], [0.0, 0.1], [[1.0], [2.0]])


def test_data_frame_has_the_channels_over_time(recording: Recording) -> None:
    pytest.importorskip("pandas")
    frame = recording.to_dataframe()
    assert list(frame.columns) == list(recording.channels.names)
    assert frame.index.name == "time_s"
    assert np.array_equal(frame.index, recording.time_s)
    assert np.array_equal(frame.to_numpy(), recording.values, equal_nan=True)
    assert frame.attrs["units"]["yaw_rate_radps"] == "rad/s"
    assert frame.attrs["metrics"] == recording.metrics
    first = recording["yaw_rate_radps"][0]
    frame.iloc[0] = -99.0  # a copy, which may be changed
    assert recording["yaw_rate_radps"][0] == first


def test_missing_pandas_is_answered_with_what_to_install(recording: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with raises(RecordingError, cause=ImportError, value="pandas", allowed="data"):
        recording.to_dataframe()


def test_csv_gives_the_same_numbers_back(recording: Recording, tmp_path: Path) -> None:
    path = recording.to_csv(tmp_path / "run.csv")
    with path.open(newline="", encoding="utf-8") as stream:
        names, *rows = csv.reader(stream)
    assert names == ["time_s", *recording.channels.names]
    columns = dict(zip(names, np.array([[float(cell or "nan") for cell in row] for row in rows]).T, strict=True))
    assert np.array_equal(columns["time_s"], recording.time_s)
    for name in recording.channels.names:
        expected = in_the_file(recording, name)
        assert np.array_equal(columns[name].astype(expected.dtype), expected, equal_nan=True), name


def test_parquet_gives_the_same_numbers_back_with_units(recording: Recording, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    path = recording.to_parquet(tmp_path / "run.parquet")
    table = parquet.read_table(path)
    assert table.column_names == ["time_s", *recording.channels.names]
    assert np.array_equal(table["time_s"], recording.time_s)
    for channel in recording.channels:
        assert np.array_equal(table[channel.name], in_the_file(recording, channel.name), equal_nan=True)
        notes = table.schema.field(channel.name).metadata
        assert (notes[b"unit"].decode(), notes[b"meaning"].decode()) == (channel.unit, channel.meaning)
    assert json.loads(table.schema.metadata[b"metadata"])["controller"] == "ars"
    assert json.loads(table.schema.metadata[b"metrics"])["yaw_rate_overshoot"] == 0.125


def test_matlab_gives_the_same_numbers_back_with_units(recording: Recording, tmp_path: Path) -> None:
    path = recording.to_mat(tmp_path / "run.mat")
    found = loadmat(path, simplify_cells=True)
    assert np.array_equal(found["time_s"], recording.time_s)
    for channel in recording.channels:
        assert found[channel.name].dtype == np.float64
        assert np.array_equal(found[channel.name], recording[channel.name], equal_nan=True)
        # MATLAB's empty text is an empty array.
        assert (found["units"][channel.name] if channel.unit else "") == channel.unit
        assert found["meanings"][channel.name] == channel.meaning
    assert json.loads(found["metadata"])["controller"] == "ars"
    assert found["metrics"]["yaw_rate_overshoot"] == 0.125
    # A column each, as MATLAB's own functions expect.
    assert loadmat(path)["time_s"].shape == (len(recording), 1)


def test_matlab_names_are_kept_up_to_its_limit(tmp_path: Path) -> None:
    longest = "a" * 61 + "_m"
    path = with_channel(longest).to_mat(tmp_path / "run.mat")
    found = loadmat(path, simplify_cells=True)
    assert found[longest].tolist() == [1.0, 2.0]
    assert found["units"][longest] == "m"
    with raises(RecordingError, value="a" + longest, allowed=63):
        with_channel("a" + longest).to_mat(tmp_path / "run.mat")
    with raises(RecordingError, value="units"):
        with_channel("units").to_mat(tmp_path / "run.mat")


def test_recording_without_metrics_or_rows_can_be_exported(tmp_path: Path) -> None:
    empty = Recording([Channel("y_m", "m", "", "vehicle")], [], np.empty((0, 1)))
    assert len(loadmat(empty.to_mat(tmp_path / "run.mat"))["y_m"]) == 0
    assert empty.to_csv(tmp_path / "run.csv").read_text().splitlines() == ["time_s,y_m"]
    assert empty.to_parquet(tmp_path / "run.parquet").stat().st_size > 0


@pytest.mark.parametrize("method", ["to_csv", "to_parquet", "to_mat"])
def test_file_that_cannot_be_written_is_answered(recording: Recording, tmp_path: Path, method: str) -> None:
    with raises(RecordingError, cause=OSError, value=tmp_path / "nowhere" / "run.x"):
        getattr(recording, method)(tmp_path / "nowhere" / "run.x")
    with raises(RecordingError, cause=IsADirectoryError):
        getattr(recording, method)(tmp_path)
