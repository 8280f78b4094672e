"""Brakes: hydraulics, anti-lock system and traction control, as native code that the car's step calls."""

from activesteer.brakes.parameters import Antilock, Brakes, Hydraulics, TractionControl

__all__ = ["Antilock", "Brakes", "Hydraulics", "TractionControl"]
