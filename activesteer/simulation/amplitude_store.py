"""Store of amplitudes found by driving, in the process and in the user's cache folder.

The folder is `$XDG_CACHE_HOME/activesteer/amplitudes`, by default `~/.cache/activesteer/amplitudes`. You can delete it
at any time. The name of a file is the key of its number. The file holds the number and a hash of both, so a damaged or
misplaced file is ignored. If the folder cannot be read or written, nothing is stored there.
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
"""Maximum of numbers in the process and in the folder; the oldest are deleted first."""
_MAX_BYTES: Final = 200
_SUFFIX: Final = ".amplitude"
_in_process: dict[str, float] = {}
_reads = True
_writes = True


def folder() -> Path:
    """Return the folder of the numbers, which need not exist."""
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    # XDG base directory specification: ignore a path that is not absolute.
    cache = given if given.is_absolute() else Path.home() / ".cache"
    return cache / "activesteer" / "amplitudes"


def recall(key: str) -> float | None:
    """Return a stored number, bit for bit; None if there is none."""
    if _reads and key not in _in_process:
        with contextlib.suppress(ActiveSteerError, RuntimeError, ValueError):
            text = read_bytes(folder() / f"{key}{_SUFFIX}", ActiveSteerError, _MAX_BYTES).decode("ascii")
            value = float.fromhex(text.partition(" ")[0])
            if text == _line(key, value) and math.isfinite(value):
                _remember(key, value)
    return _in_process.get(key)


def keep(key: str, value: float) -> None:
    """Store a number."""
    _remember(key, value)
    if not _writes:
        return
    with contextlib.suppress(OSError, RuntimeError):
        place = folder()
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        part = place / f"{key}-{secrets.token_hex(4)}{_SUFFIX}"
        try:
            part.write_text(_line(key, value), encoding="ascii")
            # Not `files.atomic_write`, which follows links: a link here may point to any file of the user.
            part.replace(place / f"{key}{_SUFFIX}")
        finally:
            part.unlink(missing_ok=True)
        kept = sorted(place.glob(f"*{_SUFFIX}"), key=lambda file: file.lstat().st_mtime)
        for file in kept[:-MAX_KEPT]:
            with contextlib.suppress(OSError):
                file.unlink()


@contextlib.contextmanager
def not_on_disk() -> Iterator[None]:
    """Keep numbers found inside in the process only, because the many cars of a study do not occur again."""
    global _writes  # noqa: PLW0603 - one setting for the process, like the numbers
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
