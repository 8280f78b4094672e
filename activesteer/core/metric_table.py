"""Table of all metrics: display unit, smallest difference that counts, and preferred direction.

A metric is declared here once. An evaluation that returns another name raises an error; see `analysis.metrics`.

The significances are based on published data about sensors and humans. The guide (`docs/claims.md`) says that the
results of an earlier driver and earlier gains were known when these sizes were written down.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Final, NamedTuple

from activesteer.core.units import DisplayUnit, display_unit
from activesteer.errors import ParameterError, nearest_names

STEER_RAD: Final = math.radians(0.05)
"""Angle of a road wheel that is turned or added [rad]: workshops set wheel alignment to about 3 minutes of arc.
`claims.judge` defines when a demand counts, so that noise does not."""
SETTLED_SIDESLIP_RAD: Final = math.radians(0.05)
"""Difference of sideslip angles averaged over a second [rad]: half of the +-0.1 deg of an optical sensor."""
SIDESLIP_RAD: Final = math.radians(0.1)
"""Difference of two sideslip angles, momentary or of an oscillation [rad]: an optical sensor is accurate to 0.1 deg."""
HEADING_RAD: Final = math.radians(0.1)
"""Difference of two headings at the end of a run [rad]: two satellite antennas on a car measure the heading to 0.1 deg
(OxTS RT3003, manual)."""
YAW_RATE_RADPS: Final = math.radians(0.5)
"""Difference of two yaw rates [rad/s]: humans notice 0.6 deg/s of a quick rotation (Grabherr et al. 2008), production
sensors have 0.1 to 0.2 deg/s of noise."""
TIME_S: Final = 0.01
"""Difference of two times [s]: a yaw rate or acceleration sensor on a car's bus reports every 10 ms."""
TRACK_M: Final = 0.05
"""Difference of two tracks [m]: differential satellite positioning gives each track to 0.02 m."""
STEERING_WHEEL_RAD: Final = math.radians(5.0)
"""Difference of two steering wheel angles [rad]: about what a driver notices while turning the wheel."""

FRICTION_UTILISATION: Final = ("friction_utilisation_max", "friction_utilisation_mean")
RENAMED: Final = {f"tyre_use_{end}": f"friction_utilisation_{end}" for end in ("max", "mean")}
"""Current names of renamed metrics, by the former name."""
CONES_HIT: Final = "cones_hit"
CONES_MISSED: Final = "cones_missed"
LANE_OVERSTEP: Final = "lane_overstep_m"
STAYS_IN_LANES: Final = "stays_in_lanes"
SIDESLIP_PEAKS: Final = ("sideslip_peak_abs_rad", "sideslip_peak_rad")
"""Metrics of the largest sideslip angle. A manoeuvre has one of them."""


class Better(StrEnum):
    """Preferred direction of a metric."""

    SMALLER = "smaller in magnitude"
    LOWER = "lower"
    """Lower values are better, also below zero: a lane that is not touched has a negative overstep."""
    HIGHER = "higher"


class Form(StrEnum):
    """Kind of a metric's value, for its format."""

    NUMBER = "number"
    COUNT = "count"
    YES_OR_NO = "yes or no"


class Metric(NamedTuple):
    """A metric with its display unit, the difference that counts and its preferred direction."""

    name: str  # its name in recordings, which ends in its SI unit
    label: str  # its name in words
    unit: DisplayUnit  # its unit for display, with the factor from the SI value
    # smallest difference that a driver or a sensor in a test car could tell [SI]; 0 if unknown
    significance: float = 0.0
    better: Better | None = None  # its preferred direction; None where neither more nor less is better
    form: Form = Form.NUMBER  # how its value is written

    @property
    def unit_name(self) -> str:
        """Name of the unit, or empty for a pure number."""
        return self.unit.name.removesuffix("-")

    @property
    def title(self) -> str:
        """Label and unit, as shown at an axis."""
        return f"{self.label} [{self.unit.name}]"

    @property
    def whole(self) -> bool:
        """True if the value is a whole number, or yes (1) or no (0)."""
        return self.form is not Form.NUMBER

    def text(self, value: float) -> str:
        """Format a value [SI] for a table, with `-` for nan."""
        if math.isnan(value):
            return "-"
        if self.form is Form.YES_OR_NO:
            return "yes" if value else "no"
        return f"{value:z.0f}" if self.form is Form.COUNT else f"{value * self.unit.factor:z.3f}"

    def cost(self, value: float) -> float:
        """Return a cost to minimise [SI], or the value itself without a preferred direction."""
        if self.better is Better.SMALLER:
            return abs(value)
        return -value if self.better is Better.HIGHER else value


