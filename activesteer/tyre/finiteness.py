"""Test that a tyre is finite inside its own range: a readable file need not describe a tyre."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import product
from typing import Final

import numpy as np

from activesteer.compilation import compiled
from activesteer.tyre.file.coefficients import BY_NAME
from activesteer.tyre.kernels.contact import tyre_on_road
from activesteer.tyre.kernels.magic_formula import (
    FORCE_COLUMNS,
    INPUT_COLUMNS,
    ROLLING_COLUMNS,
    evaluate_rows,
    rolling_rows,
)
from activesteer.tyre.kernels.record import TYRE_RECORD

_MAX_FORCE: Final = 1e12
"""No result of a tyre exceeds this [N, Nm, m ...]; beyond it, the engine's state soon overflows too."""
_ENORMOUS: Final = 1e7
"""No coefficient of a tyre is larger in SI: pressures and stiffnesses are some 1e6."""
_TURN_SLIP_1PM: Final = 0.1
_MF52: Final = 52.0


def is_finite(tyre: np.record) -> bool:
    """Return True if forces, radii and relaxation lengths are finite over the tyre's ranges, rolling and at rest."""
    return _is_finite(np.atleast_1d(tyre).tobytes())


def culprit(tyre: np.record, names: Iterable[str]) -> str | None:
    """Return the enormous coefficient whose default makes the tyre finite; the largest one if there are several."""
    enormous = (name for name in names if abs(tyre[name]) > _ENORMOUS)
    for name in sorted(enormous, key=lambda name: -abs(tyre[name])):
        tried = np.atleast_1d(tyre).copy()
        tried[name] = BY_NAME[name].default if BY_NAME[name].default is not None else 1.0
        if is_finite(tried[0]):
            return name
    return None


@lru_cache(maxsize=64)
def _is_finite(record: bytes) -> bool:
    tyre = np.frombuffer(record, TYRE_RECORD)
    inputs = _operating_points(tyre[0])
    forces = np.empty((len(inputs), len(FORCE_COLUMNS)))
    rolling = np.empty((len(inputs), len(ROLLING_COLUMNS)))
    evaluate_rows(tyre, inputs, forces, np.empty(len(inputs), np.int64))
    rolling_rows(tyre, inputs, forces, rolling)
    driven = np.array([_on_road(tyre, *point) for point in _motions(tyre[0])])
    return all(bool((np.abs(values) < _MAX_FORCE).all()) for values in (forces, rolling, driven))


@compiled
def _on_road(tyre, deflection_m, camber_rad, speed_mps, slip, across_mps, closing_mps):
    """Evaluate the tyre as the engine does, without relaxation states."""
    p = tyre[0]
    cos, sin = math.cos(camber_rad), math.sin(camber_rad)
    spin = (1.0 + slip) * speed_mps / p.UNLOADED_RADIUS
    return tyre_on_road(
        p, 1.0, p.INFLPRES, 2.0, 1500.0, 0.001, (p.UNLOADED_RADIUS - deflection_m) * cos, 0.0, cos, sin,
        speed_mps, across_mps, -closing_mps, 0.0, spin * cos, spin * sin, 0.01, 0.01, 0.01,
    )  # fmt: skip


def _motions(p: np.record) -> Iterator[tuple[float, ...]]:
    """Yield wheels that stand, roll, slide and fall, pressed down by a little and by a third of the tyre's height."""
    height = p.UNLOADED_RADIUS - p.RIM_RADIUS
    return product(
        (0.02 * height, 0.3 * height),
        (p.CAMMIN, 0.0, p.CAMMAX),
        (0.0, 1.0, p.LONGVL),
        (-0.5, 0.0),
        (0.0, 2.0),
        (0.0, 1.0),
    )


def _operating_points(p: np.record) -> np.ndarray:
    """Return corners, middle and points between of the ranges of a tyre file, shape (n, len(INPUT_COLUMNS))."""
    loads = {max(p.FZMIN, 0.01 * p.FZMAX), min(max(p.FNOMIN, p.FZMIN), p.FZMAX), p.FZMAX}
    slips, angles = (
        (low, 0.1 * low, 0.0, 0.1 * high, high) for low, high in ((p.KPUMIN, p.KPUMAX), (p.ALPMIN, p.ALPMAX))
    )
    turn = 0.0 if p.MF_VERSION == _MF52 else _TURN_SLIP_1PM
    return np.array(
        [
            (load, slip, angle, camber, pressure, speed, 1.0, turn_slip)
            for load, slip, angle, camber, pressure, (speed, turn_slip) in product(
                sorted(loads), slips, angles, (p.CAMMIN, 0.0, p.CAMMAX), (p.PRESMIN, p.INFLPRES, p.PRESMAX),
                ((p.LONGVL, 0.0), (0.0, turn)),
            )
        ]
    ).reshape(-1, len(INPUT_COLUMNS))  # fmt: skip
