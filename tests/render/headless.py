"""The rerun viewer without a window: what each view shows of a file, and what it complains about."""

from __future__ import annotations

import functools
import importlib.util
import io
import os
import socket
import subprocess
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from rerun.experimental import ViewerClient

TIMELINE = "time"


class Picture(NamedTuple):
    """What a view shows: red, green, blue of each pixel, and the warnings and errors that it reports."""

    pixels: NDArray[np.int16]
    reports: list[str]


def viewer_binary() -> Path:
    """The viewer itself: terminating the Python script `rerun` would leave it running."""
    spec = importlib.util.find_spec("rerun_cli")
    binary = Path(spec.origin).with_name("rerun") if spec and spec.origin else None
    if binary is None or not binary.exists():
        pytest.skip("this rerun-sdk brings no viewer")
    return binary


@functools.cache
def skip_reason() -> str:
    """Why no picture can be made here, empty where one can: the viewer is started once without data."""
    try:
        with Headless(Path(os.environ.get("TMPDIR", "/tmp"))):
            return ""
    except ViewerDied as error:
        text = str(error)
        if "adapter" in text or "vulkan" in text.lower() or "graphics" in text.lower():
            return "no Vulkan driver: apt-get install mesa-vulkan-drivers"
        raise


class HiddenView(Exception):  # noqa: N818 - what it is
    """The view stands on a page that is not shown."""


class ViewerDied(Exception):  # noqa: N818 - what happened, not a kind of error
    """The viewer ended before it could be asked for anything."""


class Headless:
    """A running viewer without a window."""

    def __init__(self, folder: Path, size: str = "1600x900", timeout_s: float = 90.0) -> None:
        self._log = folder / f"viewer-{os.getpid()}.log"
        self._deadline = time.monotonic() + timeout_s
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
                client.get_state()
            except Exception:
                if time.monotonic() > self._deadline:
                    raise
                time.sleep(0.1)
            else:
                return client

    def pictures(self, file: Path, time_s: float) -> dict[str, Picture]:
        """What every visible view shows of a file at an instant, by the name of the view."""
        client = self._client
        client.open([str(file.resolve())])
        while True:
            state = client.get_state()
            ready = [r for r in state.recordings if r.timelines and all(line.end is not None for line in r.timelines)]
            if ready and not state.loading and state.views:
                break
            self._wait("the file is not loaded")
        client.set_time(TIMELINE, duration=time_s, play_state="paused")
        shown = {}
        for view in client.get_state().views:
            with suppress(HiddenView):
                shown[view.name] = self._settled(view.view_id)
        # Reports are those of the last time a view was drawn.
        reports = {v.name: [f"{r.severity}: {r.summary} {r.details or ''}" for r in v.reports] for v in client.get_state().views}
        return {name: Picture(pixels, reports.get(name, [])) for name, pixels in shown.items()}

    def _settled(self, view_id: str) -> NDArray[np.int16]:
        from PIL import Image

        last = None
        while True:
            try:
                data = self._client.take_screenshot(view_id)
            except ConnectionError as error:
                if "not found" in str(error):
                    raise HiddenView from None
                raise
            pixels = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(np.int16)
            if last is not None and np.array_equal(pixels, last):
                return pixels
            last = pixels
            self._wait("the picture does not settle")

    def _wait(self, problem: str) -> None:
        if time.monotonic() > self._deadline:
            raise TimeoutError(f"{problem}: {self._log.read_text()[-500:]}")
        time.sleep(0.15)

    def close(self) -> None:
        self._process.terminate()
        self._process.wait(10)

    def __enter__(self) -> Headless:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def save_pictures(pictures: Mapping[str, Picture], folder: Path) -> None:
    """For a look at them."""
    from PIL import Image

    for name, picture in pictures.items():
        file = "".join(letter if letter.isalnum() else "_" for letter in name)
        Image.fromarray(picture.pixels.astype(np.uint8)).save(folder / f"{file}.png")
