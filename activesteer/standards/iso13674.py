"""ISO 13674: on-centre handling, weave test and transition test."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from activesteer.core.conventions import CURVE_STEP_S, Array
from activesteer.core.units import quantity_of
from activesteer.errors import RecordingError
from activesteer.pages import Table
from activesteer.plotting import Curve, Panel, Picture
from activesteer.standards.standard import (
    Findings,
    NoResult,
    StandardRun,
    StandardRunner,
    axis_label,
    cell,
    steering_wheel_at,
)

SPEED_KMH: Final = 100.0
"""Speed [km/h]."""
AY_MPS2: Final = 2.0
"""Lateral acceleration of the weave's peaks, and of the end of the transition [m/s2]."""
WEAVE_Hz: Final = 0.2
"""Frequency of the weave [Hz]."""
PERIODS: Final = 6
_DROPPED: Final = 2
"""Number of periods, and number of initial periods that are not evaluated, because the motion is not yet periodic."""
TRANSITION_DEGPS: Final = 5.0
"""Rate of the steering wheel in the transition test [deg/s]."""
_CENTRE_MPS2: Final = 0.5
"""Range of lateral acceleration to either side for the slopes of the transition [m/s2]."""
_BEGIN_S: Final = 1.0
_SAMPLE_S: Final = 0.02
_CHANNELS: Final = ("steering_wheel_rad", "yaw_rate_radps", "ay_mps2", "hand_torque_Nm")
_PLOTS: Final = (
    ("steering_wheel_rad", "ay_mps2"),
    ("steering_wheel_rad", "yaw_rate_radps"),
    ("steering_wheel_rad", "hand_torque_Nm"),
    ("ay_mps2", "hand_torque_Nm"),
)
"""Abscissa and ordinate of each cross-plot."""
AROUND: Final = 0.2
"""Range of the gradient of a loop around zero, as a fraction of the largest abscissa."""

Signals = Mapping[str, Array]


def loop(x: Array, y: Array) -> dict[str, float]:
    """Return gradient and dead bands of a loop at its zero crossings, averaged over all periods."""
    # The ordinate's dead band is the height of the loop at abscissa zero, positive if the ordinate lags behind the
    # abscissa; the abscissa's is the width at ordinate zero, with the same sign.
    up, down = (_crossings(x, y, sign) for sign in (1.0, -1.0))
    right, left = (_crossings(y, x, sign) for sign in (1.0, -1.0))
    rate = np.gradient(x)
    near = np.abs(x) < AROUND * float(np.abs(x).max())
    slopes = [slope(x[part], y[part]) for part in (near & (rate > 0.0), near & (rate < 0.0))]
    return {
        "gradient": 0.5 * sum(slopes),
        "ordinate_dead_band": float(np.mean(down) - np.mean(up)),
        "abscissa_dead_band": float(np.mean(right) - np.mean(left)),
    }


def _crossings(x: Array, y: Array, sign: float) -> Array:
    """Return the interpolated values of y at the zero crossings of x, upwards (1) or downwards (-1)."""
    places = np.flatnonzero((sign * x[:-1] < 0.0) & (sign * x[1:] >= 0.0))
    if places.size == 0:
        raise RecordingError("the signals form no loop: one of them does not pass through zero")
    fraction = x[places] / (x[places] - x[places + 1])
    return y[places] + fraction * (y[places + 1] - y[places])


def slope(x: Array, y: Array) -> float:
    """Return the slope of the line through points, or nan for fewer than three points."""
    return float(np.polynomial.Polynomial.fit(x, y, 1).convert().coef[1]) if len(x) > 2 else math.nan


def weave_loops(signals: Signals) -> list[dict[str, Any]]:
    """Return gradient and dead bands of every cross-plot."""
    found = []
    for abscissa, ordinate in _PLOTS:
        x, y = (quantity_of(name).factor * signals[name] for name in (abscissa, ordinate))
        try:
            values: dict[str, float | None] = {**loop(x, y)}
        except RecordingError:
            values = dict.fromkeys(("gradient", "ordinate_dead_band", "abscissa_dead_band"))
        found.append({"abscissa": axis_label(abscissa), "ordinate": axis_label(ordinate), **values})
    return found


