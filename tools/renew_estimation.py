"""Drive the runs of docs/estimation.md again and write their table.

python tools/renew_estimation.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer import simulate
from activesteer.controllers import load_controller

PAGE: Final = Path(__file__).resolve().parent.parent / "docs" / "estimation.md"
BEGIN: Final = "<!-- the table is written by tools/renew_estimation.py -->\n"
END: Final = "<!-- end of the table -->\n"
SYSTEMS: Final = ("none", "ars", "afs")
RUNS: Final = (
    *((scenario, system) for scenario in ("step_steer", "slalom", "double_lane_change", "double_lane_change_low_mu",
                                          "sine_with_dwell") for system in SYSTEMS),
    *((scenario, "none") for scenario in ("severe_lane_change", "brake_in_turn", "split_mu_braking",
                                          "straight_braking")),
)  # fmt: skip
"""The paper's five scenarios with its systems, and some harder ones."""
SLOWEST_MPS: Final = 5.0
LARGEST_SIDESLIP_RAD: Final = np.radians(8.0)
"""Slower samples, and samples with a larger sideslip angle, do not count."""
_HEAD: Final = (
    "| | | peak sideslip | error, RMS | error, peak | filter std | speed error, RMS | error, peak | NEES | NIS |",
    "|---|---|---|---|---|---|---|---|---|---|",
    "| | | deg | deg | deg | deg | % | % | of 1 | of 2 |",
)


def row(scenario: str, system: str) -> str:
    """Return the row of one run: a system drives, and an estimator runs beside it on the same sensors."""
    innovations: list[float] = []

    class Watched:
        def __init__(self, setup: Any) -> None:
            self.system, self.estimator = load_controller(system, setup), setup.estimator()

        def step(self, command: Any, measurement: Any) -> Any:
            estimate = self.estimator.step(measurement)
            innovations.append(self.estimator.innovation)
            return self.system.step(command, measurement)._replace(estimate=estimate)

    run = simulate(scenario, Watched, overrides={"sensors.preset": "production"})
    speed_mps, sideslip_rad = run["vx_mps"], run["sideslip_rad"]
    rolls = speed_mps > SLOWEST_MPS
    counts = rolls & (abs(sideslip_rad) < LARGEST_SIDESLIP_RAD)
    error_rad = (run["estimated_sideslip_rad"] - sideslip_rad)[counts]
    std_rad = run["estimated_sideslip_std_rad"][counts]
    speed_error = run["estimated_speed_mps"][counts] / speed_mps[counts] - 1.0
    squared = np.array(innovations[-len(speed_mps) :])[counts]
    angles_deg = np.degrees([abs(sideslip_rad[rolls]).max(), _rms(error_rad), abs(error_rad).max(), _rms(std_rad)])
    cells = [
        f"{angles_deg[0]:.2g}",
        *(f"{angle_deg:.2f}" for angle_deg in angles_deg[1:]),
        *(f"{100.0 * share:.2f}" for share in (_rms(speed_error), abs(speed_error).max())),
        f"{np.mean((error_rad / std_rad) ** 2):.2f}",
        f"{squared.mean():.2f}",
    ]
    return f"| {scenario.replace('_', ' ')} | `{system}` | " + " | ".join(cells) + " |"


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def main() -> None:
    """Entry point."""
    lines = [*_HEAD]
    for scenario, system in RUNS:
        lines.append(row(scenario, system))
        print(lines[-1], flush=True)
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    PAGE.write_text(f"{before}{BEGIN}" + "\n".join(lines) + f"\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
