"""Checks of an error apart from its words: its place, its key, its value."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from activesteer.errors import ActiveSteerError


@contextmanager
def raises(
    error: type[ActiveSteerError] | tuple[type[ActiveSteerError], ...],
    cause: type[BaseException] | None = None,
    **fields: Any,
) -> Iterator[pytest.ExceptionInfo[Any]]:
    """Require that the body raises an error with these attributes; `cause` is the class of its cause."""
    with pytest.raises(error) as caught:
        yield caught
    assert {name: getattr(caught.value, name) for name in fields} == fields
    assert cause is None or isinstance(caught.value.__cause__, cause)
