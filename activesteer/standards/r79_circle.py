"""UN R79: steering effort at walking pace, and failures of auxiliary steering equipment in a circle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.core.units import display_unit
from activesteer.errors import SimulationDiverged
from activesteer.pages import Table
from activesteer.plotting import Curve, Panel, Picture
from activesteer.standards.standard import (
    SIDES,
    Findings,
    NoResult,
    Standard,
    StandardRun,
    TestRunner,
    cell,
    time_panels,
)


class Effort(NamedTuple):
    """A line of table 2 for cars (M1).

    Attributes:
        radius_m: Radius to reach [m].
        limit_N: Greatest force at the rim until then [N].
        case: Condition of the car: dotted key -> value.
    """

    radius_m: float
    limit_N: float
    case: Mapping[str, Any]


EFFORTS: Final = {
    "intact": Effort(12.0, 150.0, {}),
    "power_assist_failed": Effort(20.0, 300.0, {"steering.assist_fraction": 0.0}),
}
"""Name -> requirement for the steering effort."""
WITHIN_S: Final = 4.0
"""Time in which the car must reach the radius [s]."""
SPEED_KMH: Final = 10.0
"""Speed of the spiral [km/h]."""
RIM_RADIUS_M: Final = 0.185
"""Nominal radius of the steering wheel [m]: an assumption (diameter 370 mm). Vehicle files have none."""
FIGURES: Final = (
    "yaw_rate_change_radps", "ay_change_mps2", "lateral_offset_1s_m", "lateral_offset_1s_driver_m",
    "steering_correction_rad", "fault_tolerant_time_s",
)  # fmt: skip
"""Values of a fault: largest changes with hands fixed. Offset across the path, left positive, with hands fixed and with
the driver. Largest change of the driver's steering wheel angle. Tolerated time, None if no limit is exceeded."""
_TURNED_S: Final = 3.0
"""Time in which the steering wheel reaches the Ackermann angle of the radius [s]. The limit is a third longer."""
_BEGIN_S: Final = 0.5
_CHANNELS: Final = ("steering_wheel_rad", "hand_torque_Nm", "yaw_rate_radps", "speed_mps")


class Reached(NamedTuple):
    """Time from the beginning of steer to a radius, and greatest force at the rim until then, or nan if not reached."""

    time_s: float
    effort_N: float


def reached(run: StandardRun, radius_m: float) -> Reached:
    """Return time and force to reach a radius of the centre of gravity's path [m] in a spiral from `_BEGIN_S` on."""
    if not run.channels:
        return Reached(math.nan, math.nan)
    tighter = np.abs(run["yaw_rate_radps"]) * radius_m >= run["speed_mps"]
    if not tighter.any():
        return Reached(math.nan, math.nan)
    first = int(np.argmax(tighter))
    effort_N = float(np.abs(run["hand_torque_Nm"][: first + 1]).max()) / RIM_RADIUS_M
    return Reached(float(run.time_s[first]) - _BEGIN_S, effort_N)


def _examine(runner: TestRunner) -> Findings:
    spirals = {name: _spirals(runner, name, effort) for name, effort in EFFORTS.items()}
    efforts = []
    for name, runs in spirals.items():
        requirement = EFFORTS[name]
        for side, run in runs.items():
            found = reached(run, requirement.radius_m)
            good = found.time_s <= WITHIN_S and found.effort_N <= requirement.limit_N
            efforts.append({
                "steering": name, "direction": side, "radius_m": requirement.radius_m, "time_s": found.time_s,
                "effort_N": found.effort_N, "limit_N": requirement.limit_N, "pass": good,
            })  # fmt: skip
    faults = _faults(runner)
    values = {
        "rim_radius_m": RIM_RADIUS_M, "efforts": efforts, "faults": faults,
        "pass": all(row["pass"] for row in efforts),
    }  # fmt: skip
    summary = f"{_effort_words(efforts)}; circle (no limits): {_fault_words(faults)}"
    force = {f"{name.replace('_', ' ')}, {side}": run for name, runs in spirals.items() for side, run in runs.items()}
    pictures = [
        Picture("Spiral at 10 km/h", time_panels(force, _CHANNELS[:2], _BEGIN_S, "the beginning of steer")),
        _dots(faults),
    ]
    return Findings(values, summary, [_effort_table(efforts), _fault_table(faults)], pictures)


