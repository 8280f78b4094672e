"""Recording with its exports, and names for several recordings.

CSV and Parquet are written with pyarrow and need no pandas.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from activesteer.core.files import atomic_write, finite
from activesteer.core.signals import Channel
from activesteer.errors import RecordingError, nearest_names, not_installed
from activesteer.recording.contents import ScenePart, metadata_texts
from activesteer.recording.reader import read_mcap
from activesteer.recording.rows import FileRows, Poses, values_of
from activesteer.recording.schemas import TIME, ChannelTable, nanoseconds, shaped
from activesteer.recording.writer import McapWriter

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

_MATLAB_NAME_LENGTH: Final = 63
"""Longest name of a variable or field in MATLAB (`namelengthmax`)."""
_MATLAB_TABLES: Final = ("units", "meanings", "metrics", "metadata")
"""Variables of a MATLAB file in addition to the channels."""


class MissingMetricError(RecordingError, KeyError):
    """Error for a metric that a run does not have."""

    __str__ = Exception.__str__


class _Metrics(dict[str, float]):
    def __missing__(self, name: object) -> float:
        raise MissingMetricError(f"no metric {name!r} in this recording: {nearest_names(str(name), self)}", value=name)


class Recording:
    """A run, in memory or read from an MCAP file.

    `recording["yaw_rate_radps"]` is the channel as a read-only array over `recording.time_s`.

    Attributes:
        metadata: Everything needed to repeat the run, and how it ended; JSON values. `complete` is false if the file
            was not ended properly, as after a killed process.
        metrics: Metrics by name, in the unit at the end of the name.
        attachments: Name -> file kept with the run.
        scene: Shape of the car: solids in body frames, and links between bodies.

    Examples:
        >>> import activesteer
        >>> recording = activesteer.simulate("straight_line", overrides={"duration_s": 2.0})
        >>> recording.save("straight.mcap")
        >>> again = activesteer.Recording.open("straight.mcap")
        >>> len(again), again["speed_mps"].shape, again.metadata["controller"]
        (2000, (2000,), 'none')
        >>> next(channel.name for channel in again.channels if channel.unit == "rad/s")
        'yaw_rate_radps'
        >>> float(again.metrics["speed_end_mps"]) == float(recording.metrics["speed_end_mps"])
        True
    """

    def __init__(
        self,
        channels: Iterable[Channel],
        time_s: ArrayLike,
        values: ArrayLike | FileRows,
        *,
        poses: Poses | None = None,
        metadata: Mapping[str, Any] | None = None,
        metrics: Mapping[str, float] | None = None,
        attachments: Mapping[str, bytes] | None = None,
        scene: Iterable[ScenePart] = (),
    ) -> None:
        """Create a recording from arrays.

        Float arrays are not copied, and must not change afterwards.

        Args:
            channels: Channels in the order of the columns of `values`.
            time_s: Time of each row [s], increasing, >= 0, shape (n,). Kept in whole nanoseconds, as in a file.
            values: Channel values, shape (n, number of channels); or the rows of a file, which are read when needed.
            poses: Poses of the bodies; none by default.
            metadata: Metadata; its key `metrics` becomes the metrics.
            metrics: Metrics by name.
            attachments: Name -> file to keep.
            scene: Shape of the car: solids in body frames, and links between bodies.

        Raises:
            RecordingError: a shape or a time is wrong, or a channel occurs twice.
        """
        self._channels = channels if isinstance(channels, ChannelTable) else ChannelTable(channels)
        self._time_s = _frozen(nanoseconds(time_s, "time_s") / 1e9)
        shape = (len(self._time_s), len(self._channels))
        self._values = values if isinstance(values, FileRows) else _frozen(shaped(values, "values", shape))
        self.metadata: dict[str, Any] = {"complete": True, **(metadata or {})}
        found = self.metadata.pop("metrics", {})
        if not isinstance(found, Mapping):
            raise RecordingError(
                f"is {found!r} where numbers by name are expected", file="the metadata", key="metrics", value=found
            )
        self.metrics: dict[str, float] = _Metrics({**found, **(metrics or {})})
        self.attachments: dict[str, bytes] = dict(attachments or {})
        self.scene: tuple[ScenePart, ...] = tuple(scene)
        if poses is None and not isinstance(self._values, FileRows):
            poses = Poses(np.empty(0), (), np.empty((0, 0, 3)), np.empty((0, 0, 4)))
        self._poses = None if poses is None else _checked(poses)

    @classmethod
    def open(cls, path: str | Path, *, recover: bool = False) -> Self:
        """Read a recording from an MCAP file.

        A file that ends too early, as after a killed process, opens with all complete blocks and with
        `metadata["complete"]` false.

        Args:
            path: The file.
            recover: Whether to return the part of a damaged file before the damage.

        Raises:
            RecordingError: the file cannot be opened, is not a recording, or is damaged (with its readable part).
        """
        contents, damage = read_mcap(Path(path))
        if damage and not recover:
            rows = len(contents["time_s"])
            message = f"{path} is damaged: {damage}. "
            if rows:
                message += f"The {rows} rows up to {contents['time_s'][-1]:.3f} s can be read"
            else:
                message += "Metadata and attachments can be read, but no rows"
            raise RecordingError(message + ", with Recording.open(path, recover=True)", value=path, allowed=rows)
        if damage:
            contents["metadata"].setdefault("error", f"the file is damaged: {damage}")
        try:
            return cls(**contents)
        except RecordingError as error:
            raise RecordingError(f"{path}: {error}", value=error.value, allowed=error.allowed) from None

    def save(self, path: str | Path, *, overwrite: bool = True) -> None:
        """Write the recording to an MCAP file.

        Channels with `single` are stored with 32 bit, all others exactly.

        Args:
            path: The file.
            overwrite: Whether an existing recording may be replaced; any other file never is.

        Raises:
            RecordingError: the file cannot be written, or a metadata value cannot be stored as JSON.
        """
        with McapWriter(
            path,
            self._channels,
            self._values.body_names if isinstance(self._values, FileRows) else self.poses.names,
            {**self.metadata, "metrics": self.metrics},
            self.attachments,
            self.scene,
            overwrite=overwrite,
        ) as writer:
            if not isinstance(self._values, FileRows):
                poses = self.poses
                writer.write(self._time_s, self._values, poses.time_s, poses.positions_m, poses.quaternions)
                return
            for block in self._values.blocks():
                values = values_of([block], len(block.row_ns), len(self._channels))
                writer.write(block.row_ns / 1e9, values, block.pose_ns / 1e9, block.positions_m, block.quaternions)

    def to_dataframe(self) -> pd.DataFrame:
        """Return a data frame with a column per channel and the time as index.

        Returns:
            The frame, a copy; `attrs["units"]` has the units by column, `attrs["metrics"]` the metrics.

        Raises:
            RecordingError: pandas is not installed.
        """
        try:
            import pandas as pd  # noqa: PLC0415 - an extra, and slow to import
        except ImportError as reason:
            raise not_installed(RecordingError, "to_dataframe", "pandas", "data") from reason
        index = pd.Index(self.time_s, name=TIME)
        frame = pd.DataFrame(self.values, index=index, columns=list(self.channels.names), copy=True)
        frame.attrs["units"] = {channel.name: channel.unit for channel in self.channels}
        frame.attrs["metrics"] = dict(self.metrics)
        return frame

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write a CSV file: a header, then a line per row, with `time_s` first.

        An existing file is replaced.

        Numbers have enough digits to restore the same values; channels with `single` have 32 bit.

        Raises:
            RecordingError: the file cannot be written.
        """
        from pyarrow import csv  # noqa: PLC0415 - slow to import

        def write(target: Path) -> None:
            with target.open("wb") as stream:
                # pyarrow would quote the names, and some readers keep the quotes.
                stream.write((",".join((TIME, *self.channels.names)) + "\n").encode())
                csv.write_csv(_table(self), stream, csv.WriteOptions(include_header=False))

        return _written(path, write)

    def to_parquet(self, path: str | os.PathLike[str]) -> Path:
        """Write a Parquet file with `time_s` and the channels as columns.

        An existing file is replaced.

        Channels with `single` have 32 bit. Each field carries `unit` and `meaning`, the schema `metadata` and `metrics`
        as JSON texts.

        Raises:
            RecordingError: the file cannot be written.
        """
        from pyarrow import parquet  # noqa: PLC0415 - slow to import

        return _written(path, lambda target: parquet.write_table(_table(self), target, compression="zstd"))

    def to_mat(self, path: str | os.PathLike[str]) -> Path:
        """Write a MATLAB file of version 5, which MATLAB and Octave can load.

        An existing file is replaced.

        `time_s` and every channel is a column of doubles, since single precision would spread to all results.
        Structs `units`, `meanings` and `metrics` have a field for each name; `metadata` is JSON text, for `jsondecode`.

        Raises:
            RecordingError: the file cannot be written, or a name is taken or too long for MATLAB.
        """
        from scipy.io import savemat  # noqa: PLC0415 - slow to import

        taken = {TIME, *_MATLAB_TABLES}
        for name in (*self.channels.names, *self.metrics):
            if len(name) > _MATLAB_NAME_LENGTH:
                raise RecordingError(
                    f"{name!r} has {len(name)} characters; MATLAB allows at most {_MATLAB_NAME_LENGTH}",
                    value=name,
                    allowed=_MATLAB_NAME_LENGTH,
                )
        if clash := taken.intersection(self.channels.names):
            name = clash.pop()
            raise RecordingError(f"a channel is called {name!r}, the name of another variable in the file", value=name)
        variables: dict[str, Any] = {TIME: self.time_s}
        variables |= {name: self[name] for name in self.channels.names}
        variables["units"] = {channel.name: channel.unit for channel in self.channels}
        variables["meanings"] = {channel.name: channel.meaning for channel in self.channels}
        variables["metrics"] = dict(self.metrics)
        variables["metadata"] = _metadata(self)

        def write(target: Path) -> None:
            # Field names longer than 31 letters need MATLAB 7.6 (2008) or later.
            savemat(target, variables, appendmat=False, long_field_names=True, do_compression=True, oned_as="column")

        return _written(path, write)

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Time of each row [s], shape (n,), read-only."""
        return self._time_s

    @property
    def channels(self) -> ChannelTable:
        """The channels in column order: name, unit, meaning."""
        return self._channels

    @property
    def poses(self) -> Poses:
        """Poses of all bodies, read-only."""
        if self._poses is None:
            assert isinstance(self._values, FileRows)
            self._poses = _checked(self._values.poses())
        return self._poses

    @property
    def values(self) -> NDArray[np.float64]:
        """All channel values, shape (n, number of channels), read-only and large for a long recording."""
        return _frozen(self._values.values()) if isinstance(self._values, FileRows) else self._values

    def at(self, rows: NDArray[np.intp]) -> Recording:
        """Return the run in memory with some of its rows and all poses."""
        values = self._values.at(rows) if isinstance(self._values, FileRows) else self._values[rows]
        return Recording(
            self._channels, self._time_s[rows], values, poses=self.poses, metadata=self.metadata,
            metrics=self.metrics, attachments=self.attachments, scene=self.scene,
        )  # fmt: skip

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """Return a channel over time, shape (n,), read-only, or raise `RecordingError` if there is none."""
        column = self._channels.index(name)
        if isinstance(self._values, FileRows):
            return _frozen(self._values.channel(column))
        return self._values[:, column]

    def __contains__(self, name: object) -> bool:
        """Return whether a channel exists."""
        return name in self._channels

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self._time_s)

    def __repr__(self) -> str:
        """Show the number of channels and rows, and the duration."""
        span = f"{self._time_s[0]:.3f} to {self._time_s[-1]:.3f} s" if len(self._time_s) else "no rows"
        return f"<Recording: {len(self._channels)} channels, {len(self._time_s)} rows, {span}>"


def _checked(poses: Poses) -> Poses:
    count, bodies = len(np.asarray(poses.time_s)), len(poses.names)
    return Poses(
        _frozen(nanoseconds(poses.time_s, "poses.time_s") / 1e9),
        tuple(poses.names),
        _frozen(shaped(poses.positions_m, "poses.positions_m", (count, bodies, 3))),
        _frozen(shaped(poses.quaternions, "poses.quaternions", (count, bodies, 4))),
    )


def _frozen(array: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a view that cannot be written to."""
    view = array.view()
    view.flags.writeable = False
    return view


