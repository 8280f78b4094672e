"""Metrics of a step steer and of a slowly increasing steer.

The car runs straight before the step, so every value counts from zero. t = 0 is the time at which the steering wheel
passes half of its final angle, interpolated between samples. A steady-state value is the mean over the last second.

Sources: ISO 7401, Road vehicles - Lateral transient response test methods, step input; 49 CFR 571.126 (FMVSS 126),
S7.6 and S7.11; NHTSA TP-126, which gives the range of the line.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from activesteer.analysis import handling
from activesteer.analysis.series import Array, crossing_time, largest_rate, low_pass, peak, step_response, timestep
from activesteer.analysis.sine_with_dwell import MOTION_CUT_OFF_Hz, STEERING_CUT_OFF_Hz
from activesteer.analysis.source import RecordingLike, entry
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.errors import RecordingError

STEADY_WINDOW_S: Final = 1.0
"""Length of the window at the end of the run whose mean is the steady-state value [s]."""

MIN_STEP_RAD: Final = math.radians(0.5)
"""Smallest final steering wheel angle that counts as a step [rad]."""


SIGNALS: Final = {"yaw_rate_radps": 1e-3, "ay_mps2": 1e-2, "roll_rad": 1e-4, "sideslip_rad": 1e-4}
"""Smallest steady-state value of each channel for which times and overshoot have a meaning."""
STEADY_CHANNELS: Final = ("steering_wheel_rad", "front_steer_rad", "rear_steer_rad", "superposition_rad")
"""Channels of which only the steady-state value is given."""


def step_response_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of a step steer, with nan where a metric cannot be evaluated.

    For yaw rate, lateral acceleration (`ay`), roll and sideslip: `<name>_steady_state_<unit>`, `<name>_response_time_s`
    (90 %), `<name>_peak_<unit>` and `<name>_peak_time_s` in the direction of the steady-state value, and
    `<name>_overshoot`. `sideslip_peak_abs_rad` is the largest sideslip angle to either side. `tb_srad` is the peak
    response time of the yaw rate times the magnitude of the steady-state sideslip. For the steering: `step_time_s`, the
    largest rate, and steady-state angles. Also `speed_end_mps`.

    Args:
        recording: A run with one step of the steering wheel, to either side, and at least two seconds after it.

    Returns:
        Metric name, ending in its unit, to value. Times count from t = 0 [s], but `step_time_s` from the start of
        the run.

    Raises:
        RecordingError: there is no step, it has no start, the run ends too early after it, or a channel is missing.
    """
    time_s = recording.time_s
    steering_rad = recording["steering_wheel_rad"]
    step_time_s = _step_time(time_s, steering_rad)

    values: dict[str, float] = {"step_time_s": step_time_s}
    for channel, minimum in SIGNALS.items():
        name, _, unit = channel.rpartition("_")
        for key, value in step_response(time_s, recording[channel], step_time_s, STEADY_WINDOW_S, minimum).items():
            values[f"{name}_{key}" + (f"_{unit}" if key in ("steady_state", "peak") else "")] = value
    values |= peak(recording, "sideslip_rad")
    values["tb_srad"] = values["yaw_rate_peak_time_s"] * abs(values["sideslip_steady_state_rad"])

    settled = time_s >= time_s[-1] - STEADY_WINDOW_S
    values["steering_wheel_max_rate_radps"] = largest_rate(steering_rad, timestep(time_s))
    for name, _, unit in (channel.rpartition("_") for channel in STEADY_CHANNELS):
        values[f"{name}_steady_state_{unit}"] = float(np.mean(recording[f"{name}_{unit}"][settled]))
    values["speed_end_mps"] = float(recording["speed_mps"][-1])
    return values


_FOLLOWED_SHARE: Final = 0.1
"""Share of the desired yaw rate below which a car does not follow the steering. Chosen."""
NOT_FOLLOWED: Final = "the car does not follow the steering, so its response has no times and no overshoot."
"""Explanation of the missing values of a car that does not follow the steering."""
_OF_THE_RESPONSE: Final = ("_response_time_s", "_peak_time_s", "_overshoot", "tb_srad")
"""Ends of the names of metrics that describe a response."""


