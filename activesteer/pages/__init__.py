"""Self-contained HTML pages, from one jinja2 template and one stylesheet.

In: tables, figures and texts.
Out: HTML pages that work without a network.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from activesteer.core.conventions import RUN_COLOURS, RUN_COLOURS_ON_DARK
from activesteer.core.files import make_folder, write_text
from activesteer.core.units import typeset
from activesteer.core.version import __version__
from activesteer.errors import ParameterError
from activesteer.pages.model import Page, Section, Table, Text, failed, passed, picture_values


def render_page(page: Page) -> str:
    """Return a page as HTML."""
    charts = [picture_values(picture) for section in page.sections for picture in section.pictures]
    scripts = ["uPlot.iife.min.js", "touch.js", "charts.js", *page.scripts] if charts or page.scripts else []
    data = {"pictures": charts, **page.data}
    return _environment().get_template("document.html").render(page=page, scripts=scripts, data=data)


def write_page(page: Page, path: Path) -> Path:
    """Write a page as HTML over an existing file and return its path."""
    make_folder(path.parent, ParameterError)
    return write_text(path, render_page(page), ParameterError)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("activesteer.pages"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # The filter escapes `<`, `>`, `&` and quotes. JSON has no nan, so nan is an error.
    environment.policies["json.dumps_kwargs"] = {"ensure_ascii": False, "separators": (",", ":"), "allow_nan": False}
    environment.globals |= {"version": __version__, "asset": _asset}
    environment.globals |= {"run_colours": RUN_COLOURS, "run_colours_on_dark": RUN_COLOURS_ON_DARK}
    environment.filters["typeset"] = _typeset
    environment.filters["unbroken"] = _unbroken
    return environment


def _typeset(text: Text) -> Text:
    return text if isinstance(text, Markup) else typeset(text)


def _unbroken(text: Text) -> Text:
    """Keep a number and its unit in one line."""
    return text if isinstance(text, Markup) else re.sub(r"(?<=\d) (?=[^\W\d])", "\N{NO-BREAK SPACE}", text)


def _asset(name: str) -> Markup:
    """Return the content of a stylesheet or a script."""
    loader = PackageLoader("activesteer.pages")
    return Markup(loader.get_source(_environment(), name)[0])


__all__ = ["Page", "Section", "Table", "Text", "failed", "passed", "render_page", "write_page"]
