"""Synthetic recordings from formulas, for tests of the analysis."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from activesteer.errors import RecordingError

STEP_S = 1.0
"""Time at which the steering wheel of the synthetic runs passes half of its final angle [s]."""

RAMP_S = 0.1
"""Duration of its ramp [s]."""


VEHICLE: dict[str, Any] = {
    "single_track": {
        "mass_kg": 1400.0, "yaw_inertia_kgm2": 2200.0, "cg_to_front_m": 1.0, "cg_to_rear_m": 1.6,
        "front_stiffness_Nprad": 100e3, "rear_stiffness_Nprad": 150e3,
    },
    "controllers": {
        "ars": {"prediction_gain": 0.1, "corrector": {"deadband_start_radps": 0.002, "deadband_end_radps": 0.005}},
        "afs": {"corrector": {"deadband_start_radps": 0.002, "deadband_end_radps": 0.005}},
    },
}  # fmt: skip
"""What the metadata of a run say of its vehicle, as far as the analysis reads it."""


class SyntheticRun:
    """A recording of computed arrays, without a drive."""

    def __init__(self, time_s: np.ndarray, channels: Mapping[str, np.ndarray], kind: str = "step_steer") -> None:
        self.time_s = time_s
        maneuver = {"kind": kind, "duration_s": float(time_s[-1])}
        self.metadata: dict[str, Any] = {"maneuver": maneuver, "controller": "none", "vehicle": VEHICLE}
        self.channels = dict(channels)

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.channels:
            raise RecordingError(f"no channel {name!r}", value=name)
        return self.channels[name]


def elsewhere(run: SyntheticRun, turn_rad: float, x_m: float = 30.0, y_m: float = -12.0) -> SyntheticRun:
    """Return the same run in a world that is turned and moved, with its yaw angle between -pi and pi."""
    cos, sin = np.cos(turn_rad), np.sin(turn_rad)
    channels = dict(run.channels)
    for name in [name.removesuffix("x_m") for name in channels if name == "x_m" or name.endswith("_x_m")]:
        x, y = channels[f"{name}x_m"], channels[f"{name}y_m"]
        channels[f"{name}x_m"], channels[f"{name}y_m"] = x_m + cos * x - sin * y, y_m + sin * x + cos * y
    channels["yaw_rad"] = np.angle(np.exp(1j * (channels["yaw_rad"] + turn_rad)))
    moved = SyntheticRun(run.time_s, channels)
    moved.metadata = run.metadata
    return moved


Response = Callable[[np.ndarray], np.ndarray]


def first_order(time_s: np.ndarray, lag_s: float = 0.2) -> np.ndarray:
    """Return the unit step response of a first-order lag from t = 0 on."""
    after_s = np.maximum(time_s, 0.0)
    return np.where(time_s >= 0.0, 1.0 - np.exp(-after_s / lag_s), 0.0)


def second_order(time_s: np.ndarray, natural_radps: float = 9.0, damping: float = 0.5) -> np.ndarray:
    """Return the unit step response of an underdamped second-order lag from t = 0 on."""
    after_s = np.maximum(time_s, 0.0)
    root = np.sqrt(1.0 - damping**2)
    decay = np.exp(-damping * natural_radps * after_s)
    phase = root * natural_radps * after_s
    return np.where(time_s >= 0.0, 1.0 - decay * (np.cos(phase) + damping / root * np.sin(phase)), 0.0)


def step_steer(
    yaw: Response = second_order,
    *,
    side: float = 1.0,
    yaw_radps: float = 0.2,
    sideslip_rad: float = -0.01,
    rear_rad: float = 0.0,
    superposition_rad: float = 0.0,
    ay_lag_s: float = 0.2,
    duration_s: float = 7.0,
    timestep_s: float = 0.001,
) -> SyntheticRun:
    """Return a step steer to the left (side 1) or right (-1): signals step at `STEP_S` to the given final values."""
    time_s = np.arange(round(duration_s / timestep_s) + 1) * timestep_s
    since_s = time_s - STEP_S
    ramp = np.clip(since_s / RAMP_S + 0.5, 0.0, 1.0)
    channels = {
        "steering_wheel_rad": 1.0 * ramp,
        "front_steer_rad": ramp / 16.0,
        "rear_steer_rad": rear_rad * first_order(since_s),
        "rear_steer_demand_rad": rear_rad * (since_s >= 0.0),
        "superposition_rad": superposition_rad * first_order(since_s),
        "superposition_demand_rad": superposition_rad * (since_s >= 0.0),
        "yaw_rate_radps": yaw_radps * yaw(since_s),
        "yaw_rate_desired_radps": yaw_radps * first_order(since_s, 0.1),
        "ay_mps2": 4.0 * first_order(since_s, ay_lag_s),
        "roll_rad": 0.04 * second_order(since_s),
        "sideslip_rad": sideslip_rad * first_order(since_s, 0.3),
    }
    mirrored = {name: side * values for name, values in channels.items()}
    return SyntheticRun(time_s, {**mirrored, "speed_mps": np.full_like(time_s, 22.0)})


SINE_BEGIN_S = 0.5
SINE_Hz = 0.7
DWELL_S = 0.5
REVERSAL_S = SINE_BEGIN_S + 0.5 / SINE_Hz
COMPLETION_S = SINE_BEGIN_S + 1.0 / SINE_Hz + DWELL_S
"""Times of the synthetic sine with dwell [s]."""


def sine_with_dwell(
    *,
    side: float = 1.0,
    amplitude_rad: float = 2.5,
    peak_radps: float = 0.5,
    after_1000ms: float = 0.1,
    after_1750ms: float = 0.05,
    sideslip_rad: float = 0.05,
    rear_rad: float = 0.0,
    superposition_rad: float = 0.0,
    ay_mps2: float = 8.0,
    creep_s: float = 0.0,
    duration_s: float = 6.0,
) -> SyntheticRun:
    """A sine with dwell: the yaw rate follows the second half to its peak, stays, and passes the two shares given.

    Args:
        side: 1 begins to the left, -1 to the right.
        amplitude_rad: Of the steering wheel.
        peak_radps: Of the yaw rate after the reversal.
        after_1000ms: Yaw rate over its peak 1.00 s after the completion of steer.
        after_1750ms: The same 1.75 s after.
        sideslip_rad: Peak of the sideslip.
        rear_rad: Largest rear angle, in the direction of the steering wheel's.
        superposition_rad: Largest superposed angle, likewise.
        ay_mps2: Lateral acceleration, with which the position goes.
        creep_s: Time constant with which the wheel takes its last 3 deg to the centre; 0 is at once.
        duration_s: Length of the run.
    """
    time_s = np.arange(round(duration_s * 1000.0) + 1) * 0.001
    since_s = time_s - SINE_BEGIN_S
    dwell_s = 0.75 / SINE_Hz
    phase_s = np.clip(np.where(since_s < dwell_s, since_s, np.maximum(since_s - DWELL_S, dwell_s)), 0.0, 1.0 / SINE_Hz)
    steering = amplitude_rad * np.sin(2.0 * np.pi * SINE_Hz * phase_s)
    if creep_s:
        last_rad = np.radians(3.0)
        late = since_s - DWELL_S > dwell_s
        start = time_s[late & (steering > -last_rad)][0]
        creeping = -last_rad * np.exp(-np.maximum(time_s - start, 0.0) / creep_s)
        steering = np.where(late & (time_s >= start), creeping, steering)
    first_s = SINE_BEGIN_S + 0.25 / SINE_Hz
    second_s = REVERSAL_S + 0.3
    knots_s = (SINE_BEGIN_S, first_s, REVERSAL_S, second_s, COMPLETION_S, COMPLETION_S + 1.0, COMPLETION_S + 1.75)
    # The level at the completion is high: a ratio that counts from anywhere else is far from those asked for.
    knots = (0.0, 0.6, 0.3, -1.0, -0.9, -after_1000ms, -after_1750ms)
    channels = {
        "steering_wheel_rad": steering,
        "yaw_rate_radps": peak_radps * np.interp(time_s, knots_s, knots),
        "sideslip_rad": sideslip_rad * np.exp(-((time_s - second_s) ** 2) / 0.1),
        "roll_rad": 0.05 * steering / amplitude_rad,
        "ay_mps2": ay_mps2 * (since_s >= 0.0),
        "y_m": 0.5 * ay_mps2 * np.maximum(since_s, 0.0) ** 2,
        "yaw_rad": np.zeros_like(time_s),
        "rear_steer_rad": rear_rad * steering / amplitude_rad,
        "rear_steer_demand_rad": rear_rad * steering / amplitude_rad,
        "superposition_rad": superposition_rad * steering / amplitude_rad,
        "superposition_demand_rad": superposition_rad * steering / amplitude_rad,
    }
    mirrored = {name: side * values for name, values in channels.items()}
    speed = {"speed_mps": np.full_like(time_s, 22.0), "x_m": 22.0 * time_s}
    return SyntheticRun(time_s, {**mirrored, **speed}, "sine_with_dwell")


SPEED_MPS = 20.0
WIDTH_M, WHEELBASE_M, TRACK_M, TYRE_M = 1.8, 2.6, 1.5, 0.2
LANES = (("entry", 30.0, 45.0, -1.6, 1.6), ("offset", 75.0, 100.0, 1.9, 5.1), ("exit", 125.0, 155.0, -1.7, 1.7))
LANE_KEYS = ("name", "start_x_m", "end_x_m", "right_y_m", "left_y_m")
LAST_GATE_M = 155.0
"""Course and car of the synthetic runs along a path."""

Track = Callable[[np.ndarray], np.ndarray]


def offset_track(x_m: np.ndarray, offset_m: float = 3.5) -> np.ndarray:
    """Return a track through the middle of `LANES`: to the left from 45 to 75 m, back from 100 to 125 m."""
    return np.interp(x_m, (45.0, 75.0, 100.0, 125.0), (0.0, offset_m, offset_m, 0.0))


def along_path(
    track: Track = offset_track,
    *,
    kind: str = "lane_change",
    path: Track | None = None,
    lanes: tuple[tuple[str, float, float, float, float], ...] = LANES,
    cones: tuple[tuple[float, float], ...] = (),
    last_gate_m: float | None = LAST_GATE_M,
    yaw_rate: Track | float = 0.1,
    sideslip: Track | float = 0.02,
    after: float = 1.0,
    steering_rad: float = 1.0,
    steering_lead_s: float = 0.1,
    friction_utilisation: float = 0.5,
    stops_m: float | None = None,
    rear_rad: float = 0.0,
    superposition_rad: float = 0.0,
    duration_s: float = 12.0,
    timestep_s: float = 0.002,
) -> SyntheticRun:
    """A run at `SPEED_MPS` whose front axle centre follows a track; yaw rate and sideslip are sines of their own.

    Args:
        track: y of the front axle centre over x.
        kind: Kind of the manoeuvre.
        path: y of the path asked for over x; the track where not given.
        lanes: Lanes of the course.
        cones: Its cones.
        last_gate_m: Its last gate.
        yaw_rate: Amplitude, 1 Hz [rad/s], or values over time.
        sideslip: Amplitude, 1 Hz [rad], or values over time.
        after: Factor on both after the last gate.
        steering_rad: Amplitude of the steering wheel angle.
        steering_lead_s: Time by which it is ahead of the yaw rate.
        friction_utilisation: Of the front left tyre; the others use half.
        stops_m: Place beyond which the car does not get.
        rear_rad: Amplitude of the rear angle demanded.
        superposition_rad: Amplitude of the superposed angle demanded.
        duration_s: Length of the run.
        timestep_s: Interval of the samples.
    """
    time_s = np.arange(round(duration_s / timestep_s)) * timestep_s
    x = SPEED_MPS * time_s
    if stops_m is not None:
        x = np.minimum(x, stops_m)
    y = track(x)
    step_m = SPEED_MPS * timestep_s
    heading = np.arctan2(np.gradient(track(np.append(x, x[-1] + step_m)))[:-1], step_m)
    gain = np.where(x >= (last_gate_m or np.inf), after, 1.0)
    sine = np.sin(2.0 * np.pi * time_s)
    channels = {
        "front_axle_x_m": x,
        "front_axle_y_m": y,
        "yaw_rad": heading,
        "yaw_rate_radps": gain * (yaw_rate(time_s) if callable(yaw_rate) else yaw_rate * sine),
        "sideslip_rad": gain * (sideslip(time_s) if callable(sideslip) else sideslip * sine),
        "ay_mps2": gain * 4.0 * np.sin(2.0 * np.pi * (time_s - 0.05)),
        "roll_rad": 0.04 * sine,
        "steering_wheel_rad": gain * steering_rad * np.sin(2.0 * np.pi * (time_s + steering_lead_s)),
        "speed_mps": np.linspace(SPEED_MPS, SPEED_MPS - 1.0, len(time_s)),
        "rear_steer_rad": np.zeros_like(x),
        "rear_steer_demand_rad": rear_rad * sine,
        "superposition_rad": np.zeros_like(x),
        "superposition_demand_rad": superposition_rad * sine,
    }
    cos, sin = np.cos(heading), np.sin(heading)
    for corner in ("fl", "fr", "rl", "rr"):
        ahead = -WHEELBASE_M if corner.startswith("r") else 0.0
        left = 0.5 * TRACK_M if corner.endswith("l") else -0.5 * TRACK_M
        channels[f"{corner}_contact_x_m"] = x + ahead * cos - left * sin
        channels[f"{corner}_contact_y_m"] = y + ahead * sin + left * cos
        channels[f"{corner}_friction_utilisation"] = np.full_like(
            x, friction_utilisation if corner == "fl" else 0.5 * friction_utilisation
        )
    run = SyntheticRun(time_s, channels, kind)
    path_x = np.arange(0.0, 300.0, 0.5)
    run.metadata["course"] = {
        "path": {"x_m": path_x.tolist(), "y_m": (path or track)(path_x).tolist()},
        "lanes": [dict(zip(LANE_KEYS, lane, strict=True)) for lane in lanes],
        "cones": [list(cone) for cone in cones],
        "last_gate_x_m": last_gate_m,
    }
    run.metadata["car"] = {
        "width_m": WIDTH_M, "wheelbase_m": WHEELBASE_M, "front_track_m": TRACK_M, "rear_track_m": TRACK_M,
        "tyre_width_m": [TYRE_M, TYRE_M],
    }  # fmt: skip
    return run


SLALOM_CONES = tuple((40.0 + 30.0 * i, 0.0) for i in range(5))


def slalom(amplitude_m: float = 1.5, **words: Any) -> SyntheticRun:
    """Return a sine around `SLALOM_CONES` that passes left of the first cone."""

    def track(x_m: np.ndarray) -> np.ndarray:
        inside = np.clip((x_m - 25.0) / 15.0, 0.0, 1.0) * np.clip((175.0 - x_m) / 15.0, 0.0, 1.0)
        return amplitude_m * inside * np.cos(np.pi * (x_m - 40.0) / 30.0)

    arguments = {"lanes": (), "cones": SLALOM_CONES, "last_gate_m": SLALOM_CONES[-1][0], **words}
    return along_path(track, kind="slalom", **arguments)
