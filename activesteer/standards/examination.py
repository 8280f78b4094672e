"""Test by a standard: runs and evaluation for each controller, and the page of the results."""

from __future__ import annotations

import datetime
import functools
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from markupsafe import Markup

from activesteer.core.conventions import run_looks
from activesteer.core.files import file_word
from activesteer.core.units import parameter_title, typeset
from activesteer.drawing.cars import bytes_of
from activesteer.pages import Page, Section, Table, Text, failed, passed
from activesteer.plotting import Curve, Heat, Panel, Picture
from activesteer.scenario import FileOrTable, check_gains, check_parts, read_by, resolve
from activesteer.standards import braking, fmvss126, iso3888_2, iso4138, iso7401, iso13674, r79_circle
from activesteer.standards.catalogue import Standard, standard_of
from activesteer.standards.standard import Findings, NoResult, StandardRunner
from activesteer.studies.engine.factor_values import label_of
from activesteer.studies.engine.runs import versions
from activesteer.studies.engine.workers import workers_for

EXAMINED_BY: Final[dict[str, Callable[[StandardRunner], Findings]]] = {
    "fmvss126": fmvss126.examine,
    "iso3888-2": iso3888_2.examine,
    "iso4138": iso4138.examine,
    "iso7401": iso7401.examine,
    "iso7975": braking.in_a_turn,
    "iso13674": iso13674.examine,
    "iso14512": braking.on_split_friction,
    "iso21994": braking.stop,
    "r79-circle": r79_circle.examine,
}
"""Functions that drive and evaluate one car with one controller, by name of the standard. A run that fails is a row;
without any result the function raises `NoResult`."""


@dataclass(frozen=True)
class Examination:
    """Result of a test by a standard."""

    standard: Standard
    vehicle: str
    driver: str
    overrides: Mapping[str, Any]
    findings: Mapping[str, Findings]  # controller -> findings
    versions: Mapping[str, str]  # versions of the program and its libraries
    date: datetime.date  # date of the test [UTC]

    @property
    def failed(self) -> list[str]:
        """Controllers with which the car exceeds a limit or cannot be tested."""
        return [name for name, found in self.findings.items() if found.passed is False or found.error]

    def to_json(self) -> dict[str, Any]:
        """Return the result as JSON values."""
        return {
            "standard": self.standard.name,
            "edition": self.standard.edition,
            "vehicle": self.vehicle,
            "driver": self.driver,
            "overrides": dict(self.overrides),
            "versions": dict(self.versions),
            "controllers": {name: found.values | {"summary": found.summary} for name, found in self.findings.items()},
        }


def examine(
    name: str,
    controllers: Sequence[str] = ("none",),
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    *,
    driver: FileOrTable | None = None,
    output: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[str, str, int, int], None] = lambda *_: None,
) -> Examination:
    """Drive and evaluate a standard, one of `catalogue.STANDARDS`, with each controller separately.

    Overrides may change car, driver and road; the standard defines the manoeuvres, and the driver if none is given. The
    runs in the folder can be resumed; without a folder, they are not kept. `progress` is called with controller,
    series, finished runs, and all runs.
    """
    standard = standard_of(name)
    driver = standard.driver if driver is None else driver
    given = dict(overrides or {})
    scenario = resolve("straight_line", vehicle, given, driver, controllers)
    check_parts(given, scenario, ("vehicle", "driver"))
    check_gains(given, controllers)
    scenario.car.on()  # else its error would be a missing result of every controller
    found = {}
    with workers_for(jobs, scheduler=scheduler) as workers:
        for controller in controllers:
            label = label_of(controller)
            folder = None if output is None else Path(output) / "runs" / file_word(label)
            tell = functools.partial(progress, label)
            read = read_by(given, controller)
            runner = StandardRunner(standard.name, vehicle, driver, controller, read, folder, workers, tell)
            try:
                found[label] = EXAMINED_BY[standard.name](runner)
            except NoResult as reason:
                found[label] = Findings({"error": str(reason)}, f"no result: {reason}")
    today = datetime.datetime.now(tz=datetime.UTC).date()
    return Examination(standard, label_of(vehicle), label_of(driver), given, found, versions(), today)


_WIDE, _THIN, _LINE = 3.6, 1.0, 1.4
"""Widths of the first and of the second curve of a controller, and of a single curve [pt]. Both sides may coincide."""
_SIDES: Final = 2
_BESIDE: Final = 8
"""Largest number of runs whose metrics stand side by side."""
_PALE: Final = 0.55
"""Share of white in the colour of the wide curve."""


