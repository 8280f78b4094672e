"""`validation.toml`: measured runs of a car, and what is predicted, fitted and compared.

The file stands in the folder of the measured files. Windows are times of these files.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from activesteer.config import Range, Source, build, field_in_unit, read_toml
from activesteer.errors import ActiveSteerError, ParameterError, nearest_names
from activesteer.files import is_file, is_folder, shown_path, user_path
from activesteer.measured.comparison import TOLERANCES, Tolerance
from activesteer.resources import models_dir
from activesteer.scenario import load_car, resolve
from activesteer.studies.engine.factors import Factor, read_factor

NAME: Final = "validation.toml"
Window = tuple[float, ...]
"""Start and end in the time of the file [s]."""


@dataclass(frozen=True)
class RunTable:
    """A measured run."""

    name: str
    """Its name."""
    files: tuple[str, ...]
    """Files of the data logger, beside this file."""
    map: str = ""
    """Map file of `activesteer import`."""
    fit_s: Window = ()
    """Window for fitting; by default the run is not used for fitting."""
    check_s: Window = ()
    """Window for checking; by default the run is not used for checking."""


@dataclass(frozen=True)
class QuantityTable:
    """A compared channel; the numbers have the unit of its key."""

    noise: Annotated[float, Range(1e-12)] | None = None
    """Standard deviation of its noise, its weight in fits; by default the channel is not used in fits."""
    offset: Annotated[float, Range(0.0)] | None = None
    """Constant part of the tolerance; by default that of `activesteer compare`."""
    gain: Annotated[float, Range(0.0)] | None = None
    """Fraction of the simulated value that is added to the tolerance."""
    source: str = ""
    """Source of the tolerance."""


@dataclass(frozen=True)
class PredictTable:
    """Table of the factors that are free in the prediction."""

    factors: tuple[str, ...] = ()
    """Factors that the data must give before anything can be predicted, such as an unknown scale."""
    channels: tuple[str, ...] = ()
    """Channels that determine them; by default all that have a noise."""


@dataclass(frozen=True)
class IntervalTable:
    """A value with an unknown true value."""

    ends: tuple[float, ...]
    """Its ends."""
    source: str
    """Where they come from."""


@dataclass(frozen=True)
class MeasuredTable:
    """The file `validation.toml`."""

    vehicle: str
    """Name or file of the car."""
    runs: tuple[RunTable, ...]
    """The measured runs."""
    quantities: dict[str, QuantityTable]
    """Channel, in any unit -> how it is compared."""
    title: str = ""
    """Title of the page."""
    filter: Literal["iso15037", "fmvss126", "none"] = "iso15037"
    """Filter of both sides; see `activesteer compare`."""
    noise_allowance: bool = True
    """Whether to widen the corridors by the estimated noise of the measurement."""
    overrides: dict[str, Any] = field(default_factory=dict)
    """Values of the car and the manoeuvre that are known better than in their files."""
    predict: PredictTable = PredictTable()
    """What is free in the prediction."""
    factors: dict[str, Any] = field(default_factory=dict)
    """Factors of the fit, with ranges as in a study."""
    intervals: dict[str, IntervalTable] = field(default_factory=dict)
    """Key -> ends of its unknown value, for the band around the prediction."""
    assumptions: tuple[str, ...] = ()
    """What was assumed, one sentence each."""


@dataclass(frozen=True)
class MeasuredFile:
    """A checked file.

    Attributes:
        table: Its table.
        folder: Its folder.
        vehicle: Name or path of the car.
        factors: The factors.
        tolerances: Channel -> tolerance, SI.
        noise: Channel -> standard deviation, SI.
        predict_channels: Channels that determine the free factors of the prediction.
        source: For error messages.
    """

    table: MeasuredTable
    folder: Path
    vehicle: str
    factors: tuple[Factor, ...]
    tolerances: dict[str, Tolerance]
    noise: dict[str, float]
    predict_channels: tuple[str, ...]
    source: Source


def read_measured(folder: Path) -> MeasuredFile:
    """Read and check the file of a folder.

    Raises:
        ParameterError: the file cannot be read, or a key or value is wrong; the error names file, key and line.
    """
    path = folder / NAME
    given, source = read_toml(path)
    table = build(MeasuredTable, given, source)
    if not table.runs:
        raise source.fail(("runs",), "at least one measured run [[runs]] is needed")
    for number, run in enumerate(table.runs):
        _check_run(run, folder, source, ("runs", str(number)), [other.name for other in table.runs[:number]])
    if not any(run.check_s for run in table.runs):
        raise source.fail(("runs",), "a verdict needs a run with check_s = [start, end]")
    own = folder / table.vehicle
    vehicle = str(own) if table.vehicle.endswith(".toml") or "/" in table.vehicle else table.vehicle
    try:
        names = [channel.name for channel in load_car(vehicle).on().channels.channels]
    except ActiveSteerError as reason:
        raise source.fail(("vehicle",), reason.problem, table.vehicle, reason.allowed) from reason
    tolerances, noise = _quantities(table, source, names)
    channels = tuple(_channel(key, noise, source, ("predict", "channels")) for key in table.predict.channels)
    factors = _factors(table, vehicle, source)
    if factors and not noise:
        raise source.fail(("quantities",), "a fit needs a channel with noise = its standard deviation")
    for key, interval in table.intervals.items():
        if len(interval.ends) != 2 or interval.ends[0] >= interval.ends[1]:
            raise source.fail(("intervals", key), "ends = [low, high] is needed", interval.ends)
        _check_key(vehicle, key, interval.ends[0], source, ("intervals", key))
    for key, value in table.overrides.items():
        _check_key(vehicle, key, value, source, ("overrides", key))
    return MeasuredFile(table, folder, vehicle, factors, tolerances, noise, channels or tuple(noise), source)


def _factors(table: MeasuredTable, vehicle: str, source: Source) -> tuple[Factor, ...]:
    factors = tuple(read_factor(key, value, source) for key, value in table.factors.items())
    for factor in factors:
        where = ("factors", factor.key)
        if factor.kind != "uniform":
            raise source.fail(where, "a fit needs a range: uniform = [low, high]")
        _check_key(vehicle, factor.key, factor.low, source, where, relative=bool(factor.nominal))
    keys = [factor.key for factor in factors]
    for key in table.predict.factors:
        if key not in keys:
            raise source.fail(("predict", "factors"), f"{key} is no factor; {nearest_names(key, keys)}", key, keys)
    if factors and not any(run.fit_s for run in table.runs):
        raise source.fail(("runs",), "a fit needs a run with fit_s = [start, end]")
    return factors


def _check_run(run: RunTable, folder: Path, source: Source, where: tuple[str, ...], before: Iterable[str]) -> None:
    if run.name in before:
        raise source.fail((*where, "name"), "is the name of two runs", run.name)
    for key, names in (("files", run.files), ("map", (run.map,) if run.map else ())):
        for name in names:
            if not is_file(folder / name):
                raise source.fail((*where, key), f"there is no file {shown_path(folder / name)}", name)
    if not run.files:
        raise source.fail((*where, "files"), "names no file")
    for key, window in (("fit_s", run.fit_s), ("check_s", run.check_s)):
        if window and (len(window) != 2 or window[0] >= window[1]):
            raise source.fail((*where, key), "[start, end] with start before end is needed", window)
    if not run.fit_s and not run.check_s:
        raise source.fail((*where, "check_s"), "the run is used for nothing; give fit_s, check_s or both")


def _channel(key: str, known: Iterable[str], source: Source, where: tuple[str, ...]) -> str:
    name, _ = field_in_unit(key, known := list(known))
    if name is None:
        raise source.fail(where, f"there is no such channel; {nearest_names(key, known)}", key, known)
    return name


def _quantities(
    table: MeasuredTable, source: Source, names: list[str]
) -> tuple[dict[str, Tolerance], dict[str, float]]:
    """Return tolerances and noise by channel, SI."""
    tolerances: dict[str, Tolerance] = {}
    noise: dict[str, float] = {}
    if not table.quantities:
        raise source.fail(("quantities",), "at least one channel is needed")
    for key, given in table.quantities.items():
        where = ("quantities", key)
        name = _channel(key, names, source, where)
        factor = field_in_unit(key, names)[1]
        if name in tolerances:
            raise source.fail(where, "is given twice, in two units", key)
        usual = TOLERANCES.get(name)
        if usual is None and (given.offset is None or given.gain is None):
            raise source.fail(where, "has no usual tolerance; give offset, gain and source", key, list(TOLERANCES))
        if given.offset is not None or given.gain is not None:
            usual = usual or Tolerance(0.0, 0.0, "")
            offset = usual.offset if given.offset is None else given.offset * factor
            usual = Tolerance(offset, usual.gain if given.gain is None else given.gain, given.source or "user's file")
        assert usual is not None
        tolerances[name] = usual
        if given.noise is not None:
            noise[name] = given.noise * factor
    return tolerances, noise


def _check_key(
    vehicle: str, key: str, value: Any, source: Source, where: tuple[str, ...], *, relative: bool = False
) -> None:
    """Refuse a key that neither the car nor a repeated measurement has."""
    inputs: Mapping[str, Any] = {"kind": "open_loop", "name": "inputs", "duration_s": 1.0, "speed_mps": 20.0}
    try:
        resolve(inputs, vehicle, {} if relative else {key: value})
    except ActiveSteerError as reason:
        raise source.fail(where, reason.problem, value, reason.allowed) from reason


def measured_folder(name: str) -> Path | None:
    """Return the folder of measured runs: that of a car of the package, or a path; None for another comparison.

    Raises:
        ParameterError: the folder has no `validation.toml`.
    """
    own = models_dir() / "reference" / name
    if name in (path.name for path in own.parent.iterdir()):
        return own if is_file(own / NAME) else None
    folder = user_path(name, ParameterError)
    if not is_folder(folder):
        if folder.name == name:
            return None
        raise ParameterError(f"there is no folder {shown_path(folder)}", value=name)
    if not is_file(folder / NAME):
        raise ParameterError(
            f"the folder {shown_path(folder)} has no {NAME}; activesteer validate --new FOLDER makes an example",
            value=name,
        )
    return folder