def _table(recording: Recording) -> pa.Table:
    import pyarrow as pa  # noqa: PLC0415 - slow to import

    columns = [pa.array(recording.time_s)]
    fields = [pa.field(TIME, pa.float64(), metadata={"unit": "s", "meaning": "time since the recording began"})]
    for channel in recording.channels:
        kind = np.float32 if channel.single else np.float64
        columns.append(pa.array(recording[channel.name].astype(kind)))
        notes = {"unit": channel.unit, "meaning": channel.meaning}
        fields.append(pa.field(channel.name, pa.from_numpy_dtype(kind), metadata=notes))
    about = {"metadata": _metadata(recording), "metrics": json.dumps(finite(recording.metrics))}
    return pa.table(columns, schema=pa.schema(fields, metadata=about))


def _metadata(recording: Recording) -> str:
    texts, _ = metadata_texts(recording.metadata)
    return json.dumps({key: json.loads(text) for key, text in texts.items()}, ensure_ascii=False)


def _written(path: str | os.PathLike[str], write: Callable[[Path], object]) -> Path:
    target = Path(path)
    with atomic_write(target, RecordingError) as part:
        write(part)
    return target


def run_names(sources: Sequence[str | Path], recordings: Iterable[Recording]) -> list[str]:
    """Return a name for each run: its controller, or its file if controllers repeat."""
    controllers = []
    for run in recordings:
        # A user's controller is named by file and class; the class is enough. A parameter may contain a colon too.
        name, mark, parameters = str(run.metadata.get("controller", "run")).partition("?")
        uses_truth = "+truth" if run.metadata.get("controller_uses_truth") else ""
        controllers.append(name.rpartition(":")[2] + mark + parameters + uses_truth)
    if len(set(controllers)) == len(controllers):
        return controllers
    paths = [str(source).removesuffix(".mcap") for source in sources]
    stems = Counter(Path(path).name for path in paths)
    return [Path(path).name if stems[Path(path).name] == 1 else path for path in paths]
