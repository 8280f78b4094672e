"""Recordings of runs that are ended from outside: killed, or stopped by a full disk."""

from __future__ import annotations

import importlib.util
import os
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader

from activesteer import Recording
from activesteer.core.signals import Channel
from activesteer.simulation.recorder import BLOCK_INTERVAL_S
from tests.cli.process import MAIN, ended

LIMITED = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000)); " + MAIN
STATES = ("/state/vehicle", "/state/control")


def stock_messages(path: Path) -> dict[str, int]:
    """Return the log time [ns] of the last message of each topic, as read by the `mcap` library."""
    topics: dict[int, str] = {}
    last: dict[str, int] = {}
    with path.open("rb") as stream:
        try:
            for record in StreamReader(stream).records:
                if isinstance(record, Message):
                    last[topics[record.channel_id]] = record.log_time
                elif hasattr(record, "topic"):
                    topics[record.id] = record.topic  # type: ignore[union-attr]
        except (McapError, struct.error):  # the end, which is missing or cut inside a record
            pass
    return last


BODY = """
from activesteer import ActuatorCommand


class Mine:
    steps = 0

    def step(self, command, measurement):
        self.steps += 1
        if self.steps > 1201:  # just after a block is written: it may still be on its way
            import os
            os.kill(os.getpid(), 9)
        return ActuatorCommand()
"""
KILLED_S = 1.201


@pytest.fixture(scope="module")
def left(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the recording of a killed run."""
    folder = tmp_path_factory.mktemp("killed")
    (folder / "mine.py").write_text(BODY)
    done = ended(folder, "run", "slalom", "-c", "mine.py:Mine", "--set", "settle_s=0", "-o", "run.mcap")
    assert done.returncode == -9, done.stderr
    return folder / "run.mcap"


def test_killed_run_is_marked_and_keeps_its_files(call, left):
    told = call("info", left)
    assert told.status == 0
    assert "INCOMPLETE: the run did not end properly" in told.out
    recording = Recording.open(left)
    assert recording.time_s[-1] >= KILLED_S - 2.0 * BLOCK_INTERVAL_S
    assert np.isfinite(recording.values).all()
    assert recording.metadata["maneuver"]["name"] == "slalom"
    assert {"maneuver.toml", "vehicle.toml", "mine.py"} <= set(recording.attachments)


def test_reader_of_the_mcap_library_finds_what_a_killed_run_left(left):
    last_ns = stock_messages(left)
    assert all(last_ns[topic] >= (KILLED_S - 2.0 * BLOCK_INTERVAL_S) * 1e9 for topic in (*STATES, "/tf"))


@pytest.mark.slow
def test_rerun_opens_what_a_killed_run_left(left, tmp_path):
    spec = importlib.util.find_spec("rerun_cli")
    binary = Path(spec.origin).with_name("rerun") if spec and spec.origin else None
    if binary is None or not binary.exists():
        pytest.skip("this rerun-sdk brings no rerun binary")
    words = ("mcap", "convert", "--recover", left, "-o", "run.rrd")
    environment = os.environ | {"HOME": str(tmp_path)}  # it keeps its settings out of the user's home
    done = subprocess.run([binary, *words], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run.rrd").stat().st_size > 10_000


def test_recovered_file_of_a_killed_run_opens_in_readers_that_seek(call, left, tmp_path):
    whole = tmp_path / "whole.mcap"
    done = call("info", left, "--recover", whole)
    before, after = Recording.open(left), Recording.open(whole)
    assert done.status == 0
    assert done.out == f"{whole}: {len(before)} steps up to {before.time_s[-1]:.3f} s\n"
    assert np.array_equal(after.values, before.values)
    assert np.array_equal(after.poses.positions_m, before.poses.positions_m)
    assert (after.metadata, after.attachments, after.scene) == (before.metadata, before.attachments, before.scene)
    assert after.metadata["complete"] is False
    with whole.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_end_time >= (len(before) - 1) * 1_000_000
    refused = call("info", left, "--recover", left)
    assert refused.status == 1
    assert "is the input file; choose another name" in refused.err


def test_the_line_about_a_recovered_file_says_that_it_has_no_rows(call, tmp_path):
    Recording([Channel("speed_mps", "m/s", "", "vehicle")], [], [], metadata={"a": 1}).save(tmp_path / "a.mcap")
    told = call("info", "a.mcap", "--recover", "b.mcap")
    assert told.out == "b.mcap: metadata and attachments only; no rows can be read in a.mcap\n"
    assert Recording.open(tmp_path / "b.mcap").metadata["a"] == 1


@pytest.mark.slow
def test_disk_that_fills_up_leaves_no_half_file_for_the_viewer(call, tmp_path):
    call("run", "straight_line", "--set", "duration_s=3", "-o", "run.mcap")
    done = ended(tmp_path, "replay", "run.mcap", "--save", "run.rrd", code=LIMITED.replace("1_000_000", "200_000"))
    assert done.returncode == 1
    assert done.stderr == "activesteer: cannot write run.rrd: not all of it could be written; is the disk full?\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.mcap"]
