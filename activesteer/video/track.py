"""Poses of a car's bodies at any instant, interpolated from a recording."""

from __future__ import annotations

import numpy as np

from activesteer.conventions import Array, yaw_of
from activesteer.drawing.bodywork import CHASSIS
from activesteer.drawing.cars import direction_of_motion
from activesteer.errors import PlaybackError
from activesteer.recording import Recording
from activesteer.road.course import Footprint, footprint_of


class Track:
    """Poses of a car over time.

    Attributes:
        bodies: Names of the bodies.
        start_s: Time of the first pose [s].
        end_s: Time of the last pose [s].
    """

    def __init__(self, recording: Recording, name: str) -> None:
        """Read the poses that can be drawn; a run that diverged ends with poses that cannot.

        Args:
            recording: The run.
            name: Name of the run in error messages.

        Raises:
            PlaybackError: the recording has no poses of a car.
        """
        poses = recording.poses
        self.bodies = poses.names
        whole = poses.usable()
        if CHASSIS not in poses.names or not whole.any():
            raise PlaybackError(f"{name} has no poses of a car, so there is nothing to draw", value=name)
        self._time_s = poses.time_s[whole]
        self._positions_m = poses.positions_m[whole]
        self._quaternions = poses.quaternions[whole]
        self.start_s, self.end_s = float(self._time_s[0]), float(self._time_s[-1])
        self._heading_rad = np.unwrap(yaw_of(self._quaternions[:, poses.names.index(CHASSIS)]))
        self._middle_m = -0.5 * (footprint_of(recording.metadata) or Footprint()).wheelbase_m
        forward = np.column_stack([np.cos(self._heading_rad), np.sin(self._heading_rad)])
        middle_m = self._positions_m[:, poses.names.index(CHASSIS), :2] + self._middle_m * forward
        self._middles_m = np.column_stack([middle_m, self._positions_m[:, poses.names.index(CHASSIS), 2]])
        self._direction_rad = direction_of_motion(self._time_s, middle_m, self._heading_rad)

    def poses(self, time_s: float) -> tuple[Array, Array]:
        """Return the poses at an instant: the first pose before the recording, the last pose after it.

        Args:
            time_s: The instant [s].

        Returns:
            Positions [m], shape (bodies, 3); orientations, w x y z, shape (bodies, 4).
        """
        last = len(self._time_s) - 1
        after = min(max(int(np.searchsorted(self._time_s, time_s, side="right")), min(1, last)), last)
        before = max(after - 1, 0)
        span = self._time_s[after] - self._time_s[before]
        fraction = min(max((time_s - self._time_s[before]) / span, 0.0), 1.0) if span > 0.0 else 0.0
        positions = (1.0 - fraction) * self._positions_m[before] + fraction * self._positions_m[after]
        # The fastest body, a wheel, rotates by less than a radian between two poses: the chord is as good as the arc.
        first, second = self._quaternions[before], self._quaternions[after]
        sign = np.where(np.einsum("ij,ij->i", first, second) < 0.0, -1.0, 1.0)[:, None]
        turned = (1.0 - fraction) * first + fraction * sign * second
        return positions, turned / np.linalg.norm(turned, axis=1, keepdims=True)

    def heading(self, time_s: float) -> float:
        """Return the continuous heading of the chassis at an instant [rad], left positive."""
        return float(np.interp(time_s, self._time_s, self._heading_rad))

    def direction(self, time_s: float) -> float:
        """Return the averaged direction of motion at an instant [rad]; see `drawing.cars`."""
        return float(np.interp(time_s, self._time_s, self._direction_rad))

    def middle(self, time_s: float) -> Array:
        """Return the point on the road below the midpoint of the axles [m], shape (3,)."""
        positions, _ = self.poses(time_s)
        heading = self.heading(time_s)
        forward = np.array([np.cos(heading), np.sin(heading), 0.0])
        return positions[self.bodies.index(CHASSIS)] * (1.0, 1.0, 0.0) + self._middle_m * forward

    def path(self) -> tuple[Array, Array]:
        """Return all instants [s], shape (k,), and the midpoints of the axles at the height of the chassis [m].

        The points have the shape (k, 3). The origin of the chassis lies on the road in the design position.
        """
        return self._time_s, self._middles_m

    def wheel_place(self, corner: str) -> Array:
        """Return the initial centre of a wheel relative to the chassis, in axes along its heading [m], shape (3,).

        Raises:
            PlaybackError: the car has no such wheel.
        """
        body = f"{corner}_wheel"
        if body not in self.bodies:
            raise PlaybackError(
                f"the recording has no body {body!r}; it has {', '.join(self.bodies)}", value=body, allowed=self.bodies
            )
        positions, _ = self.poses(self.start_s)
        x, y, z = positions[self.bodies.index(body)] - positions[self.bodies.index(CHASSIS)] * (1.0, 1.0, 0.0)
        cos, sin = np.cos(self.heading(self.start_s)), np.sin(self.heading(self.start_s))
        return np.array([cos * x + sin * y, -sin * x + cos * y, z])

    def chassis(self, time_s: float) -> Array:
        """Return the point on the road below the chassis origin [m], shape (3,)."""
        positions, _ = self.poses(time_s)
        return positions[self.bodies.index(CHASSIS)] * (1.0, 1.0, 0.0)
