"""An FMU file: its archive, which is untrusted, and its description."""

from __future__ import annotations

import atexit
import functools
import hashlib
import io
import math
import re
import shutil
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any, Final, NamedTuple

from activesteer.core import limits
from activesteer.core.files import read_bytes, shown_path
from activesteer.core.units import Unit, find_unit, known_unit
from activesteer.errors import not_installed, shown
from activesteer.plugins import Kind

_BLOCK_BYTES: Final = 1 << 20
_DAMAGED: Final = (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError, RuntimeError)
DESCRIPTION: Final = "modelDescription.xml"
BINARIES: Final = ("binaries/linux64/", "binaries/x86_64-linux/")
"""Folders of the binaries for Linux on x86-64, of FMI 2 and of FMI 3."""
_NEEDED: Final = (DESCRIPTION, "resources/", *BINARIES)


class Archive:
    """An FMU file with the digest `key`. The end of the process deletes the unpacked copy."""

    def __init__(self, path: Path, kind: Kind) -> None:
        """Read and check the archive without unpacking it."""
        self.path = path
        self._error = kind.error
        self._fail = functools.partial(kind.fail, path.name)
        self._data = read_bytes(path, kind.error, limits.MAX_FMU_BYTES)
        self.key = hashlib.sha256(self._data).hexdigest()
        try:
            with zipfile.ZipFile(io.BytesIO(self._data)) as archive:
                self._check(archive)
                self.names = archive.namelist()
                self.description = archive.read(DESCRIPTION)
        except (*_DAMAGED, KeyError, ValueError) as reason:
            raise self._fail(f"{shown_path(path)} is not an FMU: {reason}") from reason
        # An FMU needs no document type; one could expand without limit or read files of this machine.
        if b"\0" in self.description[:4] or b"<!DOCTYPE" in self.description or b"<!ENTITY" in self.description:
            raise self._fail(f"its {DESCRIPTION} is not plain UTF-8 without a document type")

    def _check(self, archive: zipfile.ZipFile) -> None:
        members = archive.infolist()
        total = sum(member.file_size for member in members)
        limits.check_count(len(members), limits.MAX_FMU_MEMBERS, "files", self._error, file=self.path.name)
        limits.check_count(total, limits.MAX_FMU_UNPACKED_BYTES, "unpacked bytes", self._error, file=self.path.name)
        for member in members:
            name = PurePosixPath(member.filename)
            kind = stat.S_IFMT(member.external_attr >> 16)
            outside = name.is_absolute() or ".." in name.parts or any(sign in member.filename for sign in "\\:\0")
            if outside or kind not in (0, stat.S_IFREG, stat.S_IFDIR):
                raise self._fail(f"holds {member.filename!r}, which is outside of the FMU or no plain file")
        if DESCRIPTION not in archive.namelist():
            raise self._fail(f"{shown_path(self.path)} is not an FMU: it has no {DESCRIPTION}")
        size = archive.getinfo(DESCRIPTION).file_size
        limits.check_count(size, limits.MAX_FMU_DESCRIPTION_BYTES, "bytes", self._error, file=DESCRIPTION)

    def kept(self, most_bytes: int) -> dict[str, bytes]:
        """Return the data of the FMU for a recording: the file itself, or description and digest if it is large."""
        if len(self._data) <= most_bytes:
            return {self.path.name: self._data}
        return {f"{self.path.stem}.sha256": self.key.encode(), f"{self.path.stem}.xml": self.description}

    def unpacked(self) -> Path:
        """Return the folder with description, resources, and the binaries for this platform."""
        if (folder := _unpacked.get(self.key)) is None:
            folder = Path(tempfile.mkdtemp(prefix="activesteer-fmu-"))
            atexit.register(shutil.rmtree, folder, ignore_errors=True)
            try:
                with zipfile.ZipFile(io.BytesIO(self._data)) as archive:
                    for member in archive.infolist():
                        if member.filename.startswith(_NEEDED) and not member.is_dir():
                            _write(archive, member, folder / member.filename)
            except _DAMAGED as reason:
                raise self._fail(f"cannot be unpacked: {reason}") from reason
            _unpacked[self.key] = folder
        return folder


_unpacked: Final[dict[str, Path]] = {}


