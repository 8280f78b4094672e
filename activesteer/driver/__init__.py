"""The driver: steering wheel, drive and brake from the setpoint and the path ahead.

In: the setpoint of a manoeuvre, the measurement, and the motion of the car.
Out: steering wheel angle, drive torque, brake pedal and gear.
"""

from activesteer.driver.base import Driver, DriverParameters, DriverSetup
from activesteer.driver.human import DRIVER, HumanDriver, driver_spec, is_driver_file
from activesteer.driver.open_loop import ConstantRadiusDriver, OpenLoopDriver, SpeedHold
from activesteer.driver.path_preview import PathPreviewDriver

__all__ = [
    "DRIVER",
    "ConstantRadiusDriver",
    "Driver",
    "DriverParameters",
    "DriverSetup",
    "HumanDriver",
    "OpenLoopDriver",
    "PathPreviewDriver",
    "SpeedHold",
    "driver_spec",
    "is_driver_file",
]
