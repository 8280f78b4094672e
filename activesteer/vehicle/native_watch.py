"""Looking for changes in the engine's memory, fast enough for each step."""

from __future__ import annotations

from typing import Final

from numba import carray, types

from activesteer.compilation import compiled_call
from activesteer.native_memory import f64_pointer, pointer_to, word_pointer

UNCHANGED: Final = 0
CHANGED: Final = 1
NEGATIVE: Final = 2
_bytes: Final = pointer_to(types.uint8)


@compiled_call(types.intp, types.intp, types.intp, types.intp, types.intp, others_run=False)
def watch(copies, n_copies, positive, n_positive):
    """Compare arrays with their copies, and look for negative numbers."""
    changed = negative = False
    rows = word_pointer(copies)
    for index in range(n_copies):
        size = rows[3 * index + 2]
        now, then = carray(_bytes(rows[3 * index]), (size,)), carray(_bytes(rows[3 * index + 1]), (size,))
        for place in range(size):
            changed |= now[place] != then[place]
    rows = word_pointer(positive)
    for index in range(n_positive):
        values = f64_pointer(rows[2 * index])
        for place in range(rows[2 * index + 1]):
            negative |= values[place] < 0.0
    return 2 if negative else 1 if changed else 0
