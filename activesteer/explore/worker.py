"""The worker process of the page: one thread that drives, told by messages through a pipe.

A new choice drops the runs of an older one. An error becomes a message to the page; the process goes on.
"""

from __future__ import annotations

import signal
import tempfile
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from activesteer.errors import ActiveSteerError
from activesteer.explore.choice import Folder
from activesteer.explore.drive import Drive
from activesteer.explore.runs import Reply, Runs


def work(connection: Connection, folder: str) -> None:
    """Answer messages until the server closes the pipe."""
    # Ctrl-C reaches every process of the terminal; the server ends this one by closing the pipe.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EOFError, OSError):
        _Worker(connection, Folder(Path(folder))).run()


class _Worker:
    def __init__(self, connection: Connection, folder: Folder) -> None:
        self._connection, self._folder = connection, folder
        self._waiting: deque[dict[str, Any]] = deque()
        self._runs = Runs(folder)
        self._drive: Drive | None = None
        self._reports = Path(tempfile.mkdtemp(prefix="activesteer-"))

    def run(self) -> None:
        """Answer messages, and drive in real time while a drive is on."""
        self._send(Reply({"kind": "ready", **self._folder.names(), "folder": str(self._folder.path)}))
        try:
            while True:
                self._receive(wait=self._drive is None and not self._waiting)
                while self._waiting:
                    message = self._waiting.popleft()
                    try:
                        for reply in self._answers(message):
                            self._send(reply)
                    except ActiveSteerError as error:
                        self._send(Reply({"kind": "error", "text": str(error), "about": message.get("kind")}))
                if self._drive is not None:
                    self._drive_on(self._drive)
        finally:
            if self._drive is not None:
                self._drive.end()
            for file in self._reports.iterdir():
                file.unlink()
            self._reports.rmdir()

    def _answers(self, message: dict[str, Any]) -> Iterator[Reply]:
        kind = message.pop("kind", None)
        number = message.pop("id", None)
        if kind == "describe":
            yield self._numbered(self._runs.describe(message), number)
        elif kind == "run" and self._drive is None:  # a drive comes before curves; the page asks again after it
            values = message.pop("values", {})
            for reply in self._runs.run(message, values, self._stale):
                yield self._numbered(reply, number)
        elif kind == "save":
            yield self._runs.save()
        elif kind == "report":
            path = self._reports / "report.html"
            reply = self._runs.report(path)
            yield Reply({**reply.header, "html": path.read_text("utf-8")})
        elif kind == "start":
            if self._drive is not None:
                yield self._drive.end()
            self._drive = None
            self._drive = Drive(message, self._folder)
            yield self._drive.start()
        elif kind == "end":
            if self._drive is not None:
                drive, self._drive = self._drive, None
                yield drive.end()
        elif kind == "act":
            if self._drive is not None:
                self._drive.act(message)
        elif kind != "run":
            yield Reply({"kind": "error", "text": f"the page sent an unknown message: {kind!r}", "about": None})

    def _drive_on(self, drive: Drive) -> None:
        try:
            self._send(drive.frame())
            if drive.done:
                self._drive = None
                self._send(drive.end())
        except ActiveSteerError as error:
            self._drive = None
            ended = drive.end()
            self._send(Reply({**ended.header, "error": str(error)}))

    def _numbered(self, reply: Reply, number: Any) -> Reply:
        return Reply({**reply.header, "id": number}, reply.arrays)

    def _stale(self) -> bool:
        """Return whether a newer choice waits."""
        self._receive(wait=False)
        return any(message.get("kind") in ("run", "start") for message in self._waiting)

    def _receive(self, *, wait: bool) -> None:
        """Take all messages that have come; only the newest choice and the newest hands are kept."""
        while wait or self._connection.poll():
            message = self._connection.recv()
            wait = False
            if message.get("kind") == "run":
                self._waiting = deque(other for other in self._waiting if other.get("kind") != "run")
            self._waiting.append(message)

    def _send(self, reply: Reply) -> None:
        self._connection.send((reply.header, [(array.shape, array.tobytes()) for array in reply.arrays]))
