"""The driver: from what is asked (and, for a path, what is seen) to steering wheel, drive and brake."""

from activesteer.driver.base import Driver, DriverSetup
from activesteer.driver.constant_radius import ConstantRadiusDriver
from activesteer.driver.loading import BUILT_IN, DRIVER, find_driver
from activesteer.driver.open_loop import OpenLoopDriver
from activesteer.driver.parameters import DriverParameters
from activesteer.driver.path_preview import PathPreviewDriver
from activesteer.driver.speed_hold import SpeedHold
from activesteer.driver.standard import StandardDriver

__all__ = [
    "BUILT_IN",
    "DRIVER",
    "ConstantRadiusDriver",
    "Driver",
    "DriverParameters",
    "DriverSetup",
    "OpenLoopDriver",
    "PathPreviewDriver",
    "SpeedHold",
    "StandardDriver",
    "find_driver",
]
