"""Bounded least squares: differences of all channels, derivatives from runs that are made at once.

Everything in here is relative: differences to the noise of their channel, parameters to their range, 0 to 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple, cast

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import StudyError

STEP: Final = 1e-3
"""Step of the derivatives, of a parameter's range: far above what a run rounds off, far below its curvature."""
_SETTLED: Final = 1e-4
"""The search ends where no parameter moves further, of its range. The steps of Gauss and Newton become shorter with
their square, so what is left is far less."""
_LESS: Final = 1e-8
"""Or where the sum of squares is less by no more than this fraction."""
_MOST_ROUNDS: Final = 40
AT_END: Final = 1e-3
"""A parameter this near to an end of its range is at it."""

Answer = list[Array] | str
"""Differences of every channel of every recording with one set of parameters; or why it could not be driven."""


class Found(NamedTuple):
    """Where the search ended.

    Attributes:
        place: The parameters, shape (p,).
        before: Differences where it began, a series for each channel of each recording.
        after: Those where it ended.
        slopes: Derivatives of these, shape (n, p) each.
        rounds: How often parameters were tried.
        settled: Whether it ended because nothing moved any more.
    """

    place: Array
    before: list[Array]
    after: list[Array]
    slopes: list[Array]
    rounds: int
    settled: bool


def search(
    answers: Callable[[list[Array]], Sequence[Answer]], start: Array, check: Callable[[list[Array]], None]
) -> Found:
    """Make the sum of squares of all differences as small as it becomes (trust region reflective, SciPy).

    Args:
        answers: Drives several sets of parameters at once.
        start: Where to begin, shape (p,).
        check: Called with the derivatives at the start; whatever it raises ends the search.

    Raises:
        StudyError: the first set cannot be driven, or none beside another one.
    """
    from scipy.optimize import least_squares  # noqa: PLC0415 - slow to import

    rounds: dict[bytes, tuple[list[Array], list[Array]] | None] = {}

    def tried(place: Array) -> tuple[list[Array], list[Array]] | None:
        """Differences and derivatives at a place; None where it cannot be driven."""
        name = place.tobytes()
        if name not in rounds:
            rounds[name] = _tried(answers, place, first=not rounds)
            if len(rounds) == 1:
                check(rounds[name][1])  # type: ignore[index] - the first one is there, or an error was raised
        return rounds[name]

    def differences(place: Array) -> Array:
        found = tried(place)
        # What is not finite makes the search take a shorter step.
        return np.full(size, np.nan) if found is None else np.concatenate(found[0])

    def slopes(place: Array) -> Array:
        found = tried(place)
        assert found is not None
        return np.concatenate(found[1])

    # Not at the very end of a range, where the search could not take a step to either side.
    start = np.clip(start, STEP, 1.0 - STEP)
    begun = tried(start)
    assert begun is not None
    size = sum(map(len, begun[0]))
    derivatives, unused = cast(Any, slopes), cast(Any, None)  # their types are guessed from SciPy's defaults
    found = least_squares(
        differences, start, derivatives, (0.0, 1.0), xtol=_SETTLED, ftol=_LESS, gtol=unused, max_nfev=_MOST_ROUNDS
    )
    last = tried(found.x)
    assert last is not None
    return Found(found.x, begun[0], *last, len(rounds), found.status > 0)


def _tried(
    answers: Callable[[list[Array]], Sequence[Answer]], place: Array, *, first: bool
) -> tuple[list[Array], list[Array]] | None:
    steps = np.where(place + STEP > 1.0, -STEP, STEP)
    here, *there = answers([place, *(place + step for step in np.diag(steps))])
    if isinstance(here, str):
        if first:
            raise StudyError(f"where the search begins, the car cannot be driven: {here}", value=here)
        return None
    sides: list[list[Array]] = []
    for beside in there:
        if isinstance(beside, str):
            raise StudyError(f"beside parameters that could be driven, the car cannot be driven: {beside}")
        sides.append(beside)
    slopes = [
        np.column_stack([(side[number] - series) / step for side, step in zip(sides, steps, strict=True)])
        for number, series in enumerate(here)
    ]
    return here, slopes
