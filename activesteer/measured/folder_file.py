"""The file `validation.toml` of a folder of measured runs, and example folders.

The file is in the folder of the measured files. Windows are times of these files.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal

from activesteer.config import Range, Source, build, read_toml
from activesteer.core.conventions import Array
from activesteer.core.files import is_file, is_folder, make_folder, shown_path, user_path, write_text
from activesteer.errors import ActiveSteerError, ParameterError, nearest_names
from activesteer.measured.comparison import TOLERANCES, Tolerance
from activesteer.measured.signals import by_channel
from activesteer.resources import models_dir
from activesteer.scenario import load_car, resolve, value_of
from activesteer.studies.engine.factors import Factor, read_factor

NAME: Final = "validation.toml"
STEERING: Final = "steering_wheel_rad"
_OF_RUNS: Final = ("runs", "predict", "factors", "filter", "noise_allowance")
"""Keys that only measured runs can have."""
CIRCLE_KEYS: Final = ("radius_m", "ay_mps2", "zero_deg", "body_roll", "stiff_column")
"""Keys of a measured circle that an interval may have, in addition to the keys of the car."""
Window = tuple[float, ...]
"""Start and end in the time of the file [s]."""


@dataclass(frozen=True)
class RunTable:
    """Table of a measured run: its files, map and windows."""

    name: str
    """Name of the run."""
    files: tuple[str, ...]
    """Files of the data logger, in the folder of this file."""
    map: str = ""
    """Map file of `activesteer import`."""
    fit_s: Window = ()
    """Window for fitting. By default the run is not used for fitting."""
    check_s: Window = ()
    """Window for checking. By default the run is not used for checking."""


@dataclass(frozen=True)
class QuantityTable:
    """A compared channel, with numbers in the unit of its key."""

    noise: Annotated[float, Range(1e-12)] | None = None
    """Standard deviation of the noise: the channel's weight in fits. By default the channel is not used in fits."""
    offset: Annotated[float, Range(0.0)] | None = None
    """Constant part of the tolerance; by default the tolerance of `activesteer compare`."""
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
    """Channels that determine these factors. By default all channels with a noise."""


@dataclass(frozen=True)
class IntervalTable:
    """A value that is known only within an interval."""

    source: str
    """Source of the ends of the interval."""
    ends: tuple[float, ...] = ()
    """Ends of the interval of a key."""
    low: dict[str, Any] = field(default_factory=dict)
    """Overrides at one end of an interval of any name; only with a circle."""
    high: dict[str, Any] = field(default_factory=dict)
    """Overrides at the other end."""


@dataclass(frozen=True)
class CircleTable:
    """Table of a measured circle: path, lateral acceleration and measured angles."""

    radius_m: Annotated[float, Range(1.0)]
    """Radius of the path of the centre of gravity [m]."""
    ay_mps2: Annotated[float, Range(0.5)]
    """Measured lateral acceleration [m/s2]."""
    steering_wheel_rad: tuple[float, ...]
    """Size of the measured steering wheel angle, one value for each lap."""
    spread: dict[str, Annotated[float, Range(1e-12)]]
    """Standard deviation from lap to lap of `radius_m`, `ay_mps2` or a key of the car."""
    zero_deg: float = 0.0
    """Steering wheel angle that the sensor shows straight ahead."""
    body_roll: float = 0.0
    """Part of the body's roll angle by which the accelerometer tilts: 0 levelled, 1 on the body."""
    stiff_column: bool = False
    """True if the steering column does not twist."""
    prediction: dict[str, Any] = field(default_factory=dict)
    """Overrides of the prediction that is judged. The intervals start from the car without them."""


@dataclass(frozen=True)
class MeasuredTable:
    """Keys of the file `validation.toml`."""

    KEY_HINTS: ClassVar = dict.fromkeys(
        ("effects", "steps", "decisions"), "give values of the car in [circle.prediction] and [intervals]"
    )

    vehicle: str
    """Name or file of the car."""
    runs: tuple[RunTable, ...] = ()
    """Measured runs, in place of a circle."""
    circle: CircleTable | None = None
    """Measured circle, in place of runs."""
    quantities: dict[str, QuantityTable] = field(default_factory=dict)
    """Comparison of each channel, which may be in any unit."""
    title: str = ""
    """Title of the page."""
    filter: Literal["iso15037", "fmvss126", "none"] = "iso15037"
    """Filter of measured and simulated signals (see `activesteer compare`)."""
    noise_allowance: bool = True
    """True to widen the corridors by the estimated noise of the measurement."""
    overrides: dict[str, Any] = field(default_factory=dict)
    """Values of the car and the manoeuvre that are known better than in their files."""
    predict: PredictTable = PredictTable()
    """Factors that are free in the prediction."""
    factors: dict[str, Any] = field(default_factory=dict)
    """Factors of the fit, with ranges as in a study."""
    intervals: dict[str, IntervalTable] = field(default_factory=dict)
    """Ends of unknown values by key, for the band around the prediction."""
    assumptions: tuple[str, ...] = ()
    """Assumptions, one sentence each."""


