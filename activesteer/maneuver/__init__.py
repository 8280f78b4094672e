"""Manoeuvres: TOML files that say what is asked of the driver, on which road, and for how long."""

from activesteer.maneuver.base import Maneuver
from activesteer.maneuver.kinds import KINDS, build_maneuver, maneuver_class
from activesteer.maneuver.open_loop import OpenLoop
from activesteer.maneuver.step_steer import StepSteer

__all__ = ["KINDS", "Maneuver", "OpenLoop", "StepSteer", "build_maneuver", "maneuver_class"]
