"""The elastic part of an axle of curves, from tests of compliance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from activesteer.core.conventions import Array
from activesteer.vehicle.curve_axles import COORDINATES
from activesteer.vehicle_builder.kc_fit import Load, fitted

INERTIA = np.diag([35.0, 35.0, 0.9, 0.26, 0.4])
"""Of a wheel with hub and knuckle [kg, kg m2]."""


def test_what_no_test_moves_is_stiff_but_not_faster_than_a_step_can_tell() -> None:
    """A compliance of 0.1 mm/kN under side force is kept, and the wheel oscillates at 320 Hz at most."""
    force = np.linspace(-4000.0, 4000.0, 17)
    moved: dict[str, Array | None] = {name: np.zeros(17) for name in COORDINATES}
    pushed = Load(
        "side_force", np.array([0.0, 1.0, 0.3, 0.0, 0.0]), force, moved | {"y": 1e-7 * force}, np.zeros((5, 5))
    )
    turned = [
        Load(name, np.eye(5)[COORDINATES.index(name)], 0.1 * force, moved, np.zeros((5, 5)))
        for name in ("caster", "toe")
    ]
    elastic, _ = fitted([pushed, *turned])
    matrix = np.zeros((5, 5))
    matrix[np.triu_indices(5)] = elastic["stiffness"]
    stiffness = matrix + np.triu(matrix, 1).T
    frequencies_Hz = np.sqrt(eigh(stiffness, INERTIA, eigvals_only=True)) / (2.0 * np.pi)
    assert 250.0 < frequencies_Hz.max() < 330.0
    assert np.linalg.solve(stiffness, pushed.direction)[1] == pytest.approx(1e-7, rel=0.05)