@dataclass(frozen=True)
class MeasuredFile:
    """Checked file of a folder of measured runs."""

    table: MeasuredTable  # its table
    folder: Path  # its folder
    vehicle: str  # name or path of the car
    factors: tuple[Factor, ...]  # the factors
    tolerances: dict[str, Tolerance]  # channel -> tolerance, SI
    noise: dict[str, float]  # channel -> standard deviation, SI
    predict_channels: tuple[str, ...]  # channels that determine the free factors of the prediction
    source: Source  # for error messages
    # key of the circle, or of the car if it varies from lap to lap -> its value in the files
    nominal: dict[str, float] = field(default_factory=dict)

    @property
    def on_circle(self) -> dict[str, Any]:
        """Nominal case of the measured circle: values of `CIRCLE_KEYS`, and overrides."""
        return {key: getattr(self.table.circle, key) for key in CIRCLE_KEYS} | self.table.overrides

    def changed(self, case: dict[str, Any], *changes: Mapping[str, Any]) -> dict[str, Any]:
        """Return a case with overrides. A varied number is shifted by the difference of its override from the files."""
        for change in changes:
            numbers = {key: self.nominal[key] for key in change if key in self.nominal}
            added = {key: case.get(key, own) + (change[key] - own) for key, own in numbers.items()}
            case = {**case, **change, **added}
        return case

    def drawn(self, case: dict[str, Any], draw: Array) -> dict[str, Any]:
        """Return a case of another lap, from standard normal numbers for the keys of `circle.spread`."""
        circle = self.table.circle
        assert circle is not None
        spreads = zip(circle.spread.items(), draw.tolist(), strict=True)
        return case | {key: case.get(key, self.nominal[key]) + spread * number for (key, spread), number in spreads}


def read_measured(folder: Path) -> MeasuredFile:
    """Read and check the file of a folder."""
    given, source = read_toml(folder / NAME)
    table = build(MeasuredTable, given, source)
    for key in _OF_RUNS if table.circle is not None else ():
        if key in given:
            raise source.fail((key,), "belongs in [[runs]], not here")
    own = folder / table.vehicle
    vehicle = str(own) if table.vehicle.endswith(".toml") or "/" in table.vehicle else table.vehicle
    try:
        names = [channel.name for channel in load_car(vehicle).on().channels.channels]
    except ActiveSteerError as reason:
        raise source.fail(("vehicle",), reason.problem, table.vehicle, reason.allowed) from reason
    for key, value in table.overrides.items():
        _value(vehicle, key, source, ("overrides", key), {key: value})
    file = MeasuredFile(table, folder, vehicle, (), *_quantities(table, source, names), (), source)
    return _with_runs(file) if table.circle is None else _with_circle(file, table.circle)


def _with_runs(file: MeasuredFile) -> MeasuredFile:
    """Check runs, factors and intervals."""
    table, source = file.table, file.source
    if not table.runs:
        raise source.fail(("runs",), "at least one measured run [[runs]], or a [circle], is needed")
    for number, run in enumerate(table.runs):
        _check_run(run, file.folder, source, ("runs", str(number)), [other.name for other in table.runs[:number]])
    if not any(run.check_s for run in table.runs):
        raise source.fail(("runs",), "a verdict needs a run with check_s = [start, end]")
    channels = tuple(by_channel(dict.fromkeys(table.predict.channels), file.noise, source, ("predict", "channels")))
    factors = _factors(table, file.vehicle, source)
    if factors and not file.noise:
        raise source.fail(("quantities",), "a fit needs a channel with noise = its standard deviation")
    for key, interval in table.intervals.items():
        _check_ends(interval, source, key)
        _value(file.vehicle, key, source, ("intervals", key), {key: interval.ends[0]})
    return replace(file, factors=factors, predict_channels=channels or tuple(file.noise))


def _with_circle(file: MeasuredFile, circle: CircleTable) -> MeasuredFile:
    """Check circle and intervals, and convert the ends of each interval to overrides."""
    table, source = file.table, file.source
    if set(file.tolerances) != {STEERING}:
        raise source.fail(("quantities",), "a circle compares only steering_wheel_deg", list(table.quantities))
    if len(set(circle.steering_wheel_rad)) < 2 or not circle.spread:
        raise source.fail(
            ("circle",), "two different angles, and a spread of at least one value, are needed for distributions"
        )
    nominal = {key: value for key, value in file.on_circle.items() if key in CIRCLE_KEYS and key != "stiff_column"}
    for key in set(circle.spread) - set(nominal):
        nominal[key] = value = _value(file.vehicle, key, source, ("circle", "spread", key), table.overrides)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise source.fail(("circle", "spread", key), "is not a number that could vary", key)
    intervals = dict(table.intervals)
    changes = {("circle", "prediction"): circle.prediction}
    for key, interval in table.intervals.items():
        if not interval.low and not interval.high:
            _check_ends(interval, source, key)
            intervals[key] = replace(interval, low={key: interval.ends[0]}, high={key: interval.ends[1]})
        changes |= {("intervals", key, end): getattr(intervals[key], end) for end in ("low", "high")}
    for where, change in changes.items():
        own = {key: value for key, value in change.items() if key in CIRCLE_KEYS}
        build(CircleTable, asdict(circle) | own, source, where)
        _value(file.vehicle, "", source, where, {key: value for key, value in change.items() if key not in own})
    return replace(file, nominal=nominal, table=replace(table, intervals=intervals))


