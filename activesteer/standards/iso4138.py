"""ISO 4138: steady-state circular driving, by its three methods."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from activesteer.analysis.handling import FIT_MPS2, CarGeometry, evaluate
from activesteer.core.conventions import Array
from activesteer.core.metric_table import metric
from activesteer.core.units import quantity_of
from activesteer.errors import RecordingError
from activesteer.plotting import Curve, Panel, Picture
from activesteer.standards.standard import SIDES, Findings, StandardRun, StandardRunner, axis_label, metrics_table

RADIUS_M: Final = 100.0
"""Radius of the first method [m]."""
FIXED_RADIUS_M: Final = 40.0
"""Initial radius of the second method [m]."""
SPEED_KMH: Final = 80.0
"""Speed of the third method [km/h]."""
_CHANNELS: Final = (
    "steering_wheel_rad", "ay_mps2", "vx_mps", "yaw_rate_radps", "sideslip_rad", "roll_rad",
)  # fmt: skip
_ENTRY_S: Final = 6.0
_START_KMH: Final = 15.0
_RISE_MPS2: Final = 0.4
"""Rise of the speed of the second method [m/s2]."""
_DURATION_S: Final = 90.0
_FIXED_ANGLE: Final = f"constant steering wheel angle, from {FIXED_RADIUS_M:g} m on"
_RESULT: Final = "understeer_gradient_radpmps2"


def examine(runner: StandardRunner) -> Findings:
    """Drive and evaluate one car with one controller."""
    config = runner.scenario("constant_radius").car.config
    single_track = config.single_track
    car = CarGeometry(single_track.cg_to_front_m, single_track.cg_to_rear_m, config.steering.ratio)
    methods = {
        f"constant radius {RADIUS_M:g} m": runner.drive(
            "constant_radius",
            "constant_radius",
            [{"circle.radius_m": sign * RADIUS_M} for sign in SIDES.values()],
            curves=_CHANNELS,
        ),
        _FIXED_ANGLE: _fixed_angle(runner, car),
        f"constant speed {SPEED_KMH:g} km/h": runner.drive(
            "constant_speed",
            "slowly_increasing_steer",
            [{"steer.rate_degps": sign * 5.0} for sign in SIDES.values()],
            {"speed_kmh": SPEED_KMH},
            _CHANNELS,
        ),
    }
    tables, pictures, values, words = [], [], {}, []
    for method, runs in methods.items():
        found: dict[str, dict[str, float]] = {}
        values[method] = []
        for side, run in zip(SIDES, runs, strict=True):
            try:
                metrics = evaluate(run, car).items()
                found[side] = {name: value for name, value in metrics if not math.isnan(value)}
                values[method].append({"direction": side, **found[side]})
            except RecordingError as error:
                values[method].append({"direction": side, "error": str(error)})
        tables.append(metrics_table(method[0].upper() + method[1:], found))
        pictures.append(_picture(method, dict(zip(SIDES, runs, strict=True))))
        words.append(f"{method}: {_words(found)}")
    return Findings({"methods": values}, "; ".join(words), tables, pictures)


def _fixed_angle(runner: StandardRunner, car: CarGeometry) -> list[StandardRun]:
    """Drive at rising speed with the steering wheel held at the Ackermann angle of the radius."""
    angle_deg = math.degrees(car.steering_ratio * car.wheelbase_m / FIXED_RADIUS_M)
    speed_mps = _START_KMH / 3.6
    maneuver: dict[str, Any] = {
        "kind": "open_loop",
        "name": "constant_steering_wheel_angle",
        "speed_mps": speed_mps,
        "duration_s": _DURATION_S,
        "hold_last": True,
        "speed": {
            "time_s": [0.0, _ENTRY_S, _DURATION_S],
            "speed_mps": [speed_mps, speed_mps, speed_mps + _RISE_MPS2 * (_DURATION_S - _ENTRY_S)],
        },
    }
    cases = [
        {"steering": {"time_s": [0.0, 0.5 * _ENTRY_S], "steering_wheel_deg": [0.0, sign * angle_deg]}}
        for sign in SIDES.values()
    ]
    # The values of a factor cannot be tables, so each side is a series.
    return [
        runner.drive(f"constant_angle_{side}", {**maneuver, **case}, [{"speed_kmh": _START_KMH}], curves=_CHANNELS)[0]
        for side, case in zip(SIDES, cases, strict=True)
    ]


def _words(found: dict[str, dict[str, float]]) -> str:
    if not found:
        return "no result"
    metrics = next(iter(found.values()))
    gradient = metric(_RESULT).unit.factor * metrics[_RESULT]
    linear = metrics.get("linear_range_mps2")
    return (
        f"understeer gradient {gradient:.2f} deg/g, "
        + ("" if linear is None else f"linear to {linear:.1f} m/s², ")
        + f"up to {metrics['limit_acceleration_mps2']:.1f} m/s²"
    )


def _picture(method: str, runs: dict[str, StandardRun]) -> Picture:
    def panel(channel: str) -> Panel:
        factor = quantity_of(channel).factor
        curves = []
        for side, run in runs.items():
            if run.error and not run.channels:
                continue
            ay = _smooth(run["ay_mps2"])
            # The car enters the circle below the range of the gradients.
            shown = slice(int(np.argmax(np.abs(ay) >= FIT_MPS2[0])), int(np.argmax(np.abs(ay))) + 1)
            curves.append(Curve(np.abs(ay[shown]), SIDES[side] * factor * _smooth(run[channel])[shown], side))
        return Panel("lateral acceleration [m/s²]", axis_label(channel), curves)

    # The yaw rate takes the place of a steering wheel that is held.
    first = "yaw_rate_radps" if method == _FIXED_ANGLE else "steering_wheel_rad"
    channels = (first, "sideslip_rad", "roll_rad")
    return Picture(method[0].upper() + method[1:], [panel(channel) for channel in channels])


def _smooth(values: Array) -> Array:
    """Return the moving mean over half a second for the figure."""
    width = 25
    return np.convolve(values, np.full(width, 1.0 / width), mode="valid") if len(values) > width else values
