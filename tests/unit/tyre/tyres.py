"""The tyres that the unit tests share."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from activesteer.tyre import TyreParameters, load_tir

TYRES = Path(__file__).parents[3] / "models" / "tyres"


@cache
def tyre(name: str = "compact_205_55R16") -> TyreParameters:
    return load_tir(TYRES / f"{name}.tir")
