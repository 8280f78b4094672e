"""Unpacking of an FMU, which is a foreign and perhaps hostile archive."""

from __future__ import annotations

import atexit
import functools
import hashlib
import io
import shutil
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import Final

from activesteer import limits
from activesteer.files import read_bytes, shown_path
from activesteer.plugins import Kind

_BLOCK_BYTES: Final = 1 << 20
_DAMAGED: Final = (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError, RuntimeError)
DESCRIPTION: Final = "modelDescription.xml"
BINARIES: Final = ("binaries/linux64/", "binaries/x86_64-linux/")
"""Folders of the binaries for Linux on x86-64, of FMI 2 and of FMI 3."""
_NEEDED: Final = (DESCRIPTION, "resources/", *BINARIES)

Fail = Callable[..., Exception]


class Archive:
    """An FMU file, unpacked at first use and deleted at the end of the process.

    Attributes:
        path: The file.
        key: Digest of its content.
        names: Names of its members.
    """

    def __init__(self, path: Path, kind: Kind) -> None:
        """Read and check the archive without unpacking it.

        Args:
            path: The file.
            kind: Kind of block, whose error is raised.

        Raises:
            ActiveSteerError: of the kind's type: the file cannot be read, is no archive, or is hostile or too large.
        """
        self.path = path
        self._error = kind.error
        self._fail = functools.partial(kind.fail, path.name)
        self._data = read_bytes(path, kind.error, limits.MAX_FMU_BYTES)
        self.key = hashlib.sha256(self._data).hexdigest()
        try:
            with zipfile.ZipFile(io.BytesIO(self._data)) as archive:
                self._check(archive)
                self.names = archive.namelist()
                self.description = archive.read(DESCRIPTION)
        except (*_DAMAGED, KeyError, ValueError) as reason:
            raise self._fail(f"{shown_path(path)} is not an FMU: {reason}") from reason
        # An FMU needs no document type; one could expand without limit or read files of this machine.
        if b"\0" in self.description[:4] or b"<!DOCTYPE" in self.description or b"<!ENTITY" in self.description:
            raise self._fail(f"its {DESCRIPTION} is not plain UTF-8 without a document type")

    def _check(self, archive: zipfile.ZipFile) -> None:
        members = archive.infolist()
        total = sum(member.file_size for member in members)
        limits.check_count(len(members), limits.MAX_FMU_MEMBERS, "files", self._error, file=self.path.name)
        limits.check_count(total, limits.MAX_FMU_UNPACKED_BYTES, "unpacked bytes", self._error, file=self.path.name)
        for member in members:
            name = PurePosixPath(member.filename)
            kind = stat.S_IFMT(member.external_attr >> 16)
            outside = name.is_absolute() or ".." in name.parts or any(sign in member.filename for sign in "\\:\0")
            if outside or kind not in (0, stat.S_IFREG, stat.S_IFDIR):
                raise self._fail(f"holds {member.filename!r}, which is outside of the FMU or no plain file")
        if DESCRIPTION not in archive.namelist():
            raise self._fail(f"{shown_path(self.path)} is not an FMU: it has no {DESCRIPTION}")
        size = archive.getinfo(DESCRIPTION).file_size
        limits.check_count(size, limits.MAX_FMU_DESCRIPTION_BYTES, "bytes", self._error, file=DESCRIPTION)

    def kept(self, most_bytes: int) -> dict[str, bytes]:
        """Return what a recording keeps of the FMU: the file, or the description and the digest of a larger one."""
        if len(self._data) <= most_bytes:
            return {self.path.name: self._data}
        return {f"{self.path.stem}.sha256": self.key.encode(), f"{self.path.stem}.xml": self.description}

    def unpacked(self) -> Path:
        """Return the folder with description, resources, and the binaries for this platform.

        Raises:
            ActiveSteerError: of the kind's type: the archive is damaged, or the disk is full.
        """
        if (folder := _unpacked.get(self.key)) is None:
            folder = Path(tempfile.mkdtemp(prefix="activesteer-fmu-"))
            atexit.register(shutil.rmtree, folder, ignore_errors=True)
            try:
                with zipfile.ZipFile(io.BytesIO(self._data)) as archive:
                    for member in archive.infolist():
                        if member.filename.startswith(_NEEDED) and not member.is_dir():
                            _write(archive, member, folder / member.filename)
            except _DAMAGED as reason:
                raise self._fail(f"cannot be unpacked: {reason}") from reason
            _unpacked[self.key] = folder
        return folder


_unpacked: Final[dict[str, Path]] = {}


def _write(archive: zipfile.ZipFile, member: zipfile.ZipInfo, target: Path) -> None:
    """Write a member, at most the size that it declares."""
    target.parent.mkdir(parents=True, exist_ok=True)
    left = member.file_size
    with archive.open(member) as source, target.open("xb") as file:
        while block := source.read(min(left, _BLOCK_BYTES)):
            left -= len(block)
            file.write(block)
