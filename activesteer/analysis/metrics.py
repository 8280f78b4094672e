"""The metrics of a recording: general metrics and metrics of its manoeuvre.

The latter are sizes, energy, ride and rollover.

The seat point is in the middle of the wheelbase, `SEAT_ASIDE_M` from the middle of the car, on both sides in turn; the
worse side counts. Its vertical acceleration is the sum of heave, pitch and roll.

Source: ISO 2631-1:1997, annex A (frequency weighting W_k: band limits 0.4 and 100 Hz, transition 12.5 Hz, step 2.37 to
3.35 Hz).

NHTSA's rollover test counts a run in which both inner wheels leave the ground by two inches at the same time. Here the
wheels count as lifted while the road does not carry them.

Source: 68 FR 59250 (2003), Consumer Information; New Car Assessment Program; Rollover Resistance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis import braking, frequency_response, handling, path_following, sine_with_dwell, step_response
from activesteer.analysis.series import Array, peak, sizes
from activesteer.analysis.source import Evaluable, RecordingLike
from activesteer.config import read_toml
from activesteer.core.conventions import CORNERS
from activesteer.core.limits import table_of, text
from activesteer.core.metric_table import metric, recorded_metric
from activesteer.errors import RecordingError, nearest_names
from activesteer.road.road import road_of

_MEASURABLE: Final[tuple[Callable[[RecordingLike], dict[str, float]], ...]] = (
    *(partial(sizes, channel=channel) for channel in ("yaw_rate_radps", "ay_mps2", "sideslip_rad", "roll_rad")),
    partial(peak, channel="steering_wheel_rad"),
    lambda recording: {"speed_end_mps": float(recording["speed_mps"][-1])},
)
"""Functions that evaluate the quantities that a test car can measure."""
_STANDING_MPS: Final = 1.0
"""Largest speed of a car that stands, and rocks on its springs and tyres [m/s]."""


def general_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return peaks and root mean squares of a run.

    Returns:
        `<name>_peak_abs_<unit>` and `<name>_rms_<unit>` of yaw rate, lateral acceleration, sideslip (above 10 km/h)
        and roll; the largest steering wheel angle; `friction_utilisation_max`, the largest fraction of its available
        friction that any tyre uses; `speed_end_mps`; and, if the car never drives faster than 1 m/s,
        `displacement_at_rest_m`, its largest distance from where the run began.

    Raises:
        RecordingError: a channel is missing.
    """
    use = max(float(recording[f"{corner}_friction_utilisation"].max()) for corner in CORNERS)
    *values, end = (part(recording) for part in _MEASURABLE)
    all_parts = (*values, {"friction_utilisation_max": use}, end, _displacement_at_rest(recording))
    return {name: value for part in all_parts for name, value in part.items()}


def speed_note(recording: RecordingLike) -> str:
    """Return a note on a response that is not at the demanded speed, empty otherwise."""
    if evaluated_kind(recording) not in ("step_steer", "sine_sweep", "random_steer") or stands(recording):
        return ""
    speed_mps, demanded_mps = recording["speed_mps"], recording.metadata["maneuver"]["speed_mps"]
    off = float(speed_mps[np.argmax(np.abs(speed_mps - demanded_mps))])
    if abs(off - demanded_mps) <= handling.CONSTANT_SHARE * abs(demanded_mps):
        return ""
    return (
        f"the car drives {3.6 * off:.4g} km/h where {3.6 * demanded_mps:.4g} km/h are demanded; up to "
        f"{100.0 * handling.CONSTANT_SHARE:g} % of difference counts as constant speed"
    )


def stands(recording: RecordingLike) -> bool:
    """Return whether a car stands in the whole run."""
    return float(np.abs(recording["speed_mps"]).max()) <= _STANDING_MPS


def _displacement_at_rest(recording: RecordingLike) -> dict[str, float]:
    """Return how far a standing car moves, or nothing for a car that drives."""
    if not stands(recording):
        return {}
    moved_m = np.hypot(*(recording[name] - recording[name][0] for name in ("x_m", "y_m")))
    return {"displacement_at_rest_m": float(moved_m.max())}


def measured_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics whose channels were measured."""
    values: dict[str, float] = {}
    for part in _MEASURABLE:
        with suppress(RecordingError):
            values |= part(recording)
    return values


def energy_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the energies of a run, or nothing for a car without motors."""
    vehicle = recording.metadata.get("vehicle")
    if not isinstance(vehicle, Mapping) or not vehicle.get("motors"):
        return {}
    time_s = recording.time_s
    battery_J = recording["battery_energy_J"]
    brakes_W = sum(-recording[f"{c}_brake_torque_Nm"] * recording[f"{c}_wheel_speed_radps"] for c in CORNERS)
    steering_J = sum(np.trapezoid(np.maximum(power_W, 0.0), time_s) for power_W in _steering(recording, vehicle))
    return {
        "battery_energy_J": float(battery_J[-1] - battery_J[0]),
        "steering_energy_J": float(steering_J),
        "brake_energy_J": float(np.trapezoid(brakes_W, time_s)),
    }


