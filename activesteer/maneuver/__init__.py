"""Manoeuvres: TOML files that give setpoint, road and duration.

A kind of manoeuvre is a subclass of `Maneuver` with its name, in any file of this folder. The package `analysis`
evaluates its recordings: `analysis.metrics.EVALUATIONS` needs a line too.

In: TOML files and tables.
Out: setpoints for the driver, the road, and the duration of a run.
"""

import importlib
import pkgutil

from activesteer.maneuver.base import KINDS, Maneuver, build_maneuver, maneuver_class

for _module in pkgutil.iter_modules(__path__, f"{__name__}."):
    importlib.import_module(_module.name)

__all__ = ["KINDS", "Maneuver", "build_maneuver", "maneuver_class"]
