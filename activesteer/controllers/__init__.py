"""Active steering controllers: DriverCommand, Measurement -> ActuatorCommand."""

from activesteer.controllers.front_superposition import FrontSuperposition
from activesteer.controllers.loading import BUILT_IN, CONTROLLER, Controller, find_controller, load_controller
from activesteer.controllers.no_control import NoControl
from activesteer.controllers.parameters import ControllerParameters, ControllerSetup
from activesteer.controllers.rear_steer import RearSteer
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters

__all__ = [
    "BUILT_IN",
    "CONTROLLER",
    "Controller",
    "ControllerParameters",
    "ControllerSetup",
    "FrontSuperposition",
    "NoControl",
    "RearSteer",
    "SingleTrack",
    "SingleTrackParameters",
    "find_controller",
    "load_controller",
]
