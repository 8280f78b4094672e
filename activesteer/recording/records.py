"""Records of an MCAP file up to the first broken one. All sizes that they declare are limited."""

from __future__ import annotations

import os
import stat
import struct
import zlib
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Final

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, DataEnd, Metadata, Schema
from mcap.writer import MCAP0_MAGIC

from activesteer import limits
from activesteer.errors import RecordingError
from activesteer.files import reading, shown_path
from activesteer.recording.rows import BROKEN, read_bytes

_RECORD: Final = struct.Struct("<BQ")
_PIECE_BYTES: Final = 2**20
_READ: Final = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.METADATA: Metadata,
    Opcode.ATTACHMENT: Attachment,
}
"""Records that are kept; chunks are read later, and all others repeat information."""
_REFUSED: Final = (0, Opcode.FOOTER, Opcode.MESSAGE)
"""Records that cannot stand here: none, the footer, and a message outside a chunk."""


@dataclass
class Records:
    """Records of a file, chunks as places.

    Attributes:
        position: End of the last record.
        crc: Checksum of all bytes up to `position`.
        complete: Whether the end of the data section was reached; the rest only repeats information.
        damage: Description of the damage.
        reason: The error behind the damage, if it is one of ours.
    """

    position: int = len(MCAP0_MAGIC)
    crc: int = zlib.crc32(MCAP0_MAGIC)
    schemas: dict[int, Schema] = field(default_factory=dict)
    topics: dict[int, Channel] = field(default_factory=dict)
    metadata: list[Metadata] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    chunks: list[tuple[int, int]] = field(default_factory=list)
    complete: bool = False
    damage: str = ""
    reason: RecordingError | None = None
    _bytes: int = 0
    _count: int = 0

    def read_next(self, descriptor: int, size: int) -> None:
        """Read one record and move the position to its end, also if the record is broken.

        Raises:
            RecordingError: the record is not allowed here, too large, or broken.
        """
        start, self.position = self.position, size + 1
        head = read_bytes(descriptor, start, min(_RECORD.size, size - start))
        opcode, length = _RECORD.unpack(head)
        first = start + _RECORD.size
        self.position = first + length
        if opcode in _REFUSED:
            raise RecordingError(f"a record has opcode {opcode}", value=opcode)
        if self.position > size:
            raise RecordingError(f"a record of {length} bytes reaches beyond the end")
        if opcode in _READ:
            self._bytes, self._count = self._bytes + length, self._count + 1
            if self._bytes > limits.MAX_OTHER_BYTES or self._count > limits.MAX_OTHER_RECORDS:
                raise RecordingError(
                    "attachments, schemas and metadata are too large",
                    value=self._bytes, allowed=limits.MAX_OTHER_BYTES,
                )  # fmt: skip
            self._take(opcode, read_bytes(descriptor, first, length))
        elif opcode == Opcode.CHUNK:
            self.chunks.append((first, length))
        elif opcode == Opcode.DATA_END:
            declared = DataEnd.read(ReadDataStream(BytesIO(read_bytes(descriptor, first, length)))).data_section_crc
            self.complete = True
            if declared not in (0, self.crc):
                raise RecordingError(f"the checksum of the file is {self.crc} instead of {declared}")
        self.crc = zlib.crc32(head, self.crc)
        for piece in range(first, self.position, _PIECE_BYTES):
            self.crc = zlib.crc32(read_bytes(descriptor, piece, min(_PIECE_BYTES, self.position - piece)), self.crc)

    def _take(self, opcode: int, content: bytes) -> None:
        record = _READ[Opcode(opcode)].read(ReadDataStream(BytesIO(content)))
        if isinstance(record, Schema):
            self.schemas[record.id] = record
        elif isinstance(record, Channel):
            self.topics[record.id] = record
        elif isinstance(record, Metadata):
            self.metadata.append(record)
        else:
            self.attachments[record.name] = record.data


def opened(path: Path) -> int:
    """Open a regular file and return its descriptor; a device or pipe may never end.

    Raises:
        RecordingError: the file cannot be read, or is not a regular file.
    """
    with reading(path, RecordingError):
        # Without O_NONBLOCK, opening a pipe would wait for a writer.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    mode = os.fstat(descriptor).st_mode
    if stat.S_ISREG(mode):
        return descriptor
    os.close(descriptor)
    what = "a folder; name its recordings as DIR/*.mcap" if stat.S_ISDIR(mode) else "a device or a pipe"
    raise RecordingError(f"cannot read {shown_path(path)}: it is {what}", value=path)


def read_records(descriptor: int, size: int) -> Records:
    """Collect all records up to the end of the data section.

    Args:
        descriptor: Descriptor of the file.
        size: Its size [byte].
    """
    records = Records()
    while not records.complete:
        start = records.position
        try:
            records.read_next(descriptor, size)
        except (RecordingError, *BROKEN) as error:
            # A killed process leaves a record that reaches beyond the end of the file. A file that continues after
            # the record, or ends properly, is damaged.
            ended = os.pread(descriptor, len(MCAP0_MAGIC), size - len(MCAP0_MAGIC)) == MCAP0_MAGIC
            if records.position <= size or ended:
                records.damage = f"bytes {start} to {min(records.position, size)} cannot be read: {words_of(error)}"
                records.reason = error if isinstance(error, RecordingError) else None
            break
    return records


def words_of(error: BaseException) -> str:
    """Describe an error of ours or of a library in words."""
    if isinstance(error, RecordingError):
        return str(error)
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
