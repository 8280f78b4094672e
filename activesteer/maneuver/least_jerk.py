"""The smoothest path through gates: least change of curvature within bounds.

The path is a quintic B-spline y(x) between two straight sections. Its coefficients minimise the integral of y'''^2:
the lateral jerk at constant speed is proportional to y'''. The axles of the car, ahead of and behind its
centre, stay within bounds. This strictly convex quadratic programme is written as a least distance programme.
Non-negative least squares solve it exactly in a finite number of steps.

Source: C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, 1974, chapter 23 (problems LSI and LDP). Minimum
jerk for smooth motion: T. Flash, N. Hogan, The coordination of arm movements, Journal of Neuroscience 5 (1985).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ManeuverError

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_DEGREE: Final = 5
"""Without active bounds the path of least jerk is a quintic polynomial."""
_KNOT_SPACING_M: Final = 2.0
"""Distance of the knots [m]; halving it changes the paths of ISO 3888 by less than 1 cm."""
_INCOMPATIBLE: Final = 1e-9
"""Residual of the dual below which bounds contradict each other; usual values are above 1e-4."""


class Bound(NamedTuple):
    """Bounds on y of a point that moves with the car.

    Attributes:
        x_m: Position of the car's centre [m].
        ahead_m: Distance of the point ahead of the centre, along the path [m].
        low_m: Least y of the point [m].
        high_m: Largest y of the point [m].
    """

    x_m: float
    ahead_m: float
    low_m: float
    high_m: float


def least_jerk(start_x_m: float, end_x_m: float, end_y_m: float, bounds: Sequence[Bound]) -> BSpline:
    """Return the path y(x) of least jerk from y = 0 to another straight line along x.

    Args:
        start_x_m: Point at which the path leaves y = 0, without heading and curvature [m].
        end_x_m: Point at which it is straight again [m].
        end_y_m: y at this point [m].
        bounds: The bounds; those outside start and end are ignored.

    Returns:
        Spline y(x) [m] between start and end, with its derivatives.

    Validity: small headings; a point ahead is at y + ahead y', its x at x + ahead.
    """
    spline = _Spline(start_x_m, end_x_m)
    inside = np.array([bound for bound in bounds if start_x_m <= bound.x_m <= end_x_m]).reshape(-1, 4)
    x, ahead, low, high = inside.T
    at = spline.basis(x) + ahead[:, None] * spline.basis(x, 1)
    # The last three coefficients are y at the end without slope and curvature, the first three are 0.
    fixed = np.zeros(at.shape[1])
    fixed[-3:] = end_y_m
    rest = at @ fixed
    free = at[:, 3:-3]
    return spline.of(_bounded(spline.jerk[:, 3:-3], -spline.jerk @ fixed, free, low - rest, high - rest), fixed)


class _Spline:
    """Basis functions on clamped, equally spaced knots.

    Attributes:
        basis: Function from x to the values of all basis functions, shape (k, n); a second argument selects a
            derivative.
        jerk: Square root of the weight times third derivative at the points of a quadrature, shape (q, n).
    """

    def __init__(self, start: float, end: float) -> None:
        from scipy.interpolate import BSpline  # noqa: PLC0415 - slow to import, and few manoeuvres need it

        count = max(_DEGREE + 2, round((end - start) / _KNOT_SPACING_M))
        knots = np.linspace(start, end, count + 1)
        self._knots = np.concatenate([[start] * _DEGREE, knots, [end] * _DEGREE])
        self._on_knots = partial(BSpline, self._knots, k=_DEGREE)
        self.basis = self._on_knots(np.eye(count + _DEGREE))
        # y''' is a parabola between knots: three points of Gauss integrate its square exactly.
        points, weights = np.polynomial.legendre.leggauss(3)
        half = 0.5 * np.diff(knots)[:, None]
        middle = 0.5 * (knots[:-1] + knots[1:])[:, None]
        self.jerk = np.sqrt(half * weights).reshape(-1, 1) * self.basis((middle + half * points).ravel(), 3)

    def of(self, free: Array, fixed: Array) -> BSpline:
        coefficients = fixed.copy()
        coefficients[3:-3] = free
        return self._on_knots(coefficients)


def _bounded(a: Array, b: Array, g: Array, low: Array, high: Array) -> Array:
    """Return the z that minimises |A z - b| for low <= G z <= high; A has full column rank (LSI, LDP)."""
    from scipy.linalg import solve_triangular  # noqa: PLC0415 - slow to import
    from scipy.optimize import nnls  # noqa: PLC0415 - slow to import

    q, r = np.linalg.qr(a)
    target = q.T @ b
    if not len(g):  # nnls does not take an empty matrix
        return solve_triangular(r, target)
    g = solve_triangular(r.T, g.T, lower=True).T
    shift = g @ target
    # In w = R z - Q^T b the problem is: least |w| within S w >= h.
    s = np.concatenate([g, -g])
    h = np.concatenate([low - shift, shift - high])
    e = np.concatenate([s.T, h[None, :]])
    f = np.zeros(len(e))
    f[-1] = 1.0
    dual, _ = nnls(e, f)
    residual = e @ dual - f
    if -residual[-1] < _INCOMPATIBLE:
        raise ManeuverError("no path keeps all bounds: the gates are too narrow or too close to each other")
    w = -residual[:-1] / residual[-1]
    return solve_triangular(r, w + target)