def examination_page(result: Examination) -> Page:
    """Return the page of a test."""
    standard = result.standard
    car = Markup("Vehicle <b>{}</b>, driver {}").format(result.vehicle, result.driver)
    for key, value in result.overrides.items():
        car += Markup(", {} {} (<code>{}</code>)").format(parameter_title(key), value, key)
    lead: list[Text] = [car + f". {result.date.isoformat()}."]
    versions = ", ".join(f"{name} {version}" for name, version in result.versions.items())
    lead.append(Markup('<span class="quiet">{}</span>').format(versions))
    several = len(result.findings) > 1
    rows = [
        (name, _verdict(found), Markup("<br>").join(re.split("[.;] ", typeset(found.error or found.summary))))
        for name, found in result.findings.items()
    ]
    sections = [Section(tables=[Table("", ["controller", "result", ""], rows)])] if several else []
    compared, together = _side_by_side(result.findings), _together(result.findings)
    if compared or together:
        sections += [Section("All controllers"), *_parts(list(compared.values()), list(together.values()))]
    for found, (name, *words) in zip(result.findings.values(), rows, strict=True):
        own = _parts(
            [table for table in found.tables if table.title not in compared],
            [picture for picture in found.pictures if picture.title not in together and not _is_empty(picture)],
        )
        # The first table has the words of several controllers.
        if own or not several:
            sections += [Section(name, [] if several else words), *own]
    sections += [
        Section("Scope of this implementation", [standard.edition]),
        Section("Implemented", points=standard.implemented, level=3),
        Section("Not implemented", points=standard.left_out, level=3),
    ]
    return Page(f"{standard.name}: {result.vehicle}", standard.title, lead, sections)


def _parts(tables: Sequence[Table], pictures: Sequence[Picture]) -> list[Section]:
    """Return a subsection for each title, with the table and the plots of the same runs."""
    parts = []
    for title in dict.fromkeys(part.title for part in (*tables, *pictures)):
        own = [table for table in tables if table.title == title]
        drawn = [picture._replace(title="" if own else title) for picture in pictures if picture.title == title]
        parts.append(Section(tables=own, pictures=drawn, level=3))
    return parts


def _is_empty(picture: Picture) -> bool:
    """Return whether a figure has no points, for example because its runs failed at the start."""
    return not any(isinstance(panel, Heat) or any(np.size(it.x) for it in panel.curves) for panel in picture.panels)


def _side_by_side(findings: Mapping[str, Findings]) -> dict[str, Table]:
    """Return the tables of metrics of several controllers by title, with a column for each run."""
    shown = {name: {table.title: table for table in found.tables} for name, found in findings.items() if found.tables}
    found = {}
    for title in next(iter(shown.values()), {}) if len(shown) > 1 else ():
        alike = {name: tables[title] for name, tables in shown.items() if title in tables}
        runs = {
            f"{name}, {run}" if len(table.columns) > 3 else name: {tuple(row[:2]): row[place] for row in table.rows}
            for name, table in alike.items()
            for place, run in enumerate(table.columns[2:], 2)
            if table.columns[1] == "unit"
        }
        if len(alike) == len(shown) and 0 < len(runs) <= _BESIDE:
            heads = dict.fromkeys(head for cells in runs.values() for head in cells)
            rows = [(*head, *(cells.get(head, "-") for cells in runs.values())) for head in heads]
            found[title] = Table(title, ("", "unit", *runs), rows)
    return found


def _together(findings: Mapping[str, Findings]) -> dict[str, Picture]:
    """Return overlaid plots of several controllers by title, one colour each; empty for a single controller."""
    looks = run_looks(findings)
    shown = {name: {picture.title: picture for picture in found.pictures} for name, found in findings.items()}
    shown = {name: pictures for name, pictures in shown.items() if pictures}
    first = next(iter(shown.values()), {})
    found = {}
    for title in first if len(shown) > 1 else ():
        alike = [pictures[title] for pictures in shown.values() if title in pictures]
        rows = list(zip(*(picture.panels for picture in alike), strict=False))
        if len(alike) < len(shown) or not all(map(_overlays, rows)):
            continue
        panels = [
            parts[0]._replace(curves=[curve for name, panel in zip(shown, parts, strict=True)
                                      for curve in _in_one_colour(panel, name, looks[name].colour)])
            for parts in rows
        ]  # fmt: skip
        found[title] = first[title]._replace(panels=panels)
    return found


def _overlays(parts: Sequence[Panel | Heat]) -> bool:
    """Return whether the panels of several controllers remain legible in one panel."""
    return all(
        isinstance(panel, Panel)
        and len(panel.curves) <= _SIDES
        and panel.names == parts[0].names
        and all(curve.shade is None for curve in panel.curves)
        and len({curve.dashes == "" for curve in panel.curves}) <= 1  # points beside lines, such as cones
        for panel in parts
        if isinstance(parts[0], Panel)
    )


def _in_one_colour(panel: Panel, name: str, colour: str) -> Iterator[Curve]:
    pale = "#" + "".join(f"{round(255 * _PALE + (1.0 - _PALE) * part):02x}" for part in bytes_of(colour))
    looks = ((colour, _LINE),) if len(panel.curves) == 1 else ((pale, _WIDE), (colour, _THIN))
    for curve, (own, width) in zip(panel.curves, looks, strict=False):
        label = f"{name}, {curve.label}" if curve.label else name
        yield curve._replace(label=label, colour=own, dashes=curve.dashes and "-", width=width)


def _verdict(found: Findings) -> Markup:
    if found.error:
        return Markup('<b class="failed">no result</b>')
    if found.passed is None:
        return Markup('<span class="quiet">No limits in the standard</span>')
    return passed("pass", chip=True) if found.passed else failed("fail", chip=True)
