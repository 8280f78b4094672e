"""Speed along a path: the setpoint follows the place of the car, with the pedal where the speed falls."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from activesteer.conventions import Array
from activesteer.maneuver.base import Maneuver, within
from activesteer.road.path import Path
from activesteer.road.path_search import PathSearch
from activesteer.signals import Setpoint

_WINDOW_M: Final = 5.0
"""Distance to either side of the last place in which the car is looked for [m]; so a path may cross itself."""
_COAST_MPS2: Final = 0.7
"""Deceleration that drag and engine give without the brake [m/s2]."""
_PEDAL_PER_MPS2: Final = 1.0 / 13.0
"""Pedal over deceleration of a typical car [s2/m]: 0.38 gives 5 m/s2 in `brake_in_turn`."""
_PEDAL_PER_MPS: Final = 0.08
"""Pedal over the speed that is too high [s/m]."""
_FREE_MPS: Final = 0.3
"""Speed above the demand that calls for no brake [m/s]."""


class PathSpeed:
    """Setpoints of one run along a path with speeds.

    Attributes:
        maneuver: The manoeuvre.
        present: Last setpoint.
        began: Phases that have begun; a path has none.
    """

    def __init__(self, maneuver: Maneuver, path: Path, speed_mps: Array) -> None:
        self.maneuver, self.present = maneuver, maneuver.setpoint(0.0)
        self.began: list[tuple[float, str]] = []
        self._search, self._along_m = PathSearch(path), 0.0
        self._s_m, self._speed_mps = path.s_m, speed_mps
        self._acceleration_mps2 = speed_mps * np.gradient(speed_mps, path.s_m)

    def setpoint(self, time_s: float, seen: Sequence[float]) -> Setpoint:
        """Return the setpoint for the present place of the car; see `PhaseSequence.setpoint`."""
        speed_mps, x_m, y_m = seen[3:6]
        self._along_m = self._search.nearest(x_m, y_m, self._along_m, _WINDOW_M)
        wanted_mps = float(np.interp(self._along_m, self._s_m, self._speed_mps))
        deceleration = -float(np.interp(self._along_m, self._s_m, self._acceleration_mps2, right=0.0)) - _COAST_MPS2
        excess_mps = speed_mps - wanted_mps - _FREE_MPS
        pedal = _PEDAL_PER_MPS2 * max(deceleration, 0.0) + _PEDAL_PER_MPS * excess_mps if excess_mps > -2.0 else 0.0
        pedal = within(pedal, 1.0)
        self.present = self.maneuver.setpoint(time_s)._replace(
            speed_demand_mps=wanted_mps, brake_pedal=pedal, hold_speed=pedal == 0.0
        )
        return self.present

    def __deepcopy__(self, memo: dict[int, Any]) -> PathSpeed:
        return copy.copy(self)
