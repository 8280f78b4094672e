"""Metrics of a run along a path: lane change, slalom, or a path of the user.

"The gates" begin where the front axle centre reaches the first lane, or the first cone of a course without lanes. They
end where it reaches the end of the last gate. "After the gates" is the 3 s from then on. These metrics are nan for a
car that never reaches the last gate, or a recording that ends within the 3 s.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis import lanes
from activesteer.analysis.series import counted, lag, largest_rate, rate_rms, rms, sizes, timestep
from activesteer.analysis.source import RecordingLike, entry, read_course, read_footprint
from activesteer.core.conventions import CORNERS, Array
from activesteer.core.metric_table import CONES_MISSED
from activesteer.road.course import Course

if TYPE_CHECKING:
    from activesteer.recording import Recording

AFTER_S: Final = 3.0
"""Time after the last gate in which the car should settle [s]."""
LONGEST_LAG_S: Final = 0.6
"""Longest lag [s]: a quarter of the period of a slalom of 36 m at 100 km/h."""
_LAP_STEP_S: Final = 0.01
"""Interval at which the car's place along a path is searched [s]."""
SIGNALS: Final = ("yaw_rate_radps", "sideslip_rad", "ay_mps2", "roll_rad")
"""Channels that are evaluated."""
OSCILLATING: Final = ("yaw_rate_radps", "sideslip_rad", "ay_mps2", "steering_wheel_rad")
"""Channels whose root mean squares within and after the gates are metrics."""


