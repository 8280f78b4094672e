"""Highest entry speeds of a course by bisection, and a map over speed and line that checks them.

A car completes a lane change if its whole body stays in the lanes, and a slalom if it passes every cone on the right
side and hits none. Bisection assumes that a car that succeeds at one speed succeeds at every lower one. The map does
not: it is driven cell by cell, and `Envelope.exceptions` are the cells that contradict the assumption.
"""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.errors import ActiveSteerError, ParameterError, SimulationDiverged, StudyError
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable, Scenario, check_gains, read_by, resolve
from activesteer.simulation.runner import run_scenario
from activesteer.studies.engine.plan import label_of
from activesteer.studies.engine.run_task import Status
from activesteer.studies.engine.study import study
from activesteer.studies.engine.task_queue import in_parallel

RANGE_KMH: Final = (40.0, 160.0)
"""Range of the entry speed [km/h]."""
RESOLUTION_KMH: Final = 1.0
"""Resolution of the entry speed [km/h]."""
_AFTER_S: Final = 4.0
"""Time after the last gate [s]: metrics use 3 s of it."""
_NONE: Final = "none"


class Line(NamedTuple):
    """Second axis of a map, beside the speed.

    Attributes:
        key: Key of the manoeuvre.
        label: Its name.
        values: Default values [m].
        kept: Metrics of a run -> whether the car succeeded.
    """

    key: str
    label: str
    values: tuple[float, ...]
    kept: Callable[[Mapping[str, float]], bool]


LINES: Final = {
    "lane_change": Line(
        "lane.margin_m",
        "margin between the car and the lanes",
        (0.0, 0.04, 0.08, 0.12, 0.16, 0.2),
        lambda metrics: metrics["stays_in_lanes"] == 1.0,
    ),
    "slalom": Line(
        "cones.offset_m",
        "distance of the line from the cones",
        (1.3, 1.6, 1.9, 2.2, 2.5, 2.8),
        lambda metrics: metrics["cones_hit"] == 0.0 and metrics["cones_missed"] == 0.0,
    ),
}
"""Kind of manoeuvre -> its second axis."""
_METRICS: Final = ("stays_in_lanes", "lane_overstep_m", "cones_*", "*_peak_abs_*", "*_gates_rms_*", "track_amplitude_m")


def line_of(scenario: Scenario) -> Line:
    """Return the second axis of a scenario's map.

    Raises:
        ParameterError: the manoeuvre has no lanes and no cones.
    """
    name, kind = scenario.maneuver.name, scenario.maneuver.kind
    if kind not in LINES:
        raise ParameterError(
            f"{name} is of the kind {kind}, which has no entry speed to search for; allowed are {' and '.join(LINES)}",
            key="maneuver",
            value=kind,
            allowed=tuple(LINES),
        )
    return LINES[kind]


class State(StrEnum):
    """Outcomes of the cars in a cell."""

    NOBODY = "nobody is lost"
    NONE_ONLY = "only the car without control is lost"
    SOME = "others are lost"
    ALL = "all are lost"


@dataclass(frozen=True)
class Envelope:
    """Result of an envelope.

    Attributes:
        maneuver: Name of the manoeuvre.
        line: Second axis of the map.
        nominal: Speed [km/h] and line [m] of the manoeuvre.
        entry_speeds: `driver`, `controller` and `entry_speed_kmh` for each driver and controller: the highest speed on
            the line of the manoeuvre. None if the car fails at the lowest speed that was tried; the highest speed if it
            succeeds at every one.
        rows: The map: `driver`, `controller`, `speed_kmh`, `line_m`, `kept`, and metrics of the run.
    """

    maneuver: str
    line: Line
    nominal: tuple[float, float]
    entry_speeds: list[dict[str, Any]]
    rows: list[dict[str, Any]]

    @property
    def drivers(self) -> list[str]:
        """Drivers of the map."""
        return list(dict.fromkeys(entry["driver"] for entry in self.entry_speeds))

    def kept(self, driver: str) -> dict[tuple[float, float], dict[str, bool]]:
        """Return speed [km/h] and line [m] -> controller -> whether its car succeeds."""
        found: dict[tuple[float, float], dict[str, bool]] = {}
        for row in self.rows:
            if row["driver"] == driver:
                found.setdefault((row["speed_kmh"], row["line_m"]), {})[row["controller"]] = row["kept"]
        return found

    def cells(self, driver: str) -> dict[tuple[float, float], State]:
        """Return speed [km/h] and line [m] -> outcomes of the cars."""
        return {place: _state(cars) for place, cars in self.kept(driver).items()}

    @property
    def exceptions(self) -> list[dict[str, Any]]:
        """Return pairs of neighbouring cells in which the faster car succeeds and the slower one fails."""
        keys = ("driver", "controller", "line_m")
        columns: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
        for row in sorted(self.rows, key=lambda row: row["speed_kmh"]):
            columns.setdefault(tuple(row[key] for key in keys), []).append(row)
        return [
            {key: row[key] for key in keys} | {"lost_kmh": row["speed_kmh"], "kept_kmh": faster["speed_kmh"]}
            for column in columns.values()
            for row, faster in pairwise(column)
            if faster["kept"] and not row["kept"]
        ]

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        cells = [
            {"driver": driver, "speed_kmh": speed, "line_m": line, "state": state.value}
            for driver in self.drivers
            for (speed, line), state in self.cells(driver).items()
        ]
        return {
            "maneuver": self.maneuver,
            "line": self.line.key,
            "nominal": {"speed_kmh": self.nominal[0], "line_m": self.nominal[1]},
            "entry_speeds": self.entry_speeds,
            "map": self.rows,
            "cells": cells,
            "exceptions": self.exceptions,
        }


