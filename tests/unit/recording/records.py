"""MCAP files record by record, for files that our writer cannot produce."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Sequence
from pathlib import Path

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk, DataEnd, Footer, McapRecord, Message
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC


def records_of(path: Path) -> list[McapRecord]:
    """Return all records of the data section, with whole chunks, without the message index."""
    found: list[McapRecord] = []
    with path.open("rb") as stream:
        for record in StreamReader(stream, emit_chunks=True).records:
            if isinstance(record, DataEnd):
                break
            if type(record).__name__ != "MessageIndex":
                found.append(record)
    return found


def write_records(path: Path, records: Iterable[McapRecord]) -> Path:
    """Return a file of these records with a proper end, without checksums."""
    path.write_bytes(MCAP0_MAGIC + encoded([*records, DataEnd(0), Footer(0, 0, 0)]) + MCAP0_MAGIC)
    return path


def encoded(records: Sequence[McapRecord]) -> bytes:
    """Return the bytes of records."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()


def chunk(data: bytes, compression: str = "zstd", size: int | None = None) -> Chunk:
    """Return a chunk of these bytes, which may declare another size."""
    packed = zstandard.ZstdCompressor().compress(data) if compression == "zstd" else data
    return Chunk(
        compression=compression,
        data=packed,
        message_start_time=0,
        message_end_time=0,
        uncompressed_crc=zlib.crc32(data),
        uncompressed_size=len(data) if size is None else size,
    )


def message(channel_id: int, data: bytes = b"", time_ns: int = 0) -> Message:
    """Return a message."""
    return Message(channel_id=channel_id, log_time=time_ns, data=data, publish_time=time_ns, sequence=0)
