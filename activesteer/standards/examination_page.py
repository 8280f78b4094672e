"""Printable HTML page of a test, with its pictures embedded."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from markupsafe import Markup

from activesteer.conventions import run_looks
from activesteer.drawing.colours import bytes_of
from activesteer.pages import Page, Section, Table, Text, failed, passed
from activesteer.plotting import Panel, Picture, as_svg, draw
from activesteer.standards.examination import Examination
from activesteer.standards.standard import Findings
from activesteer.units import parameter_title, typeset

_WIDE, _THIN = 3.6, 1.0
"""Widths of the first and of the second curve of a controller [pt]; the two sides of a car may coincide."""
_PALE: Final = 0.55
"""Share of white in the colour of the wide curve."""


def examination_page(result: Examination) -> Page:
    """Return the page."""
    standard = result.standard
    car = Markup("Vehicle <b>{}</b>, driver {}").format(result.vehicle, result.driver)
    for key, value in result.overrides.items():
        car += Markup(", {} {} (<code>{}</code>)").format(parameter_title(key), value, key)
    lead: list[Text] = [car + f". {result.date.isoformat()}."]
    versions = ", ".join(f"{name} {version}" for name, version in result.versions.items())
    lead.append(Markup('<span class="quiet">{}</span>').format(versions))
    rows = [(name, _verdict(found), found.error or found.summary) for name, found in result.findings.items()]
    sections = [Section(tables=[Table("", ["controller", "result", ""], rows)])]
    together = _together(result.findings) if standard.overlaid else []
    if together:
        sections.append(Section("All controllers", pictures=[as_svg(draw(picture)) for picture in together]))
    for name, found in result.findings.items():
        words = Markup("{}: {}.").format(_verdict(found), found.error or typeset(found.summary))
        alone = [] if together else [as_svg(draw(picture)) for picture in found.pictures]
        sections.append(Section(name, [words], alone, found.tables))
    sections += [
        Section("Scope of this implementation", [standard.edition]),
        Section("Implemented", points=standard.implemented, level=3),
        Section("Not implemented", points=standard.left_out, level=3),
    ]
    return Page(f"{standard.name}: {result.vehicle}", standard.title, lead, sections)


def _together(findings: Mapping[str, Findings]) -> list[Picture]:
    """Return the pictures of several controllers laid over each other; empty for a single one.

    A controller has one colour. The first curve of each panel, the turn to the left, is wide and pale, the second thin.
    """
    looks = run_looks(findings)
    shown = {name: found.pictures for name, found in findings.items() if found.pictures}
    if len(shown) < 2:
        return []
    pictures = []
    for alike in zip(*shown.values(), strict=True):
        panels = []
        for parts in zip(*(picture.panels for picture in alike), strict=True):
            curves = [
                curve._replace(label=f"{name}, {curve.label}", colour=colour, dashes="-", width=width)
                for name, panel in zip(shown, parts, strict=True)
                for curve, colour, width in zip(
                    panel.curves if isinstance(panel, Panel) else (),
                    (_pale(looks[name].colour), looks[name].colour),
                    (_WIDE, _THIN),
                    strict=False,
                )
            ]
            panels.append(parts[0]._replace(curves=curves))
        pictures.append(alike[0]._replace(panels=panels, shared_legend=True))
    return pictures


def _pale(colour: str) -> str:
    return "#" + "".join(f"{round(255 * _PALE + (1.0 - _PALE) * part):02x}" for part in bytes_of(colour))


def _verdict(found: Findings) -> Markup:
    if found.error:
        return Markup('<b class="failed">no result</b>')
    if found.passed is None:
        return Markup('<span class="quiet">no limits</span>')
    return passed("pass", chip=True) if found.passed else failed("fail", chip=True)
