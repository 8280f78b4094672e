"""Where files and folders are opened and made: what the system refuses becomes an error of ours.

Every error raised here is of the class that the caller names, and is one line: what could not be done, to which path,
and why.
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from activesteer.errors import MAX_SHOWN, ActiveSteerError


def shown_path(path: str | os.PathLike[str]) -> str:
    """A path as a message shows it: cut to 200 characters, and none of them moves a cursor or cannot be printed."""
    text = "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in os.fspath(path))
    return text if len(text) <= MAX_SHOWN else text[: MAX_SHOWN - 3] + "..."


@contextmanager
def writing(path: str | os.PathLike[str], error: type[ActiveSteerError]) -> Iterator[None]:
    """Stands around what writes a file.

    Args:
        path: The file.
        error: Class of the error that an OSError becomes.

    Raises:
        ActiveSteerError: the body raised an OSError; of class `error`.
    """
    with _refused("write", path, error):
        yield


@contextmanager
def reading(path: str | os.PathLike[str], error: type[ActiveSteerError]) -> Iterator[None]:
    """Stands around what reads a file.

    Args:
        path: The file.
        error: Class of the error that an OSError becomes.

    Raises:
        ActiveSteerError: the body raised an OSError; of class `error`.
    """
    with _refused("read", path, error):
        yield


@contextmanager
def replacing(path: str | os.PathLike[str], error: type[ActiveSteerError]) -> Iterator[Path]:
    """Gives a new file beside `path` to write to, which takes the place of `path` in the end.

    So nobody meets half a file: where the body fails, the new file is deleted and what was there before stays. A device
    is written to as it is.

    Args:
        path: The file.
        error: Class of the error that an OSError becomes.

    Yields:
        What to write to; it has the ending of `path`.

    Raises:
        ActiveSteerError: the body raised an OSError, or `path` may not be replaced; of class `error`.
    """
    with _refused("write", path, error):
        target = Path(os.path.realpath(path))
        if target.exists():
            target.open("ab").close()  # the folder's permissions alone would allow to replace a read-only file
        if target.exists() and not target.is_file():
            yield target
            return
        part = target.with_name(f".{target.stem[:40]}-{secrets.token_hex(4)}.part{target.suffix}")
        try:
            yield part
            if target.exists():
                part.chmod(target.stat().st_mode & 0o777)
            part.replace(target)
        finally:
            part.unlink(missing_ok=True)


def write_text(path: str | os.PathLike[str], text: str, error: type[ActiveSteerError]) -> Path:
    """Writes a text file, in UTF-8; one that exists is replaced as a whole.

    Args:
        path: The file.
        text: What it shall hold.
        error: Class of the error where it cannot be written.

    Returns:
        The path.

    Raises:
        ActiveSteerError: it cannot be written; of class `error`.
    """
    with replacing(path, error) as part:
        part.write_text(text, encoding="utf-8")
    return Path(path)


def make_folder(path: str | os.PathLike[str], error: type[ActiveSteerError]) -> Path:
    """Makes a folder and those above it, where they do not exist.

    Args:
        path: The folder.
        error: Class of the error where it cannot be made.

    Returns:
        The path.

    Raises:
        ActiveSteerError: it cannot be made, or is a file; of class `error`.
    """
    folder = Path(path)
    with _refused("make the folder", folder, error):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


@contextmanager
def _refused(doing: str, path: str | os.PathLike[str], error: type[ActiveSteerError]) -> Iterator[None]:
    if "\0" in os.fspath(path):
        raise error(f"cannot {doing} {shown_path(path)}: a path has no zero byte")
    try:
        yield
    except OSError as reason:
        raise error(f"cannot {doing} {shown_path(path)}: {reason.strerror or reason}") from reason
