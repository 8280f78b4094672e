"""Output of commands on the terminal: JSON, tables, colours, wrapped text, progress and log messages."""

from __future__ import annotations

import argparse
import logging
import os
import re
import sys
import textwrap
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO

from activesteer.core.files import json_text
from activesteer.core.text_table import COLUMNS, WHOLE, text_table, wrapped_line

if TYPE_CHECKING:
    from activesteer.studies.engine.study import StudyProgress

GOOD: Final = 32
BAD: Final = 31
KNOWN: Final = 33
"""Colour codes of a terminal: green, red, yellow."""
_COLOURS: Final = {"passed": GOOD, "FAILED": BAD, "not reproduced": KNOWN}
"""Colour of each verdict."""
_VERDICT: Final = re.compile(rf"^(\S+ +)({'|'.join(_COLOURS)})\b", re.MULTILINE)


def table_lines(rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str]) -> Iterator[str]:
    """Yield the lines of a table of rows, with a column for each key."""
    return text_table([list(columns.values()), *cells(rows, columns)], text=0, repeat=2, least=10, gap=1)


def cells(rows: Sequence[Mapping[str, Any]], keys: Iterable[str]) -> list[list[str]]:
    """Return the cells of a table of rows, with three digits for numbers."""
    return [[row[key] if isinstance(row[key], str) else f"{row[key]:.3g}" for key in keys] for row in rows]


def print_json(value: Any, *, one_line: bool = False) -> None:
    """Print a value as indented JSON, or on one line if a program reads the output at once."""
    text = json_text(value)
    text = " ".join(line.strip() for line in text.splitlines()) if one_line else text
    print(text, file=_for_json[-1] if _for_json else None, flush=one_line)


def tell(
    options: argparse.Namespace, values: Any, lines: Iterable[str], files: Iterable[Path] = (), word: str = "figure"
) -> None:
    """Print values as JSON with `--json`, and otherwise as lines, with a line for each written file."""
    if options.json:
        print_json(values)
        return
    for line in lines:
        # A command or a path is there to be copied.
        copied = "activesteer " in line or os.path.exists(line.rpartition(" ")[2])
        print("\n".join([line] if copied else [part for one in line.split("\n") for part in wrapped_line(one)]))
    for path in files:
        print(f"{word}: {path}")


_for_json: Final[list[TextIO]] = []
"""Stream of `print_json`, while it is not standard output."""


@contextmanager
def stdout_for_json() -> Iterator[None]:
    """Reserve standard output for `print_json`, and send all other output to standard error."""
    stream = sys.stdout
    own = stream if stream is sys.__stdout__ else None
    if own is not None:  # native code and other processes write to it, too
        own.flush()
        stream = open(os.dup(1), "w", encoding=own.encoding, errors=own.errors)  # noqa: SIM115 - closed below
        os.dup2(2, 1)
    _for_json.append(stream)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        _for_json.pop()
        if own is not None:
            own.flush()
            os.dup2(stream.fileno(), 1)
            try:
                stream.close()
            except BrokenPipeError:
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
                raise


def painted(text: str, colour: int) -> str:
    """Return the text in a colour on a terminal or with FORCE_COLOR, and never with NO_COLOR."""
    forced = os.environ.get("FORCE_COLOR", "") not in ("", "0")
    coloured = forced or (sys.stdout.isatty() and os.environ.get("TERM") != "dumb")
    plain = bool(os.environ.get("NO_COLOR")) or not text.strip()
    return f"\x1b[{colour}m{text}\x1b[0m" if coloured and not plain else text


def coloured(text: str) -> str:
    """Return the text with coloured verdicts if output is coloured."""
    return _VERDICT.sub(lambda found: f"{found[1]}{painted(found[2], _COLOURS[found[2]])}", text)


def print_notes(notes: Iterable[str]) -> None:
    """Print notes on unusual results to standard error, one per line."""
    for note in notes:
        print(entry("! ", note), file=sys.stderr)


def entry(head: str, text: str, hanging: int = 2) -> str:
    """Wrap a heading and a message to 80 columns, with all lines but the first indented."""
    lines = textwrap.wrap(printable(text), COLUMNS, initial_indent=head, subsequent_indent=" " * hanging, **WHOLE)
    return "\n".join(lines) or head.rstrip()


def printable(text: str) -> str:
    """Replace the control characters of a string by escape sequences."""
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)


@contextmanager
def log_to_terminal() -> Iterator[None]:
    """Print the log messages of the package to standard error."""
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("activesteer: %(message)s"))
    logger = logging.getLogger("activesteer")
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)


_CELLS: Final = 30
_LINE_EVERY_S: Final = 10.0
"""Time between two lines of a log [s]."""


class Progress:
    """Progress of counted runs: a bar on a terminal, lines in a log."""

    def __init__(self, label: str, *, quiet: bool) -> None:
        self._label, self._quiet = label, quiet
        self._bar = not quiet and sys.stderr.isatty()
        self._width = 0
        self._begun_s = self._said_s = time.monotonic()

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar:
            print("\r" + " " * self._width + "\r", end="", file=sys.stderr, flush=True)

    def __call__(self, fraction: float, note: str = "") -> None:
        """Show a fraction from 0 to 1, and a note."""
        if self._bar:
            filled = round(_CELLS * fraction)
            line = f"{self._label} [{'#' * filled}{' ' * (_CELLS - filled)}] {fraction:4.0%} {note}"
            print("\r" + line.ljust(self._width), end="", file=sys.stderr, flush=True)
            self._width = max(self._width, len(line))

    def count(self, runs: StudyProgress) -> None:
        """Show number, rate and remaining time of many runs."""
        now_s = time.monotonic()
        rate = runs.here / max(now_s - self._begun_s, 1e-6)
        left_s = round((runs.total - runs.done) / rate) if rate > 0.0 else 0
        clock = f"{left_s // 3600}:{left_s // 60 % 60:02}:{left_s % 60:02}"
        failed = f", {runs.failed} failed" if runs.failed else ""
        words = f"{runs.done}/{runs.total} runs, {rate:.3g} runs/s, {clock} left{failed}"
        self(runs.done / runs.total, words)
        if not self._bar and not self._quiet and (now_s - self._said_s >= _LINE_EVERY_S or runs.done == runs.total):
            print(words, file=sys.stderr, flush=True)
            self._said_s = now_s
