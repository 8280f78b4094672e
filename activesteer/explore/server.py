"""The server of the page: files of the page, and a WebSocket between the browser and the worker process.

It listens only on 127.0.0.1. The address of the page contains a random token, and the headers Host and Origin must name
this server, so that neither another user's browser nor another page in yours can reach it.
"""

from __future__ import annotations

import asyncio
import json
import multiprocessing
import secrets
import socket
import struct
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from importlib import resources
from pathlib import Path
from typing import Any, Final

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from activesteer.core.conventions import RUN_COLOURS, RUN_COLOURS_ON_DARK, SYSTEM_LABELS
from activesteer.core.files import finite
from activesteer.core.version import __version__
from activesteer.errors import ActiveSteerError
from activesteer.explore.choice import Folder
from activesteer.explore.drive import COURSES
from activesteer.explore.messages import MAX_CONTROLLERS, MAX_MESSAGE_BYTES, End, Message, add, read
from activesteer.explore.worker import work

HOST: Final = "127.0.0.1"
TAKEN: Final = 4000, "This page was opened in another window. Reload it to continue here."
"""Code and reason with which the connection of a page ends when another window takes its place."""
_TYPES: Final = {".js": "text/javascript", ".css": "text/css", ".html": "text/html"}
_OF_REPORTS: Final = ("uPlot.iife.min.js", "uPlot.min.css", "page.css", "car.js", "touch.js")
"""Files that the page shares with the report."""
_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src data: blob:; "
    "connect-src 'self' ws://{host}; frame-ancestors 'none'; base-uri 'none'"
)


