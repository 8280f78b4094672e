"""Sensors between the true motion of the car and its controllers.

In: the true motion of the car.
Out: measurements with noise, offset, quantisation and delay.
"""

from activesteer.sensors.block import SensorBlock
from activesteer.sensors.parameters import Sensors

__all__ = ["SensorBlock", "Sensors"]
