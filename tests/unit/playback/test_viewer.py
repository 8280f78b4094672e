"""The viewer's window, the browser's page, and the messages if neither is available."""

from __future__ import annotations

import importlib.util
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import psutil
import pytest

from activesteer.commands.cli import main
from activesteer.errors import PlaybackError
from activesteer.playback import runs_of, show
from activesteer.playback.viewer import viewer_binary
from tests.raising import raises
from tests.unit.playback.rrd import Rrd
from tests.unit.playback.synthetic import circle


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "run.mcap"
    circle(0.5).save(path)
    return path


def told(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str]:
    status = main(["replay", *(str(word) for word in words)])
    return status, capsys.readouterr().err


def test_the_command_writes_a_file(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out.rrd"
    status, text = told(capsys, file, "--save", out)
    assert status == 0
    assert str(out) in text
    rrd = Rrd(out)
    assert "/ars/scene/car/chassis" in rrd.entities
    # Metrics are shown in the units of the tables.
    assert "| peak yaw rate [deg/s] | 11.459 |" in rrd.column("/summary", "TextDocument:text")[0][0]


def test_the_viewer_says_nothing_of_its_own(tmp_path: Path) -> None:
    """The viewer warns of application ids that it has to change; names of manoeuvres and files are free."""
    circle(0.1, {"maneuver": {"name": "an: odd/name, ü", "title": "Odd"}}).save(tmp_path / "run.mcap")
    code = "import sys; from activesteer.commands.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "replay", "run.mcap", "--save", "out.rrd"]
    done = subprocess.run(command, cwd=tmp_path, env=_environment(tmp_path), capture_output=True, text=True, check=True)
    assert done.stdout == ""
    assert done.stderr == "out.rrd: open it with `rerun out.rrd`\n"


def _environment(home: Path) -> dict[str, str]:
    root = str(Path(__file__).parents[3])
    return {**os.environ, "BROWSER": "true", "HOME": str(home), "PYTHONPATH": root}


def test_files_of_the_same_controller_are_told_apart_by_their_names(file: Path, tmp_path: Path) -> None:
    other = tmp_path / "wet.mcap"
    other.write_bytes(file.read_bytes())
    out = tmp_path / "out.rrd"
    assert main(["replay", str(file), str(other), "--compare", "--save", str(out)]) == 0
    entities = Rrd(out).entities
    assert {"/1_run/scene/car/chassis", "/2_wet/scene/car/chassis"} <= entities


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["missing.mcap"], "cannot read missing.mcap: No such file"),
        (["{file}", "--compare"], "--compare needs at least two files"),
        (["{file}", "{file}"], "is given twice"),
        (["{file}", "--save", "nowhere/out.rrd"], "cannot write nowhere/out.rrd: No such file or directory"),
        ([__file__], "is not an MCAP file"),
    ],
)
def test_what_is_wrong_is_said(
    file: Path, capsys: pytest.CaptureFixture[str], words: list[str], message: str, monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    status, text = told(capsys, *(word.format(file=file) for word in words))
    assert status == 1
    assert message in text


def test_a_missing_viewer_is_named_with_what_works_without(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with raises(PlaybackError, value="rerun-sdk"):
        show(runs_of({"ars": circle(0.1)}))


def test_a_viewer_that_does_not_start_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    broken = tmp_path / "rerun"
    broken.write_text("not a program")
    monkeypatch.setattr("activesteer.playback.viewer.viewer_binary", lambda: broken)
    with raises(PlaybackError, cause=PermissionError, value=broken):
        show(runs_of({"ars": circle(0.1)}))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux tells a display by the environment")
def test_without_a_display_the_error_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with raises(PlaybackError) as refused:
        show(runs_of({"ars": circle(0.1)}))
    assert all(word in refused.value.problem for word in ("display", "--web", "--save"))


def _runs_viewer(process: psutil.Process) -> bool:
    """Return True for the viewer; another child may have ended just now and then has no program."""
    try:
        return Path(process.exe()) == viewer_binary().resolve()
    except psutil.NoSuchProcess:
        return False


def test_web_serves_the_viewer_to_this_machine_until_it_is_interrupted(file: Path, tmp_path: Path) -> None:
    code = "import sys; from activesteer.commands.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "replay", str(file), "--web"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=_environment(tmp_path)
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.match(r"(http://127\.0\.0\.1:\d+/)\?url=rerun%2Bhttp%3A%2F%2F127\.0\.0\.1%3A(\d+)%2Fproxy\n", line)
        assert found, line
        with urllib.request.urlopen(found[1], timeout=10) as page:
            assert page.status == 200
            assert b"rerun" in page.read().lower()
        (viewer,) = (child for child in psutil.Process(process.pid).children() if _runs_viewer(child))
        listening = [c.laddr for c in viewer.net_connections("inet") if c.status == psutil.CONN_LISTEN]
        assert {address.ip for address in listening} == {"127.0.0.1"}
        assert int(found[2]) in {address.port for address in listening}
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=20)
        assert process.returncode == 130, error
        assert "nothing was saved" in error
        deadline = time.monotonic() + 5.0
        while viewer.is_running() and viewer.status() != psutil.STATUS_ZOMBIE:
            assert time.monotonic() < deadline, "the viewer goes on"
            time.sleep(0.05)
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)  # unlike a kill, it ends the viewer too, which would go on for ever
            process.communicate(timeout=20)