def examine(runner: StandardRunner) -> Findings:
    """Drive and evaluate one car with one controller."""
    angle_deg = steering_wheel_at(runner, SPEED_KMH, AY_MPS2)
    [weave] = runner.drive("weave", _weave(angle_deg), [{"speed_kmh": SPEED_KMH}], curves=_CHANNELS)
    transition = runner.drive(
        "transition",
        "slowly_increasing_steer",
        [{"steer.rate_degps": sign * TRANSITION_DEGPS} for sign in (1.0, -1.0)],
        {"speed_kmh": SPEED_KMH, "duration_s": 2.0 * angle_deg / TRANSITION_DEGPS + _BEGIN_S},
        _CHANNELS,
    )
    failed = [run.error for run in (weave, *transition) if not run.channels]
    if failed:
        raise NoResult(failed[0])
    first = round((_BEGIN_S + _DROPPED / WEAVE_Hz) / CURVE_STEP_S)
    last = round((_BEGIN_S + PERIODS / WEAVE_Hz) / CURVE_STEP_S)
    periodic = {name: weave[name][first:last] for name in _CHANNELS}
    loops = weave_loops(periodic)
    through = _through_centre(transition)
    lines = transition_lines(through)
    summary = (
        f"weave: {loops[0]['gradient']:.3f} m/s² per deg of the steering wheel, dead band "
        f"{loops[0]['abscissa_dead_band']:.2f} deg; transition: {lines[0]['slope']:.3f} m/s² per deg"
    )
    tables = [
        Table(
            f"Weave, {WEAVE_Hz:g} Hz, {angle_deg:.1f} deg",
            ("abscissa", "ordinate", "gradient", "ordinate dead band", "abscissa dead band"),
            [(row["abscissa"], row["ordinate"], *(cell(row[key], 4) for key in list(row)[2:])) for row in loops],
        ),
        Table(
            f"Transition through straight ahead, {TRANSITION_DEGPS:g} deg/s",
            ("abscissa", "ordinate", "slope", "intercept"),
            [(row["abscissa"], row["ordinate"], cell(row["slope"], 4), cell(row["intercept"], 4)) for row in lines],
        ),
    ]
    pictures = [Picture("Weave", _panels(periodic)), Picture("Transition", _panels(through))]
    values = {"steering_wheel_deg": angle_deg, "weave": loops, "transition": lines}
    return Findings(values, summary, tables, pictures)


def _weave(angle_deg: float) -> dict[str, Any]:
    """Return the manoeuvre: a second straight ahead, then the sine."""
    length_s = PERIODS / WEAVE_Hz
    times = np.arange(round(length_s / _SAMPLE_S) + 1) * _SAMPLE_S
    angles = angle_deg * np.sin(2.0 * math.pi * WEAVE_Hz * times)
    return {
        "kind": "open_loop",
        "name": "weave",
        "speed_kmh": SPEED_KMH,
        "duration_s": _BEGIN_S + length_s,
        "steering": {
            "time_s": [round(time, 6) for time in (times + _BEGIN_S).tolist()],
            "steering_wheel_deg": [round(angle, 6) for angle in angles.tolist()],
        },
    }


def _through_centre(runs: list[StandardRun]) -> dict[str, Array]:
    """Join both transitions from the right to the left, up to the required lateral acceleration."""
    left, right = ({name: run[name] for name in _CHANNELS} for run in runs)
    ends = [int(np.argmax(np.abs(side["ay_mps2"]) >= AY_MPS2)) or len(side["ay_mps2"]) for side in (left, right)]
    return {name: np.concatenate([right[name][: ends[1]][::-1], left[name][: ends[0]]]) for name in _CHANNELS}


def transition_lines(signals: Signals) -> list[dict[str, Any]]:
    """Return the slopes of the car's response at the centre, and the hand torque lines outside the centre."""
    ay = signals["ay_mps2"]
    near = np.abs(ay) <= _CENTRE_MPS2
    found = []
    for abscissa, ordinate in _PLOTS:
        x, y = (quantity_of(name).factor * signals[name] for name in (abscissa, ordinate))
        if ordinate == "hand_torque_Nm":
            line = np.polynomial.Polynomial.fit(np.abs(x[~near]), (np.sign(x) * y)[~near], 1).convert().coef
            intercept, gradient = (float(value) for value in line)
        else:
            intercept, gradient = None, slope(x[near], y[near])
        found.append(
            {
                "abscissa": axis_label(abscissa),
                "ordinate": axis_label(ordinate),
                "slope": gradient,
                "intercept": intercept,
            }
        )
    return found


def _panels(signals: Signals) -> list[Panel]:
    shown = {name: quantity_of(name).factor * values for name, values in signals.items()}
    return [Panel(axis_label(x), axis_label(y), [Curve(shown[x], shown[y])]) for x, y in _PLOTS]
