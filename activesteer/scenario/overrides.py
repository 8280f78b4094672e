"""Overrides: single keys of a file replaced for one run, each at most once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from activesteer.config import Source, check_overruled, field_path, merged
from activesteer.errors import ParameterError, shown


class Override(NamedTuple):
    """One replaced key."""

    given: str
    path: tuple[str, ...]
    value: Any


def plain(overrides: Mapping[str, Any] | None) -> dict[str, Any]:
    """Convert NumPy's numbers and arrays in overrides to Python's, because JSON cannot store them."""
    for key in overrides or {}:
        if not isinstance(key, str):
            raise ParameterError(f"the key of an override is text such as 'road.mu', not {shown(key)}", value=key)
    return {
        key: value.tolist() if isinstance(value, (np.generic, np.ndarray)) else value
        for key, value in (overrides or {}).items()
    }


def applied(
    cls: type, table: Mapping[str, Any], source: Source, overrides: Sequence[Override]
) -> tuple[dict[str, Any], Source]:
    """Apply overrides to the table of a file.

    Returns:
        The new table, and its source, which knows the overridden keys.

    Raises:
        ParameterError: a key does not exist, or two overrides set the same value.
    """
    paths = [field_path(cls, override.path) for override in overrides]
    for (one, above), (other, below) in combinations(zip(overrides, paths, strict=True), 2):
        shorter = min(len(above), len(below))
        if above[:shorter] == below[:shorter]:
            raise ParameterError(
                f"replaces the value of {one.given}; leave one of the two out",
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
