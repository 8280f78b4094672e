"""The record of a tyre for the kernels: `p.PCX1`, one float64 for each coefficient of the table.

The same compiled code serves Python, the vectorised call and the native callback. The callback finds the record in a
numeric block of the model.
"""

from __future__ import annotations

from typing import Final

from activesteer.native_records import numbers_type
from activesteer.tyre.conventions import TyreConventions
from activesteer.tyre.file.syntax import COEFFICIENTS

_WORKED_OUT: Final = (
    "MF_VERSION",  # 52, 60, 61 or 62
    "SLIP_TANGENT",  # 0: alpha* = alpha and gamma* = gamma; 1: alpha* = tan(alpha) and gamma* = sin(gamma)
    "SIDE",  # +1: mounted on the side of the file; -1: on the other side, everything mirrored
    "PTX_GIVEN",  # 1 where the file gives PTX1 (MF 5.2 relaxation length of Fx)
    "PTY_GIVEN",  # 1 where the file gives PTY1 (MF 5.2 relaxation length of Fy)
    "Q_RA_GIVEN",  # 1 where the file gives the contact length
    "Q_RB_GIVEN",  # 1 where the file gives the contact width
)
"""Fields that no file holds; `TyreParameters.record` sets them."""

_FIELDS: Final = (*(coefficient.name for coefficient in COEFFICIENTS), *_WORKED_OUT, *TyreConventions().numbers())

TYRE_RECORD: Final = numbers_type(*_FIELDS)
"""Coefficients in the order of their table, derived fields, and the conventions."""
