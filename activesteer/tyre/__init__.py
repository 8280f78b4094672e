"""Magic Formula tyres: .tir files, forces and moments, relaxation, contact with the road."""

from __future__ import annotations

from pathlib import Path

from activesteer.tyre.kernels.cache import drop_stale_kernels

drop_stale_kernels(Path(__file__).parent)

from activesteer.tyre.evaluation import MagicFormula, TyreForces  # noqa: E402 - the kernels compile on import
from activesteer.tyre.file.tir import load_tir  # noqa: E402
from activesteer.tyre.file.writer import write_tir  # noqa: E402
from activesteer.tyre.kernels.limits import Limit  # noqa: E402
from activesteer.tyre.tyre_parameters import TyreParameters  # noqa: E402

__all__ = ["Limit", "MagicFormula", "TyreForces", "TyreParameters", "load_tir", "write_tir"]
