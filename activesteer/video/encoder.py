"""Encoding of frames: MP4 by ffmpeg, GIF by Pillow."""

from __future__ import annotations

import importlib
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from contextlib import ExitStack, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from activesteer.errors import ParameterError, PlaybackError, not_installed
from activesteer.files import temporary_file, writing

Pixels = NDArray[np.uint8]

FORMATS: Final = (".mp4", ".gif")
"""Suffixes of the files that can be written."""

_GIF_TICKS_HZ: Final = 100.0
_COLOURS: Final = 128
_SIDE_LIMIT: Final = 8192


class Encoder(Protocol):
    """Writer of frames. The file appears when the context ends without an error. Otherwise nothing is left."""

    def write(self, pixels: Pixels) -> None:
        """Append one frame, shape (height, width, 3)."""
        ...

    def __enter__(self) -> Self:
        """Open the file."""
        ...

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        """Complete the file, or delete the part written so far after an error."""
        ...


def frame_rate(path: Path, wanted_hz: float) -> float:
    """Return the nearest frame rate that a format can have: a GIF shows each frame for whole hundredths of a second."""
    if path.suffix.lower() != ".gif":
        return wanted_hz
    return _GIF_TICKS_HZ / max(2, round(_GIF_TICKS_HZ / wanted_hz))  # browsers show less than two hundredths as ten


def check(path: Path, size: tuple[int, int]) -> None:
    """Check the conditions for writing before anything is drawn."""
    if path.suffix.lower() not in FORMATS:
        raise ParameterError(f"a video's name must end in {' or '.join(FORMATS)}", file=str(path), allowed=FORMATS)
    if min(size) < 16 or max(size) > _SIDE_LIMIT:
        raise ParameterError(
            f"a picture of {size[0]} x {size[1]} pixels cannot be made; each side must be 16 to {_SIDE_LIMIT}",
            value=size,
            allowed=(16, _SIDE_LIMIT),
        )
    if not path.parent.is_dir():
        raise PlaybackError(f"cannot write {path}: there is no folder {path.parent}", value=path.parent)
    if path.suffix.lower() == ".mp4":
        if size[0] % 2 or size[1] % 2:
            raise ParameterError(f"{size[0]} x {size[1]} pixels: an MP4 needs an even width and height", value=size)
        ffmpeg()


def encoder(path: Path, size: tuple[int, int], rate_hz: float, samples: Iterable[Pixels]) -> Encoder:
    """Return the writer for a file name."""
    if path.suffix.lower() == ".gif":
        return _Gif(path, rate_hz, samples)
    return _Mp4(path, size, rate_hz)


def ffmpeg() -> str:
    """Return the ffmpeg program of the package imageio-ffmpeg, or else of the system."""
    with suppress(ImportError, RuntimeError):
        return importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    if found := shutil.which("ffmpeg"):
        return found
    what = "no program ffmpeg is found (apt-get install ffmpeg; a .gif needs none): an MP4"
    raise not_installed(PlaybackError, what, "imageio-ffmpeg", "video")


class _Mp4:
    def __init__(self, path: Path, size: tuple[int, int], rate_hz: float) -> None:
        self._path, self._part = path, path.with_name(f".{path.name}.part")
        self._command = [
            ffmpeg(), "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}",
            "-r", f"{rate_hz:.6g}", "-i", "-", "-an", "-c:v", "libx264", "-preset", "veryfast", "-crf", "20",
            # Every player and browser supports this, and can start before the whole file has arrived.
            "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(self._part),
        ]  # fmt: skip

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            self._log = stack.enter_context(tempfile.TemporaryFile())
            stack.enter_context(temporary_file(self._part))
            try:
                self._process: Any = subprocess.Popen(self._command, stdin=subprocess.PIPE, stderr=self._log)
            except OSError as reason:
                raise PlaybackError(f"{self._command[0]} does not start: {reason.strerror or reason}") from None
            self._leaving = stack.pop_all()
        return self

    def write(self, pixels: Pixels) -> None:
        try:
            self._process.stdin.write(np.ascontiguousarray(pixels).data)
        except OSError:
            self._process.wait()
            raise self._failure() from None

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        if kind is not None:
            self._process.kill()
        with suppress(OSError):
            self._process.stdin.close()
        status = self._process.wait()
        with self._leaving:
            if kind is None and status != 0:
                raise self._failure()
            if kind is None:
                with writing(self._path, PlaybackError):
                    self._part.replace(self._path)

    def _failure(self) -> PlaybackError:
        self._log.seek(0)
        said = (self._log.read().decode(errors="replace").strip().splitlines() or ["nothing"])[-1]
        return PlaybackError(f"cannot write {self._path}: ffmpeg says: {said}", value=said)


class _Gif:
    def __init__(self, path: Path, rate_hz: float, samples: Iterable[Pixels]) -> None:
        self._path, self._part = path, path.with_name(f".{path.name}.part")
        self._duration_ms = round(1000.0 / rate_hz)
        # All frames share one palette; with a palette for each frame, the colours of still objects would flicker.
        mosaic = Image.fromarray(np.concatenate(list(samples)))
        self._palette = mosaic.quantize(_COLOURS, method=Image.Quantize.MEDIANCUT)
        self._pictures: list[Image.Image] = []

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            stack.enter_context(temporary_file(self._part))
            with writing(self._path, PlaybackError):
                self._part.open("wb").close()
            self._leaving = stack.pop_all()
        return self

    def write(self, pixels: Pixels) -> None:
        picture = Image.fromarray(np.ascontiguousarray(pixels))
        self._pictures.append(picture.quantize(palette=self._palette, dither=Image.Dither.NONE))

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        with self._leaving:
            if kind is None and self._pictures:
                first, *others = self._pictures
                with writing(self._path, PlaybackError):
                    first.save(
                        self._part, "GIF", save_all=True, append_images=others, duration=self._duration_ms, loop=0,
                        optimize=False,
                    )  # fmt: skip
                    self._part.replace(self._path)
