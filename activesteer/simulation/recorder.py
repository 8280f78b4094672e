"""Recorder of a run: blocks of rows, and the data that repeat and draw the run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from activesteer.core.signals import ActuatorCommand, DriverCommand
from activesteer.errors import ParameterError, RecordingError, SimulationDiverged
from activesteer.native.records import Uncopyable
from activesteer.recording import McapWriter, Poses
from activesteer.vehicle import MAX_VALUE, RawRows, Tape, Vehicle

BLOCK_INTERVAL_S: Final = 0.3  # a killed process loses less than two blocks (0.6 s)
"""Length of a block, which is turned into channels and written at once [s]."""
MEMORY_BLOCK_INTERVAL_S: Final = 2.0
"""Length of a block without a file [s]: longer, because every block starts with cold caches, which costs 0.2 ms."""
PACED_BLOCK_INTERVAL_S: Final = 0.02
"""Length of a block in a run by the clock [s]: short, so that no step waits long for a block."""
POSE_INTERVAL_S: Final = 0.01
"""Time between two recorded poses of all bodies [s]."""
_TAPE_ROWS: Final = 125
"""Rows on the tape: few enough that they are still in the processor's caches when they are taken."""


@dataclass
class _Kept:
    """Rows and poses in memory. The first `referred_rows` rows are shared and never overwritten."""

    values: NDArray[np.float64]
    positions_m: NDArray[np.float64]
    quaternions: NDArray[np.float64]
    referred_rows: int = 0

    @classmethod
    def empty(cls, rows: int, poses: int, channels: int, bodies: int) -> Self:
        # By column, because rows are filled and read by column.
        return cls(np.empty((rows, channels), order="F"), np.empty((poses, bodies, 3)), np.empty((poses, bodies, 4)))

    def copied(self, rows: int, poses: int) -> Self:
        """Copy the first rows and poses, with the same capacity."""
        new = self.empty(len(self.values), len(self.positions_m), self.values.shape[1], self.positions_m.shape[1])
        new.values[:rows] = self.values[:rows]
        new.positions_m[:poses], new.quaternions[:poses] = self.positions_m[:poses], self.quaternions[:poses]
        return new


class RecordedRows(NamedTuple):
    """Rows of a recorder at the time when its state was saved."""

    kept: _Kept
    rows: int
    yaw_rad: float


