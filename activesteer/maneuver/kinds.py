"""The kinds of manoeuvre."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from activesteer.config import Source, build
from activesteer.config.faults import check_faults
from activesteer.errors import ManeuverError, nearest_names, shown
from activesteer.maneuver.base import Maneuver
from activesteer.maneuver.braking import BrakeInTurn, StraightBraking
from activesteer.maneuver.follow_path import ConstantRadius, FollowPath
from activesteer.maneuver.lane_changes import LaneChange, Slalom
from activesteer.maneuver.open_loop import OpenLoop
from activesteer.maneuver.phases import Phases
from activesteer.maneuver.steering_tests import RandomSteer, SineSweep, SineWithDwell, SlowlyIncreasingSteer, StepSteer

KINDS: Final[dict[str, type[Maneuver]]] = {
    "step_steer": StepSteer,
    "open_loop": OpenLoop,
    "slowly_increasing_steer": SlowlyIncreasingSteer,
    "constant_radius": ConstantRadius,
    "sine_sweep": SineSweep,
    "random_steer": RandomSteer,
    "sine_with_dwell": SineWithDwell,
    "brake_in_turn": BrakeInTurn,
    "straight_braking": StraightBraking,
    "lane_change": LaneChange,
    "slalom": Slalom,
    "follow_path": FollowPath,
    "phases": Phases,
}
"""Value of `kind` in a file -> class."""


def maneuver_class(table: Mapping[str, Any], source: Source) -> type[Maneuver]:
    """Return the class of a manoeuvre table."""
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        problem = "is missing" if kind is None else f"there is no kind {shown(kind)}"
        help_ = nearest_names(kind if isinstance(kind, str) else "", KINDS)
        raise source.fail(("kind",), f"{problem}; {help_}", kind, sorted(KINDS))
    return KINDS[kind]


def build_maneuver(table: Mapping[str, Any], source: Source) -> Maneuver:
    """Build a manoeuvre from its table."""
    maneuver = build(maneuver_class(table, source), table, source)
    if maneuver.fault:
        check_faults(maneuver.fault, maneuver.duration_s, source.fail)
    try:
        _ = maneuver.ground
    except ManeuverError as reason:
        raise source.placed((), reason) from reason
    return maneuver
