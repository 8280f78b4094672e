"""Collects what a run does, step by step, and turns it into channels block by block."""

from __future__ import annotations

import struct
from operator import attrgetter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.errors import SimulationDiverged
from activesteer.recording import McapWriter, Poses
from activesteer.signals import Channel, DriverCommand, SteerCommand
from activesteer.vehicle import Vehicle

BLOCK_INTERVAL_S: Final = 0.5
"""How much of a run is turned into channels and written at once [s].

A killed process loses less than two blocks, a second: the one that it fills, and the one that is being written.
"""
POSE_INTERVAL_S: Final = 0.01
"""Time between two recorded poses of all bodies [s]."""
MAX_VALUE: Final = float(np.finfo(np.float32).max)
"""Most that a recorded value may be: files keep most channels to 32 bit."""

_DRIVER_CHANNELS: Final = {
    "front_steer_demand_rad": Channel(
        "front_steer_demand_rad", "rad", "the driver's demand at the road wheel", "control"
    ),
    "drive_torque_demand_Nm": Channel(
        "drive_torque_demand_Nm", "Nm", "drive torque demanded, all wheels together", "control"
    ),
    "brake_pedal": Channel("brake_pedal", "", "brake pedal position, 0 to 1", "control"),
    "saturated": Channel(
        "driver_saturated", "", "1 where the steering is at its lock or the engine at its limit", "control"
    ),
}
"""Field of `DriverCommand` -> its channel."""
_CONTROLLER_CHANNELS: Final = {
    "rear_steer_demand_rad": Channel(
        "rear_steer_demand_rad", "rad", "rear angle that the controller demands", "control"
    ),
    "superposition_demand_rad": Channel(
        "superposition_demand_rad", "rad", "angle that the controller adds at the front wheels", "control"
    ),
    "yaw_rate_desired_radps": Channel(
        "yaw_rate_desired_radps", "rad/s", "yaw rate that the controller steers for", "control"
    ),
    "prediction_rad": Channel("prediction_rad", "rad", "feed-forward part of the controller's angle", "control"),
    "correction_rad": Channel("correction_rad", "rad", "feedback part of the controller's angle", "control"),
    "saturated": Channel("controller_saturated", "", "1 where a limit of the controller is active", "control"),
}
"""Field of `SteerCommand` -> its channel."""
CONTROL_CHANNELS: Final = (*_DRIVER_CHANNELS.values(), *_CONTROLLER_CHANNELS.values())
_CONTROL_ROW: Final = struct.Struct(f"{len(CONTROL_CHANNELS)}d")
_driver_row, _controller_row = attrgetter(*_DRIVER_CHANNELS), attrgetter(*_CONTROLLER_CHANNELS)


