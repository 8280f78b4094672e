"""Bounded least squares over runs, whose derivatives come from runs that are made at the same time.

All values are relative: differences to the noise of their channel, parameters to their range, 0 to 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple, cast

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import StudyError

STEP: Final = 1e-3
"""Step of the derivatives, relative to the range: far above rounding, far below the curvature of a run."""
_SETTLED: Final = 1e-4
"""The search ends when no parameter moves further than this fraction of its range. Gauss-Newton steps shrink
quadratically, so the remaining error is far smaller."""
_LESS: Final = 1e-8
"""The search also ends when the sum of squares decreases by no more than this fraction."""
_MOST_ROUNDS: Final = 40
AT_END: Final = 1e-3
"""A parameter this close to an end of its range is at that end."""

Answer = list[Array] | str
"""Differences of every channel of every recording for a set of parameters; or the reason why it cannot be driven."""


class Found(NamedTuple):
    """End of the search.

    Attributes:
        place: Parameters, shape (p,).
        before: Differences at the start, a series per channel and recording.
        after: Differences at the end.
        slopes: Derivatives at the end, shape (n, p) each.
        rounds: Number of parameter sets tried.
        settled: Whether the search converged.
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
    """Minimise the sum of squares of all differences (trust region reflective, SciPy).

    Args:
        answers: Function that drives several sets of parameters at once.
        start: Start of the search, shape (p,).
        check: Called with the derivatives at the start; an exception ends the search.

    Raises:
        StudyError: the first set, or a set beside a drivable one, cannot be driven.
    """
    from scipy.optimize import least_squares  # noqa: PLC0415 - slow to import

    rounds: dict[bytes, tuple[list[Array], list[Array]] | None] = {}

    def tried(place: Array) -> tuple[list[Array], list[Array]] | None:
        """Return differences and derivatives; None if the parameters cannot be driven."""
        name = place.tobytes()
        if name not in rounds:
            rounds[name] = _tried(answers, place, first=not rounds)
            if len(rounds) == 1:
                check(rounds[name][1])  # type: ignore[index] - the first one is there, or an error was raised
        return rounds[name]

    def differences(place: Array) -> Array:
        found = tried(place)
        # The search shortens its step if a value is not finite.
        return np.full(size, np.nan) if found is None else np.concatenate(found[0])

    def slopes(place: Array) -> Array:
        found = tried(place)
        assert found is not None
        return np.concatenate(found[1])

    # Away from the ends of a range, so that the search can step to both sides.
    start = np.clip(start, STEP, 1.0 - STEP)
    begun = tried(start)
    assert begun is not None
    size = sum(map(len, begun[0]))
    derivatives, unused = cast(Any, slopes), cast(Any, None)  # SciPy declares no types for them
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
            raise StudyError(f"the car cannot be driven at the start of the search: {here}", value=here)
        return None
    sides: list[list[Array]] = []
    for beside in there:
        if isinstance(beside, str):
            raise StudyError(f"the car cannot be driven beside drivable parameters: {beside}")
        sides.append(beside)
    slopes = [
        np.column_stack([(side[number] - series) / step for side, step in zip(sides, steps, strict=True)])
        for number, series in enumerate(here)
    ]
    return here, slopes
