"""The rerun viewer without a window: the picture of each view of a file, and the viewer's complaints."""

from __future__ import annotations

import importlib.util
import io
import os
import socket
import subprocess
import time
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from rerun.experimental import ViewerClient

TIMELINE = "time"


class Picture(NamedTuple):
    """Pixels of a view (red, green, blue) and the warnings and errors that the viewer reports."""

    pixels: NDArray[np.int16]
    reports: list[str]


def viewer_binary() -> Path:
    """Return the viewer's own program: terminating the Python script `rerun` would leave the program running."""
    spec = importlib.util.find_spec("rerun_cli")
    binary = Path(spec.origin).with_name("rerun") if spec and spec.origin else None
    if binary is None or not binary.exists():
        pytest.skip("this rerun-sdk brings no viewer")
    return binary


class ViewerDied(Exception):  # noqa: N818 - what happened, not a kind of error
    """The viewer ended before it could be queried."""


class Headless:
    """A running viewer without a window."""

    def __init__(self, folder: Path, size: str = "1280x800", timeout_s: float = 60.0) -> None:
        self._log = folder / "viewer.log"
        self._timeout_s = timeout_s
        self._started = time.monotonic()
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder), "HOME": str(folder)}
        arguments = ["--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", size]
        with self._log.open("w") as log:
            self._process = subprocess.Popen(
                [viewer_binary(), *arguments, "--hide-welcome-screen"], env=environment, stdout=log, stderr=log
            )
        try:
            self._client = self._connect(f"rerun+http://127.0.0.1:{port}/proxy")
        except BaseException:
            self.close()
            raise

    def _connect(self, url: str) -> ViewerClient:
        while True:
            if self._process.poll() is not None:
                raise ViewerDied(self._log.read_text()[-2000:])
            try:
                client = ViewerClient.connect(url)
                # It answers before it has looked for a graphics adapter, and ends if there is none: only a picture
                # proves that it will go on.
                client.take_screenshot()
            except Exception:
                self._wait("the viewer does not answer")
            else:
                return client

    def open(self, file: Path) -> None:
        """Close all recordings and open a file."""
        if self._client.get_state().recordings:
            self._client.close("all")
        self._started = time.monotonic()
        self._client.open([str(file.resolve())])
        while True:
            state = self._client.get_state()
            ready = [r for r in state.recordings if r.timelines and all(line.end is not None for line in r.timelines)]
            if ready and not state.loading and state.views:
                break
            self._wait("the file is not loaded")
        # The layout of the file before is shown until that of this one has been taken up.
        views, since = None, time.monotonic()
        while time.monotonic() < since + 1.0:
            found = {view.view_id for view in self._client.get_state().views}
            if found != views:
                views, since = found, time.monotonic()
            self._wait("the layout does not settle")

    def pictures(self, time_s: float, names: Collection[str]) -> dict[str, Picture]:
        """Return the pictures of views at an instant, by the names of the views.

        The views must be on open pages. The viewer also lists the others, but asking for a picture of such a view makes
        the viewer cover the window with a complaint.
        """
        client = self._client
        client.set_time(TIMELINE, duration=time_s, play_state="paused")
        shown = {}
        of = {view.name: view.view_id for view in client.get_state().views}
        for name in names:
            shown[name] = self._settled(of[name])
        # Reports are those of the last time a view was drawn.
        reports = {
            view.name: [f"{report.severity}: {report.summary} {report.details or ''}" for report in view.reports]
            for view in client.get_state().views
        }
        return {name: Picture(pixels, reports[name]) for name, pixels in shown.items()}

    def window(self, time_s: float) -> Image.Image:
        """Return the picture of the whole window at an instant."""
        self._client.set_time(TIMELINE, duration=time_s, play_state="paused")
        last, self._started = b"", time.monotonic()
        while (data := self._client.take_screenshot()) != last:
            last = data
            self._wait("the picture does not settle")
        return Image.open(io.BytesIO(data)).convert("RGB")

    def _settled(self, view_id: str) -> NDArray[np.int16]:
        last = None
        self._started = time.monotonic()
        while True:
            data = self._client.take_screenshot(view_id)
            pixels = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(np.int16)
            if last is not None and np.array_equal(pixels, last):
                return pixels
            last = pixels
            self._wait("the picture does not settle")

    def _wait(self, problem: str) -> None:
        """Wait a little; raise an error for each picture or file that took too long."""
        if time.monotonic() > self._started + self._timeout_s:
            raise TimeoutError(f"{problem}: {self._log.read_text()[-500:]}")
        time.sleep(0.1)

    def close(self) -> None:
        self._process.terminate()
        self._process.wait(10)

    def __enter__(self) -> Headless:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def save_pictures(pictures: Mapping[str, Picture], folder: Path) -> None:
    """Save the pictures for inspection."""
    for name, picture in pictures.items():
        file = "".join(letter if letter.isalnum() else "_" for letter in name)
        Image.fromarray(picture.pixels.astype(np.uint8)).save(folder / f"{file}.png")
