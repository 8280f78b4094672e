"""Manoeuvres: TOML files that say what is asked of the driver, on which road, and for how long."""

from activesteer.maneuver.base import Maneuver
from activesteer.maneuver.brake_in_turn import BrakeInTurn
from activesteer.maneuver.constant_radius import ConstantRadius
from activesteer.maneuver.follow_path import FollowPath
from activesteer.maneuver.kinds import KINDS, build_maneuver, filled_from_csv, maneuver_class
from activesteer.maneuver.lane_change import LaneChange
from activesteer.maneuver.open_loop import OpenLoop
from activesteer.maneuver.random_steer import RandomSteer
from activesteer.maneuver.sine_sweep import SineSweep
from activesteer.maneuver.sine_with_dwell import SineWithDwell
from activesteer.maneuver.slalom import Slalom
from activesteer.maneuver.slowly_increasing_steer import SlowlyIncreasingSteer
from activesteer.maneuver.step_steer import StepSteer
from activesteer.maneuver.straight_braking import StraightBraking
from activesteer.road.lane import Lane

__all__ = [
    "KINDS",
    "BrakeInTurn",
    "ConstantRadius",
    "FollowPath",
    "Lane",
    "LaneChange",
    "Maneuver",
    "OpenLoop",
    "RandomSteer",
    "SineSweep",
    "SineWithDwell",
    "Slalom",
    "SlowlyIncreasingSteer",
    "StepSteer",
    "StraightBraking",
    "build_maneuver",
    "filled_from_csv",
    "maneuver_class",
]
