"""An FMU given as a controller or driver: `controller.fmu`, `controller.fmu?gain=2&isolate=5`."""

from __future__ import annotations

import functools
import itertools
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from activesteer.config import Source, read_toml
from activesteer.coupling.fmu.archive import Archive
from activesteer.coupling.fmu.block import FmuBlock, Wiring
from activesteer.coupling.fmu.description import Variable, describe_fmu
from activesteer.coupling.fmu.instance import Group, Spec
from activesteer.coupling.fmu.signals import Link, linked, signals_of
from activesteer.errors import nearest_names, shown
from activesteer.files import is_file, shown_path, user_path, why_no_file
from activesteer.plugins import Kind, Plugin
from activesteer.plugins.declared import read_values
from activesteer.plugins.file import parse_parameters
from activesteer.plugins.plugin import allowed
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint

ENDING: Final = ".fmu"
ISOLATE: Final = "isolate"
_ISOLATE_RANGE: Final = (0.001, 3600.0)
_MESSAGES: Final = {"controller": (DriverCommand, Measurement), "driver": (Setpoint, Measurement, Motion)}
"""Kind of block -> the messages that it gets."""
_MAX_KEPT_BYTES: Final = 4_000_000
"""Largest FMU that a recording keeps; of a larger one it keeps the description and the digest."""


class Fmu:
    """An FMU from which a driver or controller can be made for any car.

    Attributes:
        path: The file.
        kind: Controllers or drivers.
        description: Its description.
        PARAMETERS: Name -> declaration of its parameters; see `activesteer.plugins`.
        interval_s: Time between two steps of the FMU [s]; None for every step of the simulation.
        files: Files to keep with a recording.
    """

    checks_itself = True
    reads = ()

    def __init__(self, path: Path, kind: Kind) -> None:
        """Read the FMU and its map, and match its variables with our signals.

        Args:
            path: The file.
            kind: Controllers or drivers.

        Raises:
            ActiveSteerError: of the kind's type: the FMU cannot be used.
        """
        self.path, self.kind, self.__name__ = path, kind, path.stem
        self._archive = Archive(path, kind)
        about = self.description = describe_fmu(self._archive, kind)
        self.interval_s = about.fixed_step_s or about.usual_step_s
        map_path = path.with_suffix(".toml")
        self.files = self._archive.kept(_MAX_KEPT_BYTES)
        given: Mapping[str, Any] = {}
        source = Source(path.name, error=kind.error)
        if is_file(map_path):
            given, source = read_toml(map_path, kind.error)
            self.files[map_path.name] = source.text.encode()
        self._inputs, self._outputs = self._matched(given, source)
        if ISOLATE in about.parameters:
            raise kind.fail(path.name, f"has a parameter {ISOLATE}, a name that every FMU has already")
        single = (variable for variable in about.parameters.values() if variable.size == 1)
        self.PARAMETERS = {variable.name: _declared(variable) for variable in single}
        self.PARAMETERS[ISOLATE] = {"unit": "s", "range": _ISOLATE_RANGE}

    def _matched(self, given: Mapping[str, Any], source: Source) -> tuple[list[Link], list[Link]]:
        """Return the links of inputs and outputs, each by type."""
        about = self.description
        names = [*about.inputs, *about.outputs]
        for name in given:
            if name not in names:
                problem = f"{self.path.name} has no input or output {shown(name)}; {nearest_names(name, names)}"
                raise source.fail((name,), problem, name, names)
        inputs, no_input = linked(about.inputs, signals_of(_MESSAGES[self.kind.word]), given, source)
        outputs, no_output = linked(about.outputs, signals_of((self.kind.result,)), given, source)
        if no_input or no_output:
            left = {"inputs": no_input, "outputs": no_output}
            words = [f"{word} {', '.join(names)}" for word, names in left.items() if names]
            example = (*no_input, *no_output)[0]
            raise self.kind.fail(
                self.path.name,
                f"no signals have the names of its {' and '.join(words)}; rename them, or write "
                f"{self.path.stem}.toml beside it: {example} = {{ signal = \"yaw_rate_radps\", unit = \"deg/s\" }}, or "
                f"{{ signal = \"none\" }} to leave one alone",
                (*no_input, *no_output),
            )  # fmt: skip
        if not outputs:
            raise self.kind.fail(self.path.name, f"has no output for an activesteer.{self.kind.result.__name__}")
        return sorted(inputs, key=_type_of), sorted(outputs, key=_type_of)

    def from_vehicle(self, setup: Any, **parameters: Any) -> FmuBlock:
        """Make the block of one run.

        Args:
            setup: `ControllerSetup` or `DriverSetup`.
            parameters: Parameters that replace the FMU's start values. `isolate` is the time limit of a call in a
                process of its own [s].

        Raises:
            ActiveSteerError: of the kind's type: the FMU cannot make steps of this length, or fails.
        """
        about, every, step_s = self.description, 1, setup.timestep_s
        if self.kind.word == "driver" and self.interval_s is not None:
            every = max(1, round(self.interval_s / step_s))
            step_s *= every
        fixed_s = about.fixed_step_s
        if fixed_s is not None and (step_s < 0.999 * fixed_s or abs(step_s / fixed_s - round(step_s / fixed_s)) > 1e-6):
            problem = f"makes steps of {fixed_s:g} s; it cannot be called every {step_s:g} s"
            raise self.kind.fail(self.path.name, problem, step_s, fixed_s)
        isolate_s = parameters.pop(ISOLATE, None)
        folder = self._archive.unpacked()
        resources = folder / "resources"
        resources.mkdir(exist_ok=True)
        spec = Spec(
            str(folder / about.library), about.version, about.token, str(resources), step_s, _grouped(self._inputs),
            _grouped(self._outputs), [self._changed(name, value) for name, value in parameters.items()], self.path.stem,
        )  # fmt: skip
        keeps = about.saves_state
        wiring = Wiring(spec, self._inputs, self._outputs, every, isolate_s, keeps, keeps and about.serialises_state)
        again = functools.partial(_from_vehicle, self, {**parameters, ISOLATE: isolate_s})
        return FmuBlock(wiring, self.kind, self.path.name, setup, again)

    def _changed(self, name: str, value: Any) -> tuple[Group, list[float]]:
        variable = self.description.parameters[name]
        return Group(variable.kind, variable.form, [variable.reference], 1), [float(value)]

    def __reduce__(self) -> Any:
        return Fmu, (self.path, self.kind)


