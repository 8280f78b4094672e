"""Amplitudes that were found by driving, kept for the process and, in the user's cache folder, for the next one.

The folder is `$XDG_CACHE_HOME/activesteer/amplitudes`, by default `~/.cache/activesteer/amplitudes`; it may be deleted
at any time. A file is named by the key of its number and holds the number with a hash of both, so that one that is
damaged, or belongs elsewhere, is not taken; where nothing can be read or written, nothing is kept there.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from activesteer.errors import ActiveSteerError
from activesteer.files import read_bytes

MAX_KEPT: Final = 1000
"""Numbers that are kept, in the process and in the folder; the oldest make room."""
_MAX_BYTES: Final = 200
_SUFFIX: Final = ".amplitude"
_in_process: dict[str, float] = {}
_reads = True
_writes = True


def folder() -> Path:
    """Where the numbers are kept.

    Returns:
        A folder, which need not exist.

    Raises:
        RuntimeError: the user has no home folder.
    """
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    # The XDG base directory specification: a path that is not absolute is to be ignored.
    cache = given if given.is_absolute() else Path.home() / ".cache"
    return cache / "activesteer" / "amplitudes"


def recall(key: str) -> float | None:
    """A number that was kept.

    Args:
        key: Hexadecimal digest of everything that decides the number.

    Returns:
        The number, bit for bit; None where it is not known.
    """
    if _reads and key not in _in_process:
        with contextlib.suppress(ActiveSteerError, RuntimeError, ValueError):
            text = read_bytes(folder() / f"{key}{_SUFFIX}", ActiveSteerError, _MAX_BYTES).decode("ascii")
            value = float.fromhex(text.partition(" ")[0])
            if text == _line(key, value) and math.isfinite(value):
                _remember(key, value)
    return _in_process.get(key)


def keep(key: str, value: float) -> None:
    """Keeps a number.

    Args:
        key: Hexadecimal digest of everything that decides it.
        value: The number.
    """
    _remember(key, value)
    if not _writes:
        return
    with contextlib.suppress(OSError, RuntimeError):
        place = folder()
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        part = place / f"{key}-{secrets.token_hex(4)}{_SUFFIX}"
        try:
            part.write_text(_line(key, value), encoding="ascii")
            # Not `files.replacing`, which follows links: what stands here may be a link to a file of someone's.
            part.replace(place / f"{key}{_SUFFIX}")
        finally:
            part.unlink(missing_ok=True)
        kept = sorted(place.glob(f"*{_SUFFIX}"), key=lambda file: file.lstat().st_mtime)
        for file in kept[:-MAX_KEPT]:
            with contextlib.suppress(OSError):
                file.unlink()


@contextlib.contextmanager
def not_on_disk() -> Iterator[None]:
    """Numbers that are found inside stay in the process: the thousand cars of a study are not met again."""
    global _writes  # noqa: PLW0603 - of the process, as the numbers are
    before, _writes = _writes, False
    try:
        yield
    finally:
        _writes = before


@contextlib.contextmanager
def searched_anew() -> Iterator[None]:
    """Search amplitudes inside as if none had been kept, and write none to disk."""
    global _in_process, _reads
    before, _in_process, _reads = (_in_process, _reads), {}, False
    try:
        with not_on_disk():
            yield
    finally:
        _in_process, _reads = before


def _remember(key: str, value: float) -> None:
    _in_process[key] = value
    for oldest in list(_in_process)[:-MAX_KEPT]:
        _in_process.pop(oldest, None)


def _line(key: str, value: float) -> str:
    digits = value.hex()
    return f"{digits} {hashlib.sha256(f'{key} {digits}'.encode()).hexdigest()}\n"
