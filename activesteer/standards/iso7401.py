"""ISO 7401: lateral transient response to step, sinusoidal and random input."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from activesteer.analysis.frequency_response import (
    INPUT,
    FrequencyResponse,
    HIGHEST_Hz,
    LOWEST_Hz,
    frequency_response,
    random_response,
)
from activesteer.core.conventions import Array
from activesteer.core.units import DisplayUnit, display_unit, quantity_of
from activesteer.errors import RecordingError
from activesteer.pages import Table
from activesteer.plotting import Curve, Panel, Picture
from activesteer.standards.standard import (
    SIDES,
    Findings,
    StandardRun,
    StandardRunner,
    metrics_table,
    steering_wheel_at,
    time_panels,
)

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
"""Outputs and the units of their gains over steering wheel angle."""
_POINTS: Final = 60
SEQUENCES: Final = 12
"""Number of one-minute runs with random steering. The standard requires 12 minutes."""
RANDOM_SHARE: Final = 0.2
"""Root mean square of the random angle, as a fraction of the step's angle: the peaks stay below the step."""
COHERENCE: Final = 0.95
"""Bound of the coherence; below it, noise and nonlinearity cause more than a twentieth of the output's power."""

Responses = dict[str, FrequencyResponse]


def examine(runner: StandardRunner) -> Findings:
    """Drive and evaluate one car with one controller."""
    angle_deg = steering_wheel_at(runner, SPEED_KMH, STEP_MPS2)
    driven = runner.drive(
        "step_steer",
        "step_steer",
        [{"steer.steering_wheel_deg": sign * angle_deg} for sign in SIDES.values()],
        {"speed_kmh": SPEED_KMH, "steer.start_s": _BEGIN_S},
        _STEP_CHANNELS,
    )
    steps = dict(zip(SIDES, driven, strict=True))
    [sweep] = runner.drive("sine_sweep", "sine_sweep", [{"speed_kmh": SPEED_KMH}], curves=(INPUT, *_RESPONSES))
    rms_deg = round(RANDOM_SHARE * angle_deg, 1)
    random = runner.drive(
        "random_steer",
        "random_steer",
        [{"random.seed": seed} for seed in range(SEQUENCES)],
        {"speed_kmh": SPEED_KMH, "random.rms_deg": rms_deg},
        (INPUT, *_RESPONSES),
    )
    averaged = _random_responses(random)
    found = {"sweep": _sweep_responses(sweep), "random": averaged}
    weak = {(kind, name): weak_ranges(each) for kind, responses in found.items() for name, each in responses.items()}
    left = steps["left"]
    bandwidth_Hz = sweep.metric("yaw_rate_bandwidth_Hz")
    summary = (
        f"step of {STEP_MPS2:g} m/s², {angle_deg:.1f} deg: "
        f"yaw rate response time {left.metric('yaw_rate_response_time_s'):.3f} s, "
        f"overshoot {100.0 * left.metric('yaw_rate_overshoot'):.1f} %, "
        f"TB factor {math.degrees(left.metric('tb_srad')):.2f} s deg; yaw rate bandwidth "
        + (f"above {HIGHEST_Hz:g} Hz" if math.isnan(bandwidth_Hz) else f"{bandwidth_Hz:.2f} Hz")
        + "".join(
            f"; coherence below {COHERENCE:g}: {quantity_of(name).label}, {kind}, {words}"
            for (kind, name), words in weak.items()
            if words
        )
    )
    errors = [run.error for run in (*driven, sweep, *random) if run.error]
    if errors:
        summary = f"{len(errors)} of {len(driven) + 1 + len(random)} runs failed, the first: {errors[0]}; {summary}"
    values = {
        "steering_wheel_deg": angle_deg,
        "steps": [{"direction": side, **run.values} for side, run in steps.items()],
        "sweep": sweep.values,
        "random": {
            "rms_deg": rms_deg,
            "runs": [run.values for run in random],
            "averages": max((each.averages for each in averaged.values()), default=0.0),
            "gain_error": {name: each.gain_error.tolist() for name, each in averaged.items()},
        },
        "responses": {
            kind: {name: _values(each) for name, each in responses.items()} for kind, responses in found.items()
        },
    }
    tables = [
        metrics_table("Step", {side: run.metrics for side, run in steps.items()}),
        metrics_table("Sine sweep", {"sweep": sweep.metrics}),
        _coherence_table(found, weak),
    ]
    driven_of = {kind: responses for kind, responses in found.items() if responses}
    pictures = [
        Picture("Step", time_panels(steps, _STEP_CHANNELS, _BEGIN_S, "the start of steering")),
        *(_bode(name, {kind: responses[name] for kind, responses in driven_of.items()}) for name in _RESPONSES),
    ]
    return Findings(values, summary, tables, pictures)


