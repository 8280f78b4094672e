"""The track of the front axle centre: distance from a path, and from other tracks."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.analysis.source import RecordingLike
from activesteer.conventions import Array
from activesteer.road.path import Path

_NEAR: Final = 10
"""Points of a path to either side of the last place in which a car is looked for: 5 m."""


def front_axle(recording: RecordingLike) -> tuple[Array, Array]:
    """Return world x and y of the front axle centre over time [m], shape (n,) each."""
    x, y = (np.asarray(recording[f"front_axle_{axis}_m"], dtype=np.float64) for axis in "xy")
    return x, y


def first_at(recording: RecordingLike, x_m: float) -> int | None:
    """Return the index of the first sample at which the front axle centre has reached an x; None if it never does."""
    reached = np.flatnonzero(front_axle(recording)[0] >= x_m)
    return int(reached[0]) if reached.size else None


def path_distance(x_m: Array, y_m: Array, path_x_m: Array, path_y_m: Array) -> Array:
    """Return the distance of points from a path of straight pieces, which continues straight beyond both of its ends.

    The nearest point of the path lies on a piece beside the nearest corner point.

    Args:
        x_m: World x of the points [m], shape (n,).
        y_m: World y of the points [m], shape (n,).
        path_x_m: World x of the path [m], shape (m,), m >= 2.
        path_y_m: World y of the path [m], shape (m,).

    Returns:
        Distance [m], shape (n,), positive for a point to the left of the path; nan for a point that is not finite.
    """
    from scipy.spatial import KDTree  # noqa: PLC0415 - takes a while to import

    points = np.column_stack([x_m, y_m])
    corners = np.column_stack([path_x_m, path_y_m])
    # For a point that is not finite, or whose distance is not, the tree returns a corner that does not exist.
    nearest = np.minimum(KDTree(corners).query(np.nan_to_num(points))[1], len(corners) - 1)
    pieces = np.diff(corners, axis=0)
    lengths = np.linalg.norm(pieces, axis=1)
    last = len(pieces) - 1
    best = np.full(len(points), math.inf)
    signed = np.full(len(points), math.nan)
    for piece in (np.maximum(nearest - 1, 0), np.minimum(nearest, last)):
        along, start = pieces[piece] / lengths[piece, None], points - corners[piece]
        along_m = np.einsum("ij,ij->i", start, along)
        low = np.where(piece == 0, -math.inf, 0.0)
        high = np.where(piece == last, math.inf, lengths[piece])
        offset = start - np.clip(along_m, low, high)[:, None] * along
        distance = np.linalg.norm(offset, axis=1)
        left = along[:, 0] * start[:, 1] - along[:, 1] * start[:, 0]
        closer = distance < best
        best = np.where(closer, distance, best)
        signed = np.where(closer, np.copysign(distance, left), signed)
    return signed


def heading_at_end(recording: RecordingLike, path_x_m: Array, path_y_m: Array) -> float:
    """Return the heading of the car at the end of a run against the nearest piece of a path, -pi to pi [rad].

    A car that turned around several times has its whole turns left out.
    """
    x, y = (channel[-1] for channel in front_axle(recording))
    nearest = int(np.argmin(np.hypot(path_x_m - x, path_y_m - y)))
    begin = min(nearest, len(path_x_m) - 2)
    along = math.atan2(path_y_m[begin + 1] - path_y_m[begin], path_x_m[begin + 1] - path_x_m[begin])
    return math.remainder(float(recording["yaw_rad"][-1]) - along, 2.0 * math.pi)


def places_along(x_m: Array, y_m: Array, path: Path) -> tuple[Array, Array]:
    """Return distance along a path and distance to its left [m] of a car that follows it; the path may cross itself."""
    along, beside = np.empty(len(x_m)), np.empty(len(x_m))
    at = 0
    for row, (x, y) in enumerate(zip(x_m.tolist(), y_m.tolist(), strict=True)):
        low = max(at - _NEAR, 0)
        dx, dy = x - path.x_m[low : at + _NEAR + 1], y - path.y_m[low : at + _NEAR + 1]
        nearest = int(np.argmin(dx**2 + dy**2))
        at = low + nearest
        cos, sin = math.cos(path.heading_rad[at]), math.sin(path.heading_rad[at])
        along[row] = path.s_m[at] + dx[nearest] * cos + dy[nearest] * sin
        beside[row] = dy[nearest] * cos - dx[nearest] * sin
    return along, beside


def track_over_x(recording: RecordingLike, x_m: Array) -> Array:
    """Return world y of the front axle centre at its first passage of each x, interpolated [m], shape (n,).

    The values of x ascend; y is nan where the run never gets there.
    """
    x, y = front_axle(recording)
    # A car that spins may go back: only samples ahead of all earlier ones count.
    ahead = np.concatenate([[True], x[1:] > np.maximum.accumulate(x)[:-1]])
    return np.interp(x_m, x[ahead], y[ahead], left=math.nan, right=math.nan)


def largest_difference(first: RecordingLike, second: RecordingLike, from_x_m: float, to_x_m: float) -> float:
    """Return the largest lateral distance between two tracks at the same x [m]; nan if one does not cover the range."""
    x = np.linspace(from_x_m, to_x_m, max(2, math.ceil((to_x_m - from_x_m) / 0.1) + 1))
    return float(np.abs(track_over_x(first, x) - track_over_x(second, x)).max())