_QUANTITIES: Final = {
    "ay": "lateral acceleration",
    "sideslip": "sideslip angle",
    "roll": "roll angle",
    "steering_wheel": "steering wheel angle",
    "front_steer": "front steer angle",
    "rear_steer": "rear steer angle",
    "superposition": "superposition angle",
    "added_rear_steer": "added rear steer angle",
    "added_superposition": "added superposition angle",
}
"""Words of quantities in names of metrics, where they differ from the name."""
_ENDS: Final = {
    "_after_gates_rms": "{} after the gates, RMS",
    "_gates_rms": "{} between the gates, RMS",
    "_end_rms": "{} at the end, RMS",
    "_rms": "{}, RMS",
    "_peak_abs": "largest {}",
    "_reversal_peak": "peak {} after the reversal",
    "_peak": "peak {}",
    "_steady_state": "steady-state {}",
    "_after_1000ms_share": "{} remaining after 1.00 s",
    "_after_1750ms_share": "{} remaining after 1.75 s",
    "_after_1000ms": "{} after 1.00 s",
    "_begin": "initial {}",
    "_end": "final {}",
    "_max": "largest {}",
    "_min": "least {}",
    "_mean": "mean {}",
}
"""Labels by the end of a name, with a place for the quantity. The first end that fits counts."""
_LABELS: Final = {
    "tb": "TB factor",
    "steering_wheel_at_0_3g": "steering wheel angle at 0.3 g",
    "steering_wheel_max_rate": "largest steering wheel rate",
    "yaw_rate_phase_at_1Hz": "yaw rate phase at 1 Hz",
    "ay_phase_at_1Hz": "lateral acceleration phase at 1 Hz",
    "roll_phase_at_1Hz": "roll phase at 1 Hz",
    "yaw_rate_45deg": "yaw rate frequency at 45 deg of lag",
    "yaw_rate_peak_gain": "frequency of the largest yaw rate gain",
    "yaw_rate_peak_gain_ratio": "largest yaw rate gain, relative",
    "steer_begin_time": "steering start time",
    "steer_reversal_time": "steering reversal time",
    "steer_completion_time": "steering completion time",
    "braking_begin_time": "braking start time",
    "yaw_rate_reversal_peak_time": "yaw rate peak time after the reversal",
    "stopping_distance_corrected": "corrected stopping distance",
    "lateral_displacement_by_ay": "lateral displacement by acceleration",
    "track_difference_none_ars": "track difference, none and ars",
    "track_difference_none_afs": "track difference, none and afs",
    "track_difference_ars_afs": "track difference, ars and afs",
    "entry_speed_min": "entry speed, lower bound",
    "entry_speed_max": "entry speed, upper bound",
    "ackermann_gradient": "Ackermann gradient",
    "two_wheel_lift_time": "time on two wheels",
    "wheel_lift_share": "time with a lifted wheel",
    "extended_road_share": "time beyond the known road",
    "added_angles_common": "time with both added angles",
    "added_angles_opposite_share": "added angles of opposite sign",
    "added_angles_correlation": "correlation of the added angles",
}
"""Labels of names without unit for which the rules above give no good label."""
_PERCENT: Final = DisplayUnit("%", 100.0)


