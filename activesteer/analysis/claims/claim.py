"""A claim of the paper: its statement, its criterion, and its verdict in three runs.

The limits of a criterion come from the words of the statement and from what a driver or a sensor can notice
(`metric_table`). A statement names the fakes that it must reject.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from activesteer.errors import ParameterError

SYSTEMS: Final = ("none", "ars", "afs")
"""Names of the compared runs: no control, active rear steering, active front superposition."""
SYSTEMS_WITH_CONTROL: Final = SYSTEMS[1:]


class Kind(StrEnum):
    """Subject of a statement."""

    SYSTEMS = "property of the systems"
    """The steering wheel follows a table; car, road and system determine the result."""
    DRIVER = "depends on the driver"
    """A driver closes the loop and influences the result too."""


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


_NO_PROOF: Final = frozenset({Fake.NONE_AS_BOTH, Fake.EXCHANGED, Fake.NO_GAIN, Fake.NOISE, Fake.CUT_SHORT})
"""Fakes that every statement rejects: a claim passes only on whole runs in which each system acts as itself and
responds to the manoeuvre."""


@dataclass(frozen=True, slots=True)
class Statement:
    """A statement of the paper, and its criterion.

    Attributes:
        id: Its number.
        text: Its words.
        criterion: Condition for it to pass, besides the conditions of all statements (`SystemRuns.obstacle`).
        kind: Its subject.
        rejects: Fakes on which it must not pass.
    """

    id: str
    text: str
    criterion: str
    kind: Kind
    rejects: frozenset[Fake]

    @classmethod
    def about(
        cls,
        kind: Kind,
        number: str,
        text: str,
        criterion: str,
        rejects: Iterable[Fake] = (Fake.NO_EFFECT, Fake.REVERSED),
    ) -> Statement:
        """Return a statement that rejects these fakes besides those that every statement rejects."""
        return cls(number, text, criterion, kind, _NO_PROOF | frozenset(rejects))


@dataclass(frozen=True, slots=True)
class Claim:
    """A checked statement.

    Attributes:
        statement: The statement.
        passed: Whether it holds.
        values: The numbers that decide, named `<system>_<metric>`.
        obstacle: Why it cannot pass whatever the numbers are; empty if nothing prevents it.
        distance: Distance from passing: the sum over its broken conditions, each 0 to 1. If it passes, the smallest
            margin of its conditions, at most 1, with a negative sign.
    """

    statement: Statement
    passed: bool
    values: dict[str, float]
    obstacle: str = ""
    distance: float = 0.0

    @property
    def id(self) -> str:
        """Number of the statement."""
        return self.statement.id

    @property
    def text(self) -> str:
        """Words of the statement."""
        return self.statement.text

    @property
    def criterion(self) -> str:
        """Condition for it to pass."""
        return self.statement.criterion


def check_systems(runs: Mapping[str, object], what: str) -> None:
    """Check that the three runs are given; further runs are ignored."""
    if missing := [system for system in SYSTEMS if system not in runs]:
        raise ParameterError(
            f"the claims about the {what} need the runs {', '.join(SYSTEMS)}; missing: {', '.join(missing)}",
            value=missing,
            allowed=SYSTEMS,
        )
