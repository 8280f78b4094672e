"""Where a playback goes: a file, the viewer on the screen, or a browser."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from activesteer.errors import PlaybackError
from activesteer.playback.layout import blueprint
from activesteer.playback.runs import Run
from activesteer.playback.stream import fill, new_stream
from activesteer.playback.summary import MetricLabel, plain_label


def save(runs: Sequence[Run], path: Path, *, compare: bool = False, label: MetricLabel = plain_label) -> None:
    """Writes a .rrd file with its layout.

    Args:
        runs: The runs.
        path: The file; one that exists is replaced.
        compare: Whether to leave out the pages of the single runs.
        label: How metrics are shown.

    Raises:
        PlaybackError: the file cannot be written.
    """
    try:
        path.open("wb").close()
    except OSError as error:
        msg = f"cannot write {path}: {error.strerror or error}"
        raise PlaybackError(msg) from None
    stream = new_stream(runs, compare=compare)
    stream.save(path, default_blueprint=blueprint(runs, compare=compare))
    fill(stream, runs, label)
    stream.disconnect()


def show(): ...
def serve(): ...
