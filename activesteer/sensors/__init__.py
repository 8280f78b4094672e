"""Sensors between the true motion of the car and its controllers.

In: the true motion of the car.
Out: measurements with noise, offset, quantisation and delay.
"""

from activesteer.sensors.block import SensorBlock
from activesteer.sensors.parameters import (
    AccelerationSensor,
    AngleSensor,
    PressureSensor,
    RateSensor,
    Sensors,
    WheelSpeedSensor,
)

__all__ = [
    "AccelerationSensor",
    "AngleSensor",
    "PressureSensor",
    "RateSensor",
    "SensorBlock",
    "Sensors",
    "WheelSpeedSensor",
]