class Recorder:
    """Rows of one run, in memory and, where a writer is given, in a file as the run goes on.

    Attributes:
        channels: The table of channels.
        row_address: Where the vehicle leaves the row of the next step.
    """

    def __init__(self, vehicle: Vehicle, steps: int, writer: McapWriter | None = None, *, keep: bool = True) -> None:
        """Allocates everything.

        Args:
            vehicle: What is recorded.
            steps: Most steps that will come.
            writer: File to write to.
            keep: Whether all rows stay in memory; else only the block that is being filled does.
        """
        self.channels = channels_of(vehicle)
        vehicle.channels.restart()
        self._vehicle = vehicle
        self._writer = writer
        self._timestep_s = vehicle.timestep_s
        self._keep = keep
        self._block_rows = max(1, round(BLOCK_INTERVAL_S / vehicle.timestep_s))
        capacity = steps if keep else min(self._block_rows, steps)
        # By column, because that is how it is filled and read.
        self._values = np.empty((capacity, len(self.channels)), order="F")
        self._raw = vehicle.raw_rows(self._block_rows)
        self._control = np.empty((len(self._raw.sensordata), len(CONTROL_CHANNELS)))
        self._control_memory = self._control.data
        self.row_address = self._block_address = self._raw.sensordata.ctypes.data
        self._row_bytes = self._raw.sensordata.strides[0]
        self._pose_every = max(1, round(POSE_INTERVAL_S / vehicle.timestep_s))
        data, bodies = vehicle.data, len(vehicle.body_names)
        poses = -(-capacity // self._pose_every) + 1
        self._positions = np.empty((poses, bodies, 3))
        self._quaternions = np.empty((poses, bodies, 4))
        # Without the world, which is the engine's body 0.
        self._xpos, self._xquat = data.xpos[1:], data.xquat[1:]
        # Rows so far, those of them that are channels already, and the first one in memory.
        self._rows = self._flushed = self._first = 0

    def record(self, command: DriverCommand, steer: SteerCommand) -> None:
        """Takes the row of the step that was just made, which the vehicle has left at `row_address`.

        Its values are those of the instant at which the step began.

        Args:
            command: What the driver did.
            steer: What the controller asked for.
        """
        count = self._rows
        row = count - self._flushed
        _CONTROL_ROW.pack_into(
            self._control_memory, row * _CONTROL_ROW.size, *_driver_row(command), *_controller_row(steer)
        )
        if count % self._pose_every == 0:
            pose = count // self._pose_every - self._poses_before(self._first)
            self._positions[pose] = self._xpos
            self._quaternions[pose] = self._xquat
        self._rows = count + 1
        self.row_address += self._row_bytes
        if row + 1 == self._block_rows:
            self.flush()

    def flush(self, *, checked: bool = True) -> None:
        """Turns the rows since the last flush into channels, and writes them.

        Args:
            checked: Whether a value that is not finite is an error; it is recorded in any case.

        Raises:
            SimulationDiverged: a channel or a pose is not finite, or larger than a file can hold.
        """
        first, last = self._flushed, self._rows
        count = last - first
        if count == 0:
            return
        values = self._values[first - self._first : last - self._first]
        split = len(self.channels) - len(CONTROL_CHANNELS)
        self._vehicle.channels.evaluate(type(self._raw)(*(rows[:count] for rows in self._raw)), values[:, :split])
        values[:, split:] = self._control[:count]
        poses = self._poses_between(first, last)
        self._flushed = last
        self.row_address = self._block_address
        if self._writer is not None:
            self._writer.write(self._times(first, last), values, poses.time_s, poses.positions_m, poses.quaternions)
        if not self._keep:
            self._first = last
        if checked:
            self._check(first, values, poses)

    def result(self) -> tuple[NDArray[np.float64], NDArray[np.float64], Poses]:
        """Times, values and poses of all rows that are kept; see `flush`."""
        self.flush()
        first, last = self._first, self._rows
        return self._times(first, last), self._values[: last - first], self._poses_between(first, last)

    def _check(self, first: int, values: NDArray[np.float64], poses: Poses) -> None:
        # NaN compares as false, and is what `max` and `min` return where there is one.
        if values.max() <= MAX_VALUE and values.min() >= -MAX_VALUE and np.isfinite(poses.positions_m).all():
            return
        wrong = ~(np.abs(values) <= MAX_VALUE)
        if wrong.any():
            row = int(np.argmax(wrong.any(axis=1)))
            column = int(np.argmax(wrong[row]))
            time_s, what = (first + row) * self._timestep_s, f"{self.channels[column].name} is {values[row, column]:g}"
        else:
            pose, body = np.argwhere(~np.isfinite(poses.positions_m).all(axis=2))[0]
            time_s, what = poses.time_s[pose], f"the position of {poses.names[body]} is not finite"
        msg = f"{what} at {time_s:.3f} s"
        raise SimulationDiverged(msg)

    def _times(self, first: int, last: int) -> NDArray[np.float64]:
        return np.asarray(np.arange(first, last) * self._timestep_s, dtype=np.float64)

    def _poses_before(self, row: int) -> int:
        return -(-row // self._pose_every)

    def _poses_between(self, first: int, last: int) -> Poses:
        every, kept = self._pose_every, self._poses_before(self._first)
        begin, end = self._poses_before(first), self._poses_before(last)
        times = np.asarray(np.arange(begin, end) * (every * self._timestep_s), dtype=np.float64)
        rows = slice(begin - kept, end - kept)
        return Poses(times, self._vehicle.body_names, self._positions[rows], self._quaternions[rows])


def channels_of(vehicle: Vehicle) -> tuple[Channel, ...]:
    """All channels that a run with this vehicle records."""
    return (*vehicle.channels.channels, *CONTROL_CHANNELS)
