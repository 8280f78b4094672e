"""Real-time pace of a run: each step starts at its time by the clock, and delays are recorded."""

from __future__ import annotations

import time
from typing import Any, Final

import numpy as np

from activesteer.config import Range, checked_number

FACTOR: Final = Range(0.01, 100.0)
LATE_S: Final = 0.2e-3
"""Delay from which a step counts as late [s]."""
_SPIN_S: Final = 0.15e-3
"""Time before a deadline from which the clock is polled, since a sleep ends about 0.1 ms late [s]."""


class RealtimePacer:
    """Clock of a run. `factor` is the number of simulated seconds per second."""

    def __init__(self, factor: float, timestep_s: float) -> None:
        """Prepare the clock, which starts with the first step."""
        self._factor = checked_number("realtime", factor, FACTOR)
        self._interval_s = timestep_s / self._factor
        self._start_s: float | None = None
        self._steps = self._missed = 0
        self._late_s = np.empty(4096)

    def await_step(self) -> None:
        """Wait for the time of the next step. Late steps are not skipped, but begin at once."""
        now_s = time.perf_counter()
        if self._start_s is None:
            self._start_s = now_s
        due_s = self._start_s + self._steps * self._interval_s
        # The step before should have ended by now.
        self._missed += now_s > due_s and self._steps > 0
        while (left_s := due_s - now_s) > 0.0:
            if left_s > _SPIN_S:
                time.sleep(left_s - _SPIN_S)
            now_s = time.perf_counter()
        if self._steps == len(self._late_s):
            self._late_s = np.concatenate([self._late_s, np.empty_like(self._late_s)])
        self._late_s[self._steps] = now_s - due_s
        self._steps += 1

    def report(self) -> dict[str, Any]:
        """Return the statistics for the recording: missed deadlines and delays of the steps [s]."""
        late_s = self._late_s[: self._steps]
        p50, p99, most = (float(np.quantile(late_s, q)) for q in (0.5, 0.99, 1.0)) if self._steps else (0.0,) * 3
        return {
            "factor": self._factor, "steps": self._steps, "missed_deadlines": self._missed,
            "late_share": float(np.mean(late_s > LATE_S)) if self._steps else 0.0,
            "jitter_p50_s": p50, "jitter_p99_s": p99, "jitter_max_s": most,
        }  # fmt: skip