def _steering(recording: RecordingLike, vehicle: Mapping[str, Any]) -> Iterator[NDArray[np.float64]]:
    """Yield the mechanical power of each steering actuator."""
    rear = np.gradient(recording["rear_steer_rad"], recording.time_s)
    added = vehicle["steering"]["ratio"] * np.gradient(recording["superposition_rad"], recording.time_s)
    presets = vehicle["rear_actuator"], vehicle["superposition_actuator"]
    motors: list[str] = []
    if (preset := presets[0]["preset"]) == "hinge":
        yield from (recording[f"{name}_steer_torque_Nm"] * rear for name in ("rl", "rr"))
    else:
        central = presets[0].get("arrangement", "central" if preset == "screw_10deg" else "") == "central"
        motors += ["rear"] if central else ["rl", "rr"]
    if presets[1]["preset"] == "servo":
        yield recording["superposition_torque_Nm"] * added
    else:
        motors.append("superposition")
    yield from (recording[f"{name}_motor_torque_Nm"] * recording[f"{name}_motor_speed_radps"] for name in motors)


SEAT_ASIDE_M: Final = 0.35
_BUTTERWORTH: Final = math.sqrt(0.5)
_EVERY: Final = 10
"""Rows between two checks of a wheel's position: 0.2 m at 20 m/s."""
_MARKER: Final = "fl_road_z_m"
"""Channel that only recordings of uneven roads have."""


def is_uneven(recording: RecordingLike) -> bool:
    """Return whether a run was driven on an uneven road."""
    return any(getattr(channel, "name", channel) == _MARKER for channel in getattr(recording, "channels", ()))


def ride_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of ride comfort and of the wheels on an uneven road."""
    road = road_of(recording.metadata)
    extended = [
        road.extended_share(*(recording[f"{corner}_contact_{axis}_m"][::_EVERY] for axis in "xy")) for corner in CORNERS
    ]
    loads = np.stack([recording[f"{corner}_tyre_fz_N"] for corner in CORNERS])
    travels = np.stack([recording[f"{corner}_travel_m"] for corner in CORNERS])
    return {
        "seat_acceleration_rms_mps2": seat_acceleration_mps2(recording),
        "wheel_load_coefficient_max": float((loads.std(axis=1) / loads.mean(axis=1)).max()),
        "suspension_travel_max_m": float(np.ptp(travels, axis=1).max()),
        "wheel_lift_share": float((loads <= 0.0).mean(axis=1).max()),
        "extended_road_share": max(extended),
    }


def seat_acceleration_mps2(recording: RecordingLike) -> float:
    """Return the weighted RMS of the vertical acceleration at the worse seat point [m/s2]."""
    step_s = float(recording.time_s[1] - recording.time_s[0])
    axle_m = math.hypot(
        recording["front_axle_x_m"][0] - recording["x_m"][0], recording["front_axle_y_m"][0] - recording["y_m"][0]
    )
    wheelbase_m = float(recording.metadata.get("car", {}).get("wheelbase_m", 2.0 * axle_m))
    ahead_m = axle_m - 0.5 * wheelbase_m
    base = recording["az_mps2"] - ahead_m * np.gradient(recording["pitch_rate_radps"], step_s)
    aside = SEAT_ASIDE_M * np.gradient(recording["roll_rate_radps"], step_s)
    return max(float(np.sqrt(np.mean(weighted(base + sign * aside, step_s) ** 2))) for sign in (1.0, -1.0))


def weighted(acceleration_mps2: Array, step_s: float) -> Array:
    """Return a vertical acceleration without its mean, filtered by W_k."""
    spectrum = np.fft.rfft(acceleration_mps2 - np.mean(acceleration_mps2))
    gain = weighting(np.fft.rfftfreq(len(acceleration_mps2), step_s))
    return np.fft.irfft(spectrum * gain, len(acceleration_mps2))


def weighting(frequency_Hz: Array) -> NDArray[np.complex128]:
    """Return the complex gain of the weighting W_k at given frequencies."""
    s = 2j * math.pi * frequency_Hz

    def quadratic(at_Hz: float, quality: float) -> NDArray[np.complex128]:
        part = s / (2.0 * math.pi * at_Hz)
        return 1.0 + part / quality + part * part

    high = (s / (2.0 * math.pi * 0.4)) ** 2 / quadratic(0.4, _BUTTERWORTH)
    transition = (1.0 + s / (2.0 * math.pi * 12.5)) / quadratic(12.5, 0.63)
    step = quadratic(2.37, 0.91) / quadratic(3.35, 0.91) * (2.37 / 3.35) ** 2
    return high / quadratic(100.0, _BUTTERWORTH) * transition * step


LIFTED_N: Final = 1.0
"""Vertical load below which a wheel is lifted [N]."""


def rollover_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the general metrics, including the metrics of the wheel loads."""
    loads_N = np.array([recording[f"{corner}_tyre_fz_N"] for corner in CORNERS])
    lifted = loads_N < LIFTED_N
    both = (lifted[0] & lifted[2]) | (lifted[1] & lifted[3])
    step_s = float(recording.time_s[1] - recording.time_s[0])
    values = {"two_wheel_lift_time_s": float(both.sum()) * step_s, "wheel_load_min_N": float(loads_N.min())}
    return values | general_metrics(recording)


