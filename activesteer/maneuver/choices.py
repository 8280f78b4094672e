"""Keys whose value is one of a few words."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from activesteer.errors import ManeuverError, shown

SIDES: Final = {"left": 1.0, "right": -1.0}
"""Name of a side -> sign of y, of steering and of yaw there (ISO 8855)."""
DRIVES: Final = ("hold_speed", "coast")
"""What the drive may do: hold the speed, or nothing."""


def check_choice(key: str, value: str, allowed: Iterable[str]) -> None:
    """A word must be one of those that mean something.

    Args:
        key: Key in the file.
        value: What is written there.
        allowed: What may be written there.

    Raises:
        ManeuverError: it is none of them.
    """
    words = list(allowed)
    if value not in words:
        known = ", ".join(repr(word) for word in words[:-1])
        raise ManeuverError(
            f"is {shown(value)}; allowed are {known} and {words[-1]!r}", key=key, value=value, allowed=words
        )
