"""Native brakes: hydraulics, anti-lock system and traction control.

In: pedal, demanded brake torques, wheel speeds and the brakes' parameters.
Out: brake torques of the wheels, and the states of anti-lock system and traction control.
"""

from activesteer.vehicle.brakes.records import Antilock, Brakes, Hydraulics, TractionControl

__all__ = ["Antilock", "Brakes", "Hydraulics", "TractionControl"]
