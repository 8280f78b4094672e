"""The driver: from what is asked (and, for a path, what is seen) to steering wheel, drive and brake."""

from activesteer.driver.constant_radius import ConstantRadiusDriver
from activesteer.driver.open_loop import OpenLoopDriver
from activesteer.driver.parameters import DriverParameters
from activesteer.driver.path_preview import LOOK_INTERVAL_S, PathPreviewDriver
from activesteer.driver.speed_hold import SpeedHold

__all__ = [
    "LOOK_INTERVAL_S",
    "ConstantRadiusDriver",
    "DriverParameters",
    "OpenLoopDriver",
    "PathPreviewDriver",
    "SpeedHold",
]