def _check_ends(interval: IntervalTable, source: Source, key: str) -> None:
    if len(interval.ends) != 2 or interval.ends[0] >= interval.ends[1] or interval.low or interval.high:
        raise source.fail(("intervals", key), "ends = [low, high] is needed", interval.ends)


def _factors(table: MeasuredTable, vehicle: str, source: Source) -> tuple[Factor, ...]:
    factors = tuple(read_factor(key, value, source) for key, value in table.factors.items())
    for factor in factors:
        where = ("factors", factor.key)
        if factor.kind != "uniform":
            raise source.fail(where, "a fit needs a range: uniform = [low, high]")
        _value(vehicle, factor.key, source, where, {} if factor.nominal else {factor.key: factor.low})
    keys = [factor.key for factor in factors]
    for key in table.predict.factors:
        if key not in keys:
            raise source.fail(("predict", "factors"), f"{key} is not a factor; {nearest_names(key, keys)}", key, keys)
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
        raise source.fail((*where, "check_s"), "the run has no purpose; give fit_s, check_s or both")


def _quantities(
    table: MeasuredTable, source: Source, names: list[str]
) -> tuple[dict[str, Tolerance], dict[str, float]]:
    """Return tolerances and noise by channel, SI."""
    tolerances: dict[str, Tolerance] = {}
    noise: dict[str, float] = {}
    quantities = table.quantities or ({} if table.circle is None else {STEERING: QuantityTable()})
    if not quantities:
        raise source.fail(("quantities",), "at least one channel is needed")
    for name, (key, factor, given) in by_channel(quantities, names, source, ("quantities",)).items():
        if name not in TOLERANCES and (given.offset is None or given.gain is None):
            raise source.fail(
                ("quantities", key), "has no usual tolerance; give offset, gain and source", key, list(TOLERANCES)
            )
        tolerance = TOLERANCES.get(name, Tolerance(0.0, 0.0, ""))
        if given.offset is not None:
            tolerance = tolerance._replace(offset=given.offset * factor, source=given.source or "user's file")
        if given.gain is not None:
            tolerance = tolerance._replace(gain=given.gain, source=given.source or "user's file")
        tolerances[name] = tolerance
        if given.noise is not None:
            noise[name] = given.noise * factor
    return tolerances, noise


def _value(vehicle: str, key: str, source: Source, where: tuple[str, ...], overrides: Mapping[str, Any]) -> Any:
    """Return the value of a key of the car or of a repeated measurement."""
    steering = {"time_s": [0.0, 1.0], "steering_wheel_rad": [0.0, 0.1]}
    inputs = {"kind": "open_loop", "name": "inputs", "duration_s": 1.0, "speed_mps": 20.0, "steering": steering}
    try:
        scenario = resolve(inputs, vehicle, overrides)
        return value_of(scenario, key) if key else None
    except ActiveSteerError as reason:
        raise source.fail(where, reason.problem, overrides.get(key), reason.allowed) from reason


def measured_folder(name: str) -> Path:
    """Find a folder of measured runs by its path or by the name of a car of the package."""
    folder = _folder(name)
    if not is_folder(folder):
        known = [file.parent.name for file in (models_dir() / "reference").glob(f"*/{NAME}")]
        problem = f"there is no folder {shown_path(folder)}; {nearest_names(name, known)}"
        raise ParameterError(problem, value=name, allowed=known)
    if not is_file(folder / NAME):
        problem = f"the folder {shown_path(folder)} has no {NAME}; activesteer compare --new FOLDER makes an example"
        raise ParameterError(problem, value=name)
    return folder


def is_measured(name: str) -> bool:
    """Return whether a name belongs to a folder of measured runs."""
    return is_file(_folder(name) / NAME)


def _folder(name: str) -> Path:
    own = models_dir() / "reference" / name
    return own if is_file(own / NAME) else user_path(name, ParameterError)


def write_template(folder: Path) -> list[Path]:
    """Write a folder that `activesteer compare` and `fit` can run, and return its files."""
    make_folder(folder, ParameterError)
    if any(folder.iterdir()):
        raise ParameterError(f"{shown_path(folder)} is not empty; give a new folder", value=str(folder))
    files = sorted(Path(__file__).with_name("example").iterdir())
    return [write_text(folder / file.name, file.read_text(encoding="utf-8"), ParameterError) for file in files]
