"""The road: asked for by the manoeuvre, felt by the vehicle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range


@dataclass(frozen=True)
class Road:
    """What the wheels roll on; keys of the table [road] in a manoeuvre file."""

    mu: Annotated[float, Range(0.01, 2.0)] = 1.0
    """Friction relative to the one of the tyre files [-]."""
    grade: Annotated[float, Range(-0.5, 0.5)] = 0.0
    """Rise over run in the direction of travel [-]; positive is uphill."""
