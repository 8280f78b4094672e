"""The shared tyres of the unit tests."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from activesteer.tyre import TyreParameters, load_tir
from activesteer.tyre.tyre_parameters import TYRE_RECORD

TYRES = Path(__file__).parents[3] / "models" / "tyres"


@cache
def tyre(name: str = "compact_205_55R16") -> TyreParameters:
    return load_tir(TYRES / f"{name}.tir")


def differing(one: np.record, other: np.record) -> list[str]:
    """Return the fields in which two tyres differ for the kernels."""
    return [name for name in TYRE_RECORD.names or () if one[name] != other[name]]
