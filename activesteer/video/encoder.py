"""Encoding of frames: MP4 by ffmpeg, GIF by Pillow."""

from __future__ import annotations

import importlib
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from activesteer.core.files import atomic_write
from activesteer.errors import ParameterError, PlaybackError, not_installed

Pixels = NDArray[np.uint8]

FORMATS: Final = (".mp4", ".gif")
"""Suffixes of the files that can be written."""

_GIF_TICKS_HZ: Final = 100.0
_COLOURS: Final = 128
_SIDE_LIMIT: Final = 8192


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


def encoder(
    path: Path, size: tuple[int, int], rate_hz: float, samples: Iterable[Pixels]
) -> AbstractContextManager[Callable[[Pixels], None]]:
    """Context that yields a function to append a frame of shape (height, width, 3).

    The file appears when the context ends without an error. Otherwise nothing is left.
    """
    if path.suffix.lower() == ".gif":
        return _gif(path, rate_hz, samples)
    return _mp4(path, size, rate_hz)


def ffmpeg() -> str:
    """Return the ffmpeg program of the package imageio-ffmpeg, or else of the system."""
    with suppress(ImportError, RuntimeError):
        return importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    if found := shutil.which("ffmpeg"):
        return found
    what = "no program ffmpeg is found (apt-get install ffmpeg; a .gif needs none): an MP4"
    raise not_installed(PlaybackError, what, "imageio-ffmpeg", "video")


@contextmanager
def _mp4(path: Path, size: tuple[int, int], rate_hz: float) -> Iterator[Callable[[Pixels], None]]:
    with atomic_write(path, PlaybackError) as part, tempfile.TemporaryFile() as log:
        part.open("wb").close()  # a folder that cannot be written is an error before anything is drawn
        command = [
            ffmpeg(), "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}",
            "-r", f"{rate_hz:.6g}", "-i", "-", "-an", "-c:v", "libx264", "-preset", "veryfast", "-crf", "20",
            # Every player and browser supports this, and can start before the whole file has arrived.
            "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(part),
        ]  # fmt: skip
        try:
            process: Any = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=log)
        except OSError as reason:
            raise PlaybackError(f"{command[0]} does not start: {reason.strerror or reason}") from None

        def failure() -> PlaybackError:
            log.seek(0)
            said = (log.read().decode(errors="replace").strip().splitlines() or ["nothing"])[-1]
            return PlaybackError(f"cannot write {path}: ffmpeg says: {said}", value=said)

        def write(pixels: Pixels) -> None:
            try:
                process.stdin.write(np.ascontiguousarray(pixels).data)
            except OSError:
                process.wait()
                raise failure() from None

        try:
            yield write
        except BaseException:
            process.kill()
            raise
        finally:
            with suppress(OSError):
                process.stdin.close()
            status = process.wait()
        if status != 0:
            raise failure()


@contextmanager
def _gif(path: Path, rate_hz: float, samples: Iterable[Pixels]) -> Iterator[Callable[[Pixels], None]]:
    # All frames share one palette; with a palette for each frame, the colours of still objects would flicker.
    palette = Image.fromarray(np.concatenate(list(samples))).quantize(_COLOURS, method=Image.Quantize.MEDIANCUT)
    pictures: list[Image.Image] = []
    with atomic_write(path, PlaybackError) as part:
        part.open("wb").close()  # a folder that cannot be written is an error before anything is drawn
        yield lambda pixels: pictures.append(
            Image.fromarray(np.ascontiguousarray(pixels)).quantize(palette=palette, dither=Image.Dither.NONE)
        )
        first, *others = pictures
        duration_ms = round(1000.0 / rate_hz)
        first.save(part, "GIF", save_all=True, append_images=others, duration=duration_ms, loop=0, optimize=False)
