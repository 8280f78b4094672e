"""The elastic part of an axle of curves: a 5 x 5 stiffness with hardening, from the tests of compliance.

Directions without a load in the tests get the compliance of the compact (a weak pull towards it). The stiffness is
symmetric and positive definite, because the search is for a product of triangles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import least_squares

from activesteer.conventions import Array
from activesteer.vehicle.curve_axles import COORDINATES, upper_triangle

_SCALE: Final = np.array([1e-4, 1e-4, 2e-4, 2e-4, 2e-4])
"""Units of the residuals: 0.1 mm and 0.01 deg."""
_PULL: Final = 0.3
"""Weight of the usual compliance against one sample."""
_USUAL: Final = np.diag([2.2e-6, 1.0e-7, 1.8e-6, 6.0e-5, 8.0e-5])
"""Compliance of a wheel at its centre [m/N, rad/(N m)]: about the compact's, 2.2 mm/kN along and 0.1 mm/kN across the
car, 0.03 deg of camber, 1 deg of wind-up and 0.5 deg of toe per 100 N m or 0.3 kN at the road."""
_FLOOR: Final = np.diag([4e-9, 4e-9, 1e-7, 1e-7, 1e-7])
"""Smallest compliance [m/N, rad/(N m)]; with a smaller value rounding would matter."""
_WHEEL: Final = np.diag([35.0, 35.0, 0.9, 0.26, 0.4])
"""Inertia of a wheel with hub and knuckle [kg, kg m2]."""
_FASTEST: Final = (2.0 * np.pi * 320.0) ** 2
"""Square of the highest natural frequency of a wheel [1/s2]; higher ones show nothing at a step of 1 ms, and cost
iterations."""
_UNITS: Final = np.sqrt(np.outer(np.diag(_USUAL), np.diag(_USUAL)))
_LOWER: Final = np.tril_indices(5)
_LINEAR: Final = 15
"""Number of entries of a triangle, before those of the hardening springs."""
_SPRING: Final = 250.0 * np.array([1.0, 1.0, 0.3, 0.3, 0.3])
"""Unit of the hardening springs: 4e9 N/m3 along the car."""
_FIRST_SPRINGS: Final = np.array([1.0, 0.0, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0, -0.5, 0.0, 0.0, 0.0])


@dataclass(frozen=True)
class Load:
    """One test of compliance on the left wheel.

    Attributes:
        name: The test.
        direction: Load at the wheel centre per unit of x: forces along x and y, moments about x, y and z.
        x: Values of the variable [N, N m].
        moved: Coordinate to its change [m, rad]; None if not measured.
        beside: Compliance in series with the wheel's own, shape (5, 5): the rack that both wheels push in the same
            direction, or the servo of the rear steering.
    """

    name: str
    direction: Array
    x: Array
    moved: dict[str, Array | None]
    beside: Array


@dataclass(frozen=True)
class Elasticity:
    """Fitted fields of `AxleCurves`, and a remark on their basis."""

    stiffness: tuple[float, ...]
    hardening: tuple[float, ...]
    hardening_square: tuple[float, ...]
    remark: str


def fitted(loads: list[Load]) -> Elasticity:
    """Fit stiffness and hardening about the curves to the measured compliance.

    Directions that are rigid in the tests, as most are in an axle with few soft bushings, keep a small compliance: a
    wheel oscillates on them at 320 Hz, which is 0.007 mm/kN across the car, or 0.005 deg of wind-up per 100 N m.
    """
    forces = np.concatenate([np.outer(load.x, load.direction) for load in loads] or [np.zeros((0, 5))])
    wanted = np.concatenate([_wanted(load) for load in loads] or [np.zeros((0, 5))])
    weight = np.concatenate([np.full((len(load.x), 1), len(load.x) ** -0.5) for load in loads] or [np.zeros((0, 1))])
    known = np.isfinite(wanted)
    floor = _FLOOR
    root = _start(forces, wanted - forces @ _FLOOR, weight)

    def parts(numbers: Array) -> tuple[Array, Array, Array]:
        triangle = np.zeros((5, 5))
        triangle[_LOWER] = numbers[:15]
        springs, square = np.zeros((2, 5)), np.zeros(2)
        if len(numbers) > _LINEAR:
            springs, square = numbers[15:25].reshape(2, 5) * _SPRING, numbers[25:]
        return floor + (triangle @ triangle.T) * _UNITS, springs, square

    def missing(numbers: Array) -> Array:
        return ((deflections(forces, *parts(numbers)) - wanted) / _SCALE * weight)[known]

    def refined(start: Array) -> Array:
        solution = least_squares(
            lambda numbers: np.concatenate([missing(numbers), _PULL * (numbers - start)]), start, x_scale="jac",
            ftol=1e-4, max_nfev=30,
        )  # fmt: skip
        return np.asarray(solution.x, dtype=np.float64)

    numbers = root if not loads else refined(root)
    hardens = bool(loads) and float(np.sum(missing(numbers) ** 2)) > len(loads)
    if hardens:
        numbers = refined(np.concatenate([numbers, _FIRST_SPRINGS]))
    compliance, springs, square = parts(numbers)
    squares, modes = eigh(np.linalg.inv(compliance), _WHEEL)
    if (fast := squares > _FASTEST).any():
        floor = _FLOOR + modes[:, fast] @ modes[:, fast].T / _FASTEST
        compliance, springs, square = parts(refined(numbers) if loads else numbers)
    names = ", ".join(load.name for load in loads)
    return Elasticity(
        upper_triangle(np.asarray(np.linalg.inv(compliance), dtype=np.float64)),
        tuple(float(f"{value:.6g}") for value in springs.ravel()) if hardens else (),
        tuple(float(f"{value:.6g}") for value in square),
        f"measured: {names}; not loaded in a test: as usual" if names else "not measured: usual values",
    )


def _start(forces: Array, wanted: Array, weight: Array) -> Array:
    """Return the triangle of the nearest compliance by linear least squares, made positive definite."""
    places, rows, right = list(zip(*_LOWER, strict=True)), [], []
    for index in range(5):
        known = np.isfinite(wanted[:, index])
        columns = np.zeros((int(known.sum()), len(places)))
        for column, (i, j) in enumerate(places):
            unit = _UNITS[i, j] * weight[known, 0] / _SCALE[index]
            if i == index:
                columns[:, column] += forces[known, j] * unit
            if j == index and i != j:
                columns[:, column] += forces[known, i] * unit
        rows.append(columns)
        right.append(wanted[known, index] * weight[known, 0] / _SCALE[index])
    rows.append(_PULL * np.eye(len(places)))
    right.append(_PULL * np.eye(5)[_LOWER])
    solution = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0]
    matrix = np.zeros((5, 5))
    matrix[_LOWER] = solution
    values, vectors = np.linalg.eigh(matrix + np.tril(matrix, -1).T)
    held = vectors * np.sqrt(np.maximum(values, 1e-6))
    # The triangle of a product: QR of its other factor.
    triangle = np.linalg.qr(held.T)[1].T
    return np.asarray((triangle * np.sign(np.diag(triangle)))[_LOWER], dtype=np.float64)


def _wanted(load: Load) -> Array:
    """Return the motion without the motion of the compliance in series; nan if not measured; shape (n, 5)."""
    moved = [np.full(len(load.x), np.nan) if (row := load.moved[name]) is None else row for name in COORDINATES]
    return np.stack(moved, axis=1) - np.outer(load.x, load.direction) @ load.beside.T


def deflections(forces: Array, compliance: Array, springs: Array, square: Array) -> Array:
    """Return deflections under loads, by Newton's method.

    Args:
        forces: Loads, shape (n, 5).
        compliance: Inverse of the stiffness, shape (5, 5).
        springs: Directions of the hardening springs, shape (2, 5).
        square: Quadratic parts of these springs, shape (2,).
    """
    moved, stiffness = forces @ compliance, np.linalg.inv(compliance)
    if not springs.any():
        return moved
    for _ in range(40):
        along = moved @ springs.T
        missing = moved @ stiffness + (along**2 * (square + along)) @ springs - forces
        rise = along * (2.0 * square + 3.0 * along)
        slope = stiffness + np.einsum("nk,ki,kj->nij", np.maximum(rise, 0.0), springs, springs)
        step = np.linalg.solve(slope, missing[..., None])[..., 0]
        moved = moved - step
        if np.abs(step / _SCALE).max() < 1e-4:
            break
    return moved