_TABLE: Final = read_toml(Path(__file__).with_name("key_metrics.toml"), RecordingError)[0]
EVALUATIONS: Final[dict[str, Callable[[RecordingLike], dict[str, float]]]] = {
    "step_steer": step_response.step_response_metrics,
    "open_loop": general_metrics,
    "random_steer": general_metrics,
    "slowly_increasing_steer": step_response.slow_ramp_metrics,
    "constant_radius": handling.handling_metrics,
    "sine_sweep": frequency_response.frequency_response_metrics,
    "sine_with_dwell": sine_with_dwell.sine_with_dwell_metrics,
    "lane_change": path_following.path_following_metrics,
    "slalom": path_following.path_following_metrics,
    "follow_path": path_following.path_following_metrics,
    "brake_in_turn": braking.brake_in_turn_metrics,
    "phases": rollover_metrics,
    "straight_braking": braking.straight_braking_metrics,
    "measured": measured_metrics,
}
"""Functions from a run to its metrics, by kind of manoeuvre."""
KEY_METRICS: Final[dict[str, tuple[str, ...]]] = {
    kind: tuple(_TABLE["key_metrics"].get(kind, _TABLE["key_metrics"]["open_loop"])) for kind in EVALUATIONS
}
"""Metrics that are printed first and compared with the baseline, by kind of manoeuvre, most important first."""
_ON_A_PATH: Final[dict[str, str]] = _TABLE["key_figures"]["titles_on_a_path"]
_PATH: Final = "track_deviation_max_m"
_AT_REST: Final = "displacement_at_rest_m"
_TITLES: Final[dict[str, str]] = _TABLE["key_figures"]["titles"]
KEY_FIGURES: Final = {
    _TITLES.get(names[0], metric(names[0]).label[0].upper() + metric(names[0]).label[1:]): tuple(names)
    for names in _TABLE["key_figures"]["metrics"]
}
"""Names of metrics by title of a key figure. The first of these metrics that a run has is shown."""


def key_figures_of(names: Collection[str]) -> dict[str, str]:
    """Return the key figures among the metrics of a run: titles and names of metrics."""
    # A car at rest has no direction of motion.
    shown = [name for name in names if not (_AT_REST in names and name.startswith("sideslip"))]
    found = {title: next(filter(shown.__contains__, of), "") for title, of in KEY_FIGURES.items()}
    return {_ON_A_PATH.get(name, title) if _PATH in names else title: name for title, name in found.items() if name}


def label_of(name: str, names: Collection[str]) -> str:
    """Return the words for a metric of a run, as the run's key figures show them."""
    if name in _ON_A_PATH and _PATH in names:
        title = _ON_A_PATH[name].removesuffix(", magnitude")
        return title[0].lower() + title[1:]
    return recorded_metric(name).label


def evaluated_kind(recording: RecordingLike) -> str:
    """Return the kind of a run's manoeuvre, which must have an evaluation."""
    kind = text(table_of(recording.metadata.get("maneuver"), "maneuver").get("kind"), "maneuver.kind")
    if kind not in EVALUATIONS:
        raise RecordingError(
            f"there is no evaluation for the kind {kind!r}; {nearest_names(kind, EVALUATIONS)}",
            file="the metadata",
            key="maneuver.kind",
            value=kind,
        )
    return kind


def metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of a run.

    Args:
        recording: The run; `metadata["maneuver"]["kind"]` names the kind of manoeuvre.

    Returns:
        Metric name, ending in its unit, to value; nan where the run does not define one.

    Raises:
        RecordingError: the metadata name no kind or an unknown one, a channel is missing or not finite, there are fewer
            than two rows, or the run is not what its kind promises.
        ParameterError: the evaluation returns a metric that `metric_table` does not declare.
    """
    values = EVALUATIONS[evaluated_kind(recording)](Evaluable(recording)) | energy_metrics(recording)
    if is_uneven(recording):
        values |= ride_metrics(Evaluable(recording))
    for name in values:
        metric(name)
    return values
