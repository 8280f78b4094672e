"""The tyre in the engine: the forces on the wheel's body are those of the formula, in all quadrants and poses."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from activesteer.tyre import TyreForces, TyreParameters, load_tir
from tests.reference.tyre_tables import read_coefficients
from tests.tyre_rig import RigForces, TyreRig
from tests.tyre_rig import turned as to_heading

TYRES = Path(__file__).parents[2] / "models" / "tyres"
POINTS = 48
TOLERANCE = 1e-6
"""Of each column's peak. The rig itself leaves some 1e-9, from how steady the relaxation states are."""

COLUMNS = ("fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm")
# What makes a tyre's left side differ from its right one: ply steer, conicity, and shifts of the measurement.
ASYMMETRIES = (
    "PHX1", "PHX2", "PVX1", "PVX2", "PEX4", "RHX1", "PHY1", "PHY2", "PVY1", "PVY2", "PEY3", "RBY3", "RHY1", "RHY2",
    "RVY1", "RVY2", "QSX1", "QBZ4", "QDZ3", "QDZ6", "QDZ7", "QEZ4", "QHZ1", "QHZ2", "SSZ1",
)  # fmt: skip


def _softened(**more: float) -> TyreParameters:
    return load_tir(TYRES / "synthetic_all_terms.tir").with_values(Q_FCX=0.12, Q_FCY=0.3, Q_FZ3=0.5, **more)


@cache
def _tyre(name: str) -> TyreParameters:
    match name:
        case "softened":
            return _softened()
        case "mf62":
            return _softened(FITTYP=62, Q_FCY2=0.4, Q_CAM1=0.5, Q_CAM2=0.3, Q_CAM3=0.2, Q_FYS1=0.1, Q_FYS2=0.2)
        case "mf52" | "pac2002":
            file = {"mf52": "mf52_235_85R16", "pac2002": "pac2002_235_60R16"}[name]
            return TyreParameters(read_coefficients(f"{file}_coefficients.csv"))
        case "tangent":
            return load_tir(TYRES / "synthetic_all_terms.tir", slip_tangent=True)
        case _:
            return load_tir(TYRES / f"{name}.tir")


def _measured(forces: RigForces) -> np.ndarray:
    """Return force and moment in ISO-W axes: x along the heading in the road, z up."""
    return np.hstack([to_heading(vectors, -forces.heading_rad) for vectors in (forces.force_N, forces.moment_Nm)])


def _expected(forces: TyreForces, load_N: np.ndarray) -> np.ndarray:
    columns = [load_N if name == "fz_N" else getattr(forces, name) for name in COLUMNS]
    return np.stack(columns, axis=-1)


