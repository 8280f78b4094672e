"""The errors a user of activesteer can meet: one base, one child per kind of input that can be wrong."""

from __future__ import annotations

import difflib
import os
import re
import reprlib
from collections.abc import Iterable
from typing import Any, Final

MAX_SHOWN: Final = 200
"""How much of a value an error message repeats [characters]."""
_MAX_MESSAGE: Final = 1000
"""Longest message of an error [characters]; the middle of a longer one is left out."""
_GAP: Final = " ... "


class ActiveSteerError(Exception):
    """Base of every error that activesteer raises on purpose; its message is one line, made from its attributes.

    Attributes:
        problem: What is wrong, and what to do.
        file: Name of the file that it is in; None where there is none.
        line: Line in the file, from 1.
        key: Dotted key, option or argument that is wrong.
        value: What was given there.
        allowed: What may be given: a `config.Range`, or the names that exist.
        overridden: The value came from an override, not from the file.
        recording: What a run recorded until it failed with this error; None elsewhere.
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
        """See the attributes."""
        where = [f"{file}, line {line}" if line else file] if file and not overridden else []
        if key:
            where.append(f"override {key}" if overridden else key)
        super().__init__(_one_line(": ".join([*where, problem])))
        self.problem, self.file, self.line, self.key = problem, file, line, key
        self.value, self.allowed, self.overridden = value, allowed, overridden


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


class DriverError(ActiveSteerError):
    """A driver cannot be loaded, or returned something that is no command."""


class SimulationDiverged(ActiveSteerError):  # noqa: N818 - an event of the physics, named as one
    """The state became non-finite, or the engine raised a warning; what was recorded is kept."""


class RecordingError(ActiveSteerError):
    """A recording cannot be written or read, or has no such channel."""


class PlaybackError(ActiveSteerError):
    """A recording cannot be shown: no viewer, no display, or a file that cannot be written."""


class StudyError(ActiveSteerError):
    """A study cannot be begun, gone on with, or shown."""


def not_installed(error: type[ActiveSteerError], what: str, package: str, extra: str) -> ActiveSteerError:
    """What needs a package that is not there.

    Args:
        error: Class of the error.
        what: What needs it.
        package: Which package.
        extra: The extra of activesteer that brings it.

    Returns:
        The error, to be raised; its value is the package, what is allowed the extra.
    """
    return error(f"{what} needs {package}; pip install 'activesteer[{extra}]'", value=package, allowed=extra)


def shown(value: object) -> str:
    """A value as an error message repeats it: as Python writes it, a path as it is; of a long one beginning and end."""
    if isinstance(value, os.PathLike):
        return _shortened(_printable(os.fsdecode(value)), MAX_SHOWN)
    try:
        text = _REPR.repr(value)
    except ValueError:  # Python refuses to write out whole numbers of more than 4300 digits
        text = f"a whole number of {value.bit_length()} bits" if isinstance(value, int) else type(value).__name__
    return _shortened(text, MAX_SHOWN)


def nearest_names(name: str, known: Iterable[str], maximum: int = 5) -> str:
    """Words for an error message: which existing names come closest to a wrong one.

    Args:
        name: The name that does not exist.
        known: The names that do.
        maximum: How many to offer.

    Returns:
        ``"did you mean 'a' or 'b'?"`` where something is close, else all names in a list, or of many the first ones.
    """
    names = sorted(known)
    close = difflib.get_close_matches(name[:MAX_SHOWN], names, n=maximum, cutoff=0.5)
    if close:
        return "did you mean " + " or ".join(repr(match) for match in close) + "?"
    listed = ", ".join(names) if names else "none"
    if len(listed) > MAX_SHOWN:
        listed = f"{', '.join(names[:maximum])} and {len(names) - maximum} more"
    return f"known are: {listed}"


_REPR: Final = reprlib.Repr()
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = MAX_SHOWN
_REPR.maxlist = _REPR.maxtuple = _REPR.maxdict = 20


def _one_line(text: str) -> str:
    """Line breaks become blanks, and what cannot be printed becomes its escape sequence."""
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