def _declare(
    si: str,
    *stems: str,
    significance: float = 0.0,
    better: Better | None = None,
    unit: DisplayUnit | None = None,
    form: Form = Form.NUMBER,
) -> list[Metric]:
    """Return metrics of one unit, with names given without the unit."""
    names = {stem: f"{stem}_{si}" if si else stem for stem in stems}
    shown = unit or display_unit(f"_{si}")
    return [Metric(name, _label(stem), shown, significance, better, form) for stem, name in names.items()]


def _label(stem: str) -> str:
    """Return the words for the name of a metric without its unit."""
    if stem in _LABELS:
        return _LABELS[stem]
    for end, label in _ENDS.items():
        if stem.endswith(end):
            quantity = stem.removesuffix(end)
            return label.format(_QUANTITIES.get(quantity, quantity.replace("_", " ")))
    head, _, tail = stem.partition("_")
    return " ".join((_QUANTITIES["ay"] if head == "ay" else head, *tail.split("_")))


_SMALLER, _LOWER, _HIGHER = Better.SMALLER, Better.LOWER, Better.HIGHER

METRICS: Final = {
    metric.name: metric
    for metric in (
        *_declare(
            "radps", "yaw_rate_steady_state", "yaw_rate_peak", "yaw_rate_peak_abs", "yaw_rate_rms",
            "yaw_rate_gates_rms", "yaw_rate_after_gates_rms", "yaw_rate_end_rms", "yaw_rate_reversal_peak",
            "yaw_rate_begin", "yaw_rate_after_1000ms", significance=YAW_RATE_RADPS,
        ),
        *_declare("radps", "yaw_rate_deviation_after_1000ms", significance=YAW_RATE_RADPS, better=_SMALLER),
        *_declare("radps", "steering_wheel_rate_rms", better=_SMALLER),
        *_declare("radps", "steering_wheel_rate_peak", "steering_wheel_max_rate"),
        *_declare(
            "mps2", "ay_steady_state", "ay_peak", "ay_peak_abs", "ay_rms", "ay_gates_rms", "ay_after_gates_rms",
            "ay_begin", "linear_range", "limit_acceleration",
        ),
        *_declare("mps2", "mean_deceleration", better=_HIGHER),
        *_declare("mps2", "seat_acceleration_rms", better=_SMALLER),
        *_declare("rad", "sideslip_peak", "sideslip_peak_abs", significance=SIDESLIP_RAD, better=_SMALLER),
        *_declare(
            "rad", "sideslip_rms", "sideslip_gates_rms", "sideslip_after_gates_rms", "sideslip_end_rms",
            significance=SIDESLIP_RAD,
        ),
        *_declare("rad", "sideslip_steady_state", significance=SETTLED_SIDESLIP_RAD),
        *_declare(
            "rad", "rear_steer_steady_state", "superposition_steady_state", "added_rear_steer_steady_state",
            "added_superposition_steady_state", significance=STEER_RAD,
        ),
        *_declare("rad", "heading_end", significance=HEADING_RAD, better=_SMALLER),
        *_declare("rad", "steering_wheel_peak_abs", significance=STEERING_WHEEL_RAD, better=_SMALLER),
        *_declare(
            "rad", "steering_wheel_steady_state", "steering_wheel_rms", "steering_wheel_gates_rms",
            "steering_wheel_after_gates_rms", "steering_wheel_at_0_3g", significance=STEERING_WHEEL_RAD,
        ),
        *_declare(
            "rad", "roll_steady_state", "roll_peak", "roll_peak_abs", "roll_rms", "front_steer_steady_state",
            "yaw_rate_phase_at_1Hz", "ay_phase_at_1Hz", "roll_phase_at_1Hz", "yaw_angle_after_1000ms",
        ),
        *_declare(
            "s", "yaw_rate_response_time", "ay_response_time", "yaw_rate_delay", "ay_delay",
            significance=TIME_S, better=_SMALLER),
        *_declare(
            "s", "step_time", "yaw_rate_peak_time", "ay_peak_time", "roll_response_time", "roll_peak_time",
            "sideslip_response_time", "sideslip_peak_time", "steer_begin_time", "steer_reversal_time",
            "steer_completion_time", "yaw_rate_reversal_peak_time", "braking_begin_time", "yaw_rate_lag", "ay_lag",
            "added_angles_common", significance=TIME_S,
        ),
        *_declare("srad", "tb"),
        *_declare(
            "m", "stopping_distance", "path_deviation_after_1000ms", "track_deviation_max", "lateral_deviation_max",
            "track_amplitude", significance=TRACK_M, better=_SMALLER,
        ),
        *_declare("s", "lap_time", significance=TIME_S, better=_SMALLER),
        *_declare("m", "lane_overstep", "road_overstep", significance=TRACK_M, better=_LOWER),
        *_declare(
            "m", "lateral_displacement", "lateral_displacement_by_ay", "track_deviation_rms", "cone_distance_min",
            "cone_distance_mean", "radius_begin", "stopping_distance_corrected", "lateral_deviation_after_1000ms",
            "track_difference_none_ars", "track_difference_none_afs", "track_difference_ars_afs", significance=TRACK_M,
        ),
        *_declare("mps", "speed_begin", "speed_end", "speed_loss", "characteristic_speed"),
        *_declare("mps", "entry_speed_min", "entry_speed", "entry_speed_max", better=_HIGHER),
        *_declare(
            "radpmps2", "understeer_gradient", "steer_gradient", "ackermann_gradient", "roll_gradient",
            "sideslip_gradient", "front_slip_gradient", "rear_slip_gradient",
        ),
        *_declare("1ps", "yaw_rate_gain"),
        *_declare("mps2prad", "steering_wheel_gain", "ay_gain"),
        *_declare("radprad", "roll_gain"),
        *_declare("Hz", "yaw_rate_peak_gain", "yaw_rate_45deg", "yaw_rate_bandwidth"),
        *_declare("Pa", "brake_pressure_peak"),
        *_declare("s", "two_wheel_lift_time", better=_SMALLER),
        *_declare("N", "wheel_load_min"),
        *_declare("J", "battery_energy", better=_LOWER),
        *_declare("J", "brake_energy"),
        *_declare("J", "steering_energy", unit=DisplayUnit("J", 1.0)),
        *_declare("", "yaw_rate_overshoot", better=_LOWER, unit=_PERCENT),
        *_declare(
            "", "wheel_load_coefficient_max", "wheel_lift_share", "extended_road_share", better=_SMALLER, unit=_PERCENT
        ),
        *_declare("m", "suspension_travel_max", better=_SMALLER),
        *_declare("m", "displacement_at_rest", better=_SMALLER, unit=DisplayUnit("mm", 1000.0)),
        *_declare("", "yaw_rate_after_1000ms_share", "yaw_rate_after_1750ms_share", better=_SMALLER, unit=_PERCENT),
        *_declare(
            "", "ay_overshoot", "roll_overshoot", "sideslip_overshoot", "braking_efficiency", "wheel_slip_max",
            "added_angles_opposite_share", "friction_utilisation_max", "friction_utilisation_mean", unit=_PERCENT,
        ),
        *_declare("", "yaw_rate_peak_gain_ratio", "coherence_min", "added_angles_correlation"),
        *_declare("", CONES_HIT, CONES_MISSED, better=_SMALLER, form=Form.COUNT),
        *_declare("", STAYS_IN_LANES, form=Form.YES_OR_NO),
    )
}  # fmt: skip
"""All metrics by name."""


def metric(name: str) -> Metric:
    """Return a metric by its name."""
    if name in RENAMED:
        raise ParameterError(f"this metric is now {RENAMED[name]}", value=name)
    if name not in METRICS:
        raise ParameterError(f"no such metric; {nearest_names(name, METRICS)}", value=name, allowed=tuple(METRICS))
    return METRICS[name]


def recorded_metric(name: str) -> Metric:
    """Return the metric of a recording; one that only another version declares has its full name and no conversion."""
    return METRICS.get(name) or Metric(name, name, display_unit(""))
