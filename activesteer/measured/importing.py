"""Import of measured data as a recording with channels on a uniform time axis."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple

import numpy as np

from activesteer.analysis.metrics import metrics
from activesteer.config import Range, build, field_in_unit, read_toml
from activesteer.core import limits
from activesteer.core.conventions import Array
from activesteer.core.signals import Channel
from activesteer.core.units import UNIT_NAMES, alike, find_unit, unit_of
from activesteer.core.version import __version__
from activesteer.drawing.car_model import scene_of
from activesteer.errors import RecordingError, nearest_names, shown
from activesteer.measured import signals
from activesteer.measured.columns import Column, find, read_columns, second_of
from activesteer.recording import Recording
from activesteer.road.road import Road
from activesteer.scenario import load_car


@dataclass(frozen=True)
class ChannelMap:
    """Entry of a map file: source of a channel."""

    column: str
    """Name of the column."""
    unit: str = ""
    """Unit of the column; by default the unit of the file, or SI."""
    sign: Literal[1, -1] = 1
    """-1 if the sign of the column is opposite to ISO 8855 (or `axes`)."""
    factor: Annotated[float, Range(1e-12)] = 1.0
    """Scale of the column, for a signal in another unit: `factor` x column has the unit."""
    offset: float = 0.0
    """Offset added to the column, in its unit, before the scale."""
    zero_until_s: Annotated[float, Range(0.0)] | None = None
    """End of the time over which the mean of the column is taken, which is then subtracted [s]."""


@dataclass(frozen=True)
class MeasurementMap:
    """Map file of an import."""

    channels: dict[str, ChannelMap] = field(default_factory=dict)
    """Source of each channel. By default, columns are recognised by their names."""
    axes: Literal["iso8855", "sae_j670"] = "iso8855"
    """Axes of the file: SAE J670 has y to the right and z down."""
    time: str = ""
    """Name of the time column. Recognised by its name by default, as in further files without this column."""
    time_unit: str = ""
    """Unit of the time; by default the unit of the file, or s."""
    shift_s: dict[str, float] = field(default_factory=dict)
    """Time to add to the clock of each file, if several files have separate clocks [s]."""
    step_s: Annotated[float, Range(1e-4, 1.0)] | None = None
    """Step of the recording; by default the step of the file."""
    max_gap_s: Annotated[float, Range(0.0)] = 0.1
    """Longest gap without samples that is bridged by a straight line."""
    start_s: float = -math.inf
    """Start of the imported part, in the time of the file."""
    end_s: float = math.inf
    """End of the imported part."""
    title: str = ""
    """Title for lists and plots."""
    kind: str = "measured"
    """Kind of the driven manoeuvre, such as `step_steer`, which decides its metrics."""


_MOST_REPEATED: Final = 5
"""Number of repeated column names that are listed."""


class _Source(NamedTuple):
    """Source of a channel, matched with a column of a file."""

    column: Column
    unit: str  # unit of the column
    factor: float  # factor to the signs and the scale of the channel
    file: Path
    given: ChannelMap | None = None  # entry of the map


_Files = Mapping[Path, list[Column]]
"""Columns of each file."""


def import_file(path: Path | Sequence[Path], map_path: Path | None = None, vehicle: str = "compact") -> Recording:
    """Read one or several files of measured data of one run.

    The table `measured` of the metadata has `columns`, channel -> column and unit that it comes from, and `notes`,
    assumptions that the file does not state, and suspicious values.
    """
    chosen = MeasurementMap() if map_path is None else build(MeasurementMap, *read_toml(map_path, RecordingError))
    paths = [path] if isinstance(path, Path) else list(path)
    path = paths[0]
    files = {file: read_columns(file) for file in paths}
    for name in chosen.shift_s:
        if name not in (names := [file.name for file in paths]):
            raise RecordingError(f"is not an imported file; {nearest_names(name, names)}", key=f"shift_s.{name}")
    every = [{column.name for column in columns} for columns in files.values()]
    repeated = [name for names in every for name in names if second_of(name) in names]
    model = load_car(vehicle).on(Road())
    table = {channel.name: channel for channel in model.channels.channels}
    notes = [
        f"several columns are named {shown(name)}: the first is used; a map can name {shown(second_of(name))}"
        for name in sorted(repeated)[:_MOST_REPEATED]
    ]
    if len(repeated) > _MOST_REPEATED:
        notes.append(f"{len(repeated) - _MOST_REPEATED} more names belong to several columns each")
    sources = _mapped(chosen, files, table) if chosen.channels else _by_name(files, table, notes)
    read = {name: source.column.read() for name, source in sources.items()}
    lacking = {sources[name].file for name, (_, own) in read.items() if own is None}
    shared = _shared_times(files, chosen, [file for file in paths if file in lacking])
    sampled = {}
    for name, (column, own) in read.items():
        time_s = shared[sources[name].file] if own is None else own
        sampled[name] = _signal(name, sources[name], time_s, column, chosen)
    grid_s, step_s = _grid(sampled, chosen, path)
    start_s = float(grid_s[0])
    if start_s != 0.0:
        notes.append(f"the time begins at {start_s:.12g} s in the file and at 0 here")
    values = {}
    for name, signal in sampled.items():
        # A slow signal has long steps between its samples.
        longest_s = max(chosen.max_gap_s, 1.5 * float(np.median(np.diff(signal[0]))))
        before_s, after_s = signal[0][:-1], signal[0][1:]
        wide = np.flatnonzero((after_s - before_s > longest_s) & (after_s > grid_s[0]) & (before_s < grid_s[-1]))
        if wide.size:
            begin, end = float(before_s[wide[0]]), float(after_s[wide[0]])
            raise RecordingError(
                f"has no samples from {begin:.3f} to {end:.3f} s; allow it with max_gap_s in a map, or cut "
                "it off with start_s and end_s",
                file=path.name, key=name, value=(begin, end),
            )  # fmt: skip
        values[name] = signals.resampled(signal, grid_s)
        if chosen.axes == "sae_j670" and name in signals.TURNED_IN_SAE:
            values[name] = -values[name]
    taken = {}
    for name, source in sources.items():  # many names contain the unit
        column, unit = source.column.name, source.unit or "-"
        taken[name] = column if signals.split_unit(column)[1] == unit else f"{column} [{unit}]"
    notes += signals.suspicions(values, step_s)
    time_s: Array = np.arange(len(grid_s), dtype=np.float64) * step_s
    derived = signals.with_motion(time_s, values)
    channels = [_channel(name, table, taken) for name in derived]
    metadata: dict[str, Any] = {
        "maneuver": {"name": path.stem, "kind": chosen.kind, "title": chosen.title or f"measured: {path.name}"},
        "vehicle": {"name": "measured"},
        "controller": "measured",
        "measured": {
            "file": ", ".join(file.name for file in paths), "columns": taken, "axes": chosen.axes, "notes": notes,
            "shown_as": vehicle, "time_offset_s": start_s,
        },
        "versions": {"activesteer": __version__},
    }  # fmt: skip
    attachments = {} if map_path is None else {map_path.name: map_path.read_bytes()}
    recording = Recording(
        channels, time_s, np.column_stack(list(derived.values())), metadata=metadata, attachments=attachments,
        poses=signals.moved_car(model, time_s, derived), scene=scene_of(model.model),
    )  # fmt: skip
    try:
        recording.metrics.update(metrics(recording))
    except RecordingError as error:
        recording.metadata["metrics_error"] = str(error)
        notes.append(f"no metrics of the kind {chosen.kind}: {error}")
    return recording


def _found(name: str, files: _Files) -> tuple[Column, Path]:
    """Return the column with a name, and its file."""
    having = [path for path, columns in files.items() if any(column.name == name for column in columns)]
    if len(having) > 1:
        raise RecordingError(f"column {shown(name)} is in {' and in '.join(path.name for path in having)}; rename one")
    file = having[0] if having else next(iter(files))
    return find(files[file] if having else [each for columns in files.values() for each in columns], name, file), file


def _mapped(chosen: MeasurementMap, files: _Files, table: Collection[str]) -> dict[str, _Source]:
    """Return the source of each channel that the map names."""
    sources = {}
    for name, given in chosen.channels.items():
        if name not in table and (channel := field_in_unit(name, table)[0]) is not None:
            problem = f"is a channel in another unit; name it {channel} and give `unit`"
            raise RecordingError(problem, key=f"channels.{name}")
        column, file = _found(given.column, files)
        unit = given.unit or column.unit or unit_of(name)
        sources[name] = _Source(column, unit, given.sign * given.factor, file, given)
    return sources


def _by_name(files: _Files, table: Collection[str], notes: list[str]) -> dict[str, _Source]:
    """Return the source of each channel that a column name identifies."""
    every = [(path, column) for path, columns in files.items() for column in columns]
    names = {column.name for _, column in every}
    channels = [*table, "brake_pedal"]
    sources: dict[str, _Source] = {}
    for path, column in every:
        known = signals.known_column(column.name, names, channels)
        if known is None:
            base = signals.bracketed(column.name)[0]
            if base != column.name and signals.known_column(base, names, channels) is not None:
                known_units = ", ".join(UNIT_NAMES)
                notes.append(f"{shown(column.name)} is left out: its unit is unknown; known: {known_units}")
            continue
        channel, stated, sign, sure = known
        if channel in sources:
            both = f"{shown(sources[channel].column.name)} and {shown(column.name)}"
            raise RecordingError(f"{both} are both {channel}; choose one in a map", file=path.name)
        unit = column.unit or stated or unit_of(channel)
        if unit and not sure and not (column.unit or stated):
            notes.append(f"{column.name} has no unit; {unit} is assumed (a map can set another)")
        sources[channel] = _Source(column, unit, sign, path)
    if not sources:
        some = ", ".join(shown(name) for name in sorted(names)[:8])
        problem = f"no column has a known name and unit (there are {some})"
        raise RecordingError(
            "; ".join((problem, *notes, "describe them in a map: --map")), file=", ".join(path.name for path in files)
        )
    return sources


def _shared_times(files: _Files, chosen: MeasurementMap, lacking: list[Path]) -> dict[Path, Array]:
    """Return the common times of the columns of each file, for columns without separate times [s]."""
    if chosen.time and not lacking:
        raise RecordingError("every column has its own time; leave this key out", key="time", value=chosen.time)
    named = [path for path in lacking if any(column.name == chosen.time for column in files[path])]
    return {path: _shared_time(files[path], chosen, path, named=path in named or not named) for path in lacking}


def _shared_time(columns: list[Column], chosen: MeasurementMap, path: Path, *, named: bool) -> Array:
    """Return the times of a file [s], from the column in the map or from its only time column."""
    if chosen.time and named:
        column = find(columns, chosen.time, path)
    else:
        times = [column for column in columns if signals.is_time(column.name)]
        if len(times) != 1:
            what = "no column is named like a time" if not times else "several columns are named like times"
            words = nearest_names("time", [column.name for column in columns])
            raise RecordingError(f"{what}: {words}; name it in a map: time = NAME", file=path.name)
        column = times[0]
    unit = chosen.time_unit or column.unit or known_time_unit(column.name)
    found = signals.written_unit(unit)
    if found is None or not alike(found, find_unit("s")):
        raise RecordingError(f"the time has the unit {shown(unit)}; known: s, ms, us", file=path.name, value=unit)
    return _plausible(column.read()[0] * found.factor, column.name, path)


def known_time_unit(name: str) -> str:
    """Return the unit in the name of a time column, or s if there is none."""
    ending = name.rstrip("])").replace("[", " ").replace("(", " ").replace("_", " ").split()
    return ending[-1] if len(ending) > 1 and ending[-1] in ("ms", "us", "s") else "s"


def _signal(name: str, source: _Source, time_s: Array, values: Array, chosen: MeasurementMap) -> signals.Samples:
    """Return the samples of a channel, in SI units and with the signs of ISO 8855."""
    column, unit, factor, path, given = source
    found, wanted = signals.written_unit(unit), unit_of(name)
    if found is None or not alike(found, find_unit(wanted)):
        raise RecordingError(
            f"{name} is in {wanted or 'pure numbers'}, and {shown(column.name)} in {shown(unit)}; "
            f"known units are {', '.join(UNIT_NAMES)}",
            file=path.name, value=unit, allowed=UNIT_NAMES,
        )  # fmt: skip
    shift_s = chosen.shift_s.get(path.name, 0.0)
    time_s, values = signals.samples(column.name, time_s + shift_s, values, path.name)
    inside = (time_s >= chosen.start_s) & (time_s <= chosen.end_s)
    if np.count_nonzero(inside) < 2:
        raise RecordingError(f"{column.name} has no samples between start_s and end_s", file=path.name)
    time_s, values = time_s[inside], values[inside]
    if given is not None:
        values = values + given.offset
        if given.zero_until_s is not None:
            early = time_s <= given.zero_until_s
            if not early.any():
                raise RecordingError(
                    f"{column.name} starts at {time_s[0]:g} s, after zero_until_s", key=f"channels.{name}.zero_until_s"
                )
            values = values - values[early].mean()
    return time_s, _plausible(values * (factor * found.factor), column.name, path)


def _plausible(values: Array, column: str, path: Path) -> Array:
    """Return the values, or reject values that are implausible in a file."""
    limits.check_numbers(values, RecordingError, infinite=True, file=path.name, key=f"column {shown(column)}")
    return values


def _grid(sampled: Mapping[str, signals.Samples], chosen: MeasurementMap, path: Path) -> tuple[Array, float]:
    """Return the uniform times at which all signals exist, with the step of the fastest signal."""
    times = [time_s for time_s, _ in sampled.values()]
    start, end = max(float(time_s[0]) for time_s in times), min(float(time_s[-1]) for time_s in times)
    step = chosen.step_s or min(float(np.median(np.diff(time_s))) for time_s in times)
    # A calendar time of 1.7e9 s resolves 0.2 us; the step is rounded to what the clock resolves.
    step = round(step, min(9, math.floor(-math.log10(8.0 * np.spacing(max(abs(start), abs(end), 1e-9))))))
    if step <= 0.0 or end - start < step:
        raise RecordingError(
            f"the signals have no common time: the last starts at {start:g} s, the first ends at {end:g} s",
            file=path.name,
        )
    count = int((end - start) / step + 1e-6) + 1
    limits.check_count(count, limits.MAX_ROWS, f"rows of {step:g} s", RecordingError, file=path.name)
    return np.minimum(start + np.arange(count) * step, end), step


def _channel(name: str, table: Mapping[str, Channel], taken: Mapping[str, str]) -> Channel:
    meaning = f"measured: {taken[name]}" if name in taken else "derived from measured channels"
    if name in table:
        return table[name]._replace(meaning=f"{table[name].meaning}; {meaning}", single=False)
    return Channel(name, unit_of(name), meaning, "measured", single=False)
