"""Metrics, claims, tables and figures, made from recordings and from nothing else.

- `metrics`: the numbers that belong to the manoeuvre of a recording: `step_response`, `frequency_response` (ISO 7401),
  `handling` (ISO 4138), `sine_with_dwell` (FMVSS 126), `brake_in_turn` (ISO 7975), `path_following` (lane change,
  slalom, any path), `general` for others.
- `claims`: what the paper says about the three systems, as checks, with a scorecard.
- `tables`, `figures`, `linear_plots`: the same for reading and looking. The figures need matplotlib
  (`pip install 'activesteer[plot]'`).
- `linearise`: the linear car; it belongs to `activesteer.studies.linearisation` and is only offered here.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import os

    import control


def linearise(
    vehicle: str | os.PathLike[str] | Mapping[str, Any] = "compact",
    speed_mps: float = 80.0 / 3.6,
    overrides: Mapping[str, Any] | None = None,
    **options: Any,
) -> control.StateSpace:
    """The car linearised about driving straight on; see `activesteer.studies.linearisation.linearise`.

    Args:
        vehicle: Name, path, or table of a vehicle.
        speed_mps: Speed [m/s].
        overrides: Dotted key -> value, as for `simulate`.
        **options: As there.
    """
    # Found when it is called: a car is live state, which this package must not depend on. Users look for it here.
    return importlib.import_module("activesteer.studies.linearisation").linearise(
        vehicle, speed_mps, overrides, **options
    )
