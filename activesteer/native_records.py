"""Types of the records that Python and compiled code share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np


def numbers_type(*fields: str | tuple[str, int], words: Iterable[str] = ()) -> np.dtype[Any]:
    """Return a record type of numbers, and of rows of numbers where a length is given."""
    rows = [(field, np.float64) if isinstance(field, str) else (field[0], np.float64, (field[1],)) for field in fields]
    return np.dtype((np.record, [*((name, np.intp) for name in words), *rows]))
