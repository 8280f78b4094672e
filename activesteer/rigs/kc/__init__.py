"""Kinematics and compliance rig: held chassis, wheels on pads.

In: a car.
Out: kinematic and compliance curves, their metrics and figures.
"""

from activesteer.rigs.kc.figures import draw, rear_camber_figure
from activesteer.rigs.kc.programme import Sweep
from activesteer.rigs.kc.result import KcMetric, KcResult, kinematics_compliance

__all__ = ["KcMetric", "KcResult", "Sweep", "draw", "kinematics_compliance", "rear_camber_figure"]
