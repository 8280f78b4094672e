"""Results of the kinematics and compliance rig that several files read, measured once in a process."""

from __future__ import annotations

import functools

from activesteer.rigs.kc import KcResult, kinematics_compliance


@functools.cache
def on_the_bench(vehicle: str = "compact") -> KcResult:
    """Return the result of a car; do not change it."""
    return kinematics_compliance(vehicle)
