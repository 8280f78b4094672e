"""What a recording says of its course and of its car: path, lanes, cones, widths. World frame, SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.source import RecordingLike
from activesteer.errors import RecordingError
from activesteer.road.lane import Lane

Array = NDArray[np.float64]

BEFORE_M: Final = 20.0
AFTER_M: Final = 50.0
"""How much of the road is shown before the first gate and after the last [m]."""
BESIDE_M: Final = 2.0
"""How much of it beside the course [m]; who leaves the track leaves the picture."""


class Course(NamedTuple):
    """The path that the driver follows, and what stands beside it.

    Attributes:
        path_x_m: World x of the path's points [m], shape (n,).
        path_y_m: World y of them [m], shape (n,).
        lanes: Lanes in the order of travel.
        cones_m: World x and y of the cones [m], shape (number of cones, 2).
        last_gate_x_m: Where the last gate ends [m]; None for a path without gates.
    """

    path_x_m: Array
    path_y_m: Array
    lanes: tuple[Lane, ...]
    cones_m: Array
    last_gate_x_m: float | None

    @property
    def first_gate_x_m(self) -> float:
        """Where the first lane begins, or the first cone stands where there are no lanes [m]; 0 without both."""
        if self.lanes:
            return min(lane.start_x_m for lane in self.lanes)
        return float(self.cones_m[:, 0].min()) if len(self.cones_m) else 0.0

    def shown(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """What of the road a picture shows: limits of x and of y [m]."""
        ys = [self.path_y_m, self.cones_m[:, 1], np.array([y for lane in self.lanes for y in lane[3:]])]
        every = np.concatenate(ys)
        low, high = float(every.min()) - BESIDE_M, float(every.max()) + BESIDE_M
        if self.last_gate_x_m is None:
            xs = self.path_x_m
            return (float(xs.min()) - BESIDE_M, float(xs.max()) + BESIDE_M), (low, high)
        return (self.first_gate_x_m - BEFORE_M, self.last_gate_x_m + AFTER_M), (low, high)

    def on_lane_side(self) -> NDArray[np.bool_]:
        """Which cones stand on the side of a lane, so that they mark its width."""
        x, y = self.cones_m[:, 0], self.cones_m[:, 1]
        marks = np.zeros(len(x), dtype=bool)
        for lane in self.lanes:
            along = (x >= lane.start_x_m - 1e-3) & (x <= lane.end_x_m + 1e-3)
            marks |= along & (np.minimum(np.abs(y - lane.right_y_m), np.abs(y - lane.left_y_m)) < 1e-3)
        return marks


class Car(NamedTuple):
    """Sizes of the car.

    Attributes:
        width_m: Width of its body [m].
        wheelbase_m: Distance of the axles [m].
        tyre_width_m: Width of the front and of the rear tyres [m].
    """

    width_m: float
    wheelbase_m: float
    tyre_width_m: tuple[float, float]


def read_course(recording: RecordingLike) -> Course:
    """The course of a run.

    Raises:
        RecordingError: the metadata hold none, or it lacks something.
    """
    table = _table(recording, "course", "the manoeuvre has no path and no gates")
    path = table.get("path")
    if not isinstance(path, Mapping):
        raise RecordingError(f"the metadata's 'course.path' is {path!r}, expected a table with 'x_m' and 'y_m'")
    x_m, y_m = (_numbers(path, key, "course.path") for key in ("x_m", "y_m"))
    if len(x_m) < 2 or len(x_m) != len(y_m):
        raise RecordingError(
            f"the metadata's 'course.path' has {len(x_m)} x_m and {len(y_m)} y_m; "
            "as many of each are needed, at least 2"
        )
    last = table.get("last_gate_x_m")
    try:
        lanes = tuple(
            Lane(str(lane.get("name", "")), *(float(lane[key]) for key in Lane._fields[1:]))
            for lane in table.get("lanes", ())
        )
        cones = np.array(table.get("cones", ()), dtype=np.float64).reshape(-1, 2)
        last_gate_x_m = None if last is None else float(last)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise RecordingError(f"the metadata's 'course' cannot be read: {type(error).__name__}: {error}") from error
    return Course(x_m, y_m, lanes, cones, last_gate_x_m)


def read_car(recording: RecordingLike) -> Car:
    """Sizes of the car of a run.

    Raises:
        RecordingError: the metadata do not give them.
    """
    table = _table(recording, "car", "its sizes are needed")
    widths = _numbers(table, "tyre_width_m", "car")
    if len(widths) != 2:
        raise RecordingError(
            f"the metadata's 'car.tyre_width_m' has {len(widths)} values, expected 2: front and rear tyre"
        )
    width_m, wheelbase_m = (float(_numbers(table, key, "car")[0]) for key in ("width_m", "wheelbase_m"))
    return Car(width_m, wheelbase_m, (float(widths[0]), float(widths[1])))


def _table(recording: RecordingLike, key: str, otherwise: str) -> Mapping[str, Any]:
    table = recording.metadata.get(key)
    if not isinstance(table, Mapping):
        raise RecordingError(f"the metadata of the recording have no table {key!r}: {otherwise}")
    return table


def _numbers(table: Mapping[str, Any], key: str, where: str) -> Array:
    value = table.get(key)
    try:
        numbers = np.atleast_1d(np.array(value if isinstance(value, Sequence) else [value], dtype=np.float64))
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.ndim != 1 or not numbers.size or not np.isfinite(numbers).all():
        raise RecordingError(f"the metadata's '{where}.{key}' is {value!r}, expected finite numbers [m]")
    return numbers
