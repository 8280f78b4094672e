"""Springs on arms without a body: the tendon has the length of the spring in every position of the arm."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from activesteer.errors import ParameterError
from activesteer.vehicle_builder.axle_kinds import Mount, kind_of, mount
from tests.raising import raises

FRONT, REAR, OUTER = np.array([0.2, 0.4, 0.15]), np.array([-0.2, 0.45, 0.16]), np.array([0.0, 0.74, 0.1])
UPPER = np.array([-0.04, 0.5, 0.65])


def points(foot: np.ndarray) -> dict[str, np.ndarray]:
    return {
        "lca_front_inner": FRONT, "lca_rear_inner": REAR, "lca_outer": OUTER,
        "spring_inner": UPPER, "spring_outer": foot,
    }  # fmt: skip


def lengths(made: Mount, foot: np.ndarray, angle_rad: float) -> tuple[float, float]:
    """Lengths of spring and tendon after a rotation of the arm."""
    turn = Rotation.from_rotvec(angle_rad * (REAR - FRONT) / np.linalg.norm(REAR - FRONT))
    moved, outer = FRONT + turn.apply(foot - FRONT), FRONT + turn.apply(OUTER - FRONT)
    assert made.start_m is not None
    return float(np.linalg.norm(UPPER - moved)), float(np.linalg.norm(made.start_m - outer) * made.lever)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_in_the_plane_of_the_arm_the_tendon_has_the_springs_length_always(share: float) -> None:
    base = 0.3 * FRONT + 0.7 * REAR
    foot = base + share * (OUTER - base)
    made = mount("front", "spring", "lca", kind_of("front", "double_wishbone"), points(foot))
    assert made.lever == pytest.approx(share)
    for angle in (-0.25, 0.0, 0.25):
        real, tendon = lengths(made, foot, angle)
        assert tendon == pytest.approx(real, abs=1e-12)


def test_beside_the_plane_length_and_motion_ratio_hold_at_the_design_position() -> None:
    base = 0.5 * (FRONT + REAR)
    foot = base + 0.6 * (OUTER - base) + np.array([0.0, 0.0, -0.03])
    made = mount("front", "spring", "lca", kind_of("front", "double_wishbone"), points(foot))
    real, tendon = lengths(made, foot, 0.0)
    assert tendon == pytest.approx(real, abs=1e-12)
    step = 1e-6
    slopes = [(lengths(made, foot, step)[i] - lengths(made, foot, -step)[i]) / (2 * step) for i in (0, 1)]
    assert slopes[1] == pytest.approx(slopes[0], rel=1e-6)
    real, tendon = lengths(made, foot, 0.15)
    assert tendon == pytest.approx(real, abs=1e-3)


def test_a_spring_beyond_the_arm_is_refused() -> None:
    with raises(ParameterError, key="rear.points.spring_outer"):
        mount("rear", "spring", "trailing_link", kind_of("rear", "multilink"), {
            "trailing_link_inner": np.array([0.0, 0.5, 0.2]), "trailing_link_outer": np.array([-0.5, 0.5, 0.2]),
            "spring_inner": np.array([-1.0, 0.5, 0.5]), "spring_outer": np.array([-1.0, 0.5, 0.2]),
        })  # fmt: skip
