"""Exports of recordings: data frames, CSV, Parquet, MATLAB. `Recording` has a method for each.

The data frame is one of pandas with the time as its index. CSV and Parquet are written with pyarrow and need no pandas.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from activesteer.core.files import atomic_write, finite
from activesteer.errors import RecordingError, not_installed
from activesteer.recording.contents import metadata_texts
from activesteer.recording.schemas import TIME

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

    from activesteer.recording.recording import Recording

MATLAB_NAME_LENGTH: Final = 63
"""Longest name of a variable or field in MATLAB (`namelengthmax`)."""

MATLAB_TABLES: Final = ("units", "meanings", "metrics", "metadata")
"""Variables besides the channels."""


def to_dataframe(recording: Recording) -> pd.DataFrame:
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
    index = pd.Index(recording.time_s, name=TIME)
    frame = pd.DataFrame(recording.values, index=index, columns=list(recording.channels.names), copy=True)
    frame.attrs["units"] = {channel.name: channel.unit for channel in recording.channels}
    frame.attrs["metrics"] = dict(recording.metrics)
    return frame


def to_csv(recording: Recording, path: str | os.PathLike[str]) -> Path:
    """Write a line of names and a line per row: `time_s`, then the channels. An existing file is replaced.

    Numbers have enough digits to restore the same values; channels with `single` have 32 bit.

    Raises:
        RecordingError: the file cannot be written.
    """
    from pyarrow import csv  # noqa: PLC0415 - slow to import

    def write(target: Path) -> None:
        with target.open("wb") as stream:
            # pyarrow would quote the names, and some readers keep the quotes.
            stream.write((",".join((TIME, *recording.channels.names)) + "\n").encode())
            csv.write_csv(_table(recording), stream, csv.WriteOptions(include_header=False))

    return _written(path, write)


def to_parquet(recording: Recording, path: str | os.PathLike[str]) -> Path:
    """Write `time_s` and the channels as columns. An existing file is replaced.

    Channels with `single` have 32 bit. Each field carries `unit` and `meaning`, the schema `metadata` and `metrics` as
    JSON texts.

    Raises:
        RecordingError: the file cannot be written.
    """
    from pyarrow import parquet  # noqa: PLC0415 - slow to import

    return _written(path, lambda target: parquet.write_table(_table(recording), target, compression="zstd"))


def to_mat(recording: Recording, path: str | os.PathLike[str]) -> Path:
    """Write a MATLAB file of version 5, which every MATLAB and Octave can load. An existing file is replaced.

    `time_s` and every channel is a column of doubles, since single precision would spread to all results.
    Structs `units`, `meanings` and `metrics` have a field for each name; `metadata` is JSON text, for `jsondecode`.

    Raises:
        RecordingError: the file cannot be written, or a name is taken or too long for MATLAB.
    """
    from scipy.io import savemat  # noqa: PLC0415 - slow to import

    taken = {TIME, *MATLAB_TABLES}
    for name in (*recording.channels.names, *recording.metrics):
        if len(name) > MATLAB_NAME_LENGTH:
            raise RecordingError(
                f"{name!r} has {len(name)} letters; MATLAB allows {MATLAB_NAME_LENGTH}",
                value=name,
                allowed=MATLAB_NAME_LENGTH,
            )
    if clash := taken.intersection(recording.channels.names):
        name = clash.pop()
        raise RecordingError(f"a channel is called {name!r}, the name of another variable in the file", value=name)
    variables: dict[str, Any] = {TIME: recording.time_s}
    variables |= {name: recording[name] for name in recording.channels.names}
    variables["units"] = {channel.name: channel.unit for channel in recording.channels}
    variables["meanings"] = {channel.name: channel.meaning for channel in recording.channels}
    variables["metrics"] = dict(recording.metrics)
    variables["metadata"] = _metadata(recording)

    def write(target: Path) -> None:
        # Field names longer than 31 letters need MATLAB 7.6 (2008) or later.
        savemat(target, variables, appendmat=False, long_field_names=True, do_compression=True, oned_as="column")

    return _written(path, write)


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
