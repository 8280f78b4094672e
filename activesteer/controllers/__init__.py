"""Active steering controllers, which map DriverCommand and Measurement to ActuatorCommand.

In: the driver's command and the sensors' measurement.
Out: demands for rear steering, superposition, brakes and drive.
"""

from activesteer.controllers.find import (
    CONTROLLER,
    Controller,
    controller_spec,
    declared_parameters,
    is_variant,
    keys_read,
    load_controller,
    system_of,
)
from activesteer.controllers.front_superposition import FrontSuperposition
from activesteer.controllers.no_control import NoControl
from activesteer.controllers.parameters import ControllerParameters, ControllerSetup
from activesteer.controllers.rear_steer import RearSteer
from activesteer.controllers.registry import CONTROLLERS, is_read
from activesteer.controllers.variant import read_variant
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters

__all__ = [
    "CONTROLLER",
    "CONTROLLERS",
    "Controller",
    "ControllerParameters",
    "ControllerSetup",
    "FrontSuperposition",
    "NoControl",
    "RearSteer",
    "SingleTrack",
    "SingleTrackParameters",
    "controller_spec",
    "declared_parameters",
    "is_read",
    "is_variant",
    "keys_read",
    "load_controller",
    "read_variant",
    "system_of",
]