class ExploreServer:
    """The server and its worker process."""

    def __init__(self, folder: Path, port: int) -> None:
        """Open the port and start the worker process."""
        self._socket = socket.socket()
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._socket.bind((HOST, port))
        except OSError as error:
            self._socket.close()
            raise ActiveSteerError(
                f"port {port} cannot be opened ({error.strerror}); --port 0 selects a free port"
            ) from error
        self._socket.listen()
        self._token = secrets.token_urlsafe(16)
        self._host = f"{HOST}:{self._socket.getsockname()[1]}"
        self.url = f"http://{self._host}/{self._token}/"
        self._report = ""
        self._given_folder, self._folder = folder, str(folder.resolve())
        self.saved: list[Path] = []  # files of the folder that the page has saved
        self._waiting: deque[Message] = deque()
        self._came = asyncio.Event()
        self._ready: tuple[dict[str, Any], list[Any]] | None = None
        self._page: WebSocket | None = None
        self._start_worker()

    def _start_worker(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._worker = context.Process(target=work, args=(theirs, self._folder), daemon=True)
        self._worker.start()
        theirs.close()

    @property
    def port(self) -> int:
        """Port of the server."""
        return int(self._host.rpartition(":")[2])

    def serve(self, listening: Callable[[], None]) -> None:
        """Serve until the process is stopped."""
        config = uvicorn.Config(
            self._app(listening), log_level="warning", lifespan="on", ws_max_size=MAX_MESSAGE_BYTES, server_header=False
        )
        try:
            uvicorn.Server(config).run(sockets=[self._socket])
        finally:
            self.close()

    def close(self) -> None:
        """End the worker process, which completes the recording of a drive."""
        self._pipe.close()
        self._worker.join(2.0)
        if self._worker.is_alive():
            self._worker.terminate()
        self._socket.close()

    def _app(self, listening: Callable[[], None]) -> Starlette:
        @asynccontextmanager
        async def lifespan(_app: Starlette) -> AsyncIterator[None]:
            tasks = [asyncio.create_task(self._pump()), asyncio.create_task(self._feed())]
            listening()
            yield
            for task in tasks:
                task.cancel()

        token = f"/{self._token}"
        return Starlette(
            routes=[
                Route(f"{token}/", self._index),
                Route(f"{token}/report", self._show_report),
                Route(f"{token}/{{name}}", self._file),
                WebSocketRoute(f"{token}/socket", self._talk),
            ],
            middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=[HOST, "localhost"])],
            lifespan=lifespan,
        )

    async def _index(self, _request: Request) -> Response:
        text = (resources.files("activesteer.explore") / "page" / "index.html").read_text("utf-8")
        known = {
            "light": RUN_COLOURS, "dark": RUN_COLOURS_ON_DARK, "version": __version__,
            "systems": list(SYSTEM_LABELS), "mostControllers": MAX_CONTROLLERS,
            "courses": {name: course._asdict() for name, course in COURSES.items()},
        }  # fmt: skip
        text = text.replace("{{ data }}", json.dumps(known).replace("<", "\\u003c"))
        return HTMLResponse(text, headers={"Content-Security-Policy": _POLICY.format(host=self._host)})

    async def _file(self, request: Request) -> Response:
        name = request.path_params["name"]
        package = "activesteer.pages" if name in _OF_REPORTS else "activesteer.explore"
        folder = resources.files(package) / ("templates" if name in _OF_REPORTS else "page")
        suffix = Path(name).suffix
        if suffix not in _TYPES or name not in {entry.name for entry in folder.iterdir()}:
            return PlainTextResponse("there is no such file", 404)
        headers = {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff"}
        return Response((folder / name).read_bytes(), media_type=_TYPES[suffix], headers=headers)

    async def _show_report(self, _request: Request) -> Response:
        if not self._report:
            return PlainTextResponse("there is no report yet", 404)
        return HTMLResponse(self._report)

    async def _talk(self, page: WebSocket) -> None:
        """Pass messages of the page to the worker, until a second page replaces the first."""
        if page.headers.get("origin") not in (f"http://{self._host}", f"http://localhost:{self.port}"):
            await page.close(1008)
            return
        await page.accept()
        older, self._page = self._page, page
        if older is not None:
            with suppress(WebSocketDisconnect, RuntimeError):  # it is gone
                await older.close(*TAKEN)
            self._hand_on(End())  # a drive of that page
        if self._ready is not None:
            header, arrays = self._ready
            await self._deliver({**header, **Folder(Path(self._folder)).names()}, arrays)  # the folder as it is now
        try:
            while True:
                text = await page.receive_text()
                try:
                    message = read(text)
                except ActiveSteerError as error:
                    await self._tell(page, str(error))
                    continue
                if not self._hand_on(message):
                    await self._tell(page, "too many messages wait; this one is dropped")
        except (WebSocketDisconnect, KeyError, RuntimeError):
            pass
        finally:
            if self._page is page:
                self._page = None
                self._hand_on(End())

    def _hand_on(self, message: Message) -> bool:
        """Queue a message for the worker, and return False if the queue is full."""
        taken = add(self._waiting, message)
        self._came.set()
        return taken

    async def _feed(self) -> None:
        """Send messages of the page to the worker, outside the event loop because its pipe may be full."""
        loop = asyncio.get_running_loop()
        while True:
            await self._came.wait()
            self._came.clear()
            while self._waiting:
                with suppress(OSError):  # the pump replaces a worker that has ended
                    await loop.run_in_executor(None, self._pipe.send, self._waiting.popleft())

    async def _pump(self) -> None:
        """Send messages of the worker to the page, and replace a worker that has ended."""
        loop = asyncio.get_running_loop()
        while True:
            try:
                header, arrays = await loop.run_in_executor(None, self._pipe.recv)
            except (EOFError, OSError):
                if self._ready is None:  # another one would end, too
                    await self._say("the worker process has ended; start `activesteer explore` again")
                    return
                # At the end of the program its signal ends the worker first, and then this task.
                await asyncio.sleep(1.0)
                self._pipe.close()
                self._ready = None
                await loop.run_in_executor(None, self._start_worker)
                await self._say("the worker process had ended; a new one has started")
                continue
            if header["kind"] == "ready":
                self._ready = header, arrays
            if header["kind"] in {"saved", "going"}:
                names = header["files"] if header["kind"] == "saved" else [header["file"]]
                self.saved += [self._given_folder / name for name in names]
            if header["kind"] == "report":
                self._report = header.pop("html")
            await self._deliver(header, arrays)

    async def _say(self, error: str) -> None:
        if self._page is not None:
            await self._tell(self._page, error)

    async def _deliver(self, header: dict[str, Any], arrays: list[Any]) -> None:
        if self._page is not None:
            try:
                await self._page.send_bytes(_packed(header, arrays))
            except (WebSocketDisconnect, RuntimeError):
                self._page = None

    @staticmethod
    async def _tell(page: WebSocket, error: str) -> None:
        with suppress(WebSocketDisconnect, RuntimeError):  # the page is gone
            await page.send_bytes(_packed({"kind": "error", "text": error, "about": None}, []))


def _packed(header: dict[str, Any], arrays: list[Any]) -> bytes:
    """Encode a message: length, JSON, then the arrays as numbers of 32 bits."""
    text = json.dumps(finite({**header, "arrays": [list(shape) for shape, _ in arrays]}), allow_nan=False).encode()
    text += b" " * (-(4 + len(text)) % 4)  # the numbers begin at a multiple of their size
    return struct.pack("<I", len(text)) + text + b"".join(data for _, data in arrays)
