"""Printable HTML page of a test, with its pictures embedded."""

from __future__ import annotations

from pathlib import Path

from markupsafe import Markup

from activesteer.display_units import parameter_title, typeset
from activesteer.errors import ParameterError
from activesteer.files import make_folder, write_text
from activesteer.pages import Page, Section, Table, Text, failed, passed, render_page
from activesteer.plotting import as_svg, draw
from activesteer.standards.examination import Examination
from activesteer.standards.standard import Findings


def write_page(result: Examination, path: Path) -> Path:
    """Write the page and return its path; an existing file is replaced."""
    text = page(result)
    make_folder(path.parent, ParameterError)
    return write_text(path, text, ParameterError)


def page(result: Examination) -> str:
    """Return the page as HTML; see `write_page`."""
    standard = result.standard
    car = Markup("Vehicle <b>{}</b>, driver {}").format(result.vehicle, result.driver)
    for key, value in result.overrides.items():
        car += Markup(", {} {} (<code>{}</code>)").format(parameter_title(key), value, key)
    lead: list[Text] = [car + f". {result.date.isoformat()}."]
    versions = ", ".join(f"{name} {version}" for name, version in result.versions.items())
    lead.append(Markup('<span class="quiet">{}</span>').format(versions))
    rows = [(name, _verdict(found), found.error or found.summary) for name, found in result.findings.items()]
    sections = [Section(tables=[Table("", ["controller", "result", ""], rows)])]
    for name, found in result.findings.items():
        words = Markup("{}: {}.").format(_verdict(found), found.error or typeset(found.summary))
        sections.append(Section(name, [words], [as_svg(draw(picture)) for picture in found.pictures], found.tables))
    sections += [
        Section("Scope of this implementation", [standard.edition]),
        Section("Implemented", points=standard.implemented, level=3),
        Section("Not implemented", points=standard.left_out, level=3),
    ]
    return render_page(Page(f"{standard.name}: {result.vehicle}", standard.title, lead, sections))


def _verdict(found: Findings) -> Markup:
    if found.error:
        return Markup('<b class="failed">no result</b>')
    if found.passed is None:
        return Markup('<span class="quiet">no limits</span>')
    return passed("pass", chip=True) if found.passed else failed("fail", chip=True)
