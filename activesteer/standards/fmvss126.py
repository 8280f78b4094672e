"""FMVSS 126 and UN R140: electronic stability control, tested by series of sines with dwell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from activesteer.analysis.sine_with_dwell import DISPLACEMENT_TIME_S, INSTANTS_S, RATIO_LIMITS
from activesteer.analysis.step_response import FIT, REFERENCE_MPS2
from activesteer.pages import Table, Text, failed
from activesteer.plotting import Curve, Panel, Picture
from activesteer.standards.standard import SIDES, Findings, NoResult, StandardRun, StandardRunner, cell

RAMP_DEGPS: Final = 13.5
"""Rate of the slowly increasing steer [deg/s]; S7.6."""
RAMPS: Final = 3
"""Number of slow ramps to each side."""
FIRST_FACTOR, STEP_FACTOR, LAST_FACTOR = 1.5, 0.5, 6.5
"""The amplitudes as multiples of A; S7.9.2 to S7.9.4."""
LEAST_LAST_DEG, MOST_DEG = 270.0, 300.0
"""Least last amplitude, and largest of all amplitudes [deg]."""
DISPLACED_FROM: Final = 5.0
"""Multiple of A from which the displacement counts; S5.2.3."""
LEAST_DISPLACEMENT_M: Final = 1.83
LEAST_HEAVY_DISPLACEMENT_M: Final = 1.52
HEAVY_KG: Final = 3500.0
"""Required displacements [m], and mass above which the smaller displacement suffices [kg]."""
RATIOS: Final = ("yaw_ratio_1s", "yaw_ratio_175s")
_METRICS: Final = ("yaw_rate_after_1000ms_share", "yaw_rate_after_1750ms_share")
_BEGIN_S: Final = 1.5
"""Start of the sine [s]. The signals are zeroed over the second before."""
_SINE: Final = {"steer.start_s": _BEGIN_S, "duration_s": 5.6}
_RAMP: Final = {"steer.end_deg": 120.0, "duration_s": 10.0, "road.mu": 0.9}


def amplitudes(a_deg: float) -> list[tuple[float, float]]:
    """Return the amplitudes of a test series."""
    last = LAST_FACTOR * a_deg
    last = MOST_DEG if last > MOST_DEG else max(last, LEAST_LAST_DEG)
    found = []
    factor = FIRST_FACTOR
    while factor * a_deg < last - 1e-9:
        found.append((factor, factor * a_deg))
        factor += STEP_FACTOR
    return [*found, (last / a_deg, last)]


def verdict(row: Mapping[str, float], least_m: float) -> list[str]:
    """Return a description of the limits that a run exceeds, empty if there are none."""
    broken = [
        f"yaw rate {100.0 * row[name]:.0f} % {after_s:.2f} s after completion of steer ({100.0 * limit:.0f} % allowed)"
        for name, after_s, limit in zip(RATIOS, INSTANTS_S, RATIO_LIMITS, strict=True)
        if not abs(row[name]) <= limit
    ]
    if _too_short(row, least_m):
        broken.append(f"displacement {row['displacement_m']:.2f} m ({least_m:.2f} m needed)")
    return broken


def _too_short(row: Mapping[str, float], least_m: float) -> bool:
    return row["factor"] >= DISPLACED_FROM - 1e-9 and not row["displacement_m"] >= least_m


def examine(runner: StandardRunner) -> Findings:
    """Drive and evaluate one car with one controller."""
    a_deg, ramps_deg = _reference_angle(runner)
    mass_kg = runner.scenario("sine_with_dwell").car.config.single_track.mass_kg
    least_m = LEAST_DISPLACEMENT_M if mass_kg <= HEAVY_KG else LEAST_HEAVY_DISPLACEMENT_M
    steps = [(side, *step) for side in SIDES for step in amplitudes(a_deg)]
    runs = runner.drive(
        "sine_with_dwell",
        "sine_with_dwell",
        [{"steer.direction": side, "steer.steering_wheel_deg": amplitude} for side, _, amplitude in steps],
        _SINE,
        ("yaw_rate_radps",),
    )
    series, broken = [], []
    for (side, factor, amplitude), run in zip(steps, runs, strict=True):
        row: dict[str, Any] = {"direction": side, "amplitude_deg": amplitude, "factor": factor}
        row |= {name: run.metric(metric) for name, metric in zip(RATIOS, _METRICS, strict=True)}
        row["displacement_m"] = run.metric("lateral_displacement_by_ay_m")
        row["displacement_of_position_m"] = run.metric("lateral_displacement_m")
        broken.append([f"no result: {run.error}"] if run.error else verdict(row, least_m))
        series.append(row | {"pass": not broken[-1]})
    passed = all(row["pass"] for row in series)
    values = {
        "A_deg": a_deg, "ramps_deg": ramps_deg, "displacement_needed_m": least_m, "series": series, "pass": passed,
    }  # fmt: skip
    tables = [
        Table(
            f"Slowly increasing steer: A = {a_deg:.1f} deg",
            ("side", *(f"run {number + 1}: steering wheel at 0.3 g [deg]" for number in range(RAMPS))),
            [(side, *(f"{angle:.1f}" for angle in found)) for side, found in ramps_deg.items()],
        ),
        _table(series, runs, least_m),
    ]
    return Findings(values, _summary(series, broken), tables, _pictures(series, runs, least_m))


def _reference_angle(runner: StandardRunner) -> tuple[float, dict[str, list[float]]]:
    """Return the mean angle A [deg] of six slow ramps, and the angle of each ramp."""
    sensors = runner.scenario("slowly_increasing_steer").car.config.sensors
    # Repetitions differ only by the noise of the sensors.
    noise = [{} if sensors.seed is None else {"sensors.seed": sensors.seed + number} for number in range(RAMPS)]
    cases = [{"steer.rate_degps": sign * RAMP_DEGPS, **other} for sign in SIDES.values() for other in noise]
    runs = runner.drive("slowly_increasing_steer", "slowly_increasing_steer", cases, _RAMP)
    found = [math.degrees(abs(run.metric("steering_wheel_at_0_3g_rad"))) for run in runs]
    for run, angle in zip(runs, found, strict=True):
        if math.isnan(angle):
            why = run.error or f"the lateral acceleration stays below {FIT[1] * REFERENCE_MPS2:.3g} m/s2"
            rate = f"{run.case['steer.rate_degps']:g} deg/s"
            raise NoResult(f"cannot be determined from the slow ramp at {rate}: {why}", key="A")
    rounded = [round(angle, 1) for angle in found]
    sides = {side: rounded[RAMPS * number :][:RAMPS] for number, side in enumerate(SIDES)}
    return round(sum(rounded) / len(rounded), 1), sides


def _summary(series: list[dict[str, Any]], broken: list[list[str]]) -> str:
    failed = [(row, words) for row, words in zip(series, broken, strict=True) if words]
    if not failed:
        return f"all {len(series)} runs meet the limits, up to {series[-1]['amplitude_deg']:.0f} deg to both sides"
    row, words = min(failed, key=lambda pair: pair[0]["factor"])
    return (
        f"first at {row['factor']:.3g} A ({row['amplitude_deg']:.0f} deg), {row['direction']} first: "
        f"{'; '.join(words)}; {len(failed)} of {len(series)} runs fail"
    )


def _table(series: list[dict[str, Any]], runs: list[StandardRun], least_m: float) -> Table:
    def marked(value: str, broken: bool) -> Text:
        return failed(value) if broken and value != "-" else value

    limits = zip(INSTANTS_S, RATIO_LIMITS, strict=True)
    columns = (
        "first direction", "amplitude [A]", "amplitude [deg]",
        *(f"yaw rate after {instant_s:.2f} s [%], at most {100.0 * limit:.0f}" for instant_s, limit in limits),
        f"displacement after {DISPLACEMENT_TIME_S:.2f} s [m], at least {least_m:.2f} from {DISPLACED_FROM:g} A on",
        "result",
    )  # fmt: skip
    rows = [
        (
            row["direction"], f"{row['factor']:.2f}", f"{row['amplitude_deg']:.1f}",
            *(marked(cell(100.0 * row[name], 1), not abs(row[name]) <= limit)
              for name, limit in zip(RATIOS, RATIO_LIMITS, strict=True)),
            marked(cell(row["displacement_m"], 2), _too_short(row, least_m)),
            "pass" if row["pass"] else f"fail {run.error}".strip(),
        )
        for row, run in zip(series, runs, strict=True)
    ]  # fmt: skip
    return Table("Sine with dwell", columns, rows, frozenset(i for i, row in enumerate(series) if not row["pass"]))


def _pictures(series: list[dict[str, Any]], runs: list[StandardRun], least_m: float) -> list[Picture]:
    last = max(row["factor"] for row in series)

    def panel(channel: str, title: str, side: str) -> Panel:
        curves = [
            run.over_time(channel, begin_s=_BEGIN_S, shade=(row["factor"] - FIRST_FACTOR) / (last - FIRST_FACTOR))
            for row, run in zip(series, runs, strict=True)
            if row["direction"] == side
        ]
        return Panel("time from the beginning of steer [s]", title, curves, f"{side} first")

    def over_amplitude(name: str, label: str, factor: float, limit: tuple[float, str]) -> Panel:
        curves = [
            Curve(
                [row["factor"] for row in series if row["direction"] == side],
                [factor * row[name] for row in series if row["direction"] == side],
                f"{side} first", marker="o",
            )
            for side in SIDES
        ]  # fmt: skip
        return Panel("amplitude [A]", label, curves, limits=(limit,))

    needed = f"{least_m:.2f} m needed from {DISPLACED_FROM:g} A on"
    scale = ("amplitude [A]", FIRST_FACTOR, last)
    limits = [
        (100.0 * limit, f"{100.0 * limit:.0f} % allowed after {instant_s:.2f} s")
        for limit, instant_s in zip(RATIO_LIMITS, INSTANTS_S, strict=True)
    ]
    return [
        Picture("Yaw rate", [panel("yaw_rate_radps", "yaw rate [deg/s]", side) for side in SIDES], scale),
        Picture(
            "Yaw rate after completion of steer, relative to its first peak after the reversal; lateral displacement",
            [
                *(
                    over_amplitude(name, f"after {instant_s:.2f} s [%]", 100.0, limit)
                    for name, instant_s, limit in zip(RATIOS, INSTANTS_S, limits, strict=True)
                ),
                over_amplitude("displacement_m", "displacement [m]", 1.0, (least_m, needed)),
            ],
        ),
    ]