def _write(archive: zipfile.ZipFile, member: zipfile.ZipInfo, target: Path) -> None:
    """Write a member of the archive, up to the size that it declares."""
    target.parent.mkdir(parents=True, exist_ok=True)
    left = member.file_size
    with archive.open(member) as source, target.open("xb") as file:
        while block := source.read(min(left, _BLOCK_BYTES)):
            left -= len(block)
            file.write(block)


_FORMATS: Final = {
    "Real": "d", "Float64": "d", "Float32": "f", "Integer": "i", "Int8": "b", "UInt8": "B", "Int16": "h", "UInt16": "H",
    "Int32": "i", "UInt32": "I", "Int64": "q", "UInt64": "Q",
}  # fmt: skip
"""Formats of `struct` for the numeric types of FMI. Boolean and Enumeration depend on the version."""
_HERTZ: Final = re.compile(r"k?Hz|rev.*|r/.*|rpm")


class Variable(NamedTuple):
    """A variable of an FMU that holds numbers."""

    name: str
    reference: int  # value reference
    kind: str  # type, as in the names of FMI's functions (`Real`, `Float64`, `Boolean`)
    form: str  # format of `struct` of an element
    size: int  # number of elements
    start: float | None  # start value; None if there is none
    unit: Unit | None  # unit; None if the FMU declares none or one that nobody knows
    unit_name: str | None  # name of the unit; None if the FMU declares none
    low: float  # least value; `high` is the largest
    high: float


class Description(NamedTuple):
    """Description of an FMU: version, variables and library."""

    version: int  # 2 or 3
    token: str  # GUID or instantiation token
    inputs: Mapping[str, Variable]  # name -> input
    outputs: Mapping[str, Variable]  # name -> output
    parameters: Mapping[str, Variable]  # name -> parameter that can be set before the initialisation
    library: str  # member of the archive with the code for this platform
    saves_state: bool  # whether the FMU can save and restore its state
    serialises_state: bool  # whether the FMU can turn a saved state into bytes
    fixed_step_s: float | None  # step that the FMU must keep [s]; None if it can make every step
    usual_step_s: float | None  # step that the FMU suggests [s]


def describe_fmu(archive: Archive, kind: Kind) -> Description:
    """Read and check the description of an FMU."""
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
        description.fmiMajorVersion, str(description.guid), by_causality["input"],
        by_causality["output"], by_causality["parameter"], _library(archive, str(simulation.modelIdentifier), kind),
        bool(simulation.canGetAndSetFMUstate), bool(simulation.canSerializeFMUstate),
        fixed_s, usual_s,
    )  # fmt: skip


def _variable(variable: Any, description: Any) -> Variable | None:
    """Return a variable, or None if it is not numeric."""
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
        variable.name, variable.valueReference, kind, form, min(size, limits.MAX_FMU_ELEMENTS + 1),
        _number(variable.start), _declared_unit(unit_name, base), unit_name,
        _number(variable.min, -math.inf), _number(variable.max, math.inf),
    )  # fmt: skip


def _number(text: Any, default: Any = None) -> Any:
    """Return the number in an attribute, 1 for True."""
    first = str(text).split()[0] if text is not None and str(text).split() else None
    try:
        return default if first is None else float({"true": "1", "false": "0"}.get(first, first))
    except ValueError:
        return default


def _positive(text: Any) -> float | None:
    value = _number(text)
    return value if value is not None and 0.0 < value < math.inf else None


def _library(archive: Archive, identifier: str, kind: Kind) -> str:
    """Return the member with the library for this platform."""
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
    """Return a unit of an FMU from its base unit, or None for an unknown unit."""
    if name is None or base is None:
        return find_unit(name) if name else None
    others = any(getattr(base, other) for other in ("A", "K", "mol", "cd"))
    if others or not (math.isfinite(base.factor) and base.factor and math.isfinite(base.offset)):
        return Unit(name, math.nan, (99, 99, 99, 99))
    # Tools declare frequencies by the base unit 1/s, which as an angular speed is one radian per second.
    turn = known_unit("Hz").factor if _HERTZ.fullmatch(name) and base.rad == 0 and base.s == -1 else 1.0
    return Unit(name, turn * base.factor, (base.kg, base.m, base.s, base.rad), base.offset)
