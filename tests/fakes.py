"""Runs that look like the runs of a statement of the paper and are not, and the statements that must reject them."""

from __future__ import annotations

from enum import StrEnum
from typing import Final


class Fake(StrEnum):
    """Runs that look like the runs of a statement, and are not."""

    NONE_AS_BOTH = "the run without control given as both systems"
    NO_EFFECT = "both systems turn their wheels and the car moves as without control"
    EXCHANGED = "the two systems exchanged"
    REVERSED = "both systems with their signs reversed"
    ONE_REVERSED = "one of the systems with its sign reversed"
    NO_GAIN = "both systems with gains at zero"
    NOISE = "both systems respond to the noise of their sensors and to nothing else"
    CUT_SHORT = "runs that end too early"


NO_PROOF: Final = frozenset({Fake.NONE_AS_BOTH, Fake.EXCHANGED, Fake.NO_GAIN, Fake.NOISE, Fake.CUT_SHORT})
"""Fakes that every statement rejects: a claim passes only on whole runs in which each system acts as itself and
responds to the manoeuvre."""
_OTHERS: Final = {
    "S3": {Fake.REVERSED},  # about angles, which also turn without an effect on the car
    "S4": {Fake.REVERSED},
    "D4": {Fake.ONE_REVERSED},  # two angles: with both reversed, their signs are still opposite
    "L1": set(),  # likeness
}


def rejected(number: str) -> frozenset[Fake]:
    """Return the fakes on which a statement must not pass."""
    return NO_PROOF | _OTHERS.get(number, {Fake.NO_EFFECT, Fake.REVERSED})
