"""A test as one HTML page with its pictures in it, made to be printed."""

from __future__ import annotations

from pathlib import Path

from activesteer.errors import ParameterError
from activesteer.files import make_folder, write_text
from activesteer.pages import render
from activesteer.plotting import as_svg
from activesteer.standards.examination import Examination
from activesteer.standards.figures import draw


def write_page(result: Examination, path: Path) -> Path:
    """Writes the page; a file that exists is replaced.

    Args:
        result: What came out.
        path: The HTML file.

    Returns:
        The path.

    Raises:
        ParameterError: matplotlib is not installed, or the file cannot be written.
    """
    text = page(result)
    make_folder(path.parent, ParameterError)
    return write_text(path, text, ParameterError)


def page(result: Examination) -> str:
    """The page; see `write_page`."""
    pictures = {name: [as_svg(draw(picture)) for picture in found.pictures] for name, found in result.findings.items()}
    return render("standard.html", result=result, pictures=pictures)
