"""Opening and creation of files and folders, with one-line errors of the class that the caller names.

Every message states the operation, the path and the reason.
"""

from __future__ import annotations

import csv
import json
import math
import os
import re
import secrets
import stat
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.core import limits
from activesteer.errors import ActiveSteerError, shown

_passing: Final[set[Path]] = set()
_DECIMAL_COMMA: Final = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


def shown_path(path: str | os.PathLike[str]) -> str:
    """Return a path for a message: at most 200 characters, control characters escaped."""
    return shown(Path(os.fsdecode(path)))


def writing(path: str | os.PathLike[str], error: type[ActiveSteerError]) -> AbstractContextManager[None]:
    """Context that converts an OSError while writing into an error of class `error`."""
    return _refused("write", path, error)


def reading(path: str | os.PathLike[str], error: type[ActiveSteerError]) -> AbstractContextManager[None]:
    """Context that converts an OSError while reading into an error of class `error`."""
    return _refused("read", path, error)


@contextmanager
def atomic_write(path: str | os.PathLike[str], error: type[ActiveSteerError]) -> Iterator[Path]:
    """Yield a new file that replaces `path` at the end, or is deleted if the body fails; write a device directly."""
    with _refused("write", path, error):
        target = Path(os.path.realpath(path))
        if target.exists():
            target.open("ab").close()  # the permissions of the folder would allow replacing a read-only file
        if target.exists() and not target.is_file():
            yield target
            return
        part = target.with_name(f".{target.stem[:40]}-{secrets.token_hex(4)}.part{target.suffix}")
        _passing.add(part)
        try:
            yield part
            if target.exists():
                part.chmod(target.stat().st_mode & 0o777)
            part.replace(target)
        finally:
            with suppress(OSError):  # where it cannot be deleted, the error of the writing itself says why
                part.unlink(missing_ok=True)
            _passing.discard(part)


def delete_temporary_files() -> None:
    """Delete all temporary files of `atomic_write`, for a process that ends without unwinding."""
    for part in tuple(_passing):
        with suppress(OSError):
            part.unlink(missing_ok=True)


def write_text(path: str | os.PathLike[str], text: str, error: type[ActiveSteerError]) -> Path:
    """Write a UTF-8 text file, which replaces an existing one, and return its path."""
    with atomic_write(path, error) as part:
        part.write_text(text, encoding="utf-8")
    return Path(path)


def json_text(value: Any) -> str:
    """Return a value as indented JSON, with null for numbers that are not finite."""
    return json.dumps(finite(value), indent=2, allow_nan=False)


def write_json(path: Path, value: Any, error: type[ActiveSteerError]) -> Path:
    """Write a value as indented JSON into a folder that is created if it does not exist (see `write_text`)."""
    make_folder(path.parent, error)
    return write_text(path, json_text(value) + "\n", error)


def finite(value: Any) -> Any:
    """Return JSON values with None for every number that is not finite."""
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def file_word(text: str) -> str:
    """Return a string for a file name: only letters, digits, dots, hyphens and underscores."""
    return "".join(letter if letter.isalnum() or letter in "._-" else "_" for letter in text)


def user_path(path: str | os.PathLike[str], error: type[ActiveSteerError]) -> Path:
    """Return a path with `~` replaced by the home folder."""
    try:
        return Path(os.fsdecode(path)).expanduser()
    except RuntimeError as reason:
        raise error(f"{shown_path(path)}: there is no such home folder", value=path) from reason


def is_file(path: str | os.PathLike[str]) -> bool:
    """Return whether a path is a regular file, False for impossible names."""
    try:
        return stat.S_ISREG(os.stat(path).st_mode)
    except (OSError, ValueError):
        return False


def is_folder(path: str | os.PathLike[str]) -> bool:
    """Return whether a path is a folder, False for impossible names."""
    try:
        return stat.S_ISDIR(os.stat(path).st_mode)
    except (OSError, ValueError):
        return False


def why_no_file(path: str | os.PathLike[str]) -> str:
    """Return the reason why a path is not a file, for an error message."""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return "is a broken link" if os.path.islink(path) else "does not exist"
    return "is a folder" if stat.S_ISDIR(mode) else "is not a regular file"


def read_bytes(
    path: str | os.PathLike[str], error: type[ActiveSteerError], max_bytes: int = limits.MAX_TEXT_BYTES
) -> bytes:
    """Read a regular file of limited size."""
    with reading(path, error):
        # Without O_NONBLOCK, opening a pipe would wait for a writer.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            os.close(descriptor)
            raise error(f"cannot read {shown_path(path)}: it {why_no_file(path)}", value=path)
        with open(descriptor, "rb") as file:
            data = file.read(max_bytes + 1)
    if len(data) > max_bytes:
        raise error(
            f"cannot read {shown_path(path)}: it is longer than {max_bytes} bytes", value=path, allowed=max_bytes
        )
    return data


def read_text(
    path: str | os.PathLike[str],
    error: type[ActiveSteerError],
    max_bytes: int = limits.MAX_TEXT_BYTES,
) -> str:
    """Read a UTF-8 text file like `read_bytes`, with normalised line ends and without a byte order mark."""
    try:
        text = read_bytes(path, error, max_bytes).decode("utf-8-sig")
    except UnicodeDecodeError as reason:
        raise error(
            f"cannot read {shown_path(path)}: it is not UTF-8 text (byte {reason.start})", value=path
        ) from reason
    return text.replace("\r\n", "\n").replace("\r", "\n")


class CsvRow(NamedTuple):
    """Row of a CSV file, with its line number."""

    line: int  # line in the file, from 1
    cells: list[str]  # cells without surrounding blanks


def read_csv(
    path: str | os.PathLike[str], error: type[ActiveSteerError], *, empty_cells_count: bool = False
) -> list[CsvRow]:
    """Read the rows of a CSV file with the separator of the first line that contains one. `#` starts a comment."""
    lines = [line.partition("#")[0] for line in read_text(path, error, limits.MAX_CSV_BYTES).split("\n")]
    separator = next((sign for line in lines for sign in ";\t," if sign in line), ",")
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True)
    rows = []
    try:
        for given in reader:
            cells = [cell.strip() for cell in given]
            # With semicolons or tabs, 1,5 is the number 1.5.
            if separator != ",":
                cells = [cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell for cell in cells]
            if any(cells) or (empty_cells_count and len(cells) > 1):
                rows.append(CsvRow(reader.line_num, cells))
    except csv.Error as reason:
        raise error(f"invalid CSV: {reason}", file=Path(path).name, line=reader.line_num) from reason
    return rows


def make_folder(path: str | os.PathLike[str], error: type[ActiveSteerError]) -> Path:
    """Create a folder with its parents if needed, and return its path."""
    folder = Path(path)
    with _refused("make the folder", folder, error):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


@contextmanager
def _refused(doing: str, path: str | os.PathLike[str], error: type[ActiveSteerError]) -> Iterator[None]:
    if "\0" in os.fspath(path):
        raise error(f"cannot {doing} {shown_path(path)}: a path cannot contain a zero byte", value=path)
    try:
        yield
    except OSError as reason:
        raise error(f"cannot {doing} {shown_path(path)}: {reason.strerror or reason}", value=path) from reason