def _points(rng: np.random.Generator, count: int = POINTS) -> dict[str, np.ndarray]:
    """Return slips, camber and speed of both signs in all combinations, with random headings, loads and speeds."""
    signs = np.array(np.meshgrid(*4 * [[-1.0, 1.0]])).reshape(4, 16)
    signs = np.tile(signs, (1, count // 16 + 1))[:, :count]
    return {
        "slip_angle_rad": signs[0] * rng.uniform(0.0, 0.35, count),
        "slip_ratio": signs[1] * rng.uniform(0.0, 0.6, count),
        "inclination_rad": signs[2] * rng.uniform(0.0, 0.17, count),
        "load_N": rng.uniform(500.0, 9000.0, count),
        "speed_mps": signs[3] * rng.uniform(3.0, 60.0, count),
        "heading_rad": rng.uniform(-np.pi, np.pi, count),
    }


def _formula(rig: TyreRig, at: dict[str, np.ndarray]) -> TyreForces:
    return rig.formula.evaluate(
        at["load_N"],
        at["slip_ratio"],
        at["slip_angle_rad"],
        at["inclination_rad"],
        rig.pressure_Pa,
        at["speed_mps"],
        road_friction=rig.mu,
    )


@pytest.mark.parametrize("mu", [0.4, 1.0])
@pytest.mark.parametrize("side", ["LEFT", "RIGHT"])
@pytest.mark.parametrize(
    "name",
    [
        "compact_205_55R16",
        "winter_205_55R16",
        "pacejka2012_205_60R15",
        "synthetic_all_terms",
        "tangent",
        "softened",
        "mf62",
        "mf52",
        "pac2002",
    ],
)
def test_forces_on_the_wheel_body_are_those_of_the_formula(name: str, side, mu: float, rng) -> None:
    rig = TyreRig(_tyre(name), side, mu)
    at = _points(rng)
    expected = _expected(_formula(rig, at), at["load_N"])
    error = np.abs(_measured(rig.sweep(**at)) - expected).max(axis=0) / np.abs(expected).max(axis=0)
    assert dict(zip(COLUMNS, error.tolist(), strict=True)) == {
        column: pytest.approx(0.0, abs=TOLERANCE) for column in COLUMNS
    }


@pytest.mark.parametrize("pressure_Pa", [180e3, 280e3])
def test_inflation_pressure_reaches_the_wheel(pressure_Pa: float, rng) -> None:
    rig = TyreRig(_tyre("synthetic_all_terms"), pressure_Pa=pressure_Pa)
    at = _points(rng, 32)
    expected = _expected(_formula(rig, at), at["load_N"])
    assert (np.abs(_measured(rig.sweep(**at)) - expected).max(axis=0) < TOLERANCE * np.abs(expected).max(axis=0)).all()


def test_a_heading_turns_the_force_in_the_world_and_nothing_else() -> None:
    rig = TyreRig(_tyre("compact_205_55R16"))
    straight = rig.steady(0.05, 0.03, 0.04, 4000.0, 20.0)
    left = rig.steady(0.05, 0.03, 0.04, 4000.0, 20.0, heading_rad=np.pi / 2)
    x, y, z = straight.force_N
    assert left.force_N == pytest.approx([-y, x, z], rel=1e-8)
    assert x > 0.0
    assert y < 0.0
    assert z == pytest.approx(4000.0)


@pytest.mark.parametrize("name", ["compact_205_55R16", "synthetic_all_terms", "softened", "mf62", "mf52", "pac2002"])
def test_the_loaded_radius_belongs_to_the_load(name: str, rng) -> None:
    rig = TyreRig(_tyre(name))
    at = _points(rng, 48)
    at["speed_mps"] = np.abs(at["speed_mps"])
    forces = rig.sweep(**at)
    assert forces.loaded_radius_m == pytest.approx(_formula(rig, at).loaded_radius_m, rel=1e-8)
    # The contact point is on the road, in the wheel plane, at the loaded radius from the centre.
    assert np.abs(forces.contact_point_m[:, 2]).max() < 1e-12
    sideways = forces.loaded_radius_m * np.sin(np.abs(at["inclination_rad"]))
    assert np.hypot(*(forces.contact_point_m[:, :2] - (12.0, -7.0)).T) == pytest.approx(sideways, abs=1e-12)


@pytest.mark.parametrize("name", ["compact_205_55R16", "winter_205_55R16"])
def test_slip_always_costs_power(name: str, rng) -> None:
    rig = TyreRig(_tyre(name))
    at = _points(rng)
    # Beyond the shifts that ply steer and conicity bring.
    at["slip_angle_rad"] += np.copysign(0.03, at["slip_angle_rad"])
    at["slip_ratio"] += np.copysign(0.02, at["slip_ratio"])
    at["inclination_rad"] *= 0.2
    force = _measured(rig.sweep(**at))
    sliding_x = -at["slip_ratio"] * np.abs(at["speed_mps"])
    sliding_y = np.tan(at["slip_angle_rad"]) * np.abs(at["speed_mps"])
    assert (force[:, 0] * sliding_x + force[:, 1] * sliding_y < 0.0).all()
    # Each force for itself opposes its sliding.
    assert (force[:, 0] * sliding_x < 0.0).all()


def test_rolling_resistance_opposes_rolling_both_ways() -> None:
    rig = TyreRig(_tyre("compact_205_55R16"))
    forward = _measured(rig.steady(0.0, 0.0, 0.0, 4000.0, 20.0))
    backward = _measured(rig.steady(0.0, 0.0, 0.0, 4000.0, -20.0))
    assert forward[4] < 0.0 < backward[4]


def test_the_right_tyre_is_the_left_one_in_a_mirror(rng) -> None:
    left, right = (TyreRig(_tyre("synthetic_all_terms"), side) for side in ("LEFT", "RIGHT"))
    at = _points(rng, 48)
    at["heading_rad"] = np.zeros(48)
    mirrored = at | {name: -at[name] for name in ("slip_angle_rad", "inclination_rad")}
    expected = _measured(left.sweep(**at)) * (1.0, -1.0, 1.0, -1.0, 1.0, -1.0)
    assert _measured(right.sweep(**mirrored)) == pytest.approx(expected, rel=1e-7, abs=1e-4)


@pytest.mark.parametrize("name", ["compact_205_55R16", "synthetic_all_terms"])
def test_a_symmetric_tyre_rolling_backwards_is_the_same_seen_from_the_other_end(name: str, rng) -> None:
    """A symmetric wheel that rolls backwards, rotated by 180 deg about the vertical, rolls forwards."""
    # RVY3 is the only other term: the published formula does not turn it round with the rolling direction.
    tyre = _tyre(name).with_values(**dict.fromkeys((*ASYMMETRIES, "RVY3"), 0.0))
    rig = TyreRig(tyre)
    at = _points(rng, 48)
    turned = {name: -value for name, value in at.items() if name != "load_N"} | {"load_N": at["load_N"]}
    turned["heading_rad"] = at["heading_rad"]
    expected = _measured(rig.sweep(**at)) * (-1.0, -1.0, 1.0, -1.0, -1.0, 1.0)
    assert _measured(rig.sweep(**turned)) == pytest.approx(expected, rel=1e-7, abs=1e-3)
