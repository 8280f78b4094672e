"""A bar on the terminal, gone when the work ends; silent where standard error is none."""

from __future__ import annotations

import sys
from typing import Final

_CELLS: Final = 30


class ProgressBar:
    """Shows how much is done."""

    def __init__(self, label: str, *, quiet: bool) -> None:
        """Takes what stands before the bar.

        Args:
            label: The words.
            quiet: Whether to show nothing.
        """
        self._label = label
        self._shown = not quiet and sys.stderr.isatty()
        self._width = 0

    def __enter__(self) -> ProgressBar:
        """Begins."""
        return self

    def __exit__(self, *_: object) -> None:
        """Wipes the line."""
        if self._shown:
            print("\r" + " " * self._width + "\r", end="", file=sys.stderr, flush=True)

    def __call__(self, share: float, note: str = "") -> None:
        """Shows a share, 0 to 1, and a word on what was just done."""
        if self._shown:
            filled = round(_CELLS * share)
            line = f"{self._label} [{'#' * filled}{' ' * (_CELLS - filled)}] {share:4.0%} {note}"
            print("\r" + line.ljust(self._width), end="", file=sys.stderr, flush=True)
            self._width = max(self._width, len(line))
