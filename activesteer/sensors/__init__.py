"""Sensors: from the true motion of the car to what its controllers are told."""

from activesteer.sensors.block import SensorBlock
from activesteer.sensors.parameters import (
    AccelerationSensor,
    AngleSensor,
    RateSensor,
    Sensors,
    WheelSpeedSensor,
)

__all__ = ["AccelerationSensor", "AngleSensor", "RateSensor", "SensorBlock", "Sensors", "WheelSpeedSensor"]
