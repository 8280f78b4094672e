"""A child process that crashes, hangs or answers nonsense is one fault, and nothing of it survives."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from activesteer.core.child_process import Child, ChildFault

SERVED = """
import os, signal, socket, struct, subprocess, sys, time

def connection():
    return next(int(name) for name in os.listdir("/proc/self/fd") if int(name) > 2 and is_socket(name))

def is_socket(name):
    try:
        return os.readlink(f"/proc/self/fd/{name}").startswith("socket:")
    except OSError:
        return False

def answer(request):
    word = request.decode()
    if word == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    if word == "exit":
        os._exit(3)
    if word == "raise":
        raise ValueError
    if word == "hang":
        time.sleep(60)
    if word == "long":
        os.write(connection(), struct.pack("=Q", 2**62))
    if word == "part":
        os.write(connection(), struct.pack("=Q", 8) + b"123")
        time.sleep(60)
    if word == "drip":
        os.write(connection(), struct.pack("=Q", 90))
        for _ in range(90):
            os.write(connection(), b"1")
            time.sleep(0.05)
    if word == "close":
        os.close(connection())
        time.sleep(60)
    if word == "memory":
        try:
            bytearray(2**29)
        except MemoryError:
            return b"refused"
    if word == "fork":
        return str(subprocess.Popen(["sleep", "60"], pass_fds=(connection(),)).pid).encode()
    return request

def make_answerer():
    return answer
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("child") / "served.py"
    path.write_text(SERVED)
    return path


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("crash", "crashed during a test: its process ended with SIGSEGV"),
        ("exit", "crashed during a test: its process ended with exit code 3"),
        ("raise", "crashed during a test: its process ended with exit code 1"),
        ("hang", "hangs: a test took longer than 0.2 s"),
        ("part", "hangs: a test took longer than 0.2 s"),
        ("drip", "hangs: a test took longer than 0.2 s"),
        ("close", "closed its connection during a test"),
        ("long", f"answers with {2**62} bytes; at most 100 are allowed"),
    ],
)
def test_a_child_that_does_not_answer_is_a_fault_within_a_second_of_its_limit(served: Path, word: str, said: str):
    child = Child(os.fspath(served), quiet=True)
    assert child.ask(b"hello", "a greeting", 20.0, 100) == b"hello"
    begun_s = time.monotonic()
    with pytest.raises(ChildFault) as fault:
        child.ask(word.encode(), "a test", 0.2 if "took longer" in said else 20.0, 100)
    assert str(fault.value) == said
    assert time.monotonic() - begun_s < 5.0
    assert not child.alive
    with pytest.raises(ChildFault, match="has ended, before another test"):
        child.ask(b"hello", "another test", 1.0, 100)


def test_processes_of_a_child_end_with_it(served: Path):
    child = Child(os.fspath(served))
    started = int(child.ask(b"fork", "a test", 20.0, 100))
    assert Path(f"/proc/{started}/stat").exists()
    child.close()
    deadline_s = time.monotonic() + 5.0
    while runs(started) and time.monotonic() < deadline_s:
        time.sleep(0.01)
    assert not runs(started)


def test_a_crash_is_no_hang_if_a_process_of_the_child_holds_the_connection(served: Path):
    child = Child(os.fspath(served), quiet=True)
    child.ask(b"fork", "a test", 20.0, 100)
    with pytest.raises(ChildFault, match="ended with SIGSEGV"):
        child.ask(b"crash", "a test", 0.2, 100)


def test_the_memory_of_a_child_is_limited(served: Path):
    child = Child(os.fspath(served), 2**28)
    assert child.ask(b"memory", "a test", 20.0, 100) == b"refused"
    child.close()


def runs(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
