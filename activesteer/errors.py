"""The errors a user of activesteer can meet: one base, one child per kind of input that can be wrong."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any


class ActiveSteerError(Exception):
    """Base of every error that activesteer raises on purpose.

    Attributes:
        recording: What a run recorded until it failed with this error; None elsewhere.
    """

    recording: Any = None


class ParameterError(ActiveSteerError):
    """A parameter is missing, misspelt, of the wrong type or outside its range."""


class ModelError(ActiveSteerError):
    """An MJCF model does not compile, or lacks something that a car must have."""


class ManeuverError(ActiveSteerError):
    """A manoeuvre file cannot be found, read, or driven."""


class TyreFileError(ActiveSteerError):
    """A .tir file cannot be found, read, or used."""


class ControllerError(ActiveSteerError):
    """A controller cannot be loaded, or returned something that is no steering command."""


class SimulationDiverged(ActiveSteerError):  # noqa: N818 - an event of the physics, named as one
    """The state became non-finite, or the engine raised a warning; what was recorded is kept."""


class RecordingError(ActiveSteerError):
    """A recording cannot be written or read, or has no such channel."""


class PlaybackError(ActiveSteerError):
    """A recording cannot be shown: no viewer, no display, or a file that cannot be written."""


def nearest_names(name: str, known: Iterable[str], most: int = 3) -> str:
    """Words for an error message: which existing names come closest to a wrong one.

    Args:
        name: The name that does not exist.
        known: The names that do.
        most: How many to offer.

    Returns:
        ``"did you mean 'a' or 'b'?"`` where something is close, else all names in a list.
    """
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=most, cutoff=0.5)
    if close:
        return "did you mean " + " or ".join(repr(match) for match in close) + "?"
    return "known are: " + (", ".join(names) if names else "none")
