"""Ctrl-C and SIGTERM at many moments of many commands: exit of the program, and truth of its saved-file messages."""

from __future__ import annotations

import argparse
import os
import re
import signal
import time
from pathlib import Path

import pytest

from activesteer import Recording
from activesteer.commands.stopping import StopSignals
from tests.cli.process import begun

END_S = 5.0
"""What an end may take at most; on a busy machine even one second is no measure."""

RUN = ("run", "slalom", "-c", "none", "-c", "ars")
FIRST_FILE = {"run": "runs/slalom-none.mcap", "reproduce": "runs/step_steer-none.mcap"}
"""Command -> the first file that it writes: a signal at that moment meets a run, with or without workers."""
QUICK = [
    (RUN, signal.SIGINT, 0.2),  # while modules are imported
    (RUN, signal.SIGTERM, None),
    pytest.param(("reproduce", "--jobs", "2"), signal.SIGINT, None, marks=pytest.mark.slow),
]
COMMANDS = (
    ("run", "slalom", "-c", "none", "-c", "ars"),
    ("reproduce", "--jobs", "2"),
    ("vehicle", "check", "compact"),
    ("identify",),
    ("linearise", "-o", "runs"),
    ("kc", "-o", "runs"),
    ("bench",),
)
MANY = [
    (words, number, after_s)
    for words in COMMANDS
    for number, after_s in ((signal.SIGTERM, 0.06), (signal.SIGINT, 0.7), (signal.SIGTERM, 2.3), (signal.SIGINT, 5.0))
]
"""Moments at which Python starts, modules are imported, the work begins and the work goes on."""


@pytest.mark.parametrize(("words", "number", "after_s"), QUICK)
def test_signal_ends_a_command_and_one_true_line_says_what_is_saved(tmp_path, words, number, after_s):
    stopped(tmp_path, words, number, after_s or tmp_path / FIRST_FILE[words[0]])


@pytest.mark.slow
@pytest.mark.parametrize(("words", "number", "after_s"), MANY)
def test_signal_ends_every_command_at_any_moment(tmp_path, words, number, after_s):
    stopped(tmp_path, words, number, after_s)


def test_a_saved_file_is_named_after_the_clock_was_set_back_and_a_lock_is_not(tmp_path, monkeypatch):
    stop = StopSignals()
    stop.options = argparse.Namespace(output=tmp_path)
    set_back_s = 3600
    monkeypatch.setattr(time, "time_ns", lambda now_ns=time.time_ns: now_ns() - 10**9 * set_back_s)
    (tmp_path / "part").mkdir()
    for name, age_s in (("part/new.json", set_back_s), ("part/.lock", set_back_s), ("old.json", 3 * set_back_s)):
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (time.time() - age_s, time.time() - age_s))
    assert stop._saved(in_order=True) == f"saved: {tmp_path / 'part/new.json'}"


@pytest.mark.parametrize("swallowed", ["while True: pass", pytest.param("time.sleep(60.0)", marks=pytest.mark.slow)])
def test_command_that_does_not_listen_is_ended_and_leaves_no_half_file(tmp_path, controller, swallowed):
    """User code may catch all exceptions or be busy elsewhere."""
    body = f"""
        import contextlib, time
        from activesteer.errors import ParameterError
        from activesteer.core.files import atomic_write
        with atomic_write("half.png", ParameterError) as part:
            part.write_text("half")
            open("busy", "w").close()
            while True:
                with contextlib.suppress(BaseException):
                    {swallowed}"""
    stopped(tmp_path, ("run", "slalom", "-c", controller(body)), signal.SIGINT, tmp_path / "busy")
    assert not [name for name in os.listdir(tmp_path) if "half" in name]


def stopped(folder: Path, words: tuple[str, ...], number: signal.Signals, when: float | Path) -> None:
    """Send the signal to the whole process group, like a terminal, after a time [s] or when a file exists."""
    process = begun(folder, *words, start_new_session=True)
    try:
        if isinstance(when, Path):
            while not when.exists() and process.poll() is None:
                time.sleep(0.05)
        else:
            time.sleep(when)
        running = process.poll() is None
        if running:
            os.killpg(process.pid, number)
        _, told = process.communicate(timeout=END_S)
    finally:
        process.kill()
    if not running or (process.returncode == 0 and "stopped" not in told):  # the command had come to its end before
        assert process.returncode in {0, 1}, told
        return
    if isinstance(when, float) and when < 0.5 and process.returncode == -number and not told:  # before Python started
        return
    deadline = time.monotonic() + END_S
    while alive(process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive(process.pid), "processes are left"
    lines = [
        line for line in told.splitlines() if "compiling" not in line and not re.match(r"\d+/\d+ |.* \.\.\.$", line)
    ]
    lines = [line for line in lines if not re.fullmatch(r"\S+ \S+: \S+\.mcap", line)]
    assert process.returncode == 128 + number, told
    assert len(lines) == 1, told
    name = "Ctrl-C" if number == signal.SIGINT else number.name
    assert lines[0].startswith(f"activesteer: stopped by {name}; "), told
    is_true(lines[0].partition("; ")[2], folder)


def alive(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def is_true(saved: str, folder: Path) -> None:
    """Compare the reported files with the files on disk."""
    there = {
        str(path.relative_to(folder)): path
        for path in folder.rglob("*")
        if path.is_file() and path.name not in {"mine.py", "busy"}
    }
    there = {name: path for name, path in there.items() if "__pycache__" not in name}
    if saved == "nothing was saved":
        assert not there
        return
    named = saved.removeprefix("saved: ").split(", ")
    counted = 0
    for item in named:
        if files := re.fullmatch(r"(\d+) files in runs", item):
            counted += int(files[1])
            continue
        found = re.fullmatch(r"(\S+)(?: \((.*)\))?", item)
        assert found, saved
        path, part = there[found[1]], found[2]
        counted += 1
        if path.suffix != ".mcap":
            continue
        if part == "cut off":
            continue
        recording = Recording.open(path)
        assert recording.metadata["complete"] is (part is None)
        if part == "without a step":
            assert len(recording) == 0
        elif part is not None:
            assert part == f"up to {recording.time_s[-1]:.3f} s"
    assert counted == len(there)