def follows_steering(recording: RecordingLike) -> bool:
    """Return whether the settled yaw rate in a step steer reaches `_FOLLOWED_SHARE` of the desired yaw rate."""
    if entry(recording, "maneuver", "kind") != "step_steer":
        return True
    try:
        yaw_rate, desired = recording["yaw_rate_radps"], recording["yaw_rate_desired_radps"]
    except RecordingError:  # a recording of another program
        return True
    settled = recording.time_s >= recording.time_s[-1] - STEADY_WINDOW_S
    wanted = float(np.mean(desired[settled]))
    return bool(float(np.mean(yaw_rate[settled])) * math.copysign(1.0, wanted) >= _FOLLOWED_SHARE * abs(wanted))


def without_response(recording: RecordingLike, metrics: Mapping[str, float]) -> Mapping[str, float]:
    """Return the metrics to show, with nan for metrics of the response if the car does not follow the steering."""
    if follows_steering(recording):
        return metrics
    return {name: math.nan if name.endswith(_OF_THE_RESPONSE) else value for name, value in metrics.items()}


def _step_time(time_s: Array, steering_rad: Array) -> float:
    final_rad = float(np.mean(steering_rad[time_s >= time_s[-1] - STEADY_WINDOW_S]))
    if not abs(final_rad) >= MIN_STEP_RAD:
        raise RecordingError(
            f"the recording holds no step steer: the steering wheel ends at {math.degrees(final_rad):.3g} deg; "
            f"at least {math.degrees(MIN_STEP_RAD):.3g} deg to either side are needed",
            value=final_rad,
            allowed=MIN_STEP_RAD,
        )
    step_time_s = crossing_time(time_s, math.copysign(1.0, final_rad) * steering_rad, 0.5 * abs(final_rad))
    if math.isnan(step_time_s):
        raise RecordingError(
            f"the step steer has no start: the steering wheel is at {math.degrees(steering_rad[0]):.3g} deg "
            f"from the first sample on and ends at {math.degrees(final_rad):.3g} deg",
            value=float(steering_rad[0]),
        )
    if time_s[-1] - step_time_s < 2.0 * STEADY_WINDOW_S:
        raise RecordingError(
            f"the run ends {time_s[-1] - step_time_s:.3g} s after the step at {step_time_s:.3g} s; "
            f"steady-state values need at least {2.0 * STEADY_WINDOW_S:.3g} s",
            value=float(time_s[-1] - step_time_s),
            allowed=2.0 * STEADY_WINDOW_S,
        )
    return step_time_s


REFERENCE_MPS2: Final = 0.3 * GRAVITY_MPS2
"""Lateral acceleration at which the angle is A [m/s2]."""
FIT: Final = (1.0 / 3.0, 1.25)
"""Range of the line, as fractions of the required acceleration: 0.1 to 0.375 g for 0.3 g."""


def slow_ramp_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of a slow ramp."""
    values = handling.handling_metrics(recording)
    step_s = timestep(recording.time_s)
    ay = low_pass(recording["ay_mps2"], step_s, MOTION_CUT_OFF_Hz)
    steering = low_pass(recording["steering_wheel_rad"], step_s, STEERING_CUT_OFF_Hz)
    side = math.copysign(1.0, float(ay[int(np.abs(ay).argmax())]))
    reached = float((side * ay).max()) >= FIT[1] * REFERENCE_MPS2
    angle = side * angle_at(side * steering, side * ay, REFERENCE_MPS2) if reached else math.nan
    return values | {"steering_wheel_at_0_3g_rad": angle}


def angle_at(steering_rad: Array, ay_mps2: Array, wanted_mps2: float) -> float:
    """Return the steering wheel angle [rad] at a lateral acceleration, by the line through the range of `FIT`."""
    low, high = (fraction * wanted_mps2 for fraction in FIT)
    line = slice(int(np.argmax(ay_mps2 > low)), int(np.argmax(ay_mps2 > high)))
    slope, offset = np.polynomial.Polynomial.fit(steering_rad[line], ay_mps2[line], 1).convert().coef[::-1]
    return float((wanted_mps2 - offset) / slope)
