"""Detection of a failed actuator from its positions."""

from __future__ import annotations

from collections import deque


class SupervisedActuator:
    """An actuator that must approach its demand.

    An actuator is suspected if its distance from the demand was larger than a tolerance and it has not approached by a
    tenth of this distance within a window. It counts as failed, until the end of the run, once it is suspected for as
    long as the window. A slow actuator, a weak supply or a delayed bus still approach; an actuator that is stuck,
    floats or runs away does not.

    Attributes:
        failed: Whether the actuator has failed.
    """

    def __init__(self, tolerance_rad: float, window_s: float, interval_s: float) -> None:
        """Begin with a sound actuator.

        Args:
            tolerance_rad: Distance from the demand that is tolerated [rad].
            window_s: Time in which the actuator must approach its demand [s].
            interval_s: Time between two steps [s].
        """
        self._tolerance_rad = tolerance_rad
        self._steps = max(1, round(window_s / interval_s))
        self._seen: deque[tuple[float, float]] = deque(maxlen=self._steps + 1)
        self._suspected = 0
        self.failed = False

    def step(self, demand_rad: float, position_rad: float) -> bool:
        """Add a sample of demand and position [rad], and return whether the actuator has failed."""
        self._seen.append((demand_rad, position_rad))
        if len(self._seen) <= self._steps:
            return self.failed
        demand_then_rad, position_then_rad = self._seen[0]
        gap_rad = demand_then_rad - position_then_rad
        moved_rad = position_rad - position_then_rad
        if gap_rad < 0.0:
            gap_rad, moved_rad = -gap_rad, -moved_rad
        if gap_rad > self._tolerance_rad and moved_rad < 0.1 * gap_rad:
            self._suspected += 1
            self.failed = self.failed or self._suspected > self._steps
        else:
            self._suspected = 0
        return self.failed
