"""Manoeuvres: TOML files that say what is asked of the driver, on which road, and for how long."""

from activesteer.maneuver.base import Maneuver
from activesteer.maneuver.constant_radius import ConstantRadius
from activesteer.maneuver.kinds import KINDS, build_maneuver, maneuver_class
from activesteer.maneuver.open_loop import OpenLoop
from activesteer.maneuver.sine_sweep import SineSweep
from activesteer.maneuver.slowly_increasing_steer import SlowlyIncreasingSteer
from activesteer.maneuver.step_steer import StepSteer

__all__ = [
    "KINDS",
    "ConstantRadius",
    "Maneuver",
    "OpenLoop",
    "SineSweep",
    "SlowlyIncreasingSteer",
    "StepSteer",
    "build_maneuver",
    "maneuver_class",
]
