"""What commands print: JSON that any reader takes, colours, and what the package has to say."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

_COLOURS: Final = {"passed": "32", "holds": "32", "FAILED": "31", "known": "33"}
"""Verdict -> what makes a terminal write green, red or yellow."""


def print_json(value: Any) -> None:
    """Prints a value as JSON and nothing else; JSON has no nan, so what is not defined becomes null."""
    print(json.dumps(_finite(value), indent=2))


def print_plain(text: str) -> None:
    """Prints a line that comes from a file; what would move the cursor or change colours is shown instead."""
    print("".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


@contextmanager
def log_to_terminal() -> Iterator[None]:
    """What the package logs, such as that it compiles, goes to standard error."""
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("activesteer: %(message)s"))
    logger = logging.getLogger("activesteer")
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)
