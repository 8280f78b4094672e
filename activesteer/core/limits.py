"""Limits of files from outside: size, count, depth and numbers.

The page `docs/limits.md` says what they guarantee.

Every reader checks with these limits and functions before it uses what a file holds, so that a small file can fill
neither memory nor time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from activesteer.errors import ActiveSteerError, RecordingError, shown

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MAX_NUMBER: Final = 1e12
"""Largest absolute value of a number in a file, in any unit: a larger one may overflow."""

# Text files and folders of them.
MAX_TEXT_BYTES: Final = 2_000_000
"""Default limit of a text file. Files of the package have about 20 kB."""
MAX_CSV_BYTES: Final = 10_000_000
"""Limit of a CSV. An hour of samples every 10 ms has 8 MB."""
MAX_TOML_DEPTH: Final = 32
MAX_TOML_LETTERS: Final = 1000
"""Longest text of a TOML file."""
MAX_TYRE_BYTES: Final = 4_000_000

# OpenCRG.
MAX_CRG_BYTES: Final = 20_000_000
MAX_CRG_POINTS: Final = 4_000_000
MAX_CRG_COLUMNS: Final = 10_000
MAX_CRG_FILES: Final = 4
"""Largest number of files that refer to each other."""

# FMU.
MAX_FMU_BYTES: Final = 256_000_000
MAX_FMU_UNPACKED_BYTES: Final = 1_000_000_000
MAX_FMU_MEMBERS: Final = 20_000
MAX_FMU_DESCRIPTION_BYTES: Final = 32_000_000
MAX_FMU_ELEMENTS: Final = 1000
"""Largest number of elements of an array."""

# Measured data: CSV, MDF, Parquet, MATLAB; all but CSV are read by a child process of limited memory.
MAX_MEASURED_BYTES: Final = 2**30
MAX_READER_BYTES: Final = 2**32
"""Memory of the child: a file of the largest size, and its numbers in several copies."""
MAX_READER_S: Final = 120.0
"""Time for opening a file and for reading a column. A column of the largest length takes some seconds."""

# Recordings.
MAX_ROWS: Final = 20_000_000
"""Largest number of rows: five and a half hours at 1 ms, 160 MB in memory per channel."""
MAX_CHANNELS: Final = 10_000
"""Largest number of channels. A car has about 150."""
MAX_FILE_BYTES: Final = 2**35
"""Largest size of a file; 20 million rows have about 15 GB. A sparse file of any size could take forever to read."""
MAX_CHUNK_BYTES: Final = 2**26
"""Largest size of a chunk, compressed or not. One second of a car is 1 MB."""
MAX_EXPANSION: Final = 200  # driving gives 2 to 4, standing still about 50
"""Largest expansion of a chunk by decompression; the writer leaves a chunk beyond it uncompressed."""
MAX_OTHER_BYTES: Final = 2**28
"""Largest size of all attachments, schemas and metadata together. Models with meshes have about 50 MB."""
MAX_OTHER_RECORDS: Final = 20_000
"""Largest number of attachments, schemas, topics and metadata records together."""
MAX_FOREIGN_MESSAGES: Final = 100_000
"""Largest number of messages in topics of other tools in a chunk."""
MAX_BODIES: Final = 1000
"""Largest number of bodies with poses. A car has about 30."""
MAX_PARTS: Final = 100_000
"""Largest number of parts of a scene. A car has about 60."""
MAX_EVENTS: Final = 10_000
MAX_EVENT_LETTERS: Final = 2000
MAX_DESCRIPTION_LETTERS: Final = 1000
"""Longest description of a channel."""
MAX_NAME_LETTERS: Final = 5000
"""Longest name of an entry or a controller. A controller name contains a path of up to 4096 letters."""
MAX_METADATA_LETTERS: Final = 100_000
MAX_METADATA_DEPTH: Final = 16
MAX_METADATA_ENTRIES: Final = 20_000
"""Largest number of named values in all tables of the metadata. A run has about 150."""
MAX_METADATA_ELEMENTS: Final = 5_000_000
"""Largest number of values in all lists of the metadata: a path with a point per centimetre for 20 km."""
MAX_LIST_ELEMENTS: Final = 1_000_000
"""Largest number of values in one list of a road or course."""


def check_count(count: int, most: int, what: str, error: type[ActiveSteerError], **place: Any) -> None:
    """Reject a count above `most`."""
    if count > most:
        raise error(f"has {count} {what}; at most {most} are allowed", value=count, allowed=most, **place)


def check_number(value: float, error: type[ActiveSteerError], *, text: Any = None, **place: Any) -> None:
    """Reject a number that is not finite or exceeds `MAX_NUMBER`."""
    given = value if text is None else text
    if not math.isfinite(value):
        raise error(f"{shown(given)} is not a finite number", value=given, **place)
    if abs(value) > MAX_NUMBER:
        raise error(
            f"is {value:g}; the largest number allowed in a file is {MAX_NUMBER:g}",
            value=given, allowed=MAX_NUMBER, **place,
        )  # fmt: skip


def number_in(text: str, error: type[ActiveSteerError], **place: Any) -> float:
    """Parse a number (see `check_number`)."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    check_number(value, error, text=text, **place)
    return value


