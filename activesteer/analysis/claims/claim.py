"""A claim of the paper: what is stated, what must hold for it, and what became of it in three runs.

The sizes of a statement come from what its words mean and from what a driver or a
sensor can notice (`metric_table`), and it names the fakes that it must not be taken in by.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from activesteer.errors import ParameterError

SYSTEMS: Final = ("none", "ars", "afs")
"""The runs that are compared: no control, active rear steering, active front superposition."""
SYSTEMS_WITH_CONTROL: Final = SYSTEMS[1:]


class Kind(StrEnum):
    """What a statement is about."""

    SYSTEMS = "property of the systems"
    """The steering wheel follows a table: car, road and system decide."""
    DRIVER = "depends on the driver"
    """A driver closes the loop: what he sees and how he acts decide too."""


class Fake(StrEnum):
    """Runs that look like those that a statement is about, and are not."""

    NONE_AS_BOTH = "the run without control given as both systems"
    NO_EFFECT = "both systems turn their wheels and the car moves as without control"
    EXCHANGED = "the two systems exchanged"
    REVERSED = "both systems with their signs turned round"
    ONE_REVERSED = "one of the systems with its sign turned round"
    NO_GAIN = "both systems with gains at zero"
    NOISE = "both systems answer to the noise of their sensors and to nothing else"
    CUT_SHORT = "runs that end too early"


_NO_PROOF: Final = frozenset({Fake.NONE_AS_BOTH, Fake.EXCHANGED, Fake.NO_GAIN, Fake.NOISE, Fake.CUT_SHORT})
"""What every statement rejects: no claim passes but on whole runs in which each system acts as what it is,
and on the manoeuvre."""


@dataclass(frozen=True, slots=True)
class Statement:
    """One statement of the paper, and its criterion.

    Attributes:
        id: Its number.
        text: What is claimed.
        criterion: What must hold for it to pass, besides what all of them need (`Trio.obstacle`).
        kind: What it is about.
        rejects: Fakes that it must not pass on.
    """

    id: str
    text: str
    criterion: str
    kind: Kind
    rejects: frozenset[Fake]

    @classmethod
    def about(cls, kind: Kind, number: str, text: str, criterion: str, *rejects: Fake) -> Statement:
        """A statement; the fakes are those that it rejects besides the ones that all do."""
        return cls(number, text, criterion, kind, _NO_PROOF | frozenset(rejects))


@dataclass(frozen=True, slots=True)
class Claim:
    """A statement, checked.

    Attributes:
        statement: What was checked.
        passed: Whether it holds.
        values: The numbers it was decided on, named `<system>_<metric>`.
        obstacle: Why it cannot hold whatever the numbers say; empty where nothing stands against it.
    """

    statement: Statement
    passed: bool
    values: dict[str, float]
    obstacle: str = ""

    @property
    def id(self) -> str:
        """Number of the statement."""
        return self.statement.id

    @property
    def text(self) -> str:
        """What is claimed."""
        return self.statement.text

    @property
    def criterion(self) -> str:
        """What must hold for it to pass."""
        return self.statement.criterion


def check_systems(runs: Mapping[str, object], what: str) -> None:
    """All three runs must be there; more are no matter.

    Raises:
        ParameterError: one is missing.
    """
    if missing := [system for system in SYSTEMS if system not in runs]:
        raise ParameterError(
            f"the claims about the {what} need the runs {', '.join(SYSTEMS)}; missing: {', '.join(missing)}",
            value=missing,
            allowed=SYSTEMS,
        )
