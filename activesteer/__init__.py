"""activesteer: a multibody car in MuJoCo with active rear steering and active front steering superposition."""

from activesteer.recording import Recording
from activesteer.signals import DriverCommand, Measurement, SteerCommand
from activesteer.simulation.runner import simulate
from activesteer.version import __version__

__all__ = ["DriverCommand", "Measurement", "Recording", "SteerCommand", "__version__", "simulate"]
