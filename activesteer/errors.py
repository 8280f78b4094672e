"""Errors that a user of activesteer can meet: one base class, and one class for each kind of wrong input."""

from __future__ import annotations

import difflib
import os
import re
import reprlib
from collections.abc import Iterable
from typing import Any, Final

MAX_SHOWN: Final = 200
"""Largest number of characters of a value in an error message."""
_MAX_MESSAGE: Final = 1000
"""Largest number of characters of an error message. The middle of a longer message is left out."""
_GAP: Final = " ... "


class ActiveSteerError(Exception):
    """Base class of all errors that activesteer raises deliberately.

    Its message is one line, made from its attributes.

    Attributes:
        problem: The problem and its remedy.
        file: Name of the file with the problem; None without a file.
        line: Line in the file, from 1.
        key: Dotted key, option or argument that is wrong.
        value: The value given there.
        allowed: Allowed values: a `config.Range`, or the names that exist.
        overridden: True if the value came from an override, not from the file.
        recording: Recording of a run until it failed with this error; None elsewhere.
    """

    recording: Any = None

    def __init__(
        self,
        problem: str = "",
        *,
        file: str | None = None,
        line: int | None = None,
        key: str | None = None,
        value: Any = None,
        allowed: Any = None,
        overridden: bool = False,
    ) -> None:
        """Create the message (see the attributes)."""
        where = [f"{file}, line {line}" if line else file] if file and not overridden else []
        if key:
            where.append(f"override {key}" if overridden else key)
        super().__init__(_one_line(": ".join([*where, problem])))
        self.problem, self.file, self.line, self.key = problem, file, line, key
        self.value, self.allowed, self.overridden = value, allowed, overridden


class ParameterError(ActiveSteerError):
    """Error in a parameter: missing, misspelt, of the wrong type, or outside its range."""


class ModelError(ActiveSteerError):
    """Error in an MJCF model: it does not compile, or lacks a required part."""


class ManeuverError(ActiveSteerError):
    """Error in a manoeuvre: its file cannot be found, read or driven."""


class TyreFileError(ActiveSteerError):
    """Error in a tyre file: it cannot be found, read or used."""


class ControllerError(ActiveSteerError):
    """Error of a controller: it cannot be loaded, or returned something other than an actuator command."""


class DriverError(ActiveSteerError):
    """Error of a driver: it cannot be loaded, or returned something other than a driver command."""


class SimulationDiverged(ActiveSteerError):  # noqa: N818 - an event of the physics, named as one
    """Divergence of a run: a state is not finite, or the engine warns. The error holds the recording so far."""


class RecordingError(ActiveSteerError):
    """Error in a recording: it cannot be written or read, or lacks a channel."""


class PlaybackError(ActiveSteerError):
    """Error in a playback: no viewer, no display, or a file that cannot be written."""


class StudyError(ActiveSteerError):
    """Error in a study: it cannot be started, resumed or shown."""


def not_installed(error: type[ActiveSteerError], what: str, package: str, extra: str) -> ActiveSteerError:
    """Return an error for a missing package.

    Args:
        error: Class of the error.
        what: The feature that needs the package.
        package: The package.
        extra: The extra of activesteer that installs it.

    Returns:
        The error, to be raised; its value is the package.
    """
    return error(f"{what} needs {package}; pip install 'activesteer[{extra}]'", value=package, allowed=extra)


def shown(value: object) -> str:
    """Format a value for an error message: its Python form, or a path as a string, shortened in the middle."""
    if isinstance(value, os.PathLike):
        return _shortened(_printable(os.fsdecode(value)), MAX_SHOWN)
    try:
        text = _REPR.repr(value)
    except ValueError:  # Python refuses to write out whole numbers of more than 4300 digits
        text = f"a whole number of {value.bit_length()} bits" if isinstance(value, int) else type(value).__name__
    return _shortened(text, MAX_SHOWN)


def nearest_names(name: str, known: Iterable[str], maximum: int = 5) -> str:
    """Return words for an error message: the existing names closest to a wrong name.

    Args:
        name: The name that does not exist.
        known: The names that do.
        maximum: Number of names to offer.

    Returns:
        ``"did you mean 'a' or 'b'?"`` if a name is close, else the list of all names, or the first ones of a long list.
    """
    names = sorted(known)
    close = difflib.get_close_matches(name[:MAX_SHOWN], names, n=maximum, cutoff=0.5)
    if close:
        return "did you mean " + " or ".join(repr(match) for match in close) + "?"
    listed = ", ".join(names) if names else "none"
    if len(listed) > MAX_SHOWN:
        listed = f"{', '.join(names[:maximum])} and {len(names) - maximum} more"
    return f"known names: {listed}"


_REPR: Final = reprlib.Repr()
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = MAX_SHOWN
_REPR.maxlist = _REPR.maxtuple = _REPR.maxdict = 20


def _one_line(text: str) -> str:
    """Replace line breaks by spaces, and unprintable characters by their escape sequences."""
    line = re.sub(r"[ \t]*[\r\n]\s*", " ", _shortened(text.strip(), 4 * _MAX_MESSAGE))
    return _shortened(_printable(line), _MAX_MESSAGE)


def _printable(text: str) -> str:
    if text.isprintable():
        return text
    return "".join(sign if sign.isprintable() else sign.encode("unicode_escape").decode() for sign in text)


def _shortened(text: str, maximum: int) -> str:
    if len(text) <= maximum:
        return text
    rest = (maximum - len(_GAP)) // 4
    return text[: maximum - len(_GAP) - rest] + _GAP + text[-rest:]
