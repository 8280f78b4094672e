"""What commands print: JSON that any reader takes, colours, and what the package has to say."""

from __future__ import annotations

import logging
import os
import re
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from activesteer.files import json_text

_COLOURS: Final = {"passed": 32, "FAILED": 31, "not reproduced": 33}
"""Verdict -> what makes a terminal write green, red or yellow."""
_VERDICT: Final = re.compile(rf"^(\S+ +)({'|'.join(_COLOURS)})\b", re.MULTILINE)

_COLUMNS: Final = 80


def print_json(value: Any) -> None:
    """Prints a value as JSON and nothing else; see `json_text`."""
    print(json_text(value))


def coloured(text: str) -> str:
    """The text with its verdicts in colour where a terminal shows it and NO_COLOR does not forbid it (no-color.org)."""
    if not sys.stdout.isatty() or os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return text
    return _VERDICT.sub(lambda found: f"{found[1]}\x1b[{_COLOURS[found[2]]}m{found[2]}\x1b[0m", text)


def print_entry(head: str, text: str, hanging: int = 2) -> None:
    """Prints a line of 80 columns, or several of which the further ones hang.

    Args:
        head: What it begins with, kept as it is.
        text: What follows. It may come from a file of anybody's: what a terminal would obey is written out.
        hanging: How far the further lines hang.
    """
    plain = "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)
    lines = textwrap.wrap(
        plain, _COLUMNS, initial_indent=head, subsequent_indent=" " * hanging, break_on_hyphens=False,
        break_long_words=False,
    )  # fmt: skip
    print("\n".join(lines) or head.rstrip())


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
