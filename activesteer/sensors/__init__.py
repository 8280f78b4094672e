"""Sensors, which turn the true motion of the car into the measurement.

In: the true motion of the car.
Out: measurements with noise, offset, quantisation and delay.
"""

from activesteer.sensors.block import SensorBlock
from activesteer.sensors.parameters import Sensors

__all__ = ["SensorBlock", "Sensors"]
