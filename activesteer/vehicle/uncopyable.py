"""Objects that hold addresses of native memory: a copy would share the memory of the original."""

from __future__ import annotations

from typing import Any, NoReturn

from activesteer.errors import ParameterError


class Uncopyable:
    """Base of objects that can be neither copied nor pickled."""

    def _refuse(self, *_: Any) -> NoReturn:
        raise ParameterError(
            f"a {type(self).__name__} holds native memory and cannot be copied or pickled; copy the Simulation "
            "(Simulation.copy, copy.deepcopy, pickle)"
        )

    __copy__ = __deepcopy__ = __reduce_ex__ = _refuse
