"""Overrides: single keys of a file replaced for one run, each at most once and none without effect on another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from activesteer.config import Source, check_overruled, field_path, merged
from activesteer.errors import ParameterError, shown


class Override(NamedTuple):
    """One replaced key.

    Attributes:
        given: The key as it was given.
        path: The keys inside the file that it leads to.
        value: What is put there.
    """

    given: str
    path: tuple[str, ...]
    value: Any


def plain(overrides: Mapping[str, Any] | None) -> dict[str, Any]:
    """Overrides with NumPy's numbers and arrays as Python's: sweeps are made of them, JSON is not.

    Raises:
        ParameterError: a key is no text.
    """
    for key in overrides or {}:
        if not isinstance(key, str):
            raise ParameterError(f"the key of an override is a text as 'road.mu', not {shown(key)}", value=key)
    return {
        key: value.tolist() if isinstance(value, (np.generic, np.ndarray)) else value
        for key, value in (overrides or {}).items()
    }


def applied(
    cls: type, table: Mapping[str, Any], source: Source, overrides: Sequence[Override]
) -> tuple[dict[str, Any], Source]:
    """A file's table with the overrides put in.

    Args:
        cls: Dataclass that the table will become.
        table: The table.
        source: Where it came from.
        overrides: What to replace.

    Returns:
        The new table, and its source, which knows what does not come from there.

    Raises:
        ParameterError: a key does not exist, or one override replaces what another one gives.
    """
    paths = [field_path(cls, override.path) for override in overrides]
    for (one, above), (other, below) in combinations(zip(overrides, paths, strict=True), 2):
        shorter = min(len(above), len(below))
        if above[:shorter] == below[:shorter]:
            raise ParameterError(
                f"replaces what {one.given} gives; leave one of the two out",
                key=other.given,
                value=other.value,
                overridden=True,
            )
    changed = frozenset(".".join(override.path) for override in overrides)
    for override in overrides:
        given = Source("", error=ParameterError, overridden=frozenset({".".join(override.path)}))
        table = merged(cls, table, override.path, override.value, given)
    check_overruled(cls, table, Source("", error=ParameterError, overridden=changed), [one.path for one in overrides])
    return dict(table), replace(source, overridden=changed)
