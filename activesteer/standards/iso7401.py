"""ISO 7401: lateral transient response, step input and continuous sinusoidal input."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.analysis.frequency_response import INPUT, FrequencyResponse, HIGHEST_Hz, LOWEST_Hz, frequency_response
from activesteer.errors import RecordingError
from activesteer.quantities import DisplayUnit, display_unit
from activesteer.standards.standard import (
    SIDES,
    Curve,
    Findings,
    Ground,
    Panel,
    Picture,
    Run,
    Standard,
    metrics_table,
    time_panels,
)
from activesteer.standards.steering_angle import steering_wheel_at

SPEED_KMH: Final = 80.0
"""Speed of all runs [km/h]."""
STEP_MPS2: Final = 4.0
"""Steady-state lateral acceleration of the step [m/s2]."""
_STEP_CHANNELS: Final = ("yaw_rate_radps", "ay_mps2", "sideslip_rad", "roll_rad")
_BEGIN_S: Final = 0.5
_RESPONSES: Final = {
    "yaw_rate_radps": DisplayUnit("1/s", 1.0),
    "ay_mps2": display_unit("_mps2prad"),
    "roll_rad": DisplayUnit("deg/deg", 1.0),
}
"""Outputs and the units of their gains, which count from the steering wheel angle."""
_POINTS: Final = 60


def _examine(ground: Ground) -> Findings:
    angle_deg = steering_wheel_at(ground, SPEED_KMH, STEP_MPS2)
    driven = ground.drive(
        "step_steer",
        "step_steer",
        [{"steer.steering_wheel_deg": sign * angle_deg} for sign in SIDES.values()],
        {"speed_kmh": SPEED_KMH, "steer.start_s": _BEGIN_S},
        _STEP_CHANNELS,
    )
    steps = dict(zip(SIDES, driven, strict=True))
    [sweep] = ground.drive("sine_sweep", "sine_sweep", [{"speed_kmh": SPEED_KMH}], curves=(INPUT, *_RESPONSES))
    found = _responses(sweep)
    left = steps["left"]
    bandwidth_Hz = sweep.metric("yaw_rate_bandwidth_Hz")
    summary = (
        f"step of {STEP_MPS2:g} m/s²: yaw rate response time {left.metric('yaw_rate_response_time_s'):.3f} s, "
        f"overshoot {100.0 * left.metric('yaw_rate_overshoot'):.1f} %, TB {math.degrees(left.metric('tb_srad')):.2f} "
        "s deg; yaw rate bandwidth "
        + (f"above {HIGHEST_Hz:g} Hz" if math.isnan(bandwidth_Hz) else f"{bandwidth_Hz:.2f} Hz")
    )
    errors = [run.error for run in (*driven, sweep) if run.error]
    values = {
        "steering_wheel_deg": angle_deg,
        "steps": [{"direction": side, **run.values} for side, run in steps.items()],
        "sweep": sweep.values,
        "responses": {
            name: {
                "frequency_Hz": each.frequency_Hz.tolist(),
                "gain": np.abs(each.response).tolist(),
                "phase_rad": np.unwrap(np.angle(each.response)).tolist(),
                "coherence": each.coherence.tolist(),
            }
            for name, each in found.items()
        },
    }
    tables = [
        metrics_table(f"Step, {angle_deg:.1f} deg", {f"to the {side}": run.metrics for side, run in steps.items()}),
        metrics_table("Sine sweep", {"sweep": sweep.metrics}),
    ]
    pictures = [
        Picture("Step", time_panels(steps, _STEP_CHANNELS, _BEGIN_S, "the beginning of steer")),
        *(_bode(name, each) for name, each in found.items()),
    ]
    return Findings(values, f"no result: {errors[0]}" if errors else summary, tables, pictures)


def _responses(sweep: Run) -> dict[str, FrequencyResponse]:
    """Frequency responses to the steering wheel angle; none where the sweep failed."""
    frequencies = np.geomspace(LOWEST_Hz, HIGHEST_Hz, _POINTS)
    try:
        return {name: frequency_response(sweep, name, frequencies) for name in _RESPONSES}
    except RecordingError:
        return {}


def _bode(name: str, found: FrequencyResponse) -> Picture:
    unit = _RESPONSES[name]
    phase = np.degrees(np.unwrap(np.angle(found.response)))
    shown = {
        f"gain [{unit.name}]": unit.factor * np.abs(found.response),
        "phase [deg]": phase,
        "coherence [-]": found.coherence,
    }
    words = {"yaw_rate_radps": "Yaw rate", "ay_mps2": "Lateral acceleration", "roll_rad": "Roll angle"}
    panels = [Panel("frequency [Hz]", label, [Curve(found.frequency_Hz, y)], log=True) for label, y in shown.items()]
    return Picture(f"{words[name]} over steering wheel angle", panels)


STANDARD: Final = Standard(
    name="iso7401",
    title="ISO 7401: lateral transient response, step and continuous sinusoidal input",
    edition="ISO 7401:2011, as it is known from the literature; the text itself was not at hand.",
    implemented=(
        "Step input at 80 km/h to the angle at which the tested car reaches 4 m/s² in a slow ramp, 400 deg/s, left and "
        "right: steady state, response times to 90 %, peak response times, overshoot, TB.",
        "Continuous sinusoidal input with rising frequency, 0.1 to 5 Hz, 9 deg: frequency responses of yaw rate, "
        "lateral acceleration and roll angle from 0.2 to 4 Hz with phase and coherence, bandwidth, phase at 1 Hz.",
    ),
    left_out=(
        "Random, pulse and single-sine input. Other speeds than 80 km/h.",
        "Filters: the signals are those of the model, without noise.",
    ),
    examine=_examine,
)
"""ISO 7401."""