def _from_vehicle(fmu: Fmu, parameters: Mapping[str, Any], setup: Any) -> FmuBlock:
    return fmu.from_vehicle(setup, **parameters)


def _declared(variable: Variable) -> dict[str, Any]:
    """Return the declaration of a parameter, with the FMU's start value and unit."""
    is_flag = variable.kind == "Boolean" and variable.start is not None
    default = bool(variable.start) if is_flag else variable.start
    return {"default": default, "range": (variable.low, variable.high), "unit": variable.unit_name or ""}


def _type_of(link: Link) -> tuple[str, str]:
    return link.variable.kind, link.variable.form


def _grouped(links: Sequence[Link]) -> list[Group]:
    """Return the groups of links that are ordered by type."""
    groups = [(key, [link.variable for link in part]) for key, part in itertools.groupby(links, _type_of)]
    return [Group(*key, [v.reference for v in part], sum(v.size for v in part)) for key, part in groups]


def is_fmu(given: Any) -> bool:
    """Return whether a block is given as an FMU."""
    return isinstance(given, (str, os.PathLike)) and os.fspath(given).partition("?")[0].lower().endswith(ENDING)


def find_fmu(given: str | os.PathLike[str], kind: Kind) -> Plugin:
    """Read an FMU as a controller or driver.

    A file with the same name and the ending `.toml` beside it is its map: a table for each variable whose name or unit
    differs from ours, such as `r = { signal = "yaw_rate_radps", unit = "deg/s" }`.

    Args:
        given: Path of the FMU, with `?parameter=value` for its parameters. `isolate=5` runs it in a process of its own,
            in which no call may take more than 5 s.
        kind: Controllers or drivers.

    Raises:
        ActiveSteerError: of the kind's type: the FMU cannot be used.
    """
    text, _, rest = os.fspath(given).partition("?")
    path = user_path(text, kind.error)
    if not is_file(path):
        raise kind.fail(text, f"{shown_path(path)} {why_no_file(path)}")
    fmu = Fmu(path, kind)
    written = parse_parameters(rest, functools.partial(kind.fail, path.name))
    label = "-".join([path.stem, *(f"{key}={value}" for key, value in written.items() if key != ISOLATE)])
    found = Plugin(kind, os.fspath(given), re.sub(r"[^\w=.+-]+", "_", label), fmu, {}, fmu.files)
    source = Source(path.name, error=kind.error)
    return allowed(replace(found, parameters=read_values(found.declared, written, source, (kind.table, found.key))))


def isolated(given: Any, limit_s: float | None) -> Any:
    """Return an FMU that runs in a process of its own; other blocks, and all without a limit, are returned unchanged.

    Args:
        given: A driver or controller, as given.
        limit_s: Time limit of a call [s].
    """
    if limit_s is None or not is_fmu(given):
        return given
    text = os.fspath(given)
    return f"{text}{'&' if '?' in text else '?'}{ISOLATE}={limit_s:g}"
