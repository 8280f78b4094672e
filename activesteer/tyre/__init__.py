"""Magic Formula tyres: .tir files, forces and moments, relaxation, contact with the road.

In: .tir files; slip, load, inclination, pressure.
Out: forces, moments, relaxation lengths and contact.
"""

from __future__ import annotations

from activesteer.tyre.evaluation import MagicFormula, TyreForces
from activesteer.tyre.file.tir import load_tir, write_tir
from activesteer.tyre.kernels.magic_formula import Limit
from activesteer.tyre.tyre_parameters import TyreParameters

__all__ = ["Limit", "MagicFormula", "TyreForces", "TyreParameters", "load_tir", "write_tir"]