class Recorder(Uncopyable):
    """Rows of one run, in memory and, if a writer is given, in a file that grows with the run."""

    def __init__(
        self,
        vehicle: Vehicle,
        steps: int,
        writer: McapWriter | None = None,
        *,
        keep: bool = True,
        interval_s: float | None = None,
    ) -> None:
        """Allocate the memory of the run."""
        self.channels = vehicle.channels.channels
        self._vehicle = vehicle
        self._writer = writer
        self._timestep_s = vehicle.timestep_s
        self.keeps_all = keep
        interval_s = interval_s or (MEMORY_BLOCK_INTERVAL_S if writer is None else BLOCK_INTERVAL_S)
        self._block_rows = min(max(1, round(interval_s / vehicle.timestep_s)), max(steps, 1))
        capacity = steps if keep else min(self._block_rows, steps)
        self._yaw_column = [channel.name for channel in self.channels].index("yaw_rad")
        self._yaw_rad = 0.0
        self._raw = vehicle.rows.empty(min(_TAPE_ROWS, self._block_rows))
        self._inputs = vehicle.channels.inputs(self._block_rows)
        self._pose_every = max(1, round(POSE_INTERVAL_S / vehicle.timestep_s))
        bodies = len(vehicle.body_names)
        self._kept = _Kept.empty(capacity, self._poses_before(capacity) + 1, len(self.channels), bodies)
        self.tape = Tape()
        self._tape = self.tape.record
        self._tape["row_bytes"], self._tape["pose_every"] = self._raw.sensordata.strides[0], self._pose_every
        self._tape_start = self._raw.sensordata.ctypes.data
        # Rows taken from the tape, rows turned into channels, and the number of the first row in memory.
        self._taken = self._flushed = self._first = 0
        self._usable = True
        self._rewind()

    @property
    def rows(self) -> int:
        """Number of recorded rows, each with the values at the start of its step."""
        return int(self._tape["rows"][0])

    def make_room(self) -> None:
        """Flush a full block, or copy the rows from a full tape."""
        if self.rows - self._flushed == self._block_rows:
            self.flush()
        elif not self._tape["room"][0]:
            self._take()

    def _rewind(self) -> None:
        """Direct the next row to the start of the tape, and the next pose to the end of the stored poses."""
        tape, kept = self._tape, self._kept
        self.tape.memory = self._raw, kept
        pose = self._poses_before(self._taken) - self._poses_before(self._first)
        tape["position"] = kept.positions_m.ctypes.data + pose * kept.positions_m.strides[0]
        tape["quaternion"] = kept.quaternions.ctypes.data + pose * kept.quaternions.strides[0]
        self._clear_tape()

    def _clear_tape(self) -> None:
        full = min(self._flushed + self._block_rows, self._first + len(self._kept.values))
        self._tape["room"] = min(len(self._raw.sensordata), full - self._taken)
        self._tape["row"] = self._tape_start

    def _take(self) -> None:
        """Copy the rows from the tape into memory."""
        taken, last = self._taken, self.rows
        if taken < last:
            values = self._kept.values[taken - self._first : last - self._first]
            inputs = self._inputs[taken - self._flushed : last - self._flushed]
            self._usable &= self._vehicle.channels.take(self._on_tape(last - taken), values, inputs)
            self._taken = last
            self._clear_tape()

    def _on_tape(self, count: int) -> RawRows:
        raw = self._raw
        return raw if count == len(raw.sensordata) else type(raw)(*(array[:count] for array in raw))

    def flush(self, *, checked: bool = True) -> None:
        """Convert the rows since the last flush into channels, and write them."""
        self._take()
        first, last = self._flushed, self.rows
        if first == last:
            return
        values = self._kept.values[first - self._first : last - self._first]
        self._usable &= self._vehicle.channels.compute(self._inputs[: last - first], values, self._yaw_rad)
        self._yaw_rad = float(values[-1, self._yaw_column])
        poses = self._poses_between(first, last)
        self._flushed = last
        if self._writer is not None:
            self._writer.write(self._times(first, last), values, poses.time_s, poses.positions_m, poses.quaternions)
        if not self.keeps_all:
            self._first = last
        self._rewind()
        usable, self._usable = self._usable and bool(np.isfinite(poses.positions_m).all()), True
        if checked and not usable:
            raise self._complaint(first, values, poses)

    def result(self) -> tuple[NDArray[np.float64], NDArray[np.float64], Poses]:
        """Return times, values and poses of all rows in memory (see `flush`)."""
        self.flush()
        first, last = self._first, self.rows
        self._kept.referred_rows = max(self._kept.referred_rows, last)
        return self._times(first, last), self._kept.values[: last - first], self._poses_between(first, last)

    def present(self, driver_command: DriverCommand, actuator_command: ActuatorCommand) -> dict[str, float]:
        """Return the values of all channels at the current time, by name, without recording them."""
        self._take()
        for raw, now in zip(self._raw, self._vehicle.rows.present(driver_command, actuator_command), strict=True):
            raw[0] = now[0]
        # After the rows of the block, because the yaw angle continues from them.
        row = self.rows - self._flushed
        values = np.empty((row + 1, len(self.channels)), order="F")
        channels, inputs = self._vehicle.channels, self._inputs
        channels.take(self._on_tape(1), values[row:], inputs[row : row + 1])
        channels.compute(inputs[: row + 1], values, self._yaw_rad)
        return {channel.name: float(value) for channel, value in zip(self.channels, values[row], strict=True)}

    def save_state(self) -> RecordedRows:
        """Return the rows recorded so far. Later rows do not change them."""
        self.flush()
        self._kept.referred_rows = max(self._kept.referred_rows, self.rows)
        return RecordedRows(self._kept, self.rows, self._yaw_rad)

    def check_state(self, state: RecordedRows) -> None:
        """Check that this recorder can go back to the rows of a saved state."""
        if self._writer is not None:
            raise RecordingError("a run that is being written to a file cannot go back to a saved state")
        if state.kept.values.shape != self._kept.values.shape:
            raise ParameterError("holds only the last rows, because its run was written to a file", key="state")

    def restore_state(self, state: RecordedRows) -> None:
        """Go back to the rows of a saved state (see `check_state`)."""
        self.check_state(state)
        if state.kept is not self._kept or state.kept.referred_rows > state.rows:
            self._kept = state.kept.copied(state.rows, self._poses_before(state.rows))
            self._kept.referred_rows = state.rows
        self._tape["rows"] = self._taken = self._flushed = state.rows
        self._usable = True
        self._yaw_rad = state.yaw_rad
        self._rewind()

    def _complaint(self, first: int, values: NDArray[np.float64], poses: Poses) -> SimulationDiverged:
        """Return the error for a block with a value that is not finite."""
        wrong = ~(np.abs(values) <= MAX_VALUE)
        if wrong.any():
            row = int(np.argmax(wrong.any(axis=1)))
            column = int(np.argmax(wrong[row]))
            name, time_s = self.channels[column].name, (first + row) * self._timestep_s
            problem = f"{name} is {values[row, column]:g}"
        else:
            pose, body = np.argwhere(~np.isfinite(poses.positions_m).all(axis=2))[0]
            name, time_s = poses.names[body], poses.time_s[pose]
            problem = f"the position of {name} is not finite"
        return SimulationDiverged(f"{problem} at {time_s:.3f} s", value=name)

    def _times(self, first: int, last: int) -> NDArray[np.float64]:
        return np.asarray(np.arange(first, last) * self._timestep_s, dtype=np.float64)

    def _poses_before(self, row: int) -> int:
        return -(-row // self._pose_every)

    def _poses_between(self, first: int, last: int) -> Poses:
        every, kept = self._pose_every, self._poses_before(self._first)
        begin, end = self._poses_before(first), self._poses_before(last)
        times = np.asarray(np.arange(begin, end) * (every * self._timestep_s), dtype=np.float64)
        rows = slice(begin - kept, end - kept)
        return Poses(times, self._vehicle.body_names, self._kept.positions_m[rows], self._kept.quaternions[rows])