def _faults(runner: TestRunner) -> list[dict[str, Any]]:
    try:
        return runner.fault_circles()
    except SimulationDiverged as reason:
        raise NoResult(f"the car without fault does not complete the circle: {reason}") from reason


def _spirals(runner: TestRunner, name: str, effort: Effort) -> dict[str, StandardRun]:
    """Drive a spiral to each side with a steadily rising steering wheel angle."""
    config = runner.scenario("slowly_increasing_steer").car.config
    single_track = config.single_track
    angle_deg = math.degrees(config.steering.ratio * single_track.wheelbase_m / effort.radius_m)
    runs = runner.drive(
        f"effort_{name}",
        "slowly_increasing_steer",
        [{"steer.rate_degps": sign * angle_deg / _TURNED_S, **effort.case} for sign in SIDES.values()],
        {
            "speed_kmh": SPEED_KMH,
            "steer.start_s": _BEGIN_S,
            "steer.end_deg": angle_deg * WITHIN_S / _TURNED_S,
            "duration_s": _BEGIN_S + WITHIN_S + 0.5,
        },
        _CHANNELS,
    )
    return dict(zip(SIDES, runs, strict=True))


def _effort_words(efforts: list[dict[str, Any]]) -> str:
    broken = [row for row in efforts if not row["pass"]]
    if broken:
        words = [f"{row['steering'].replace('_', ' ')}, {row['direction']}: {_how(row)}" for row in broken]
        return f"steering effort: {'; '.join(words)}"
    hardest = [
        f"{max(row['effort_N'] for row in efforts if row['steering'] == name):.0f} N of {requirement.limit_N:.0f} "
        f"({name.replace('_', ' ')})"
        for name, requirement in EFFORTS.items()
    ]
    return f"steering effort within limits: {' and '.join(hardest)}"


def _how(row: Mapping[str, Any]) -> str:
    if math.isnan(row["time_s"]):
        return f"a radius of {row['radius_m']:g} m is not reached within {WITHIN_S:g} s"
    return f"{row['effort_N']:.0f} N ({row['limit_N']:.0f} allowed) after {row['time_s']:.1f} s"


def _fault_words(faults: list[dict[str, Any]]) -> str:
    done = [row for row in faults if "error" not in row]
    words = "no run finished"
    if done:
        worst = max(done, key=lambda row: row["steering_correction_rad"])
        words = (
            f"{worst['fault']} ({worst['direction']}) needs the largest correction, "
            f"{math.degrees(worst['steering_correction_rad']):.0f} deg at the steering wheel; the car is "
            f"{abs(worst['lateral_offset_1s_driver_m']):.2f} m off its course after 1 s"
        )
    return words + ("" if done == faults else f"; {len(faults) - len(done)} of {len(faults)} faults did not finish")


def _effort_table(efforts: list[dict[str, Any]]) -> Table:
    rows = [
        (
            row["steering"].replace("_", " "), row["direction"], f"{row['radius_m']:g}", cell(row["time_s"], 2),
            cell(row["effort_N"], 1), f"{row['limit_N']:.0f}", "pass" if row["pass"] else "fail",
        )
        for row in efforts
    ]  # fmt: skip
    columns = (
        "steering", "direction", "turning radius [m]", f"time to the radius [s], at most {WITHIN_S:g}",
        "steering effort [N]", "limit [N]", "result",
    )  # fmt: skip
    outside = frozenset(i for i, row in enumerate(efforts) if not row["pass"])
    return Table("Steering effort to reach the radius", columns, rows, outside)


