"""Unusual curves of an axle, with a value in every field."""

from __future__ import annotations

import numpy as np

from activesteer.vehicle.curve_axles import OVER_RACK, OVER_TRAVEL, AxleCurves, Curves

_POINTS = tuple(np.linspace(-0.08, 0.08, 7).tolist())
_STIFFNESS = (np.diag([5e5, 5e6, 2e5, 2e4, 1e5]) + 100.0)[np.triu_indices(5)]


def other_axle(*, steered: bool) -> AxleCurves:
    """Curves with slope and curvature in every coordinate."""
    travel = {
        name: tuple((0.1 * (place + 1) * x + 0.5 * x * x) for x in _POINTS) for place, name in enumerate(OVER_TRAVEL)
    }
    rack = {
        name: tuple((5.0 if name == "rack_steer_rad" else 0.2) * x + 0.4 * x * x for x in _POINTS) for name in OVER_RACK
    }
    return AxleCurves(
        travel_m=_POINTS,
        **travel,
        load_N=tuple(4e6 * x**3 for x in _POINTS),
        stiffness=tuple(_STIFFNESS.tolist()),
        hardening=(100.0, 20.0, 3.0, 40.0, 5.0, 120.0, -20.0, 6.0, -30.0, 8.0),
        hardening_square=(0.3, -0.2),
        damping_ratio=0.1,
        **(rack | {"rack_m": _POINTS} if steered else {}),
    )


def other_curves() -> Curves:
    """Curves of both axles."""
    return Curves(other_axle(steered=True), other_axle(steered=False))
