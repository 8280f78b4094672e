"""What the claims about lane changes and slalom have in common: oscillation after the last gate, windows in words."""

from __future__ import annotations

from typing import Final

from activesteer.analysis.claims.claim import Claim, Runs, lowered, pick
from activesteer.analysis.path_following import AFTER_S

CALMED: Final = 0.5
"""A system calms an oscillation when it brings its root mean square down to this fraction."""
AFTER: Final = ("yaw_rate_after_gates_rms_radps", "sideslip_after_gates_rms_rad")
SYSTEMS_WITH_CONTROL: Final = ("ars", "afs")


def calmed(runs: Runs, number: str, text: str) -> Claim:
    """L2 and Z2: each system at least halves yaw rate and sideslip after the last gate."""
    return Claim(
        number,
        text,
        f"The root mean squares of yaw rate and of sideslip in the {AFTER_S:g} s after the last gate (front axle "
        f"centre) are, for ars and for afs, at most {100.0 * CALMED:.0f} % of those of none.",
        all(lowered(runs, metric, CALMED, system) for metric in AFTER for system in SYSTEMS_WITH_CONTROL),
        pick(runs, *AFTER),
    )
