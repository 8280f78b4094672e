"""No run diverges or holds a value that is not finite: all grips, grades, speeds, both cars, every shipped manoeuvre.

What a car cannot do it does not do: it slides down a slope of ice, spins its wheels as far as the driver's foot lets
it, leaves the lanes. What cannot end as `SimulationDiverged` is any of it.
"""

from __future__ import annotations

import random
import tomllib
from typing import Any, Final, NamedTuple

import numpy as np
import pytest

import activesteer
from activesteer.core.conventions import CORNERS
from activesteer.resources import find_maneuver, list_maneuvers
from activesteer.scenario import load_car

MU: Final = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.2)
GRADE: Final = (0.0, 0.1, 0.2, 0.3, 0.5)
SPEED_KMH: Final = (5.0, 15.0, 30.0, 60.0, 100.0, 160.0, 250.0)
TIMESTEP_S: Final = (5e-4, 1e-3, 2e-3)
COURSES: Final = {"lane_change": 180.0, "slalom": 320.0}
"""Kind of manoeuvre -> length of its course, with what follows [m]."""
QUICK_STEPS: Final = 20_000
"""Largest number of steps of a run among the quick tests."""
LEFT_TO_SEARCHES: Final = ("amplitude_factor", "lateral_acceleration_g", "lateral_acceleration_mps2")
KNOWN: Final = (
    ("straight_line", 30.0, 0.2, 0.1),
    ("straight_line", 30.0, 0.3, 0.2),
    ("slalom", 100.0, 0.0, 0.05),
)
"""What once span up without end: manoeuvre, speed [km/h], grade, friction."""


class Case(NamedTuple):
    """One run."""

    maneuver: str
    vehicle: str
    controller: str
    speed_kmh: float
    grade: float
    mu: float
    timestep_s: float

    def table(self) -> dict[str, Any]:
        """Return the manoeuvre, shortened to some seconds, with given angles instead of a search."""
        table = tomllib.loads(find_maneuver(self.maneuver).read_text(encoding="utf-8"))
        for steering in ("steer", "turn"):
            for key in LEFT_TO_SEARCHES:
                if table.get(steering, {}).pop(key, None) is not None:
                    table[steering]["steering_wheel_deg"] = 90.0
        if any("steering_factor" in phase for phase in table.get("phases", ())):
            table["reference_angle_deg"] = 30.0
        speed_mps = max(self.speed_kmh, 15.0) / 3.6
        if "speed" not in table:
            table["speed_kmh"] = 3.6 * speed_mps if table["kind"] in (*COURSES, "straight_braking") else self.speed_kmh
        if table["kind"] in COURSES:
            table["duration_s"] = COURSES[table["kind"]] / speed_mps + 4.0
        elif table["kind"] in ("open_loop", "slowly_increasing_steer", "constant_radius", "random_steer"):
            table["duration_s"] = 6.0
            if "circle" in table:
                table["circle"]["end_speed_kmh"] = 20.0 + max(95.0, self.speed_kmh)
        elif table["kind"] == "sine_sweep":
            table["sweep"] |= {"length_s": 8.0}
            table["duration_s"] = 9.0
        table["road"] = {"mu": self.mu, "grade": self.grade}
        if self.maneuver == "split_mu_braking":
            table["road"] = {"mu_left": self.mu, "mu_right": max(0.05, 0.3 * self.mu), "grade": self.grade}
        return table

    @property
    def steps(self) -> float:
        """Return the number of steps of the run."""
        return self.table()["duration_s"] / self.timestep_s

    def drive(self) -> None:
        """Run it and check every recorded number."""
        recording = activesteer.simulate(
            self.table(), vehicle=self.vehicle, controller=self.controller, timestep_s=self.timestep_s
        )
        assert recording.metadata["complete"]
        for name in recording.channels.names:
            assert np.isfinite(recording[name]).all(), f"{self}: {name}"
        # An open differential turns one wheel at most twice as fast as the engine; faster than that only the road can.
        # A car that slides down a slope for a minute gets there.
        rolling_radps = np.abs(recording["speed_mps"]).max() / 0.28
        limit_radps = max(2.0 * load_car(self.vehicle).config.powertrain.max_wheel_speed_radps, rolling_radps)
        fastest = max(np.abs(recording[f"{corner}_wheel_speed_radps"]).max() for corner in CORNERS)
        assert fastest < limit_radps, f"{self}: a wheel turns at {fastest:.0f} rad/s"
        assert np.abs(recording["roll_rad"]).max() < 0.5, f"{self}: the car tips over"


def drawn(seed: int, count: int) -> list[Case]:
    """Return a sample of all combinations."""
    draw = random.Random(seed)
    return [
        Case(
            draw.choice(list_maneuvers()),
            draw.choice(("compact", "sedan")),
            draw.choice(("none", "ars", "afs")),
            draw.choice(SPEED_KMH),
            draw.choice(GRADE),
            draw.choice(MU),
            draw.choice(TIMESTEP_S),
        )
        for _ in range(count)
    ]


@pytest.mark.parametrize(
    ("maneuver", "speed_kmh", "grade", "mu", "vehicle"),
    [
        pytest.param(*known, vehicle, marks=[] if vehicle == quick else pytest.mark.slow)
        for known, quick in zip(KNOWN, ("compact", "sedan", "compact"), strict=True)
        for vehicle in ("compact", "sedan")
    ],
)
def test_wheels_do_not_spin_up_without_end(
    maneuver: str, speed_kmh: float, grade: float, mu: float, vehicle: str
) -> None:
    Case(maneuver, vehicle, "none", speed_kmh, grade, mu, 2e-3).drive()


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id="-".join(map(str, case)), marks=[pytest.mark.slow] if case.steps > QUICK_STEPS else [])
        for case in drawn(seed=20121121, count=8)
    ],
)
def test_no_run_of_a_sample_diverges(case: Case) -> None:
    case.drive()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_no_run_of_a_larger_sample_diverges(seed: int) -> None:
    for case in drawn(seed, 50):
        case.drive()


@pytest.mark.parametrize("vehicle", ["compact", "sedan"])
def test_on_a_slope_of_ice_the_car_slides_back_as_a_block_would(vehicle: str) -> None:
    """The acceleration is g (sin - mu cos) if all wheels slide; wheels that still roll may increase it."""
    case = Case("straight_line", vehicle, "none", 30.0, 0.5, 0.05, 1e-3)
    recording = activesteer.simulate(case.table(), vehicle=vehicle)
    speed = recording["vx_mps"]
    slope = np.arctan(0.5)
    minimum = 9.81 * (np.sin(slope) - 0.05 * np.cos(slope))
    assert speed[0] > speed[1000] > speed[2000]
    assert (speed[1000] - speed[2000]) / 1.0 == pytest.approx(minimum, rel=0.15)
    assert speed[2500] < -5.0
