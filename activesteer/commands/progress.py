"""Progress bars on the terminal, which disappear at the end of the work."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from activesteer.studies.engine.study import StudyProgress

_CELLS: Final = 30
_LINE_EVERY_S: Final = 10.0
"""Time between two lines of a log [s]."""


class ProgressBar:
    """Bar that shows which fraction of the work is done."""

    def __init__(self, label: str, *, quiet: bool) -> None:
        self._label = label
        self._shown = not quiet and sys.stderr.isatty()
        self._width = 0

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._shown:
            print("\r" + " " * self._width + "\r", end="", file=sys.stderr, flush=True)

    def __call__(self, fraction: float, note: str = "") -> None:
        """Show a fraction, 0 to 1, and a note."""
        if self._shown:
            filled = round(_CELLS * fraction)
            line = f"{self._label} [{'#' * filled}{' ' * (_CELLS - filled)}] {fraction:4.0%} {note}"
            print("\r" + line.ljust(self._width), end="", file=sys.stderr, flush=True)
            self._width = max(self._width, len(line))


class RunCounter:
    """Progress of many runs: number, rate and remaining time.

    A terminal gets a bar; a log, as of a batch job, gets a line every ten seconds.
    """

    def __init__(self, label: str, *, quiet: bool) -> None:
        self._bar = ProgressBar(label, quiet=quiet)
        self._as_lines = not quiet and not sys.stderr.isatty()
        self._begun_s = self._said_s = time.monotonic()

    def __enter__(self) -> RunCounter:
        self._begun_s = self._said_s = time.monotonic()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.__exit__()

    def __call__(self, counted: StudyProgress) -> None:
        """Show the progress."""
        now_s = time.monotonic()
        words = _words(counted, now_s - self._begun_s)
        self._bar(counted.done / counted.total, words)
        if self._as_lines and (now_s - self._said_s >= _LINE_EVERY_S or counted.done == counted.total):
            print(words, file=sys.stderr, flush=True)
            self._said_s = now_s


def _words(counted: StudyProgress, elapsed_s: float) -> str:
    rate = counted.here / max(elapsed_s, 1e-6)
    left_s = round((counted.total - counted.done) / rate) if rate > 0.0 else 0
    clock = f"{left_s // 3600}:{left_s // 60 % 60:02}:{left_s % 60:02}"
    failed = f", {counted.failed} failed" if counted.failed else ""
    return f"{counted.done}/{counted.total} runs, {rate:.3g} runs/s, {clock} left{failed}"