def _fault_table(faults: list[dict[str, Any]]) -> Table:
    def tolerated(row: Mapping[str, Any]) -> str:
        return "always" if row["fault_tolerant_time_s"] is None else cell(row["fault_tolerant_time_s"], 3)

    rows = [
        (
            row["fault"], row["direction"], *(cell(_shown(row, name), 2) for name in FIGURES[:-1]),
            row.get("error") or tolerated(row),
        )
        for row in faults
    ]  # fmt: skip
    columns = (
        "fault", "circle", "yaw rate, change, hands fixed [deg/s]", "lateral acceleration, change, hands fixed [m/s²]",
        "lateral offset after 1 s, hands fixed [m]", "lateral offset after 1 s, driver [m]",
        "driver's correction [deg]",
        "fault-tolerant time [s], by the fault map's limits",
    )  # fmt: skip
    outside = frozenset(i for i, row in enumerate(faults) if "error" in row)
    return Table("Failures in a circle of 100 m at 80 km/h", columns, rows, outside)


def _shown(row: Mapping[str, Any], name: str) -> float:
    return display_unit(name).factor * row[name]


def _dots(faults: list[dict[str, Any]]) -> Picture:
    """Return the effects of the faults, a line for each fault."""
    names = list(dict.fromkeys(row["fault"] for row in faults))

    def panel(figure: str, label: str) -> Panel:
        curves = []
        for side in SIDES:
            rows = [row for row in faults if row["direction"] == side]
            places = [float(names.index(row["fault"])) for row in rows]
            curves.append(Curve([_shown(row, figure) for row in rows], places, side, dashes="", marker="o"))
        shown = names if figure == FIGURES[0] else [""] * len(names)
        return Panel(label, "", curves, names=shown)

    panels = [
        panel("yaw_rate_change_radps", "yaw rate, change,\nhands fixed [deg/s]"),
        panel("lateral_offset_1s_m", "lateral offset after 1 s,\nhands fixed [m]"),
        panel("steering_correction_rad", "driver's correction,\nsteering wheel [deg]"),
    ]
    return Picture("Failures in a circle of 100 m at 80 km/h", panels)


STANDARD: Final = Standard(
    name="r79-circle",
    title="UN R79: steering effort, and failures of auxiliary steering equipment in a circle",
    edition=(
        "UN Regulation 79, revision 4 (03 series of amendments, 2018): paragraphs 6.2.4 to 6.2.6 with table 2, and "
        "annex 4, for cars (M1). The numbers are from extracts of this revision and of GB 17675-2021, which adopts "
        "them; the test procedures are from memory. The text was not available: check it before you rely on it."
    ),
    implemented=(
        "Steering effort: from straight ahead into a spiral at 10 km/h, left and right. Up to a radius of 12 m, "
        "reached within 4 s, the force at the rim is at most 150 N. With a failure, here of the whole power assist, it "
        "is at most 300 N up to a radius of 20 m. These limits decide between pass and fail.",
        "Annex 4: the faults of the fault map, each activated in a steady circle of 100 m at 80 km/h, left and right. "
        "Evaluated are the motion of the car with the steering wheel held, and correction and lateral offset with the "
        "driver after 1 s. The annex requires control without abnormal correction and has no numbers: no verdict.",
    ),
    left_out=(
        "Manufacturer and technical service choose the faults: here the actuators and sensors of a controller fail in "
        "all ways of the fault map. The tolerated time of a fault follows from the limits of the map, which are "
        "assumptions and not part of the regulation.",
        "Leaving a curve of 50 m at 50 km/h without unusual vibration, self-centring with the hands off, transient "
        "tests by the manufacturer, warning signals, energy reserves, annex 6, steering by assistance systems.",
        f"The radius of the steering wheel, {1000.0 * RIM_RADIUS_M:.0f} mm, and the power assist, a constant fraction "
        "of the column's torque, are assumptions. The turning radius is the radius of the centre of gravity's path. "
        "The ramp of the steering wheel begins abruptly; the force for its inertia over 5 ms (17 N for the sedan) does "
        "not count, since the force is read every 20 ms.",
        "The car is driven as in its file, not at its greatest mass: --set load.payload_kg loads it.",
    ),
    examine=_examine,
)
