"""Study files: manoeuvres, drivers, cars, factors, and stored results."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

from activesteer.config import Range, Source, build, read_toml, toml_value
from activesteer.core.conventions import DEFAULT_TIMESTEP_S
from activesteer.core.files import user_path
from activesteer.errors import StudyError, shown
from activesteer.resources import DEFAULT_DRIVER, find_study
from activesteer.scenario import FileOrTable, Scenario, resolve
from activesteer.studies.engine.design import DesignTable, Samples, cases, choose_design, draw, read_cases
from activesteer.studies.engine.factors import Factor, is_plain, read_factor

SEARCHES: Final = {
    "tune": "it defines what to minimise, satisfy or violate",
    "fit": "it defines the compared channels and their noise",
}
"""Tables of searches, which choose the factor values themselves; each with a hint for a missing table."""
_KEPT: Final = ("none", "failed", "all")
_LISTS: Final = ("maneuvers", "controllers", "vehicles", "metrics", "curves")
"""Keys with a list, or with its only name."""

Place = tuple[int, int, int]
"""Numbers of manoeuvre, vehicle and controller in their lists."""


def label_of(item: FileOrTable) -> str:
    """Return the name of a manoeuvre, vehicle or controller in the results."""
    if isinstance(item, Mapping):
        return str(item.get("name") or "table")
    # Look only before the parameters: a parameter's value may contain a colon too.
    named, mark, parameters = str(item).partition("?")
    path, colon, class_name = named.rpartition(":")
    if colon:
        return f"{Path(path).name}:{class_name}{mark}{parameters}"
    return Path(item).stem if str(item).endswith((".toml", ".mcap")) else str(item)


@dataclass(frozen=True)
class _Common:
    """Keys that a study copies from its file."""

    maneuvers: tuple[Any, ...]  # names, paths or tables of manoeuvres
    controllers: tuple[str, ...] = ("none",)  # names or files of controllers
    vehicles: tuple[Any, ...] = ("compact",)  # names, paths or tables of vehicles
    driver: Any = DEFAULT_DRIVER  # name, path or table of the driver, or a driver class
    overrides: dict[str, Any] = field(default_factory=dict)  # overrides of all runs: dotted key -> value
    seed: Annotated[int, Range(0)] = 0
    metrics: tuple[str, ...] = ()  # patterns of the metrics to keep, such as `yaw_rate_*`; empty for all
    recordings: Any = "none"  # `none`, `failed`, `all`, or a number n for every n-th sample
    curves: tuple[str, ...] = ()  # channels to keep of every run, every `conventions.CURVE_STEP_S`
    claims: bool = False  # whether to check the paper's claims for every sample; this needs its three systems
    timestep_s: Annotated[float, Range(1e-9)] = DEFAULT_TIMESTEP_S  # step of engine, driver and controller [s]
    tune: dict[str, Any] | None = None  # the table [tune], unparsed; see `tuning`
    fit: dict[str, Any] | None = None  # the table [fit], unparsed; see `measured.fitting`
    title: str = ""  # one line for the report


@dataclass(frozen=True)
class StudyFile(_Common):
    """A study as declared in its file, with absolute paths."""

    factors: tuple[Factor, ...] = ()
    design: DesignTable = DesignTable()
    case_list: Samples | None = None  # cases of a list design; None for other designs
    source: Source = Source("study")

    def samples(self) -> tuple[Samples, ...]:
        """Return the samples: one set that all controllers share if paired, else one set per controller."""
        if self.case_list is not None:
            return (self.case_list,)
        # A grid is the same for all controllers anyway.
        streams = 1 if self.design.paired or self.design.kind == "grid" else len(self.controllers)
        count = self.design.samples
        return tuple(draw(self.factors, self.design.kind, count, self.seed, stream) for stream in range(streams))

    @property
    def keys(self) -> tuple[str, ...]:
        """Varied keys, in the order of the file."""
        return tuple(self.case_list.columns) if self.case_list else tuple(factor.key for factor in self.factors)

    def scenario(self, maneuver: int, vehicle: int, overrides: Mapping[str, Any]) -> Scenario:
        """Return the scenario of a manoeuvre and a vehicle, by their numbers."""
        return resolve(self.maneuvers[maneuver], self.vehicles[vehicle], overrides, self.driver, self.controllers)

    def place_of(self, row: Mapping[str, Any]) -> Place:
        """Return the numbers of manoeuvre, vehicle and controller of a row of the results."""
        parts = ((self.maneuvers, "maneuver"), (self.vehicles, "vehicle"), (self.controllers, "controller"))
        maneuver, vehicle, controller = ([*map(label_of, items)].index(row[part]) for items, part in parts)
        return maneuver, vehicle, controller

    def to_table(self) -> dict[str, Any]:
        """Return the study as the table of a study file."""
        names = (
            "title", "maneuvers", "controllers", "vehicles", "driver", "seed", "timestep_s", "recordings", "claims",
            "overrides",
        )  # fmt: skip
        table: dict[str, Any] = {
            key: list(value) if isinstance(value := getattr(self, key), tuple) else value for key in names
        }
        if isinstance(self.recordings, int):
            table["recordings"] = {"every": self.recordings}
        design: dict[str, Any] = {"kind": self.design.kind, "paired": self.design.paired}
        if self.design.maneuvers != "all":
            design["maneuvers"] = self.design.maneuvers
        if self.design.samples:
            design["samples"] = self.design.samples
        if self.case_list is not None:
            design["cases"] = [self.case_list[number] for number in range(len(self.case_list))]
        else:
            table["factors"] = {factor.key: factor.to_table() for factor in self.factors}
        table |= {key: list(kept) for key in ("metrics", "curves") if (kept := getattr(self, key))}
        table |= {key: found for key in SEARCHES if (found := getattr(self, key)) is not None}
        return table | {"design": design}

    def to_toml(self) -> str:
        """Return the study as the content of a study file."""
        table = self.to_table()
        lines = [f"{key} = {toml_value(value)}" for key, value in table.items() if not isinstance(value, dict)]
        for name, inner in table.items():
            if isinstance(inner, dict):
                lines += [
                    "",
                    f"[{name}]",
                    *(f"{json.dumps(key)} = {toml_value(value)}" for key, value in inner.items()),
                ]
        return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class StudyTable(_Common):
    """Keys of a study file."""

    KEY_HINTS: ClassVar = {
        "falsify": 'write [tune] with violate = "harm(controller) <= 1" and trials, the number of sets of each search',
        "match": 'write [tune.satisfy] with lines such as prompt = "yaw_rate_response_time_s(ars) <= 0.1" or '
        'S1 = "claim(S1)", and trials and seeds in [tune]',
    }

    factors: dict[str, Any] = field(default_factory=dict)
    design: dict[str, Any] = field(default_factory=dict)


def read_study(given: FileOrTable | StudyFile, search: str = "") -> StudyFile:
    """Read a study file, and check it without its manoeuvres and vehicles."""
    if isinstance(given, StudyFile):
        return given
    if isinstance(given, Mapping):
        table, source, folder = dict(given), Source("study given as a table", error=StudyError), Path.cwd()
    else:
        path = find_study(given)
        table, source = read_toml(path, StudyError)
        folder = path.resolve().parent
    table |= {key: [value] for key in _LISTS if isinstance(value := table.get(key), str)}
    read = build(StudyTable, table, source)
    for key in (*_LISTS, "driver"):
        items = [read.driver] if key == "driver" else getattr(read, key)
        if key in table and not (items and all(isinstance(item, (str, Mapping)) for item in items)):
            raise source.fail(
                (key,), f"{shown(table[key])} is not a name, file or table, nor a list of them", table[key]
            )
    if search and search not in table:
        raise source.fail((search,), f"the table is missing: {SEARCHES[search]}")
    located = {
        "maneuvers": tuple(_located(item, folder) for item in read.maneuvers),
        "vehicles": tuple(_located(item, folder) for item in read.vehicles),
        "driver": _located_code(read.driver, folder),
        "controllers": tuple(_located_code(item, folder) for item in read.controllers),
        "recordings": _recordings(read.recordings, source),
    }
    study = StudyFile(**vars(read) | located | _varied(read, folder, source), source=source)
    both = [key for key in study.keys if key in study.overrides]
    if both:
        raise source.fail(("overrides", both[0]), "is varied by the study too; give it in one place")
    return study


def changed_study(given: FileOrTable, changes: dict[str, Any]) -> StudyFile:
    """Return a study with other controllers, vehicles, driver or samples, and more overrides."""
    study = read_study(given)
    table = study.to_table() | {key: value for key, value in changes.items() if key != "samples"}
    table["overrides"] = study.overrides | changes.get("overrides", {})
    if "samples" in changes:
        table["design"]["samples"] = changes["samples"]
    return read_study(table) if changes else study


def _varied(table: StudyTable, folder: Path, source: Source) -> dict[str, Any]:
    """Return factors, design and cases, checked for consistency."""
    factors = tuple(read_factor(key, value, source) for key, value in table.factors.items())
    given = dict(table.design)
    case_list = _cases(given.pop("cases", None), folder, source)
    if any(getattr(table, key) is not None for key in SEARCHES) and any(factor.kind != "grid" for factor in factors):
        given.setdefault("samples", 1)
    design = choose_design(build(DesignTable, given, source, ("design",)), factors, case_list is not None, source)
    return {"factors": factors, "design": design, "case_list": case_list}


def _cases(given: object, folder: Path, source: Source) -> Samples | None:
    where = ("design", "cases")
    if given is None:
        return None
    if isinstance(given, str):
        try:
            return read_cases(folder / user_path(given, StudyError))
        except StudyError as reason:
            raise source.fail(where, str(reason), given) from reason
    if not isinstance(given, Sequence) or not given or not all(isinstance(row, Mapping) and row for row in given):
        raise source.fail(where, "is neither a CSV file nor a list of tables with at least one key each")
    for row in given:
        for key, value in row.items():
            if value is not None and not is_plain(value):
                raise source.fail(where, f"{shown(value)} of {key} is not a number, string, true or false", value)
    return cases(given)


def _recordings(value: Any, source: Source) -> str | int:
    if value in _KEPT:
        return value
    if isinstance(value, Mapping) and set(value) == {"every"}:
        every = value["every"]
        if isinstance(every, int) and not isinstance(every, bool) and every > 0:
            return every
    problem = f"{shown(value)} is not one of {', '.join(_KEPT)} or {{ every = 50 }}"
    raise source.fail(("recordings",), problem, value)


def _located(item: FileOrTable, folder: Path) -> FileOrTable:
    """Return an absolute path from the study file's folder, or a name unchanged."""
    if isinstance(item, Mapping):
        return item
    text = os.fspath(item)
    is_path = text.endswith((".toml", ".mcap")) or os.sep in text
    return str((folder / user_path(text, StudyError)).resolve()) if is_path else text


def _located_code(item: Any, folder: Path) -> Any:
    """Make the path in a specification such as `my_file.py:MyController?gain=2` absolute."""
    name, mark, parameters = ("", "", "") if isinstance(item, Mapping) else item.partition("?")
    path, colon, class_name = name.rpartition(":")
    if not colon:
        return _located(item, folder)
    return f"{(folder / user_path(path, StudyError)).resolve()}:{class_name}{mark}{parameters}"
