"""Writer of a recording: it locks the target and streams blocks into an MCAP file."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Final, Self

import numpy as np
from numpy.typing import ArrayLike

from activesteer.core import limits
from activesteer.core.files import reading, shown_path, writing
from activesteer.core.signals import Channel
from activesteer.core.version import __version__
from activesteer.errors import RecordingError
from activesteer.recording.chunks import BlockEncoder, few_messages
from activesteer.recording.container import McapFile
from activesteer.recording.contents import (
    EVENTS_TOPIC,
    FORMAT_RECORD,
    FORMAT_VERSION,
    LIBRARY,
    METRICS_RECORD,
    RESULT_RECORD,
    RUN_RECORD,
    SCENE_TOPIC,
    STATE_TOPIC,
    TRANSFORMS_TOPIC,
    Event,
    ScenePart,
    check_bodies,
    check_names,
    encode_event,
    encode_scene,
    events_of,
    is_recording_start,
    metadata_texts,
)
from activesteer.recording.schemas import (
    LOG_SCHEMA,
    SCENE_SCHEMA,
    TRANSFORMS_SCHEMA,
    ChannelTable,
    foxglove_schema,
    nanoseconds,
    shaped,
    state_schema,
)

_START_BYTES: Final = 64


def check_target(path: str | Path, *, overwrite: bool = True) -> None:
    """Check that a recording may be written to a path, without changing anything."""
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
            f"cannot write {path}: it exists already and is not a recording of activesteer; delete or rename it",
            value=path,
        )


def open_target(path: Path, *, overwrite: bool) -> BinaryIO:
    """Create a locked file in place of an existing one. Processes that have opened the old file can still read it."""
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


_ROWS_PER_CHUNK = 1000
_CHUNK_BYTES = limits.MAX_CHUNK_BYTES // 8
"""Size of a chunk of very wide rows without poses."""
_ERROR_LETTERS = 2000
_BLOCKS_IN_FLIGHT = 1  # More blocks would be lost by a kill, and would fill memory with a slow disk.


class McapWriter:
    """Stream of channel values and poses into an MCAP file that can be read at any time.

    `write` encodes in the calling thread. A separate thread compresses and writes, because zstd and file output
    release the interpreter lock. The next `write` or `close` raises an error of that thread.

    The context manager closes the file in every case. After an exception it marks the file with `complete = false` and
    the error.
    """

    def __init__(
        self,
        path: str | Path,
        channels: Iterable[Channel],
        body_names: Sequence[str] = (),
        metadata: Mapping[str, object] | None = None,
        attachments: Mapping[str, bytes] | None = None,
        scene: Iterable[ScenePart] = (),
        *,
        overwrite: bool = True,
    ) -> None:
        """Open the file and write the data that are known before the run.

        Args:
            path: File to write.
            channels: Channels in the order of the columns of `values`; the channels of a group share a topic.
            body_names: Names of the bodies whose poses are recorded.
            metadata: Everything needed to repeat the run; values must be representable in JSON.
            attachments: Name -> file to keep with the recording.
            scene: Shape of the car: solids in body frames, and links between bodies.
            overwrite: Whether an existing recording may be replaced; any other file never is.

        Raises:
            RecordingError: the file cannot be written, or a channel, body, metadata value or primitive is invalid.
        """
        self.path = Path(path)
        self.channels = ChannelTable(channels)
        self.body_names = tuple(body_names)
        check_bodies(self.body_names)
        limits.check_count(len(self.channels), limits.MAX_CHANNELS, "channels", RecordingError)
        check_names(list(attachments or {}), "attachments", limits.MAX_OTHER_RECORDS)
        size = sum(map(len, (attachments or {}).values()))
        limits.check_count(size, limits.MAX_OTHER_BYTES // 2, "bytes", RecordingError, key="attachments")
        texts, metrics = metadata_texts(metadata or {})
        events = events_of(metadata or {})
        scene_data = encode_scene(scene)
        self._last_row_ns = self._last_pose_ns = -1
        self._row_count = 0
        self._saved_ns = -1
        self._events_id: int | None = None
        self._pending: list[tuple[int, Future[None]]] = []
        self._stream = open_target(self.path, overwrite=overwrite)
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="mcap-writer")
        self._closed = False
        try:
            self._file = McapFile(self._stream, LIBRARY + __version__)
            self._begin(texts, metrics, attachments or {}, scene_data)
            if events:
                self.write_events(events)
        except BaseException as error:
            self._abandon()
            if self.path.is_file():  # without rows, it cannot be opened
                with suppress(OSError):
                    self.path.unlink()
            if isinstance(error, OSError):
                raise self._failure(error) from error
            raise

    def _begin(
        self, texts: Mapping[str, str], metrics: Mapping[str, str], attachments: Mapping[str, bytes], scene: bytes
    ) -> None:
        table = list(self.channels)
        group_ids: dict[str, int] = {}
        for group, columns in self.channels.groups().items():
            members = [table[column] for column in columns]
            described = {
                table[column].name: json.dumps(
                    {"unit": table[column].unit, "meaning": table[column].meaning, "column": column},
                    ensure_ascii=False,
                )
                for column in columns
            }
            group_ids[group] = self._file.add_topic(STATE_TOPIC + group, *state_schema(group, members), described)
        bodies = {"bodies": json.dumps(self.body_names)}
        transforms_id = self._file.add_topic(TRANSFORMS_TOPIC, TRANSFORMS_SCHEMA, foxglove_schema(), bodies)
        scene_id = self._file.add_topic(SCENE_TOPIC, SCENE_SCHEMA, foxglove_schema(), {}) if scene else None
        for name, data in attachments.items():
            self._file.add_attachment(name, bytes(data))
        self._file.add_metadata(RUN_RECORD, texts)
        if metrics:
            self._file.add_metadata(METRICS_RECORD, metrics)
        # Written last: its presence tells the reader that the records before it are complete.
        self._file.add_metadata(FORMAT_RECORD, {"version": str(FORMAT_VERSION)})
        self._encoder = BlockEncoder(self.channels, self.body_names, group_ids, transforms_id)
        if scene_id is not None:
            self._file.add_chunk(few_messages(scene_id, [(0, scene)]))
        self._stream.flush()

    def write(
        self,
        time_s: ArrayLike,
        values: ArrayLike,
        pose_time_s: ArrayLike = (),
        positions_m: ArrayLike = (),
        quaternions: ArrayLike = (),
    ) -> None:
        """Write a block, preferably of about one simulated second.

        The arrays may be reused after the call.

        A value above `limits.MAX_NUMBER` is written as infinity of its sign.

        Args:
            time_s: Time of each row [s], >= 0, increasing from row to row and from block to block, shape (n,).
            values: Channel values, shape (n, number of channels).
            pose_time_s: Time of each set of poses [s], increasing, shape (k,).
            positions_m: Positions of the body frames in the world [m], shape (k, number of bodies, 3).
            quaternions: Their orientations, w x y z, shape (k, number of bodies, 4).

        Raises:
            RecordingError: a shape or a time is wrong, the file is closed, or a block could not be written.
        """
        if self._closed:
            raise RecordingError(f"{self.path} is closed", value=self.path)
        row_ns = nanoseconds(time_s, "time_s", self._last_row_ns)
        pose_ns = nanoseconds(pose_time_s, "pose_time_s", self._last_pose_ns)
        rows, poses, bodies = len(row_ns), len(pose_ns), len(self.body_names)
        values = shaped(values, "values", (rows, len(self.channels)))
        if (huge := np.abs(values) > limits.MAX_NUMBER).any():  # the run diverges
            values = np.where(huge, np.copysign(np.inf, values), values)
        positions = shaped(positions_m, "positions_m", (poses, bodies, 3))
        turns = shaped(quaternions, "quaternions", (poses, bodies, 4))
        self._row_count += rows
        limits.check_count(self._row_count, limits.MAX_ROWS, "rows", RecordingError, file=str(self.path))
        pose_done = 0
        piece_rows = min(_ROWS_PER_CHUNK, max(1, _CHUNK_BYTES // max(1, self._encoder.row_bytes)))
        for start in range(0, max(rows, min(poses, 1)), piece_rows):
            stop = start + piece_rows
            # A piece takes the poses up to its last row; the last piece takes all others.
            pose_stop = poses if stop >= rows else int(np.searchsorted(pose_ns, row_ns[stop - 1], side="right"))
            piece, pose_piece = slice(start, stop), slice(pose_done, pose_stop)
            pose_done = pose_stop
            chunk = self._encoder.encode(
                row_ns[piece], values[piece], pose_ns[pose_piece], positions[pose_piece], turns[pose_piece]
            )
            self._await(_BLOCKS_IN_FLIGHT - 1)
            self._pending.append((chunk.end_ns, self._thread.submit(self._file.add_chunk, chunk)))
        if rows:
            self._last_row_ns = int(row_ns[-1])
        if poses:
            self._last_pose_ns = int(pose_ns[-1])

    def write_events(self, events: Sequence[Event]) -> None:
        """Write events, in the order of their times.

        Raises:
            RecordingError: the file is closed, or cannot be written.
        """
        if self._closed:
            raise RecordingError(f"{self.path} is closed", value=self.path)
        self._await(0)
        try:
            if self._events_id is None:
                self._events_id = self._file.add_topic(EVENTS_TOPIC, LOG_SCHEMA, foxglove_schema(), {})
            self._file.add_chunk(few_messages(self._events_id, [encode_event(event) for event in events]))
        except OSError as error:
            raise self._failure(error) from error

    def flush(self) -> Path:
        """Wait until all blocks are in the file.

        Return its path.

        Raises:
            RecordingError: a block could not be written.
        """
        self._await(0)
        return self.path

    def close(self, metadata: Mapping[str, object] | None = None) -> None:
        """Write the data that are known after the run, and end the file.

        A second call does nothing.

        Args:
            metadata: Further metadata, such as how the run ended; the key `metrics` holds the metrics by name.

        Raises:
            RecordingError: a metadata value cannot be stored, and the file stays open; or the file could not be
                written, and it holds what was written before.
        """
        if self._closed:
            return
        texts, metrics = metadata_texts(metadata or {})
        try:
            self._await(0)
            try:
                if texts:
                    self._file.add_metadata(RESULT_RECORD, texts)
                if metrics:
                    self._file.add_metadata(METRICS_RECORD, metrics)
                self._file.finish()
                self._check_place()
                self._stream.close()
            except OSError as error:
                raise self._failure(error) from error
        finally:
            self._abandon()

    def _check_place(self) -> None:
        """Check that the written file is still at its path."""
        try:
            there = os.path.samestat(self.path.stat(), os.fstat(self._stream.fileno()))
        except FileNotFoundError:
            there = False
        if not there:
            raise RecordingError(
                f"{shown_path(self.path)} was deleted or replaced during the run: nothing is saved",
                value=self.path,
            )

    def __enter__(self) -> Self:
        """Return the open writer."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Close the file, and mark it as incomplete after an exception."""
        if error is None:
            self.close()
            return
        try:
            # An exception of user code may have a text of any length.
            text = f"{type(error).__name__}: {error}"[:_ERROR_LETTERS].encode(errors="replace").decode()
            self.close({"complete": False, "error": text})
        except RecordingError as second:
            error.add_note(f"The recording could not be ended properly either: {second}")

    def _await(self, maximum: int) -> None:
        """Wait until at most `maximum` blocks are being written, and raise any error of writing them."""
        while len(self._pending) > maximum:
            end_ns, future = self._pending[0]
            try:
                future.result()
            except OSError as error:
                failure = self._failure(error)
                self._abandon()
                raise failure from error
            self._saved_ns = end_ns
            del self._pending[0]

    def _failure(self, error: OSError) -> RecordingError:
        saved = f"; saved up to {self._saved_ns * 1e-9:.3f} s" if self._saved_ns >= 0 else ""
        return RecordingError(f"cannot write {self.path}: {error.strerror or error}{saved}", value=self.path)

    def _abandon(self) -> None:
        """Release thread and file without completing the file."""
        self._closed = True
        self._thread.shutdown(wait=True, cancel_futures=True)
        with suppress(OSError):  # the caller handles the first error
            self._stream.close()
