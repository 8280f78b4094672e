"""Whether an actuator does what it is asked to, told from its positions alone."""

from __future__ import annotations

from collections import deque


class SupervisedActuator:
    """An actuator that is to come nearer to its demand.

    Where it was further from its demand than a tolerance, and has not come nearer by a tenth of that within a window,
    it is suspected; suspected for as long as the window, it counts as failed, until the end of the run. A slow
    actuator, a weak supply, a delayed bus move all the same; one that is stuck, floats or runs away does not.

    Attributes:
        failed: Whether it has.
    """

    def __init__(self, tolerance_rad: float, window_s: float, interval_s: float) -> None:
        """Begins with a sound actuator.

        Args:
            tolerance_rad: Distance from the demand that does not count [rad].
            window_s: Time in which something must be seen of a demand [s].
            interval_s: Time between two steps [s].
        """
        self._tolerance_rad = tolerance_rad
        self._steps = max(1, round(window_s / interval_s))
        self._seen: deque[tuple[float, float]] = deque(maxlen=self._steps + 1)
        self._suspected = 0
        self.failed = False

    def step(self, demand_rad: float, position_rad: float) -> bool:
        """Looks once more.

        Args:
            demand_rad: What is asked of it now [rad].
            position_rad: Where it is [rad].

        Returns:
            Whether it has failed.
        """
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
