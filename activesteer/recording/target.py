"""Target of a recording: check that it may be written, and lock it against other writers."""

from __future__ import annotations

import fcntl
import os
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, Final

from activesteer.errors import RecordingError
from activesteer.files import reading, shown_path, writing
from activesteer.recording.format import is_recording_start

_START_BYTES: Final = 64


def check_target(path: str | Path, *, overwrite: bool = True) -> None:
    """Check that a recording can be written, without changing anything; only a recording may be replaced.

    Raises:
        RecordingError: the folder does not exist or is not writeable, or an existing file may not be replaced.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise RecordingError(f"cannot write {path}: folder {path.parent} does not exist", value=path.parent)
    if path.is_dir():
        raise RecordingError(f"cannot write {path}: Is a directory", value=path)
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise RecordingError(f"cannot write {path}: Permission denied", value=path)
    if not path.is_file():  # missing, or a device
        return
    if not overwrite:
        raise RecordingError(f"cannot write {path}: it exists already", value=path)
    with reading(path, RecordingError), path.open("rb") as stream:
        ours = is_recording_start(stream.read(_START_BYTES))
    if not ours:
        raise RecordingError(
            f"cannot write {path}: it exists already and is no recording of activesteer; delete or rename it",
            value=path,
        )


def open_target(path: Path, *, overwrite: bool) -> BinaryIO:
    """Create a locked file in place of an existing one.

    A process that has opened the old file keeps it, because it is deleted and not changed.

    Raises:
        RecordingError: see `check_target`; or another program is writing the file.
    """
    check_target(path, overwrite=overwrite)
    with writing(path, RecordingError):
        if path.is_file():
            with path.open("rb") as old:
                _lock(old, path)
                with suppress(PermissionError):  # a writeable file in a folder that is not
                    Path(os.path.realpath(path)).unlink()
        stream = path.open("wb" if overwrite else "xb")
    try:
        _lock(stream, path)
    except RecordingError:
        stream.close()
        raise
    return stream


def _lock(stream: BinaryIO, path: Path) -> None:
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise RecordingError(
            f"cannot write {shown_path(path)}: another run or program is writing it", value=path
        ) from None
    except OSError:
        return  # a file system without locks
