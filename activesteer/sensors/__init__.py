"""Sensors: from the true motion of the car to what its controllers get."""

from activesteer.sensors.block import SensorBlock
from activesteer.sensors.parameters import Sensors
from activesteer.sensors.sensor_kinds import AccelerationSensor, AngleSensor, RateSensor, WheelSpeedSensor

__all__ = ["AccelerationSensor", "AngleSensor", "RateSensor", "SensorBlock", "Sensors", "WheelSpeedSensor"]
