"""The worker process of the page: one thread that drives, controlled by messages through a pipe.

A new choice drops the runs of an older one. Any error, also in a user's code, becomes a message to the page, and the
process continues.
"""

from __future__ import annotations

import signal
import tempfile
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from activesteer.analysis.report.run_page import write_report
from activesteer.errors import ActiveSteerError, ParameterError
from activesteer.explore.choice import Folder, titles
from activesteer.explore.drive import DriveSession
from activesteer.explore.messages import Act, Describe, End, Message, Report, RunRequest, Save, Start, add
from activesteer.explore.runs import Reply, Runs
from activesteer.recording import Recording


def work(connection: Connection, folder: str) -> None:
    """Answer messages until the server closes the pipe."""
    # Ctrl-C reaches every process of the terminal; the server ends this one by closing the pipe.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EOFError, OSError):
        _Worker(connection, Folder(Path(folder))).run()


class _Worker:
    def __init__(self, connection: Connection, folder: Folder) -> None:
        self._connection, self._folder = connection, folder
        self._waiting: deque[Message] = deque()
        self._runs = Runs(folder)
        self._drive: DriveSession | None = None
        self._driven: Path | None = None  # recording of the last drive
        self._reports = Path(tempfile.mkdtemp(prefix="activesteer-"))

    def run(self) -> None:
        """Answer messages, and advance the current drive in real time."""
        self._send(Reply({"kind": "ready", **self._folder.names(), "titles": titles()}))
        try:
            while True:
                driven = self._drive is not None and self._drive.path is not None
                self._receive(wait=not driven and not self._waiting)
                while self._waiting:
                    self._answer(self._waiting.popleft())
                if self._drive is not None and self._drive.path is not None:
                    self._drive_on(self._drive)
        finally:
            list(self._ended())
            for file in self._reports.iterdir():
                file.unlink()
            self._reports.rmdir()

    def _ended(self) -> Iterator[Reply]:
        """End a drive, or remove a car that waits."""
        drive, self._drive = self._drive, None
        if drive is not None and drive.path is not None:
            self._driven = drive.path
            yield drive.end()

    def _answer(self, message: Message) -> None:
        try:
            for reply in self._answers(message):
                self._send(reply)
        except (EOFError, BrokenPipeError):  # the server is gone
            raise
        except (Exception, SystemExit) as error:
            self._send(_error(error, message))

    def _answers(self, message: Message) -> Iterator[Reply]:
        match message:
            case Describe():
                yield _numbered(self._runs.describe(message), message.id)
            case RunRequest():
                if self._drive is None:  # a drive comes before curves; the page asks again after it
                    for reply in self._runs.run(message, self._stale):
                        yield _numbered(reply, message.id)
            case Save():
                yield self._runs.save()
            case Report():
                path = self._reports / "report.html"
                write_report(self._driven_run() if message.drive else self._runs.driven(), path)
                yield Reply({"kind": "report", "html": path.read_text("utf-8")})
            case Start():
                yield from self._ended()
                self._drive = DriveSession(message, self._folder)
                for reply in self._drive.start():
                    yield _numbered(reply, message.id)
            case End():
                yield from self._ended()
            case Act():
                if self._drive is not None:
                    self._drive.act(message)
                    if message.go and self._drive.path is None:
                        yield self._drive.go()

    def _drive_on(self, drive: DriveSession) -> None:
        try:
            self._send(drive.frame())
            if drive.done:
                for reply in self._ended():
                    self._send(reply)
        except (EOFError, BrokenPipeError):
            raise
        except (Exception, SystemExit) as error:
            (ended,) = self._ended()
            self._send(Reply({**ended.header, "error": _words(error)}))

    def _driven_run(self) -> dict[str, Recording]:
        """Return the recording of the last drive, with the name of its file as the key."""
        if self._driven is None:
            raise ParameterError("there is no drive yet; drive first")
        return {self._driven.name: Recording.open(self._driven)}

    def _stale(self) -> bool:
        """Return True if a newer choice is waiting."""
        self._receive(wait=False)
        return any(isinstance(message, (RunRequest, Start)) for message in self._waiting)

    def _receive(self, *, wait: bool) -> None:
        """Receive all waiting messages."""
        while wait or self._connection.poll():
            add(self._waiting, self._connection.recv())
            wait = False

    def _send(self, reply: Reply) -> None:
        self._connection.send((reply.header, [(array.shape, array.tobytes()) for array in reply.arrays]))


def _numbered(reply: Reply, number: int) -> Reply:
    return Reply({**reply.header, "id": number}, reply.arrays)


def _error(error: BaseException, message: Message) -> Reply:
    about = {"about": type(message).__struct_config__.tag, "id": getattr(message, "id", None)}
    return Reply({"kind": "error", "text": _words(error), **about})


def _words(error: BaseException) -> str:
    """Return the message of an error, with its class for errors of other packages."""
    if isinstance(error, ActiveSteerError):
        return str(error)
    try:
        return f"{type(error).__name__}: {error}"
    except (Exception, SystemExit):
        return type(error).__name__
