"""Manoeuvres: TOML files that give setpoint, road and duration.

A kind of manoeuvre is one file with a subclass of `Maneuver`, and its line in `kinds.KINDS`. The package `analysis`
evaluates its recordings: `analysis.metrics.EVALUATIONS` needs a line too.

In: TOML files and tables.
Out: setpoints for the driver, the road, and the duration of a run.
"""

from activesteer.maneuver.base import Maneuver
from activesteer.maneuver.kinds import KINDS, build_maneuver, maneuver_class

__all__ = ["KINDS", "Maneuver", "build_maneuver", "maneuver_class"]
