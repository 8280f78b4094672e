from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from activesteer.core.signals import Channel
from activesteer.errors import RecordingError
from activesteer.recording import McapWriter, Recording, check_target
from tests.raising import raises

SPEED = [Channel("v_mps", "m/s", "Speed", "vehicle", single=False)]

CHILD = """
import sys, time
import numpy as np
from activesteer.recording import McapWriter
from activesteer.core.signals import Channel
writer = McapWriter(sys.argv[1], [Channel("v_mps", "m/s", "Speed", "vehicle", single=False)], ["chassis"], {"run": 1})
for second in range(1000):
    time_s = (1000 * second + np.arange(1000)) / 1000
    writer.write(time_s, time_s[:, None], time_s[::10], np.zeros((100, 1, 3)), np.ones((100, 1, 4)))
    time.sleep(0.05)
    print(second + 1, flush=True)
"""


def test_a_killed_process_leaves_everything_up_to_its_last_block(tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    with subprocess.Popen([sys.executable, "-c", CHILD, str(path)], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        for line in child.stdout:
            if int(line) == 5:
                os.kill(child.pid, signal.SIGKILL)
                break
    opened = Recording.open(path)
    assert len(opened) >= 5000
    assert np.array_equal(opened["v_mps"], opened.time_s)
    assert opened.metadata == {"run": 1, "complete": False}
    assert len(opened.poses.time_s) == len(opened) // 10


def test_each_block_is_on_disk_soon_after_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with McapWriter(path, SPEED) as writer:
        for second in range(3):
            writer.write(second + np.arange(10) * 0.1, np.full((10, 1), second))
            deadline = time.monotonic() + 10.0
            while len(Recording.open(path)) < 10 * (second + 1):
                assert time.monotonic() < deadline
                time.sleep(0.01)
        assert Recording.open(path).metadata["complete"] is False
    assert Recording.open(path).metadata["complete"] is True


def test_the_arrays_may_be_reused_after_write_returns(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    values = np.empty((1000, 1))
    with McapWriter(path, SPEED) as writer:
        for second in range(5):
            time_s = (1000 * second + np.arange(1000)) / 1000
            values[:, 0] = time_s
            writer.write(time_s, values)
            values[:] = np.nan
    opened = Recording.open(path)
    assert np.array_equal(opened["v_mps"], opened.time_s)


def test_an_exception_in_the_run_keeps_what_was_written(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"

    def run() -> None:
        with McapWriter(path, SPEED, metadata={"maneuver": {"name": "step_steer"}}) as writer:
            writer.write([0.0, 0.1], [[1.0], [2.0]])
            raise ArithmeticError("no more road")

    with pytest.raises(ArithmeticError):
        run()
    opened = Recording.open(path)
    assert opened["v_mps"].tolist() == [1.0, 2.0]
    assert opened.metadata == {
        "maneuver": {"name": "step_steer"},
        "complete": False,
        "error": "ArithmeticError: no more road",
    }


def test_a_wrong_result_leaves_the_file_open_for_another_try(tmp_path: Path) -> None:
    writer = McapWriter(tmp_path / "run.mcap", SPEED)
    writer.write([0.0], [[1.0]])
    with raises(RecordingError, key="a_s", value="soon"):
        writer.close({"metrics": {"a_s": "soon"}})
    writer.close({"metrics": {"a_s": 1}, "status": "done"})
    opened = Recording.open(tmp_path / "run.mcap")
    assert opened.metrics == {"a_s": 1.0}
    assert opened.metadata == {"status": "done", "complete": True}


def test_times_must_increase_across_blocks(tmp_path: Path) -> None:
    with McapWriter(tmp_path / "run.mcap", SPEED, ["chassis"]) as writer:
        writer.write([0.0, 1.0], [[1.0], [2.0]])
        with raises(RecordingError, key="time_s", value=1.0):
            writer.write([1.0], [[1.0]])
        with raises(RecordingError, key="quaternions"):
            writer.write([2.0], [[1.0]], [2.0], np.zeros((1, 1, 3)), np.zeros((1, 1, 3)))
        writer.write([2.0], [[3.0]])
    assert Recording.open(tmp_path / "run.mcap")["v_mps"].tolist() == [1.0, 2.0, 3.0]


def test_a_closed_file_takes_nothing_more(tmp_path: Path) -> None:
    writer = McapWriter(tmp_path / "run.mcap", SPEED)
    writer.close()
    writer.close()
    with raises(RecordingError, value=writer.path):
        writer.write([0.0], [[1.0]])


def test_a_path_that_cannot_be_written_says_why(tmp_path: Path) -> None:
    with raises(RecordingError, value=tmp_path / "no"):
        McapWriter(tmp_path / "no" / "run.mcap", SPEED)
    with raises(RecordingError, value=tmp_path):
        McapWriter(tmp_path, SPEED)


@pytest.mark.parametrize("content", [b"precious", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n\x01" + bytes(30)])
def test_a_file_that_is_no_recording_of_ours_is_never_replaced(
    recording: Recording, tmp_path: Path, content: bytes
) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(content)
    with raises(RecordingError, value=path):
        recording.save(path)
    assert path.read_bytes() == content


def test_a_file_of_another_program_is_never_replaced(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    foreign = Writer(str(path))
    foreign.start(profile="ros2", library="not activesteer 1")
    foreign.finish()
    content = path.read_bytes()
    with raises(RecordingError, value=path):
        recording.save(path)
    assert path.read_bytes() == content


def test_a_recording_is_replaced_unless_told_otherwise(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"")  # as a full disk leaves it
    recording.save(path)
    with raises(RecordingError, value=path):
        recording.save(path, overwrite=False)
    path.write_bytes(path.read_bytes()[:1000])  # as a killed process leaves it
    recording.save(path)
    assert len(Recording.open(path)) == len(recording)


def test_a_target_can_be_checked_without_touching_it(recording: Recording, tmp_path: Path) -> None:
    check_target(tmp_path / "new.mcap")
    assert list(tmp_path.iterdir()) == []
    with raises(RecordingError, value=tmp_path / "no"):
        check_target(tmp_path / "no" / "run.mcap")
    with raises(RecordingError, value=tmp_path):
        check_target(tmp_path)
    recording.save(tmp_path / "run.mcap")
    before = (tmp_path / "run.mcap").read_bytes()
    check_target(tmp_path / "run.mcap")
    with raises(RecordingError, value=tmp_path / "run.mcap"):
        check_target(tmp_path / "run.mcap", overwrite=False)
    assert (tmp_path / "run.mcap").read_bytes() == before


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_to_is_an_error(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with raises(RecordingError, value=tmp_path / "run.mcap"):
        check_target(tmp_path / "run.mcap")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, a device that is always full")
def test_a_full_disk_is_an_error_before_the_run_starts() -> None:
    with raises(RecordingError, cause=OSError, value=Path("/dev/full")):
        McapWriter("/dev/full", SPEED)


def test_a_file_that_cannot_be_begun_is_not_left_behind(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        with raises(RecordingError, cause=OSError, value=tmp_path / "run.mcap"):
            McapWriter(tmp_path / "run.mcap", SPEED, attachments={"vehicle.toml": bytes(1000)})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_fills_up_ends_the_recording_with_what_was_saved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    """The file size of this process is limited so that about the third block no longer fits."""
    resource = pytest.importorskip("resource")
    path = tmp_path / "run.mcap"
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, hard))
    try:
        writer = McapWriter(path, SPEED)

        def run() -> None:
            for second in range(20):
                writer.write(second + np.arange(1000) * 1e-3, rng.normal(size=(1000, 1)))

        with raises(RecordingError, cause=OSError, value=path):
            run()
        with raises(RecordingError, value=path):
            writer.write([100.0], [[0.0]])
        writer.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, ignored)
    opened = Recording.open(path)
    assert len(opened) >= 1000
    assert len(opened) % 1000 == 0
    assert opened.metadata["complete"] is False
