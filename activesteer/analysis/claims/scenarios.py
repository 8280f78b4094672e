"""Claims by manoeuvre."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from activesteer.analysis.claims import double_lane_change, sine_with_dwell, slalom, slippery, step_steer
from activesteer.analysis.claims.claim import Claim, Statement
from activesteer.analysis.source import RecordingLike

Claims = Callable[[Mapping[str, RecordingLike]], list[Claim]]
"""Function that checks the claims about a manoeuvre, in order.

It takes recordings of the same manoeuvre by system, all of `SYSTEMS`. An undefined value (nan) fails its claim. It
raises `ParameterError` if a run is missing, and `RecordingError` if a run is of another manoeuvre, or lacks its course
or a channel.
"""

_ROOMS: Final = {
    "step_steer": step_steer,
    "sine_with_dwell": sine_with_dwell,
    "double_lane_change": double_lane_change,
    "slalom": slalom,
    "double_lane_change_low_mu": slippery,
}
SCENARIOS: Final[dict[str, Claims]] = {name: room.claims for name, room in _ROOMS.items()}
"""Name of the manoeuvre -> its claims, in the order of the paper's sections."""

STATEMENTS: Final[dict[str, Statement]] = {
    statement.id: statement for room in _ROOMS.values() for statement in room.STATEMENTS
}
"""Number -> statement, in the same order."""
SCENARIO_OF: Final = {statement.id: name for name, room in _ROOMS.items() for statement in room.STATEMENTS}
"""Number of a statement -> name of its manoeuvre."""
