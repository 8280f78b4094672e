"""Display options of a playback."""

from __future__ import annotations

from typing import NamedTuple


class Showing(NamedTuple):
    """Display options of a playback.

    Attributes:
        compare: Whether to leave out the pages of single runs.
        cutaway: Whether bodies are transparent.
        verdict: Results, a line for each run and each claim, at the top of the summary.
    """

    compare: bool = False
    cutaway: bool = False
    verdict: tuple[str, ...] = ()
