"""Chooses the gains of both steering systems, one set for all scenarios: `python tools/tune_controllers.py [--runs N]`.

The driver, the car and the roads stay as they are in the files; only what the controllers do is varied, within the
ranges below, and both systems share the desired yaw rate and the tolerance band. Sets are taken from a Sobol sequence
(always the same one), and the best of them is then improved by smaller and smaller samples around it. The runs without
control are made once.

A set costs, for each system,

- in the three scenarios with a driver: RMS of yaw rate and of sideslip after the last gate, peak of the sideslip, each
  relative to the car without control (a value above 2 counts as 2), and on the slippery road 1 per metre that a wheel
  gets out of a lane;
- in the sine with dwell: what the yaw rates 1.00 s and 1.75 s after completion of steer are of their limits (35 and
  20 %), and the peak of the sideslip relative to 20 deg;
- in the step steer: overshoot and 90 % response time of the yaw rate relative to the car without control;
- a tenth of the RMS angle that is added, relative to its limit: of two sets that do the same, the calmer one;

and 1 for every claim of the paper that does not come out. Printed are the best sets, and the best one as TOML.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from scipy.stats import qmc

from activesteer.analysis.claims import SCENARIOS, SYSTEMS
from activesteer.recording import Recording
from activesteer.scenario import resolve
from activesteer.simulation.runner import prepared, run_scenario
from activesteer.studies.workers import in_parallel

RANGES: Final = {
    "desired_yaw_rate.max_lateral_acceleration_mps2": (7.8, 8.8),  # about what dry tyres transmit
    "desired_yaw_rate.delay_s": (0.05, 0.11),  # the car's own yaw response: about 0.1 s
    "corrector.off_degps": (0.05, 0.1),  # about the noise of a yaw rate sensor; the car at 0.4 g lacks 0.2 deg/s
    "corrector.width_degps": (0.05, 0.2),
    "ars.prediction_gain": (0.0, 0.2),  # more would settle with the front wheels (compact.toml)
    "ars.corrector.proportional_gain_s": (0.1, 0.35),  # above, the loop through actuator and tyre has little damping
    "afs.corrector.proportional_gain_s": (0.2, 0.6),
}
"""What is varied and between which bounds."""

_SHRINK: Final = 0.35
"""Size of a refining sample relative to the one before."""


class Judged(NamedTuple):
    """A set, what it costs, and which claims fail."""

    cost: float
    failing: tuple[str, ...]
    values: tuple[float, ...]


def overrides(values: tuple[float, ...]) -> dict[str, float]:
    """The set as overrides of a vehicle file."""
    v = dict(zip(RANGES, values, strict=True))
    off, width = v.pop("corrector.off_degps"), v.pop("corrector.width_degps")
    found = {f"controllers.{key}": value for key, value in v.items()}
    for system in ("ars", "afs"):
        found[f"controllers.{system}.corrector.off_degps"] = off
        found[f"controllers.{system}.corrector.full_degps"] = off + width
    return found


def _drive(scenario: str, system: str, changes: Mapping[str, Any]) -> Recording:
    return run_scenario(prepared(resolve(scenario, overrides=changes)), system)


_without: dict[str, Recording] = {}
"""The runs without control, kept by each process."""


def judge(values: tuple[float, ...]) -> Judged:
    """Drives all scenarios with both systems."""
    changes = overrides(values)
    cost, failing = 0.0, []
    for scenario, claims in SCENARIOS.items():
        if scenario not in _without:
            _without[scenario] = _drive(scenario, "none", {})
        runs = {"none": _without[scenario]}
        runs |= {system: _drive(scenario, system, changes) for system in SYSTEMS if system != "none"}
        # The claims look at the scenario of the metadata, which differs by nothing but the controllers' gains.
        failing += [claim.id for claim in claims(runs) if not claim.passed]
        cost += sum(_cost(scenario, runs[system], runs["none"]) for system in runs if system != "none")
    return Judged(cost + len(failing), tuple(failing), values)


def _cost(scenario: str, run: Recording, none: Recording) -> float:
    ours, theirs = run.metrics, none.metrics

    def share(name: str) -> float:
        return min(abs(ours[name]) / max(abs(theirs[name]), 1e-9), 2.0)

    added = np.hypot(run["rear_steer_demand_rad"], run["superposition_demand_rad"])
    cost = 0.1 * float(np.sqrt(np.mean(added**2))) / math.radians(3.0)
    if scenario == "step_steer":
        return cost + share("yaw_rate_overshoot") + share("yaw_rate_response_time_s")
    if scenario == "sine_with_dwell":
        late = abs(ours["yaw_rate_after_1000ms_share"]) / 0.35 + abs(ours["yaw_rate_after_1750ms_share"]) / 0.20
        return cost + late + ours["sideslip_peak_abs_rad"] / math.radians(20.0)
    names = ("yaw_rate_after_gates_rms_radps", "sideslip_after_gates_rms_rad", "sideslip_peak_abs_rad")
    out = max(ours["lane_overstep_m"], 0.0) if scenario == "double_lane_change_low_mu" else 0.0
    return cost + sum(share(name) for name in names) + out


def search(jobs: int | None, count: int, rounds: int) -> list[Judged]:
    """Samples, and samples again around the best; best first."""
    low, high = (np.array(ends) for ends in zip(*RANGES.values(), strict=True))
    centre, half = 0.5 * (low + high), 0.5 * (high - low)
    found: list[Judged] = []
    for number in range(rounds):
        points = qmc.Sobol(len(RANGES), rng=number).random(count)
        sets = np.clip(centre + (2.0 * points - 1.0) * half, low, high)
        found += in_parallel(judge, [(tuple(float(f"{value:.3g}") for value in row),) for row in sets.tolist()], jobs)
        found.sort()
        centre, half = np.array(found[0].values), half * _SHRINK
        print(
            f"round {number + 1}: best {found[0].cost:.3f}, failing: {' '.join(found[0].failing) or 'none'}", flush=True
        )
    return found


def main() -> None:
    """Searches and prints."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=32, metavar="N", help="sets a round, a power of 2 (default: 32)")
    parser.add_argument("--rounds", type=int, default=3, metavar="N", help="default: 3")
    parser.add_argument("--jobs", type=int, metavar="N", help="processes (default: one per processor)")
    options = parser.parse_args()
    found = search(options.jobs, options.runs, options.rounds)
    for judged in found[:10]:
        values = dict(zip(RANGES, judged.values, strict=True))
        print(f"{judged.cost:.3f}  failing: {' '.join(judged.failing) or 'none'}  {values}")
    print()
    for key, value in overrides(found[0].values).items():
        print(f"{key} = {value:.3g}")


if __name__ == "__main__":
    main()
