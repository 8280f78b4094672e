"""How recordings are shown."""

from __future__ import annotations

from typing import NamedTuple


class Showing(NamedTuple):
    """What can be chosen of a playback.

    Attributes:
        compare: Whether to leave out the pages of the single runs.
        cutaway: Whether bodies are to be seen through.
        verdict: What came out, a line for each run and each claim; it stands at the top of the summary.
    """

    compare: bool = False
    cutaway: bool = False
    verdict: tuple[str, ...] = ()