def too_large(values: Any, *, infinite: bool = False) -> Any:
    """Return the mask of the values above `MAX_NUMBER`."""
    # A nan is a missing value, and a run that diverged may hold infinity.
    size = abs(values)
    return (size > MAX_NUMBER) & (size < math.inf) if infinite else size > MAX_NUMBER


def check_numbers(values: Any, error: type[ActiveSteerError], *, infinite: bool = False, **place: Any) -> None:
    """Reject values above `MAX_NUMBER` (see `too_large`)."""
    wrong = too_large(values, infinite=infinite)
    if wrong.any():
        check_number(float(values[wrong].flat[0]), error, **place)


LIMIT_M: Final = 1e6
"""Largest distance of a place from 0, and largest size, on a road [m]."""


def fail(key: str, problem: str) -> RecordingError:
    """Return an error that gives the key in the metadata."""
    return RecordingError(problem, file="the metadata", key=key)


def table_of(value: object, key: str) -> Mapping[str, Any]:
    """Return the value if it is a table, or raise an error."""
    if not isinstance(value, Mapping):
        raise fail(key, f"is {shown(value)}, expected a table")
    return value


def sequence(value: object, key: str) -> Sequence[Any]:
    """Return the value if it is a list, or raise an error."""
    if not isinstance(value, list | tuple):
        raise fail(key, f"is {shown(value)}, expected a list")
    check_count(len(value), MAX_LIST_ELEMENTS, "elements", RecordingError, file="the metadata", key=key)
    return value


def number(value: object, key: str, low: float = -LIMIT_M, high: float = LIMIT_M) -> float:
    """Return the value [m] if it is a number from `low` to `high`, or raise an error."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise fail(key, f"is {shown(value)}, expected a number from {low:g} to {high:g} m")
    return float(value)


def numbers(
    value: object, key: str, low: float = -LIMIT_M, high: float = LIMIT_M, count: int | None = None
) -> NDArray[np.float64]:
    """Return the value [m] if it is a list of `count` numbers from `low` to `high`, or raise an error."""
    import numpy as np  # noqa: PLC0415 - slow to import

    listed = sequence(value, key)
    if count is not None and len(listed) != count:
        raise fail(key, f"has {len(listed)} values, expected {count}")
    return np.array([number(item, f"{key}.{index}", low, high) for index, item in enumerate(listed)], np.float64)


def text(value: object, key: str) -> str:
    """Return the value if it is a string, or raise an error."""
    if not isinstance(value, str):
        raise fail(key, f"is {shown(value)}, expected a string")
    return value