def path_following_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of a run along a path, with nan where a metric cannot be evaluated.

    - Sizes: `<name>_peak_abs_<unit>`, `<name>_rms_<unit>` of yaw rate, sideslip, lateral acceleration (`ay`) and roll
      over the whole run, sideslip above 10 km/h. `<name>_gates_rms_<unit>` and `<name>_after_gates_rms_<unit>` of the
      steering wheel and of all these but roll.
    - Lag behind the steering wheel up to the last gate: `yaw_rate_lag_s`, `ay_lag_s`.
    - Steering effort: `steering_wheel_peak_abs_rad`, `steering_wheel_rms_rad`, and the same of its rate.
    - Distance of the front axle centre from the path: `track_deviation_max_m`, `track_deviation_rms_m`; heading at the
      end of the run against the path, `heading_end_rad`.
    - Lanes: `lane_overstep_m`, the largest distance of the body beyond a lane (below 0: smallest distance from a side),
      `stays_in_lanes` (1 or 0), `cones_hit`, `cone_distance_min_m`.
    - Tyres: `friction_utilisation_max`, `friction_utilisation_mean`, the fraction of the available friction
      that all wheels use.
    - Speed: `speed_loss_mps`, initial less lowest speed; `speed_end_mps`.
    - A path without gates: `lap_time_s`, the time in which the car covers its length; and `road_overstep_m`, the
      largest distance of a side of the car beyond the edge of the road, if the width of the road is known (below 0: the
      smallest distance from it).
    - Slalom: `track_amplitude_m` (half the distance between the leftmost and the rightmost place of the front axle
      centre between first and last cone), `cone_distance_mean_m`, and `cones_missed` (cones that the car does not reach
      or passes on another side than the path does).

    Args:
        recording: A run along a path.

    Returns:
        Metric name, ending in its unit, to value.

    Raises:
        RecordingError: a channel is missing, or the metadata hold no course or no sizes of the car.
    """
    course = read_course(recording)
    step_s = timestep(recording.time_s)
    approach, gates, after = _windows(recording, course)
    values: dict[str, float] = {}
    for channel in SIGNALS:
        values |= sizes(recording, channel)
    if course.last_gate_x_m is not None:
        for name, _, unit in (channel.rpartition("_") for channel in OSCILLATING):
            for key, part in (("gates", gates), ("after_gates", after)):
                values[f"{name}_{key}_rms_{unit}"] = rms(counted(recording, f"{name}_{unit}", part))
    wheel = recording["steering_wheel_rad"]
    for name, channel in (("yaw_rate", "yaw_rate_radps"), ("ay", "ay_mps2")):
        values[f"{name}_lag_s"] = lag(wheel[approach], recording[channel][approach], step_s, LONGEST_LAG_S)
    values |= sizes(recording, "steering_wheel_rad")
    values["steering_wheel_rate_peak_radps"] = largest_rate(wheel, step_s)
    values["steering_wheel_rate_rms_radps"] = rate_rms(wheel, step_s)
    values |= _places(recording, course)
    if entry(recording, "maneuver", "kind") == "slalom":
        values |= _slalom(recording, course)
    use = np.array([recording[f"{corner}_friction_utilisation"] for corner in CORNERS])
    values["friction_utilisation_max"], values["friction_utilisation_mean"] = float(use.max()), float(use.mean())
    speed = recording["speed_mps"]
    values["speed_loss_mps"] = float(speed[0] - speed.min())
    values["speed_end_mps"] = float(speed[-1])
    return values


def _windows(recording: RecordingLike, course: Course) -> tuple[slice, slice, slice]:
    """Return the samples of three phases: before the last gate, between the gates, and 3 s after the last gate."""
    # A path without gates is all approach.
    nothing = slice(0, 0)
    if course.last_gate_x_m is None:
        return slice(None), nothing, nothing
    first, last = (lanes.first_at(recording, x) for x in (course.first_gate_x_m, course.last_gate_x_m))
    if first is None or last is None:
        return nothing, nothing, nothing
    time_s = recording.time_s
    rest_s = float(time_s[-1] - time_s[last])
    # Half a step of tolerance: the last sample is one step before the end of the run.
    if rest_s < AFTER_S - 1.5 * timestep(time_s):
        return slice(0, last), slice(first, last), nothing
    end = int(np.searchsorted(time_s, time_s[last] + AFTER_S))
    return slice(0, last), slice(first, last), slice(last, end)


def _places(recording: RecordingLike, course: Course) -> dict[str, float]:
    """Return the metrics of distances from path, lanes and cones, and of the lap time."""
    x, y = lanes.front_axle(recording)
    lap: dict[str, float] = {}
    if course.last_gate_x_m is None:  # such a path may cross itself
        every = max(1, round(_LAP_STEP_S / timestep(recording.time_s)))
        along, deviation = lanes.places_along(x[::every], y[::every], course.path)
        end_m = course.path.length_m + along[0]  # the front axle starts ahead of the path's start
        ended = np.flatnonzero(along >= end_m)
        lap["lap_time_s"] = math.nan
        if len(ended) and ended[0] > 0:
            end = slice(ended[0] - 1, ended[0] + 1)
            lap["lap_time_s"] = float(np.interp(end_m, along[end], recording.time_s[::every][end]))
        if course.width_m is not None:
            room = 0.5 * np.interp(along, course.path.s_m, course.width_m) - 0.5 * read_footprint(recording).width_m
            lap["road_overstep_m"] = float((np.abs(deviation) - room).max())
    else:
        deviation = lanes.path_distance(x, y, course.path.x_m, course.path.y_m)
    values = {"track_deviation_max_m": float(np.abs(deviation).max()), "track_deviation_rms_m": rms(deviation)}
    values["heading_end_rad"] = lanes.heading_at_end(recording, course.path.x_m, course.path.y_m)
    if course.lanes:
        car = read_footprint(recording)
        values["lane_overstep_m"] = overstep_m = lanes.lane_overstep(recording, course, car)
        values["stays_in_lanes"] = float(overstep_m <= 0.0 and lanes.passes_lanes(recording, course, car))
    if len(course.cones_m):
        distances = lanes.cone_distances(recording, course, read_footprint(recording))
        values["cones_hit"] = float(np.count_nonzero(distances <= 0.0))
        values["cone_distance_min_m"] = float(distances.min())
    return values | lap


def _slalom(recording: RecordingLike, course: Course) -> dict[str, float]:
    row = course.row_m()
    if not len(row):
        return {"track_amplitude_m": math.nan, "cone_distance_mean_m": math.nan, CONES_MISSED: math.nan}
    x = np.linspace(row[:, 0].min(), row[:, 0].max(), 1000)
    y = lanes.track_over_x(recording, x)
    distances = lanes.cone_distances(recording, replace(course, cones_m=row), read_footprint(recording))
    return {
        "track_amplitude_m": 0.5 * float(y.max() - y.min()),
        "cone_distance_mean_m": float(distances.mean()),
        CONES_MISSED: float(np.count_nonzero(~_on_path_side(recording, course, row))),
    }


def _on_path_side(recording: RecordingLike, course: Course, row: Array) -> NDArray[np.bool_]:
    """Return which cones of a row the car passes on the side of the path."""
    sides = np.sign(lanes.track_over_x(recording, row[:, 0]) - row[:, 1])
    # A cone that is not reached has side nan, which equals no side.
    return sides == np.sign(np.interp(row[:, 0], course.path.x_m, course.path.y_m) - row[:, 1])


def judged_metrics(recording: Recording) -> Mapping[str, float]:
    """Return the metrics of a run to judge, without the metrics of cones that a person did not reach."""
    by_hand = entry(recording, "driver", "name") == "by hand"
    return as_far_as_driven(recording, recording.metrics) if by_hand else recording.metrics


def as_far_as_driven(recording: RecordingLike, metrics: Mapping[str, float]) -> Mapping[str, float]:
    """Return the metrics of a slalom that may have ended early, without the metrics of cones that were not reached."""
    # Cones passed on the wrong side still count. Without any, nothing says that the car passed all of them.
    if CONES_MISSED not in metrics:
        return metrics
    course = read_course(recording)
    row = course.row_m()
    reached = row[:, 0] <= lanes.front_axle(recording)[0].max()
    if reached.all():
        return metrics
    missed = float(np.count_nonzero(~_on_path_side(recording, course, row[reached])))
    left_out = ("cone_distance_mean_m", *(() if missed else (CONES_MISSED,)))
    found = {name: value for name, value in metrics.items() if name not in left_out}
    return found | {CONES_MISSED: missed} if missed else found
