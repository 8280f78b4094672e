"""Films, read back by ffmpeg."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from activesteer.errors import PlaybackError
from activesteer.video.film import ffmpeg


class Decoded(NamedTuple):
    """Content of an MP4: ffmpeg's description, and the pictures, shape (n, height, width, 3)."""

    about: str
    pictures: NDArray[np.uint8]


def need_ffmpeg() -> None:
    """Skip the test without ffmpeg."""
    try:
        ffmpeg()
    except PlaybackError as error:
        pytest.skip(str(error))


def decode(path: Path) -> Decoded:
    command = [ffmpeg(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    about = done.stderr.decode().partition("Output #0")[0]
    size = re.search(r", (\d+)x(\d+)", about)
    assert size
    return Decoded(about, np.frombuffer(done.stdout, np.uint8).reshape(-1, int(size[2]), int(size[1]), 3))