def _sweep_responses(sweep: StandardRun) -> Responses:
    """Return the frequency responses to the steering wheel angle, empty if the sweep failed."""
    frequencies = np.geomspace(LOWEST_Hz, HIGHEST_Hz, _POINTS)
    try:
        return {name: frequency_response(sweep, name, frequencies) for name in _RESPONSES}
    except RecordingError:
        return {}


def _random_responses(runs: list[StandardRun]) -> Responses:
    """Return the responses from the finished runs with random steering, empty if there are none."""
    driven = [run for run in runs if run.channels]
    if not driven:
        return {}
    return {name: random_response(driven, name, LOWEST_Hz, HIGHEST_Hz) for name in _RESPONSES}


def weak_ranges(found: FrequencyResponse) -> str:
    """Return a description of the frequency ranges with a coherence below `COHERENCE`, empty if there are none."""
    weak = np.concatenate([[False], found.coherence < COHERENCE, [False]])
    edges = np.flatnonzero(np.diff(weak.astype(int)))
    lines = found.frequency_Hz
    ranges = [(lines[first], lines[last - 1]) for first, last in edges.reshape(-1, 2)]
    return ", ".join(f"{low:.2f} Hz" if low == high else f"{low:.2f} to {high:.2f} Hz" for low, high in ranges)


def _values(found: FrequencyResponse) -> dict[str, list[float]]:
    return {
        "frequency_Hz": found.frequency_Hz.tolist(),
        "gain": np.abs(found.response).tolist(),
        "phase_rad": np.unwrap(np.angle(found.response)).tolist(),
        "coherence": found.coherence.tolist(),
    }


def _coherence_table(found: dict[str, Responses], weak: dict[tuple[str, str], str]) -> Table:
    rows = []
    for kind, responses in found.items():
        for name, each in responses.items():
            least = int(each.coherence.argmin())
            words = weak[kind, name] or "nowhere"
            numbers = f"{each.coherence[least]:.4f}", f"{each.frequency_Hz[least]:.2f}"
            rows.append((quantity_of(name).label, kind, *numbers, words))
    columns = ("output", "steering", "least coherence", "at [Hz]", f"below {COHERENCE:g}")
    return Table(
        "Coherence", columns, rows, frozenset(number for number, row in enumerate(rows) if row[-1] != "nowhere")
    )


def _bode(name: str, found: Responses) -> Picture:
    unit = _RESPONSES[name]

    def panel(
        label: str, shown: Callable[[FrequencyResponse], Array], limits: Sequence[tuple[float, str]] = ()
    ) -> Panel:
        curves = [Curve(each.frequency_Hz, shown(each), kind) for kind, each in found.items()]
        return Panel("frequency [Hz]", label, curves, limits=limits, log="x")

    panels = [
        panel(f"gain [{unit.name}]", lambda each: unit.factor * np.abs(each.response)),
        panel("phase [deg]", lambda each: np.degrees(np.unwrap(np.angle(each.response)))),
        panel("coherence [-]", lambda each: each.coherence, [(COHERENCE, f"bound {COHERENCE:g}")]),
    ]
    return Picture(f"{quantity_of(name).label.capitalize()} over steering wheel angle", panels)
