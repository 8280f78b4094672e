"""Tables as text that fits a terminal of 80 columns."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence
from typing import Any, Final

COLUMNS: Final = 80
_COLOUR: Final = re.compile(r"\x1b\[\d*m")
_NEGATIVE_ZERO: Final = re.compile(r"(?<![\w.)\]-])-(?=0(?:\.0+)?(?![\d.]))")

WHOLE: Final[dict[str, Any]] = {"break_on_hyphens": False, "break_long_words": False, "replace_whitespace": False}
"""Arguments of `textwrap` that keep words and columns as they are."""
Rows = Sequence[Sequence[str]]


def text_table(
    rows: Rows,
    *,
    text: int = 1,
    repeat: int | None = None,
    least: int = 0,
    gap: int = 2,
    marks: Sequence[str] = (),
) -> Iterator[str]:
    """Yield the lines of a table with its head, with narrow columns, split or wrapped if it is too wide."""
    rows = [[unsigned_zeros(cell) for cell in row] for row in rows]
    marks = marks or [""] * len(rows)
    width = COLUMNS - len(marks[0])
    widths = [max(map(_length, column)) for column in zip(*rows, strict=True)]
    wide = [max(each, least) if place >= text else each for place, each in enumerate(widths)]
    if _total(wide, gap) <= width:
        yield from _lines(rows, wide, text, gap, marks)
        return
    gap = 1 if _total(widths, 1) <= width < _total(widths, 2) else 2
    if repeat is not None and _total(widths, gap) > width and len(widths) > repeat + 1:
        end = max(repeat + 1, *(n for n in range(len(widths)) if _total(widths[:n], gap) <= width))
        yield from _lines([row[:end] for row in rows], widths[:end], text, gap, marks)
        yield ""
        rest = [[*row[:repeat], *row[end:]] for row in rows]
        yield from text_table(rest, text=text, repeat=repeat, gap=gap, marks=marks)
        return
    if repeat is None:
        words = [max(map(len, " ".join(column).split()), default=0) for column in zip(*rows, strict=True)]
        gap = 2 if _total(words[:text] + widths[text:], 2) <= width else 1
        while _total(widths, gap) > width:
            place = max(range(text), key=lambda n: (widths[n] > words[n], widths[n]))
            if widths[place] <= words[place]:  # every column is as narrow as its longest word
                break
            widths[place] -= 1
    yield from _lines(rows, widths, text, gap, marks)


def wrapped_line(line: str) -> list[str]:
    """Split a line into pieces that fit, with all but the first indented by four more columns."""
    if _length(line) <= COLUMNS:
        return [line]
    indent = " " * (len(line) - len(line.lstrip()) + 4)
    return textwrap.wrap(line, COLUMNS, subsequent_indent=indent, **WHOLE)


def _length(cell: str) -> int:
    return len(_COLOUR.sub("", cell))


def _total(widths: Sequence[int], gap: int) -> int:
    return sum(widths) + gap * (len(widths) - 1)


def _lines(rows: Rows, widths: Sequence[int], text: int, gap: int, marks: Sequence[str]) -> Iterator[str]:
    for row, mark in zip(rows, marks, strict=True):
        cells = [
            [cell]
            if _length(cell) <= width
            else textwrap.wrap(cell, width, break_on_hyphens=False, break_long_words=False) or [""]
            for cell, width in zip(row, widths, strict=True)
        ]
        for n in range(max(map(len, cells))):
            parts = (cell[n] if n < len(cell) else "" for cell in cells)
            padded = (
                f"{part}{blanks}" if place < text else f"{blanks}{part}"
                for place, (part, width) in enumerate(zip(parts, widths, strict=True))
                for blanks in (" " * (width - _length(part)),)
            )
            yield f"{mark if n == 0 else ' ' * len(mark)}{(' ' * gap).join(padded)}".rstrip()


def unsigned_zeros(text: str) -> str:
    """Remove the minus sign of zeros in a string."""
    return _NEGATIVE_ZERO.sub("", text)
