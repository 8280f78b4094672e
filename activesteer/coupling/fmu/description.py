"""Description of an FMU for co-simulation: variables, capabilities, library of this platform."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.coupling.fmu.archive import BINARIES, DESCRIPTION, Archive
from activesteer.errors import not_installed, shown
from activesteer.plugins import Kind
from activesteer.units import Unit, find_unit, known_unit

_FORMATS: Final = {
    "Real": "d", "Float64": "d", "Float32": "f", "Integer": "i", "Int8": "b", "UInt8": "B", "Int16": "h", "UInt16": "H",
    "Int32": "i", "UInt32": "I", "Int64": "q", "UInt64": "Q",
}  # fmt: skip
"""Numeric type of FMI -> format of `struct`; Boolean and Enumeration depend on the version."""
_HERTZ: Final = re.compile(r"k?Hz|rev.*|r/.*|rpm")
_MAX_SIZE: Final = 1000
"""Largest number of elements of an array."""


class Variable(NamedTuple):
    """A variable of an FMU that holds numbers.

    Attributes:
        name: Its name.
        reference: Value reference.
        kind: Type, as in the names of FMI's functions (`Real`, `Float64`, `Boolean`).
        form: Format of `struct` of an element.
        size: Number of elements.
        start: Start value; None if there is none.
        unit: Unit; None if the FMU declares none or one that nobody knows.
        unit_name: Name of the unit; None if the FMU declares none.
        low: Least value; `high` is the largest.
    """

    name: str
    reference: int
    kind: str
    form: str
    size: int
    start: float | None
    unit: Unit | None
    unit_name: str | None
    low: float
    high: float


class Description(NamedTuple):
    """Description of an FMU.

    Attributes:
        version: 2 or 3.
        identifier: Model identifier.
        token: GUID or instantiation token.
        inputs: Name -> input.
        outputs: Name -> output.
        parameters: Name -> parameter that can be set before the initialisation.
        library: Member of the archive with the code for this platform.
        saves_state: Whether the FMU can save and restore its state.
        serialises_state: Whether the FMU can turn a saved state into bytes.
        alone: Whether a process can hold only one instance.
        fixed_step_s: Step that the FMU must keep [s]; None if it can make every step.
        usual_step_s: Step that the FMU suggests [s].
    """

    version: int
    identifier: str
    token: str
    inputs: Mapping[str, Variable]
    outputs: Mapping[str, Variable]
    parameters: Mapping[str, Variable]
    library: str
    saves_state: bool
    serialises_state: bool
    alone: bool
    fixed_step_s: float | None
    usual_step_s: float | None


def describe_fmu(archive: Archive, kind: Kind) -> Description:
    """Read and check the description of an FMU.

    Args:
        archive: The FMU.
        kind: Kind of block, whose error is raised.

    Raises:
        ActiveSteerError: of the kind's type: FMPy is missing, the description is invalid, or the FMU cannot be used
            here.
    """
    name = archive.path.name
    try:
        from fmpy import read_model_description  # noqa: PLC0415 - an extra, and slow to import
    except ImportError:
        raise not_installed(kind.error, f"{name}: an FMU as {kind.word}", "fmpy", "fmi") from None
    try:
        description = read_model_description(archive.unpacked())
    except Exception as reason:
        raise kind.fail(name, f"its {DESCRIPTION} is invalid: {reason}") from reason
    if description.fmiMajorVersion not in (2, 3):
        raise kind.fail(name, f"has FMI {description.fmiVersion}; FMI 2.0 or 3.0 is needed")
    simulation = description.coSimulation
    if simulation is None:
        raise kind.fail(name, "is for model exchange only; an FMU for co-simulation is needed")
    if simulation.needsExecutionTool:
        raise kind.fail(name, "needs the tool that made it (needsExecutionTool); export a self-contained FMU")
    found = {
        variable.name: (variable.causality, read)
        for variable in description.modelVariables
        if variable.alias is None
        and variable.variability != "constant"
        and (read := _variable(variable, description)) is not None
    }
    by_causality = {
        causality: {name: read for name, (own, read) in found.items() if own == causality}
        for causality in ("input", "output", "parameter")
    }
    for variable in (variable for variables in by_causality.values() for variable in variables.values()):
        if variable.start is not None and not math.isfinite(variable.start):
            problem = f"its variable {shown(variable.name)} starts at {variable.start}; a finite number is needed"
            raise kind.fail(name, problem, variable.start)
    experiment = description.defaultExperiment
    usual_s = _positive(experiment.stepSize) if experiment else None
    fixed_s = _positive(simulation.fixedInternalStepSize)
    if not simulation.canHandleVariableCommunicationStepSize:
        fixed_s = fixed_s or usual_s
    return Description(
        description.fmiMajorVersion, str(simulation.modelIdentifier), str(description.guid), by_causality["input"],
        by_causality["output"], by_causality["parameter"], _library(archive, str(simulation.modelIdentifier), kind),
        bool(simulation.canGetAndSetFMUstate), bool(simulation.canSerializeFMUstate),
        bool(simulation.canBeInstantiatedOnlyOncePerProcess), fixed_s, usual_s,
    )  # fmt: skip


def _variable(variable: Any, description: Any) -> Variable | None:
    """Return a variable; None if it holds no numbers."""
    version2 = description.fmiMajorVersion == 2
    kind, form = variable.type, _FORMATS.get(variable.type)
    if kind == "Boolean":
        form = "i" if version2 else "?"
    elif kind == "Enumeration":
        kind, form = ("Integer", "i") if version2 else ("Int64", "q")
    if form is None:
        return None
    size = math.prod(variable.shape or ())
    declared = variable.declaredType
    unit_name = variable.unit or (declared and declared.unit) or None
    base = next((unit.baseUnit for unit in description.unitDefinitions if unit.name == unit_name), None)
    return Variable(
        variable.name, variable.valueReference, kind, form, min(size, _MAX_SIZE + 1),
        _number(variable.start), _declared_unit(unit_name, base), unit_name,
        _number(variable.min, -math.inf), _number(variable.max, math.inf),
    )  # fmt: skip


def _number(text: Any, default: Any = None) -> Any:
    """Return the number in an attribute; true is 1."""
    first = str(text).split()[0] if text is not None and str(text).split() else None
    try:
        return default if first is None else float({"true": "1", "false": "0"}.get(first, first))
    except ValueError:
        return default


def _positive(text: Any) -> float | None:
    value = _number(text)
    return value if value is not None and 0.0 < value < math.inf else None


def _library(archive: Archive, identifier: str, kind: Kind) -> str:
    """Return the member with the code for this platform."""
    if not str(identifier).isidentifier():
        raise kind.fail(archive.path.name, f"its model identifier {identifier!r} is not the name of a library")
    for folder in BINARIES:
        if (member := f"{folder}{identifier}.so") in archive.names:
            return member
    parts = (Path(name).parts for name in archive.names if name.startswith("binaries/"))
    others = sorted({part[1] for part in parts if len(part) > 2})
    there = f"it has {', '.join(others)}" if others else "it has none"
    if not others and any(name.startswith("sources/") for name in archive.names):
        there += ", only sources; build it with `fmpy` or the tool that made it"
    raise kind.fail(
        archive.path.name, f"has no binary for Linux on x86-64 ({BINARIES[0]}{identifier}.so); {there}", None, BINARIES
    )


def _declared_unit(name: str | None, base: Any) -> Unit | None:
    """Return a unit as an FMU declares it, by its base unit as FMPy reads it; None if nobody knows the unit."""
    if name is None or base is None:
        return find_unit(name) if name else None
    others = any(getattr(base, other) for other in ("A", "K", "mol", "cd"))
    if others or not (math.isfinite(base.factor) and base.factor and math.isfinite(base.offset)):
        return Unit(name, math.nan, (99, 99, 99, 99))
    # Tools declare frequencies by the base unit 1/s, which as an angular speed is one radian per second.
    turn = known_unit("Hz").factor if _HERTZ.fullmatch(name) and base.rad == 0 and base.s == -1 else 1.0
    return Unit(name, turn * base.factor, (base.kg, base.m, base.s, base.rad), base.offset)
