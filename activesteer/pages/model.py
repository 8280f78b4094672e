"""The parts of a page that is read from the top to the end: texts, tables, pictures and points in sections."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

from markupsafe import Markup

from activesteer.plotting.model import Picture
from activesteer.text_table import text_table, wrapped_line

Text = str | Markup
"""Text is escaped; markup must be made by `Markup`."""


_NARROW: Final = 3
"""Most columns that fit on a phone."""
_LONG: Final = 60
"""Length of a cell that needs a line of its own there."""


class Table(NamedTuple):
    """A table.

    Attributes:
        title: Its title; empty for none.
        columns: Heads, with units.
        rows: Cells, as they are read.
        outside: Numbers of the rows that break a limit.
        quiet: Numbers of the rows that nothing is asked of.
        kind: Class of the stylesheet.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Text]]
    outside: frozenset[int] = frozenset()
    quiet: frozenset[int] = frozenset()
    kind: str = "findings"

    @property
    def cards(self) -> bool:
        """True if a phone shows each row as a card, because the table is too wide for it."""
        return len(self.columns) > _NARROW or any(len(cell) > _LONG for row in self.rows for cell in row)

    def lines(self) -> Iterator[str]:
        """Yield the table as aligned text; `!` marks rows that break a limit, `~` rows that nothing is asked of."""
        rows = [[_plain(cell) for cell in row] for row in (self.columns, *self.rows)]
        places = range(-1, len(self.rows))
        marks = ["! " if place in self.outside else "~ " if place in self.quiet else "  " for place in places]
        yield from text_table(rows, text=len(self.columns), marks=marks)


class Section(NamedTuple):
    """A section; its parts follow each other in the order of the attributes.

    Attributes:
        title: Its heading; empty for none.
        texts: Paragraphs.
        pictures: Pictures, whose panels the page draws.
        tables: Tables.
        points: Items of a list.
        level: Level of its heading: 2, or 3 for a part of the section before.
    """

    title: str = ""
    texts: Sequence[Text] = ()
    pictures: Sequence[Picture] = ()
    tables: Sequence[Table] = ()
    points: Sequence[str] = ()
    level: int = 2


class Page(NamedTuple):
    """A page.

    Attributes:
        title: Title of the window.
        heading: Heading of the page.
        lead: Paragraphs below the heading.
        sections: The sections.
    """

    title: str
    heading: Text
    lead: Sequence[Text]
    sections: Sequence[Section]

    def lines(self) -> Iterator[str]:
        """Yield heading, paragraphs and tables as text."""
        for text in map(_plain, (self.heading, *self.lead)):
            yield from wrapped_line(text)
        for section in self.sections:
            if section.texts or section.tables:
                for text in map(_plain, filter(None, (section.title, *section.texts))):
                    yield from wrapped_line(text)
            for table in section.tables:
                yield from table.lines()


def _plain(text: Text) -> str:
    """Return a text without markup, ticks and crosses."""
    if isinstance(text, Markup):
        text = Markup(str(text).replace("<br>", ", ")).striptags()
    return re.sub("[\N{CHECK MARK}\N{BALLOT X}] ", "", text)


def passed(words: str, *, chip: bool = False) -> Markup:
    """Return words with a tick."""
    return Markup('<b class="{}passed">\N{CHECK MARK} {}</b>').format("chip " if chip else "", words)


def failed(words: str, *, chip: bool = False) -> Markup:
    """Return words with a cross."""
    return Markup('<b class="{}failed">\N{BALLOT X} {}</b>').format("chip " if chip else "", words)
