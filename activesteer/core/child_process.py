"""A child process for foreign native code. It may crash, hang or return invalid data without harm to this process.

This file imports nothing of the package: run as a program, it is the child process.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import resource
import runpy
import signal
import socket
import struct
import subprocess
import sys
import time
import weakref
from collections.abc import Callable
from typing import Final

_LENGTH: Final = struct.Struct("=Q")
"""Length of a message, which precedes it."""
_LAST_WORD_S: Final = 1.0
"""Time that a child has to end after it has closed its connection [s]."""
_PIECE_BYTES: Final = 1 << 20


class ChildFault(Exception):  # noqa: N818 - a fault of the child
    """Failure of a child process: it crashed, hung or returned invalid data. The message gives the reason."""


class Child:
    """A child process whose answers have a time limit, and which ends together with its process group."""

    def __init__(self, file: str, max_memory_bytes: int | None = None, *, quiet: bool = False) -> None:
        """Start the process."""
        self._socket, theirs = socket.socketpair()
        limit = "" if max_memory_bytes is None else str(max_memory_bytes)
        words = [file, str(theirs.fileno()), str(os.getpid()), limit, json.dumps(sys.path)]
        output = subprocess.DEVNULL if quiet else None
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-I", __file__, *words], pass_fds=(theirs.fileno(),), stdin=subprocess.DEVNULL,
                stdout=output, stderr=output, start_new_session=True,
            )  # fmt: skip
        self._finalizer = weakref.finalize(self, _kill, self._process, self._socket)

    @property
    def alive(self) -> bool:
        """True while the child can answer requests."""
        return self._finalizer.alive

    def ask(self, request: bytes, doing: str, limit_s: float, max_bytes: int) -> bytes:
        """Return the answer to a request. If there is none, kill the child and raise an error."""
        if not self.alive:
            raise ChildFault(f"has ended, before {doing}")
        try:
            return self._asked(request, time.monotonic() + limit_s, max_bytes)
        except BaseException as reason:
            problem = self._problem(reason, doing, limit_s)
            self.close()
            if problem is None:
                raise
            raise ChildFault(problem) from reason

    def close(self) -> None:
        """Kill the child and its process group."""
        self._finalizer()

    def _asked(self, request: bytes, end_s: float, max_bytes: int) -> bytes:
        self._socket.settimeout(_left_s(end_s))
        self._socket.sendall(_LENGTH.pack(len(request)) + request)
        (length,) = _LENGTH.unpack(self._received(_LENGTH.size, end_s))
        if length > max_bytes:
            raise ChildFault(f"answers with {length} bytes; at most {max_bytes} are allowed")
        return self._received(length, end_s)

    def _problem(self, reason: BaseException, doing: str, limit_s: float) -> str | None:
        """Return the reason why there is no answer, or None if the exception has another cause."""
        if not isinstance(reason, EOFError | OSError):
            return None
        late = isinstance(reason, TimeoutError)
        try:  # a process that the child started may hold the connection longer than the child lives
            code = self._process.wait(0.0 if late else _LAST_WORD_S)
        except subprocess.TimeoutExpired:
            return f"hangs: {doing} took longer than {limit_s:g} s" if late else f"closed its connection during {doing}"
        end = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        return f"crashed during {doing}: its process ended with {end}"

    def _received(self, length: int, end_s: float) -> bytes:
        content = bytearray()
        while len(content) < length:
            self._socket.settimeout(_left_s(end_s))
            if not (piece := self._socket.recv(min(length - len(content), _PIECE_BYTES))):
                raise EOFError
            content += piece
        return bytes(content)


def _left_s(end_s: float) -> float:
    """Return the time until a deadline, or raise `TimeoutError` if it has passed."""
    # A socket takes no negative timeout, and 0 makes it non-blocking.
    if (left_s := end_s - time.monotonic()) <= 0.0:
        raise TimeoutError
    return left_s


def _kill(process: subprocess.Popen[bytes], connection: socket.socket) -> None:
    connection.close()
    # The child leads its group. Its number stays taken as long as a process of the group lives.
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(_LAST_WORD_S)


def _serve(connection: socket.socket, answer: Callable[[bytes], bytes]) -> None:
    """Answer requests until the other side closes the connection."""
    with connection.makefile("rwb") as stream:
        while len(head := stream.read(_LENGTH.size)) == _LENGTH.size:
            content = answer(stream.read(*_LENGTH.unpack(head)))
            stream.write(_LENGTH.pack(len(content)) + content)
            stream.flush()


def _main(file: str, descriptor: str, parent: str, limit: str, path: str) -> None:
    _PR_SET_PDEATHSIG = 1
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL))
    if os.getppid() != int(parent):
        return
    if limit:
        resource.setrlimit(resource.RLIMIT_DATA, (int(limit), int(limit)))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    sys.path[:] = json.loads(path)
    with contextlib.suppress(OSError), socket.socket(fileno=int(descriptor)) as connection:
        _serve(connection, runpy.run_path(file)["make_answerer"]())
    os._exit(0)


if __name__ == "__main__":
    _main(*sys.argv[1:])
