"""Sensors: from the true motion of the car to what its controllers get."""

from activesteer.sensors.block import SensorBlock
from activesteer.sensors.parameters import Sensors
from activesteer.sensors.sensor_kinds import (
    AccelerationSensor,
    AngleSensor,
    PressureSensor,
    RateSensor,
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
