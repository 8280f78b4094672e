"""Rows of a recording, read from the file on demand by channel or by block."""

from __future__ import annotations

import os
import struct
import weakref
import zlib
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Sequence
from io import BytesIO
from itertools import count
from typing import Final, NamedTuple

import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Chunk
from numpy.typing import NDArray

from activesteer.core import limits
from activesteer.core.limits import LIMIT_M
from activesteer.core.signals import Channel
from activesteer.errors import RecordingError
from activesteer.recording.chunks import Block, BlockDecoder

MAX_CACHED_BYTES: Final = 3 * 2**27
"""Largest size of the cached channels of all open files together."""
_READ_BYTES: Final = 2**27
"""Size of one read operation, which covers adjacent channels, since any channel needs the whole file decompressed."""
_SMALL_BYTES: Final = 2**16
"""Size up to which a chunk may be compressed by any ratio."""

BROKEN: Final = (
    McapError, struct.error, UnicodeDecodeError, ValueError, OverflowError, RuntimeError, MemoryError,
    zstandard.ZstdError, OSError,
)  # fmt: skip
"""Exceptions that the libraries raise for broken bytes."""


class Poses(NamedTuple):
    """Poses of the bodies in the world over time.

    Attributes:
        time_s: Time [s], shape (k,).
        names: Names of the bodies.
        positions_m: Positions of the body frames [m], shape (k, number of bodies, 3).
        quaternions: Orientations, w x y z, shape (k, number of bodies, 4).
    """

    time_s: NDArray[np.float64]
    names: tuple[str, ...]
    positions_m: NDArray[np.float64]
    quaternions: NDArray[np.float64]

    def usable(self) -> NDArray[np.bool_]:
        """Return the mask of the poses that can be drawn, with plausible positions and orientations."""
        near = (np.abs(self.positions_m) <= LIMIT_M).all(axis=(1, 2))
        size = np.linalg.norm(self.quaternions, axis=2)
        return near & ((size > _SMALLEST) & (size < 1.0 / _SMALLEST)).all(axis=1)


_SMALLEST: Final = 1e-6
"""Smallest length of a quaternion that still has a direction."""


class Place(NamedTuple):
    """Position and contents of a chunk."""

    start: int  # first byte of the content of its record
    length: int  # length of the content [bytes]
    crc: int  # checksum of its messages
    rows: int = 0
    poses: int = 0


def read_bytes(descriptor: int, start: int, length: int) -> bytes:
    """Read bytes of an open file."""
    pieces = []
    while length > 0:
        piece = os.pread(descriptor, length, start)
        if not piece:
            raise RecordingError(f"the file ends at byte {start}")
        pieces.append(piece)
        start, length = start + len(piece), length - len(piece)
    return b"".join(pieces)


def messages_of(content: bytes) -> tuple[bytes, int]:
    """Decompress a chunk up to its declared size, and return its messages and their checksum."""
    try:
        chunk = Chunk.read(ReadDataStream(BytesIO(content)))
        size, packed = chunk.uncompressed_size, len(chunk.data)
        if size > limits.MAX_CHUNK_BYTES or size > max(_SMALL_BYTES, limits.MAX_EXPANSION * packed):
            raise RecordingError(f"a chunk of {packed} bytes would become {size}")
        data = _decompressed(chunk.compression, chunk.data, size)
    except BROKEN as error:
        raise RecordingError(f"{type(error).__name__}: {error}") from None
    if len(data) != size:
        raise RecordingError(f"a chunk has {len(data)} bytes instead of {size}")
    crc = zlib.crc32(data)
    if chunk.uncompressed_crc not in (0, crc):
        raise RecordingError(f"a checksum is {crc} instead of {chunk.uncompressed_crc}")
    return data, crc


def _decompressed(compression: str, data: bytes, size: int) -> bytes:
    if compression == "":
        return data
    if compression == "zstd":
        # A frame may declare another size than its record, and that size would be allocated.
        if zstandard.frame_content_size(data) not in (-1, size):
            raise RecordingError("a chunk declares a wrong size")
        return zstandard.ZstdDecompressor(max_window_size=limits.MAX_CHUNK_BYTES).decompress(data, max_output_size=size)
    if compression == "lz4":
        return lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    raise RecordingError(f"a chunk has the compression {compression!r:.40}; known: zstd and lz4")


