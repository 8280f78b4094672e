"""Reader of a laboratory's K&C tables, which become samples of the left wheel.

Each file is AXLE_TEST.csv, or AXLE_TEST.toml with the columns as lists (`rigs.kc.result.TESTS` names the tests). The
samples of the right wheel are mirrored and added to the samples of the left wheel. Both branches of a loop are kept,
and the fitted curve averages them. `names.toml` gives the channel names of a laboratory and the signs that differ:

    [names]
    "Toe_FL_deg" = "left_toe [deg]"
    [signs]
    toe = -1

Measurements that would create energy, or turn the wheels against the rack, are errors. Unusual measurements give a
question.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.interpolate import make_lsq_spline

from activesteer.config import Source, build, read_toml
from activesteer.core import limits
from activesteer.core.conventions import Array
from activesteer.core.files import is_file, is_folder, read_csv
from activesteer.core.units import UNIT_NAMES, alike, find_unit
from activesteer.errors import ParameterError, nearest_names
from activesteer.rigs.kc.result import CHANNELS, OF_THE_AXLE, TESTS

_HEAD: Final = re.compile(r"(?P<name>[\w ]+?)\s*\[\s*(?P<unit>[\w/]+)\s*\]")
_SIDES: Final = ("left", "right")
_MOST_INTERVALS: Final = 16
"""Largest number of intervals of the smoothing spline: one for each 10 mm over +-80 mm of travel."""
NAMES_FILE: Final = "names.toml"
_LEAST_POINTS: Final = 5
_GREATEST: Final = {
    "travel": 0.3, "rack": 0.3, "force": 5e4, "moment": 5e3, "steering_wheel": 40.0, "toe": 1.2, "camber": 0.8,
    "caster": 0.8, "load": 1e5,
}  # fmt: skip
"""Values that no car reaches on a rig, SI units: a larger value means another unit of the column."""
_LEAST_SPAN: Final = {"travel": 0.01, "rack": 0.005, "force": 10.0, "moment": 1.0}
"""Smallest range of a variable that shows the behaviour of an axle, SI units."""
_GREATEST_WAY_M: Final = 10.0
"""Value that no car reaches in any other channel, which may have any origin [m]."""


@dataclass(frozen=True)
class Samples:
    """One test for the left wheel, in SI units."""

    x: Array  # travel, rack to the left, force forwards or to the left, moment to the left; shape (n,)
    channels: dict[str, Array]  # channel to samples, shape (n,)
    file: str

    def moved(self, name: str) -> Array | None:
        """Return a channel relative to x = 0, or None if not measured."""
        if name not in self.channels:
            return None
        return self.channels[name] - smoothed(self.x, self.channels[name], np.zeros(1))


def smoothed(x: Array, y: Array, at: Array) -> Array:
    """Fit a least-squares cubic spline to samples of both branches, with evenly spaced knots that average noise."""
    places = len(np.unique(np.round(x / np.ptp(x), 3)))
    intervals = int(np.clip(places // 2, 1, _MOST_INTERVALS))
    low, high = float(x.min()), float(x.max())
    # Every interval needs a sample; where they are dense at only one place, there are fewer intervals.
    while intervals > 1 and not np.histogram(x, intervals)[0].all():
        intervals -= 1
    knots = np.concatenate([[low] * 3, np.linspace(low, high, intervals + 1), [high] * 3])
    order = np.argsort(x, kind="stable")
    # Samples at one position count as their mean: the fit needs increasing positions.
    spots, where = np.unique(x[order], return_inverse=True)
    weight = np.bincount(where)
    mean = np.bincount(where, y[order]) / weight
    spline = make_lsq_spline(spots, mean, knots, 3, w=np.sqrt(weight))
    inside = np.clip(at, low, high)
    return np.asarray(spline(inside) + (at - inside) * spline(inside, 1), dtype=np.float64)


@dataclass(frozen=True)
class KcTables:
    """All tests of a car, as samples by axle and test, and its steering ratio if measured."""

    tests: dict[str, dict[str, Samples]] = field(default_factory=dict)
    rack_per_steering_wheel_m: float | None = None  # rack travel per angle of the steering wheel [m/rad]


def read_kc(folder: Path, axles: list[str]) -> KcTables:
    """Read the K&C tests of a folder."""
    if not is_folder(folder):
        raise ParameterError(f"there is no folder {folder}")
    names = _translation(folder)
    _check_files(folder)
    tests: dict[str, dict[str, Samples]] = {axle: {} for axle in axles}
    pinion = None
    for axle, found in tests.items():
        for name in TESTS:
            file = next((path for end in ("csv", "toml") if is_file(path := folder / f"{axle}_{name}.{end}")), None)
            if file is None:
                continue
            columns = _columns(file, names)
            if name == "steering":
                pinion = _complete_rack(columns, file)
            found[name] = _left_wheel(columns, name, file)
        if "parallel_travel" not in found:
            present = sorted(path.name for path in folder.iterdir())
            words = nearest_names(f"{axle}_parallel_travel.csv", present)
            raise ParameterError(f"{folder}: {axle}_parallel_travel.csv (or .toml) is needed; {words}")
    return KcTables(tests, pinion)


def _check_files(folder: Path) -> None:
    """Check that each file is the table of a known test."""
    known = [f"{axle}_{name}" for axle in ("front", "rear") for name in TESTS]
    for path in sorted(folder.iterdir()):
        if path.suffix in (".csv", ".toml") and path.stem.startswith(("front_", "rear_")) and path.stem not in known:
            raise ParameterError(f"there is no such test; {nearest_names(path.stem, known)}", file=path.name)


@dataclass(frozen=True)
class _Names:
    """Content of the file names.toml of a folder."""

    names: dict[str, str] = field(default_factory=dict)
    signs: dict[str, float] = field(default_factory=dict)


def _translation(folder: Path) -> _Names:
    file = folder / NAMES_FILE
    if not is_file(file):
        return _Names()
    raw, source = read_toml(file)
    found = build(_Names, raw, source)
    for channel, sign in found.signs.items():
        if channel not in CHANNELS:
            raise source.fail(("signs", channel), f"there is no such channel; {nearest_names(channel, CHANNELS)}")
        if sign not in (1, -1):
            raise source.fail(("signs", channel), f"{sign!r} is not a sign; 1 or -1 is needed")
    return found


def _columns(file: Path, names: _Names) -> dict[str, Array]:
    """Return the channels of a file in SI units, with the signs of this package."""
    columns: dict[str, Array] = {}
    for head, values in _raw_columns(file).items():
        channel, factor = _channel(file, head, names.names.get(head, head))
        if channel in columns:
            raise ParameterError(f"two columns are {channel}", file=file.name, key=head)
        bare = channel.removeprefix("left_").removeprefix("right_")
        columns[channel] = factor * names.signs.get(bare, 1.0) * values
        greatest, reached = _GREATEST.get(bare, _GREATEST_WAY_M), float(np.abs(columns[channel]).max(initial=0.0))
        if reached > greatest:
            raise ParameterError(
                f"reaches {reached:.3g} {CHANNELS[bare][0]}; at most {greatest:g} are possible: is its unit right?",
                file=file.name,
                key=head,
            )
    lengths = {len(values) for values in columns.values()}
    if len(lengths) != 1 or min(lengths) < _LEAST_POINTS:
        raise ParameterError(
            f"columns of {_LEAST_POINTS} rows or more, all of the same length, are needed", file=file.name
        )
    return columns


def _raw_columns(file: Path) -> dict[str, Array]:
    if file.suffix == ".toml":
        table, source = read_toml(file)
        return {key: _numbers(key, value, source) for key, value in table.items()}
    rows = read_csv(file, ParameterError)
    heads = rows[0].cells if rows else []
    for head in heads:
        if head and heads.count(head) > 1:
            raise ParameterError("two columns have this name", file=file.name, line=rows[0].line, key=head)
    for row in rows[1:]:
        if len(row.cells) != len(heads):
            raise ParameterError(
                f"has {len(row.cells)} cells, but the first row has {len(heads)}", file=file.name, line=row.line
            )
    return {
        head: np.array(
            [
                limits.number_in(row.cells[index], ParameterError, file=file.name, line=row.line, key=head)
                for row in rows[1:]
            ]
        )
        for index, head in enumerate(heads)
        if head
    }


def _numbers(head: str, values: Any, source: Source) -> Array:
    try:
        numbers = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as reason:
        raise source.fail((head,), "contains a value that is not a number") from reason
    if numbers.ndim != 1 or not (np.abs(numbers) <= limits.MAX_NUMBER).all():
        raise source.fail((head,), f"must be a list of finite numbers up to {limits.MAX_NUMBER:g}")
    return numbers


def _channel(file: Path, head: str, name: str) -> tuple[str, float]:
    """Return the channel of a column, with its side, and the factor to SI units."""
    match = _HEAD.fullmatch(name)
    if match is None:
        raise ParameterError(f"{name!r} is not a channel and its unit, as 'left_toe [deg]'", file=file.name, key=head)
    channel = match["name"].strip().lower().replace(" ", "_")
    bare = channel.removeprefix("left_").removeprefix("right_")
    if bare not in CHANNELS:
        words = nearest_names(bare, CHANNELS)
        raise ParameterError(f"no channel is named {bare!r}; {words}", file=file.name, key=head)
    if bare == channel and bare not in OF_THE_AXLE:
        raise ParameterError(f"which wheel? write left_{bare} or right_{bare}", file=file.name, key=head)
    unit, _ = CHANNELS[bare]
    found = find_unit("arcmin" if match["unit"] == "min" else match["unit"])
    if found is None or not alike(found, find_unit(unit)):
        known = [name for name in UNIT_NAMES if alike(find_unit(name), find_unit(unit))]
        raise ParameterError(
            f"{match['unit']!r} is not a unit of {bare}; known: {', '.join(known)}", file=file.name, key=head
        )
    return channel, found.factor


def _complete_rack(columns: dict[str, Array], file: Path) -> float | None:
    """Return the rack travel per steering wheel angle, 7.5 mm/rad if the file has no rack."""
    if "steering_wheel" not in columns:
        if "rack" not in columns:
            raise ParameterError("neither rack nor steering_wheel was measured", file=file.name)
        return None
    if "rack" not in columns:
        columns["rack"] = 0.0075 * columns["steering_wheel"]
        return 0.0075
    small = np.abs(columns["steering_wheel"]) < np.radians(90.0)
    return float(np.polyfit(columns["steering_wheel"][small], columns["rack"][small], 1)[0])


def _left_wheel(columns: dict[str, Array], name: str, file: Path) -> Samples:
    test = TESTS[name]
    xs, parts = [], []
    for side in _SIDES:
        wheel = {key.removeprefix(f"{side}_"): value for key, value in columns.items() if key.startswith(f"{side}_")}
        if not wheel:
            continue
        mirror = -1.0 if side == "right" and not test.mirrored else 1.0
        if test.variable == "travel":
            if "travel" not in wheel:
                raise ParameterError("was not measured", file=file.name, key=f"{side}_travel")
            x = wheel["travel"]
        elif test.variable not in columns:
            raise ParameterError("was not measured", file=file.name, key=test.variable)
        else:
            x = mirror * test.sign * columns[test.variable]
        xs.append(x)
        parts.append(wheel)
    if not parts:
        raise ParameterError("no column of a wheel: their names begin with left_ or right_", file=file.name)
    common = set(parts[0]).intersection(*parts[1:])
    left_out = set().union(*parts) - common
    if left_out:
        raise ParameterError(f"{', '.join(sorted(left_out))} given for one wheel only", file=file.name)
    x = np.concatenate(xs)
    order = np.argsort(x, kind="stable")
    if not x[order[0]] < 0.0 < x[order[-1]]:
        raise ParameterError(
            f"{test.variable} has no values on one side of 0; values on both sides are needed", file=file.name
        )
    if (places := len(np.unique(x))) < _LEAST_POINTS:
        raise ParameterError(
            f"has {places} different values; at least {_LEAST_POINTS} are needed", file=file.name, key=test.variable
        )
    if (span := float(np.ptp(x))) < (least := _LEAST_SPAN[test.variable]):
        raise ParameterError(
            f"covers {span:.3g} {CHANNELS[test.variable][0]}; at least {least:g} are needed: is its unit right?",
            file=file.name,
            key=test.variable,
        )
    channels = {key: np.concatenate([part[key] for part in parts])[order] for key in sorted(common)}
    return Samples(x[order], channels, file.name)


_NEAR: Final = {"travel": 0.02, "rack": 0.02, "force": 1500.0, "moment": 100.0}
"""Range about zero within which a slope counts, by variable [m, N, N m]."""
_HINT: Final = f" ({NAMES_FILE} turns the sign of a channel)"
_UNITS: Final = {"deg/m": np.degrees(1.0), "mm/m": 1e3, "deg/kN": np.degrees(1e3)}
_CHECKS: Final = read_toml(Path(__file__).with_name("kc_checks.toml"))[0]


def check_signs(tests: dict[str, Samples]) -> None:
    """Check the signs of the slopes."""
    for row, end in itertools.product(_CHECKS["must_rise"], ("", "_opposed")):
        name, channel = row["test"] + end, row["channel"]
        if name not in tests or (slope := _slope(name, tests[name], channel)) is None:
            continue
        if slope < -_least(name, channel, tests[name]):
            raise ParameterError(row["words"] + _HINT, file=tests[name].file, key=channel.removeprefix("-"))


def unusual(axle: str, tests: dict[str, Samples]) -> Iterator[str]:
    """Return remarks on unusual measurements."""
    for row in _CHECKS["unusual"]:
        name, channel, unit = row["test"], row["channel"], row["unit"]
        if axle not in row.get("axles", (axle,)) or name not in tests:
            continue
        if (slope := _slope(name, tests[name], channel)) is None:
            continue
        value = _UNITS[unit] * slope
        if value < row.get("below", -np.inf) or value > row.get("above", np.inf):
            yield f"{tests[name].file}: {channel} {value:+.3g} {unit}: {row['words']}"


def _slope(name: str, samples: Samples, channel: str) -> float | None:
    values = samples.channels.get(channel.removeprefix("-"))
    if values is None:
        return None
    near = np.abs(samples.x) <= _NEAR[TESTS[name].variable]
    if int(near.sum()) < 3:
        near = np.ones(len(samples.x), dtype=bool)
    return (-1.0 if channel.startswith("-") else 1.0) * float(np.polyfit(samples.x[near], values[near], 1)[0])


def _least(name: str, channel: str, samples: Samples) -> float:
    """Smallest significant slope over the evaluated range: 0.02 mm, 0.002 deg or 10 N."""
    step = 10.0 if channel == "load" else 3e-5 if channel.endswith("toe") else 2e-5
    return step / min(_NEAR[TESTS[name].variable], float(np.abs(samples.x).max()))
