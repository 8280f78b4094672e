"""The available standards."""

from __future__ import annotations

from typing import Final

from activesteer.errors import ParameterError, nearest_names
from activesteer.standards import (
    fmvss126,
    iso3888_2,
    iso4138,
    iso7401,
    iso7975,
    iso13674,
    iso14512,
    iso21994,
    r79_circle,
)
from activesteer.standards.standard import Standard

STANDARDS: Final[dict[str, Standard]] = {
    module.STANDARD.name: module.STANDARD
    for module in (fmvss126, iso3888_2, iso4138, iso7401, iso7975, iso13674, iso14512, iso21994, r79_circle)
}
"""Name -> standard."""


def standard_of(name: str) -> Standard:
    """Return a standard by its name."""
    if not name:
        raise ParameterError(f"which standard? {nearest_names('', STANDARDS)}", value=name, allowed=tuple(STANDARDS))
    if name not in STANDARDS:
        raise ParameterError(
            f"there is no standard {name!r}; {nearest_names(name, STANDARDS)}", value=name, allowed=tuple(STANDARDS)
        )
    return STANDARDS[name]
