"""Ride on an uneven road: comfort at the seat after ISO 2631-1, wheel loads, suspension travel.

The seat point lies in the middle of the wheelbase, `SEAT_ASIDE_M` beside the middle of the car, on both sides in turn;
the worse side counts. Its vertical acceleration is that of the centre of gravity plus that of pitch and roll.

Source: ISO 2631-1:1997, annex A (frequency weighting W_k: band limits 0.4 and 100 Hz, transition 12.5 Hz, step 2.37 to
3.35 Hz).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.source import RecordingLike
from activesteer.conventions import CORNERS, Array
from activesteer.road.road import road_of

SEAT_ASIDE_M: Final = 0.35
_BUTTERWORTH: Final = math.sqrt(0.5)
_EVERY: Final = 10
"""Rows from one look at the place of a wheel to the next: 0.2 m at 20 m/s."""
_MARKER: Final = "fl_road_z_m"
"""A channel of uneven roads only."""


def is_uneven(recording: RecordingLike) -> bool:
    """Return whether a run was driven on an uneven road."""
    return any(getattr(channel, "name", channel) == _MARKER for channel in getattr(recording, "channels", ()))


def ride_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of the ride."""
    road = road_of(recording.metadata)
    extended = [
        road.extended_share(*(np.asarray(recording[f"{corner}_contact_{axis}_m"])[::_EVERY] for axis in "xy"))
        for corner in CORNERS
    ]
    loads = np.stack([np.asarray(recording[f"{corner}_tyre_fz_N"], np.float64) for corner in CORNERS])
    travels = np.stack([np.asarray(recording[f"{corner}_travel_m"], np.float64) for corner in CORNERS])
    return {
        "seat_acceleration_rms_mps2": seat_acceleration_mps2(recording),
        "wheel_load_coefficient_max": float((loads.std(axis=1) / loads.mean(axis=1)).max()),
        "suspension_travel_max_m": float(np.ptp(travels, axis=1).max()),
        "wheel_lift_share": float((loads <= 0.0).mean(axis=1).max()),
        "extended_road_share": max(extended),
    }


def seat_acceleration_mps2(recording: RecordingLike) -> float:
    """Return the weighted RMS of the vertical acceleration at the worse seat point [m/s2]."""
    time_s = np.asarray(recording.time_s, np.float64)
    step_s = float(time_s[1] - time_s[0])
    up, pitch, roll = (
        np.asarray(recording[name], np.float64) for name in ("az_mps2", "pitch_rate_radps", "roll_rate_radps")
    )
    axle_m = math.hypot(
        recording["front_axle_x_m"][0] - recording["x_m"][0], recording["front_axle_y_m"][0] - recording["y_m"][0]
    )
    wheelbase_m = float(recording.metadata.get("car", {}).get("wheelbase_m", 2.0 * axle_m))
    ahead_m = axle_m - 0.5 * wheelbase_m
    base = up - ahead_m * np.gradient(pitch, step_s)
    aside = SEAT_ASIDE_M * np.gradient(roll, step_s)
    return max(float(np.sqrt(np.mean(weighted(base + sign * aside, step_s) ** 2))) for sign in (1.0, -1.0))


def weighted(acceleration_mps2: Array, step_s: float) -> Array:
    """Return a vertical acceleration filtered by W_k; its mean is removed first."""
    spectrum = np.fft.rfft(acceleration_mps2 - np.mean(acceleration_mps2))
    gain = weighting(np.asarray(np.fft.rfftfreq(len(acceleration_mps2), step_s), np.float64))
    return np.fft.irfft(spectrum * gain, len(acceleration_mps2))


def weighting(frequency_Hz: Array) -> NDArray[np.complex128]:
    """Return the complex gain of the weighting W_k."""
    s = 2j * math.pi * np.asarray(frequency_Hz, np.float64)

    def quadratic(at_Hz: float, quality: float) -> NDArray[np.complex128]:
        part = s / (2.0 * math.pi * at_Hz)
        return 1.0 + part / quality + part * part

    high = (s / (2.0 * math.pi * 0.4)) ** 2 / quadratic(0.4, _BUTTERWORTH)
    transition = (1.0 + s / (2.0 * math.pi * 12.5)) / quadratic(12.5, 0.63)
    step = quadratic(2.37, 0.91) / quadratic(3.35, 0.91) * (2.37 / 3.35) ** 2
    return high / quadratic(100.0, _BUTTERWORTH) * transition * step