def _state(kept: Mapping[str, bool]) -> State:
    if all(kept.values()):
        return State.NOBODY
    if not any(kept.values()):
        return State.ALL
    alone = _NONE in kept and all(value is (name != _NONE) for name, value in kept.items())
    return State.NONE_ONLY if alone else State.SOME


def envelope(
    maneuver: FileOrTable,
    controllers: Sequence[str] = (_NONE, "ars", "afs"),
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    *,
    drivers: Sequence[FileOrTable] = (DEFAULT_DRIVER,),
    speeds_kmh: Sequence[float] = (),
    lines_m: Sequence[float] = (),
    output: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Envelope:
    """Find the entry speeds of a lane change or a slalom, and drive the map of each driver.

    The overrides set neither speed nor duration nor line. The speeds of the map are by default from 30 below to 30
    above that of the manoeuvre [km/h], its lines those of `LINES` [m]. The studies of the maps are stored below the
    names of manoeuvre and driver in `output`, and can be resumed. `progress` is called with the current item, the
    finished runs or searches, and the total.
    """
    given = dict(overrides or {})
    scenario = resolve(maneuver, vehicle, given, drivers[0], controllers)
    check_gains(given, controllers)
    line = line_of(scenario)
    nominal_kmh = 3.6 * scenario.maneuver.speed_mps
    speeds = tuple(speeds_kmh) or tuple(nominal_kmh + step for step in range(-30, 31, 10))
    lines = tuple(lines_m) or line.values
    part, _, name = line.key.partition(".")
    nominal = (round(nominal_kmh, 6), float(getattr(getattr(scenario.maneuver, part), name)))

    def report(what: str) -> Callable[[int, int], None]:
        return lambda done, total: progress(what, done, total) if progress else None

    pairs = [(driver, controller) for driver in drivers for controller in controllers]
    search = functools.partial(entry_speed, maneuver, vehicle, given, line)
    tell = report("entry speeds")
    found = in_parallel(search, pairs, jobs, lambda _, done: tell(done, len(pairs)), scheduler=scheduler)
    entry_speeds = [
        {"driver": label_of(driver), "controller": controller, "entry_speed_kmh": speed}
        for (driver, controller), speed in zip(pairs, found, strict=True)
    ]
    factors = {"speed_kmh": {"grid": list(speeds)}, line.key: {"grid": list(lines)}}
    duration_s = _duration_s(scenario, min(speeds))
    rows: list[dict[str, Any]] = []
    for driver in drivers:
        tell = report(f"map of {label_of(driver)}")
        table = study(
            {
                "maneuvers": [maneuver],
                "vehicles": [vehicle],
                "driver": driver,
                "controllers": list(controllers),
                "overrides": {**given, "duration_s": duration_s},
                "metrics": list(_METRICS),
                "factors": factors,
            },
            output=None if output is None else Path(output) / scenario.maneuver.name / label_of(driver),
            jobs=jobs,
            scheduler=scheduler,
            progress=lambda counted, tell=tell: tell(counted.done, counted.total),
        )
        rows += [_map_row(label_of(driver), line, row) for row in table.to_pylist()]
    return Envelope(scenario.maneuver.name, line, nominal, entry_speeds, rows)


def _duration_s(scenario: Scenario, speed_kmh: float) -> float:
    course = scenario.maneuver.course
    assert course is not None, "kinds of LINES have a course"
    assert course.last_gate_x_m is not None, "and it has gates"
    return round(3.6 * course.last_gate_x_m / speed_kmh + _AFTER_S, 2)


def _map_row(driver: str, line: Line, row: Mapping[str, Any]) -> dict[str, Any]:
    place = {"driver": driver, "controller": row["controller"], "speed_kmh": row["speed_kmh"], "line_m": row[line.key]}
    told = {*place, line.key}
    metrics = {name: value for name, value in row.items() if isinstance(value, float) and name not in told}
    # If the engine gave up a run, or the car did not reach the last gate, the car failed. Any other failure says
    # nothing about the car.
    status, diverged = row["status"], f"{row['error']}".startswith(SimulationDiverged.__name__)
    if status == Status.CRASHED or (status == Status.FAILED and not diverged):
        where = f"{driver}, {row['controller']}, {row['speed_kmh']:g} km/h, {line.key} = {row[line.key]:g}"
        raise StudyError(f"map of {where}: {row['error']}")
    return {**place, "kept": status == Status.OK and line.kept(row), **metrics}


def entry_speed(
    maneuver: FileOrTable,
    vehicle: FileOrTable,
    overrides: Mapping[str, Any],
    line: Line,
    driver: FileOrTable,
    controller: str,
) -> float | None:
    """Return the highest speed [km/h] at which a car succeeds, by bisection within `RESOLUTION_KMH`.

    It is None if the car fails at every speed of `RANGE_KMH`, and the upper end if the car succeeds at every one.
    """
    read = read_by(overrides, controller)
    base = resolve(maneuver, vehicle, read, driver, [controller])

    def keeps(speed_kmh: float) -> bool:
        changes = {**read, "speed_kmh": speed_kmh, "duration_s": _duration_s(base, speed_kmh)}
        try:
            scenario = resolve(maneuver, vehicle, changes, driver, [controller])
            return line.kept(run_scenario(scenario, controller).metrics)
        except ActiveSteerError as error:
            if error.recording is None:  # nothing was driven: an input is wrong
                raise
            return False

    low, high = RANGE_KMH
    if not keeps(low):
        return None
    if keeps(high):
        return high
    for _ in range(math.ceil(math.log2((high - low) / RESOLUTION_KMH))):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if keeps(middle) else (low, middle)
    return low
