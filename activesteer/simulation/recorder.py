"""Collects what a run does, step by step, and turns it into channels block by block."""

from __future__ import annotations

from operator import attrgetter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.recording import McapWriter, Poses
from activesteer.signals import Channel, DriverCommand, SteerCommand
from activesteer.vehicle import Vehicle

BLOCK_INTERVAL_S: Final = 0.5
"""How much of a run is turned into channels and written at once [s].

A killed process loses less than two blocks, a second: the one that it fills, and the one that is being written.
"""
POSE_INTERVAL_S: Final = 0.01
"""Time between two recorded poses of all bodies [s]."""

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
_driver_row, _controller_row = attrgetter(*_DRIVER_CHANNELS), attrgetter(*_CONTROLLER_CHANNELS)


class Recorder:
    """Rows of one run, in memory and, where a writer is given, in a file as the run goes on.

    Attributes:
        channels: The table of channels.
    """

    def __init__(self, vehicle: Vehicle, steps: int, writer: McapWriter | None = None) -> None:
        """Allocates everything.

        Args:
            vehicle: What is recorded.
            steps: Most steps that will come.
            writer: File to write to.
        """
        self.channels = channels_of(vehicle)
        vehicle.channels.restart()
        self._vehicle = vehicle
        self._writer = writer
        self._timestep_s = vehicle.timestep_s
        # By column, because that is how it is filled and read.
        self._values = np.empty((steps, len(self.channels)), order="F")
        self._time_s = np.asarray(np.arange(steps) * vehicle.timestep_s, dtype=np.float64)
        self._block_rows = max(1, round(BLOCK_INTERVAL_S / vehicle.timestep_s))
        self._raw = vehicle.raw_rows(min(self._block_rows, steps))
        self._control = np.empty((len(self._raw.sensordata), len(CONTROL_CHANNELS)))
        self._copies = tuple(zip(self._raw, vehicle.live_arrays(), strict=True))
        self._pose_every = max(1, round(POSE_INTERVAL_S / vehicle.timestep_s))
        data, bodies = vehicle.data, len(vehicle.body_names)
        poses = -(-steps // self._pose_every)
        self._positions = np.empty((poses, bodies, 3))
        self._quaternions = np.empty((poses, bodies, 4))
        # Without the world, which is the engine's body 0.
        self._xpos, self._xquat = data.xpos[1:], data.xquat[1:]
        self._rows = 0
        self._flushed = 0

    def record(self, command: DriverCommand, steer: SteerCommand) -> None:
        """Takes the row of the step that was just made; its values are those of the instant at which it began.

        Args:
            command: What the driver did.
            steer: What the controller asked for.
        """
        count = self._rows
        row = count - self._flushed
        for rows, live in self._copies:
            rows[row] = live
        self._control[row] = (*_driver_row(command), *_controller_row(steer))
        if count % self._pose_every == 0:
            pose = count // self._pose_every
            self._positions[pose] = self._xpos
            self._quaternions[pose] = self._xquat
        self._rows = count + 1
        if row + 1 == self._block_rows:
            self.flush()

    def flush(self) -> None:
        """Turns the rows since the last flush into channels, and writes them."""
        first, last = self._flushed, self._rows
        count = last - first
        if count == 0:
            return
        values = self._values[first:last]
        split = len(self.channels) - len(CONTROL_CHANNELS)
        self._vehicle.channels.evaluate(type(self._raw)(*(rows[:count] for rows in self._raw)), values[:, :split])
        values[:, split:] = self._control[:count]
        self._flushed = last
        if self._writer is not None:
            poses = self._poses_between(first, last)
            self._writer.write(self._time_s[first:last], values, poses.time_s, poses.positions_m, poses.quaternions)

    def result(self) -> tuple[NDArray[np.float64], NDArray[np.float64], Poses]:
        """Times, values and poses of all rows so far."""
        self.flush()
        rows = self._rows
        return self._time_s[:rows], self._values[:rows], self._poses_between(0, rows)

    def _poses_between(self, first: int, last: int) -> Poses:
        every = self._pose_every
        begin, end = -(-first // every), -(-last // every)
        times = np.asarray(np.arange(begin, end) * (every * self._timestep_s), dtype=np.float64)
        return Poses(times, self._vehicle.body_names, self._positions[begin:end], self._quaternions[begin:end])


def channels_of(vehicle: Vehicle) -> tuple[Channel, ...]:
    """All channels that a run with this vehicle records."""
    return (*vehicle.channels.channels, *CONTROL_CHANNELS)