def values_of(blocks: Iterable[Block], rows: int, channels: int) -> NDArray[np.float64]:
    """Return all values of blocks, shape (rows, channels), with contiguous columns."""
    values = np.empty((rows, channels), order="F")
    done = 0
    for block in blocks:
        stop = done + len(block.row_ns)
        for column, part in block.columns.items():
            values[done:stop, column] = part
        done = stop
    return values


def poses_of(blocks: Iterable[Block], sets: int, body_names: tuple[str, ...]) -> Poses:
    """Return all poses of blocks."""
    bodies = len(body_names)
    poses = Poses(np.empty(sets), body_names, np.empty((sets, bodies, 3)), np.empty((sets, bodies, 4)))
    done = 0
    for block in blocks:
        stop = done + len(block.pose_ns)
        poses.time_s[done:stop] = block.pose_ns / 1e9
        poses.positions_m[done:stop] = block.positions_m
        poses.quaternions[done:stop] = block.quaternions
        done = stop
    return poses


class FileRows:
    """Rows of an open file. They stay valid if the file is replaced or deleted, but not if it is changed."""

    def __init__(
        self, descriptor: int, decoder: BlockDecoder, channels: Sequence[Channel], places: list[Place]
    ) -> None:
        """Take ownership of an open file."""
        self._descriptor = descriptor
        self._decoder = decoder
        self._types = [np.dtype("<f4" if channel.single else "<f8") for channel in channels]
        self._places = places
        self._rows = sum(place.rows for place in places)
        self._token = next(_tokens)
        weakref.finalize(self, _release, descriptor, self._token)

    def blocks(self) -> Iterator[Block]:
        """Yield the decoded chunks in the order of the file."""
        for place in self._places:
            try:
                data, crc = messages_of(read_bytes(self._descriptor, place.start, place.length))
            except (RecordingError, OSError) as error:
                raise RecordingError(f"the file was changed since it was opened: {error}") from None
            if crc != place.crc:
                raise RecordingError("the file was changed since it was opened")
            yield self._decoder.decode(data)

    def __len__(self) -> int:
        """Return the number of rows."""
        return self._rows

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of the bodies whose poses are recorded."""
        return self._decoder.body_names

    def channel(self, column: int) -> NDArray[np.float64]:
        """Return the values of a channel, shape (n,)."""
        if (self._token, column) in _cached:
            _cached.move_to_end((self._token, column))
            return _cached[self._token, column].astype(np.float64)
        columns = self._neighbours(column)
        return self._load(columns)[columns.index(column)].astype(np.float64)

    def at(self, rows: NDArray[np.intp]) -> NDArray[np.float64]:
        """Return the values of all channels in ascending rows, shape (number of rows, channels)."""
        values = np.empty((len(rows), len(self._types)), order="F")
        done = before = 0
        for block in self.blocks():
            stop = int(np.searchsorted(rows, before + len(block.row_ns)))
            for column, part in block.columns.items():
                values[done:stop, column] = part[rows[done:stop] - before]
            done, before = stop, before + len(block.row_ns)
        return values

    def values(self) -> NDArray[np.float64]:
        """Return the values of all channels, shape (n, number of channels)."""
        return values_of(self.blocks(), self._rows, len(self._types))

    def poses(self) -> Poses:
        """Return the poses of all bodies."""
        return poses_of(self.blocks(), sum(place.poses for place in self._places), self._decoder.body_names)

    def _neighbours(self, column: int) -> list[int]:
        """Return the columns that share their messages with a column."""
        width = max(1, _READ_BYTES // (4 * max(self._rows, 1)))  # most channels have 32 bit
        first = column - column % width
        return list(range(first, min(first + width, len(self._types))))

    def _load(self, columns: list[int]) -> list[NDArray]:
        arrays = [np.empty(self._rows, self._types[column]) for column in columns]
        done = 0
        for block in self.blocks():
            stop = done + len(block.row_ns)
            for column, array in zip(columns, arrays, strict=True):
                array[done:stop] = block.columns[column]
            done = stop
        for column, array in zip(columns, arrays, strict=True):
            _keep(self._token, column, array)
        return arrays


_cached: Final[OrderedDict[tuple[int, int], NDArray]] = OrderedDict()
"""Cached channels by token of an open file and by column, the least recently used first."""
_tokens = count()


def _keep(token: int, column: int, array: NDArray) -> None:
    _cached[token, column] = array
    while sum(each.nbytes for each in _cached.values()) > MAX_CACHED_BYTES:
        _cached.popitem(last=False)


def _release(descriptor: int, token: int) -> None:
    os.close(descriptor)
    for key in [key for key in _cached if key[0] == token]:
        del _cached[key]
