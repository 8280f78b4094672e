"""Controllers by name, or from a user's own file."""

from __future__ import annotations

import importlib.util
import sys
import traceback
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from activesteer.controllers.front_superposition import FrontSuperposition
from activesteer.controllers.no_control import NoControl
from activesteer.controllers.parameters import ControllerSetup
from activesteer.controllers.rear_steer import RearSteer
from activesteer.errors import ControllerError, nearest_names
from activesteer.signals import DriverCommand, Measurement, SteerCommand


class Controller(Protocol):
    """What a controller must have: one method."""

    def step(self, command: DriverCommand, measurement: Measurement) -> SteerCommand:
        """Steer command for the next step."""
        ...


BUILT_IN: Final = {"none": NoControl, "ars": RearSteer, "afs": FrontSuperposition}
"""Name -> class."""

_MOST_RAD: Final = 1.0
"""No road wheel is steered further by a controller; more is taken for a mistake, such as degrees [rad]."""

_USUAL: Final = frozenset({float, int, bool, np.float64})
"""Types of nearly all values of a SteerCommand."""


def load_controller(name: str, setup: ControllerSetup) -> Controller:
    """Makes a controller.

    Args:
        name: `none`, `ars`, `afs`, or a user's own as `path/to/file.py:ClassName`. A class with a classmethod
            `from_vehicle(setup)` is made by it, another one by calling it without arguments.
        setup: What the controller may know of the car.

    Returns:
        The controller; a user's own inside one that explains what goes wrong in it.

    Raises:
        ControllerError: there is no such controller, or it cannot be made.
    """
    if name in BUILT_IN:
        return BUILT_IN[name].from_vehicle(setup)
    made_from = _user_class(name)
    try:
        controller = made_from.from_vehicle(setup) if hasattr(made_from, "from_vehicle") else made_from()
    except Exception as reason:
        msg = f"controller {name}: {made_from.__name__} cannot be made: {_told(reason)}"
        raise ControllerError(msg) from reason
    if not callable(getattr(controller, "step", None)):
        msg = f"controller {name}: {made_from.__name__} has no method step(command, measurement)"
        raise ControllerError(msg)
    return UserController(controller, name)


class UserController:
    """A user's controller, watched: what it raises or returns wrongly is told with its file and class.

    Attributes:
        inner: The user's object.
    """

    def __init__(self, inner: Controller, name: str) -> None:
        """Takes the controller.

        Args:
            inner: The user's object.
            name: `file.py:ClassName`, for messages.
        """
        self.inner = inner
        self._name = name

    def step(self, command: DriverCommand, measurement: Measurement) -> SteerCommand:
        """What the user's step returns.

        Raises:
            ControllerError: it raised something, or returned no steering command.
        """
        try:
            steer = self.inner.step(command, measurement)
        except Exception as reason:
            msg = f"controller {self._name}: step raised {_told(reason)}"
            raise ControllerError(msg) from reason
        # Usual values pass quickly; anything else is looked at in full.
        if steer.__class__ is not SteerCommand or not _USUAL.issuperset(map(type, steer)) or not is_sane(steer):
            check_command(steer, self._name)
        return steer


def user_file(name: str) -> dict[str, bytes]:
    """The file of a user's own controller, to be kept with the recording; empty for a built-in one."""
    path_text, _, _ = name.rpartition(":")
    path = Path(path_text)
    return {path.name: path.read_bytes()} if name not in BUILT_IN and path.is_file() else {}


def _user_class(name: str) -> Any:
    path_text, _, class_name = name.rpartition(":")
    if not path_text or not class_name:
        msg = (
            f"there is no controller {name!r}; {nearest_names(name, BUILT_IN)} Your own is given as "
            "my_file.py:MyController"
        )
        raise ControllerError(msg)
    path = Path(path_text)
    if not path.is_file():
        msg = f"controller {name}: there is no file {path}"
        raise ControllerError(msg)
    spec = importlib.util.spec_from_file_location(f"activesteer_user_{path.stem}", path)
    if spec is None or spec.loader is None:
        msg = f"controller {name}: {path} is no Python file"
        raise ControllerError(msg)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as reason:
        msg = f"controller {name}: {path} cannot be run: {_told(reason)}"
        raise ControllerError(msg) from reason
    found = getattr(module, class_name, None)
    if not isinstance(found, type):
        classes = [key for key, value in vars(module).items() if getattr(value, "__module__", "") == spec.name]
        msg = f"controller {name}: {path} has no class {class_name!r}; {nearest_names(class_name, classes)}"
        raise ControllerError(msg)
    return found


def _told(error: Exception) -> str:
    """An error of somebody else's code in one line, with the place where it was raised."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {error}{place}"


def is_sane(steer: SteerCommand) -> bool:
    """Whether both angles are finite and within reason; quick, because it is asked every step."""
    try:
        return (
            -_MOST_RAD <= steer.rear_steer_demand_rad <= _MOST_RAD
            and -_MOST_RAD <= steer.superposition_demand_rad <= _MOST_RAD
        )
    except (TypeError, ValueError):  # no number, or an array of several
        return False


def check_command(steer: object, name: str) -> None:
    """Says what is wrong with what a controller returned.

    Args:
        steer: What it returned.
        name: The controller, for the message.

    Raises:
        ControllerError: it is no steering command, a value is no number, or an angle is not finite or beyond 1 rad.
    """
    if not isinstance(steer, SteerCommand):
        msg = f"controller {name}: step returned {steer!r}; an activesteer.SteerCommand is needed"
        raise ControllerError(msg)
    for key, value in zip(SteerCommand._fields, steer, strict=True):
        if not isinstance(value, (float, int, np.number, np.bool_)):
            msg = f"controller {name}: step returned {key} = {value!r}; a number is needed"
            raise ControllerError(msg)
    if is_sane(steer):
        return
    for key in ("rear_steer_demand_rad", "superposition_demand_rad"):
        value = getattr(steer, key)
        if not -_MOST_RAD <= value <= _MOST_RAD:
            msg = (
                f"controller {name}: step returned {key} = {value!r}; a finite angle of at most {_MOST_RAD:g} rad to "
                "either side is needed (radians, not degrees)"
            )
            raise ControllerError(msg)
