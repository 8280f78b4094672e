"""MCAP file that is written in finished chunks.

`mcap.writer.Writer` takes one message at a time. With three messages per row it costs 24 us per row under the
interpreter lock, more than the simulation. Here a chunk arrives as the bytes of all messages and of their index, both
made with numpy. The record classes of the `mcap` library write all other records.

Source: MCAP format specification, https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from typing import Any, BinaryIO, NamedTuple

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import MCAP0_MAGIC

from activesteer.core import limits

# Recordings of driven cars take four fifths of the time of level 1, and are up to 2 % larger. Level 3 takes twice the
# time and saves 3 %.
_ZSTD = zstandard.ZstdCompressionParameters.from_level(
    1, strategy=zstandard.STRATEGY_FAST, hash_log=12, min_match=5, target_length=1
)
"""Level 1 with a table that fits into the nearest cache."""
_RECORD_HEAD = 9
_CHUNK_HEAD = struct.Struct("<BQQQQII")
"""Opcode and length of a chunk record, its two times, size and checksum of its messages, length of `compression`."""


class ChunkData(NamedTuple):
    """Messages of a chunk, encoded."""

    start_ns: int  # log time of the first message [ns]
    end_ns: int  # log time of the last message [ns]
    records: bytes  # message records, uncompressed
    indexes: Mapping[int, tuple[int, bytes]]  # MCAP channel id -> number of messages, and MessageIndex record


class McapFile:
    """Writer of the records and the summary of an MCAP file."""

    def __init__(self, stream: BinaryIO, library: str) -> None:
        """Write magic and header."""
        self._stream = stream
        self._position = 0
        self._crc = 0
        self._compressor = zstandard.ZstdCompressor(compression_params=_ZSTD)
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._put(MCAP0_MAGIC)
        self._put_record(Header(profile="", library=library))

    def add_topic(self, topic: str, schema_name: str, schema: bytes, metadata: Mapping[str, str]) -> int:
        """Write a protobuf schema and the channel that uses it, and return the channel id."""
        number = len(self._channels) + 1
        self._schemas.append(Schema(id=number, data=schema, encoding=SchemaEncoding.Protobuf, name=schema_name))
        self._channels.append(
            Channel(
                id=number,
                topic=topic,
                message_encoding=MessageEncoding.Protobuf,
                metadata=dict(metadata),
                schema_id=number,
            )
        )
        self._put_record(self._schemas[-1])
        self._put_record(self._channels[-1])
        return number

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        offset = self._position
        length = self._put_record(Metadata(name=name, metadata=dict(values)))
        self._metadata.append(MetadataIndex(offset=offset, length=length, name=name))

    def add_attachment(self, name: str, data: bytes) -> None:
        """Write an attachment at time zero."""
        about: Any = {"create_time": 0, "log_time": 0, "name": name, "media_type": "application/octet-stream"}
        offset = self._position
        length = self._put_record(Attachment(**about, data=data))
        self._attachments.append(AttachmentIndex(**about, offset=offset, length=length, data_size=len(data)))

    def add_chunk(self, chunk: ChunkData) -> None:
        """Compress and write a chunk and the index of its messages in one call, and flush the stream."""
        # After each checksum and write, this thread waits for the interpreter lock and takes it from the simulation.
        records = chunk.records
        compressed, compression = self._compressor.compress(records), "zstd"
        if len(records) > limits.MAX_EXPANSION * len(compressed):
            compressed, compression = records, ""
        head = _CHUNK_HEAD.pack(
            Opcode.CHUNK,
            _CHUNK_HEAD.size - _RECORD_HEAD + len(compression) + 8 + len(compressed),
            chunk.start_ns,
            chunk.end_ns,
            len(records),
            zlib.crc32(records),
            len(compression),
        )
        pieces = [head, compression.encode(), len(compressed).to_bytes(8, "little"), compressed]
        start, length = self._position, sum(map(len, pieces))
        offsets: dict[int, int] = {}
        end = start + length
        for number, (count, index) in chunk.indexes.items():
            offsets[number] = end
            self._counts[number] = self._counts.get(number, 0) + count
            pieces.append(index)
            end += len(index)
        self._put(b"".join(pieces))
        self._chunks.append(
            ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression=compression,
                compressed_size=len(compressed),
                message_end_time=chunk.end_ns,
                message_index_length=end - start - length,
                message_index_offsets=offsets,
                message_start_time=chunk.start_ns,
                uncompressed_size=len(records),
            )
        )
        self._stream.flush()

    def finish(self) -> None:
        """Write the end of the data section, the summary and the footer."""
        self._put_record(DataEnd(self._crc))
        summary_start = self._position
        summary = RecordBuilder()
        groups = (
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        )
        offsets: list[SummaryOffset] = []
        for opcode, records in groups:
            start = summary.count
            for record in records:
                record.write(summary)
            if records:
                offsets.append(SummaryOffset(opcode, summary_start + start, summary.count - start))
        offsets_start = summary_start + summary.count
        for offset in offsets:
            offset.write(summary)
        data = summary.end()
        footer = RecordBuilder()
        Footer(summary_start=summary_start, summary_offset_start=offsets_start, summary_crc=0).write(footer)
        without_crc = footer.end()[:-4]
        self._put(data + without_crc + zlib.crc32(data + without_crc).to_bytes(4, "little") + MCAP0_MAGIC)
        self._stream.flush()

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=max((chunk.message_end_time for chunk in self._chunks), default=0),
            message_start_time=min((chunk.message_start_time for chunk in self._chunks), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _put_record(self, record: McapRecord) -> int:
        builder = RecordBuilder()
        record.write(builder)
        data = builder.end()
        self._put(data)
        return len(data)

    def _put(self, data: bytes) -> None:
        self._crc = zlib.crc32(data, self._crc)
        self._stream.write(data)
        self._position += len(data)
