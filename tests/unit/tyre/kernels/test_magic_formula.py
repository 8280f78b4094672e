from __future__ import annotations

import numpy as np
import pytest

from activesteer.errors import ParameterError
from activesteer.tyre import Limit, MagicFormula
from activesteer.tyre.kernels.magic_formula import magic_formula, slip_stiffnesses
from tests.raising import raises
from tests.unit.tyre.tyres import tyre

ALL = ("fx_N", "fy_N", "mx_Nm", "my_Nm", "mz_Nm")


@pytest.fixture
def compact() -> MagicFormula:
    return MagicFormula(tyre())


def test_a_positive_slip_angle_pushes_to_the_right_and_turns_back(compact: MagicFormula) -> None:
    forces = compact.evaluate(4000.0, 0.0, 0.05)
    assert forces.fy_N < -3000.0
    assert forces.mz_Nm > 20.0


def test_a_positive_slip_drives_and_a_locked_wheel_brakes(compact: MagicFormula) -> None:
    assert compact.evaluate(4000.0, 0.05, 0.0).fx_N > 3000.0
    assert compact.evaluate(4000.0, -1.0, 0.0).fx_N < -2800.0


def test_leaning_right_pushes_to_the_right(compact: MagicFormula) -> None:
    upright, leaning = compact.evaluate(4000.0, 0.0, 0.0, [0.0, np.radians(2)]).fy_N
    assert -200.0 < leaning - upright < -60.0


def test_rolling_resistance_turns_with_the_direction_and_fades_at_rest(compact: MagicFormula) -> None:
    forward, rest, backward = compact.evaluate(4000.0, 0.0, 0.0, vx_mps=[10.0, 0.0, -10.0]).my_Nm
    assert forward < 0.0
    assert rest == 0.0
    assert backward == pytest.approx(-forward)


@pytest.mark.parametrize("load", [0.0, -100.0])
def test_no_load_means_no_forces(compact: MagicFormula, load: float) -> None:
    forces = compact.evaluate(load, 0.1, 0.1, 0.01)
    assert all(getattr(forces, name) == 0.0 for name in ALL)


@pytest.mark.parametrize("name", ["compact_205_55R16", "synthetic_all_terms"])
def test_the_other_side_is_the_mirror_image(name: str, rng: np.random.Generator) -> None:
    left = MagicFormula(tyre(name))
    right = MagicFormula(tyre(name).mounted_on("RIGHT"))
    fz, kappa = rng.uniform(500, 8000, 200), rng.uniform(-0.3, 0.3, 200)
    alpha, gamma, turn = rng.uniform(-0.3, 0.3, 200), rng.uniform(-0.1, 0.1, 200), rng.uniform(-0.5, 0.5, 200)
    ours = left.evaluate(fz, kappa, alpha, gamma, turn_slip_1pm=turn)
    mirror = right.evaluate(fz, kappa, -alpha, -gamma, turn_slip_1pm=-turn)
    for quantity, sign in zip(ALL, (1, -1, -1, 1, -1), strict=True):
        np.testing.assert_allclose(getattr(mirror, quantity), sign * getattr(ours, quantity), rtol=0, atol=1e-9)
    assert np.abs(left.evaluate(fz, kappa, alpha).fy_N - right.evaluate(fz, kappa, alpha).fy_N).max() > 10.0


@pytest.mark.parametrize("mu", [1.0, 0.4, 0.1])
def test_the_resultant_stays_within_the_friction_on_every_road(compact: MagicFormula, mu: float) -> None:
    """Within 7 % of the longitudinal peak, the error of two separately fitted weights."""
    kappa, alpha = np.meshgrid(np.linspace(-1, 1, 401), np.linspace(-1, 1, 401))
    forces = compact.evaluate(4000.0, mu * kappa, mu * alpha, road_friction=mu)
    assert np.hypot(forces.fx_N, forces.fy_N).max() < 1.07 * 1.03 * mu * 4000.0


def test_a_slippery_road_gives_a_similar_curve(rng: np.random.Generator) -> None:
    """Without shifts, F(slip, mu) = mu F(slip / mu, 1): the similarity method (Pacejka 2012, section 4.2)."""
    shifts = ["PHX1", "PHX2", "PVX1", "PVX2", "PHY1", "PHY2", "PVY1", "PVY2", "RVY1", "RVY2", "RVY3"]
    formula = MagicFormula(tyre().with_values(**dict.fromkeys(shifts, 0.0)))
    kappa, alpha = rng.uniform(-0.3, 0.3, 300), rng.uniform(-0.3, 0.3, 300)
    dry, slippery = (
        formula.evaluate(4000.0, kappa, alpha),
        formula.evaluate(4000.0, 0.4 * kappa, 0.4 * alpha, road_friction=0.4),
    )
    np.testing.assert_allclose(slippery.fx_N, 0.4 * dry.fx_N, rtol=1e-6, atol=1e-3)
    np.testing.assert_allclose(slippery.fy_N, 0.4 * dry.fy_N, rtol=1e-6, atol=1e-3)


def test_combined_slip_gives_an_ellipse_and_no_square(compact: MagicFormula) -> None:
    slip = np.linspace(0.0, 0.4, 200)
    kappa, alpha = np.meshgrid(slip, slip)
    forces = compact.evaluate(4000.0, kappa, alpha)
    diagonal = np.abs(forces.fx_N / forces.fx_N.max() + forces.fy_N / forces.fy_N.min()).max()
    assert diagonal < 1.6


def test_slip_stiffness_is_the_slope_at_the_origin_of_the_curve() -> None:
    symmetric = tyre().with_values(
        **dict.fromkeys(["PHX1", "PHX2", "PVX1", "PVX2", "PHY1", "PHY2", "PVY1", "PVY2"], 0.0)
    )
    p, step = symmetric.record, 1e-5
    k_x, k_y = slip_stiffnesses(p, 4000.0, 0.0, 230e3)

    def slope(kappa: float, alpha: float, place: int) -> float:
        plus = magic_formula(p, 4000.0, kappa, alpha, 0.0, 230e3, 15.0, 1.0)[place]
        return (plus - magic_formula(p, 4000.0, -kappa, -alpha, 0.0, 230e3, 15.0, 1.0)[place]) / (2 * step)

    assert slope(step, 0.0, 0) == pytest.approx(k_x, rel=1e-4)
    assert slope(0.0, step, 1) == pytest.approx(k_y, rel=1e-3)


def test_forces_are_continuous_in_every_input(rng: np.random.Generator) -> None:
    """The forces may not jump between neighbouring points, including limits, low load and standstill."""
    formula = MagicFormula(tyre("synthetic_all_terms"))
    start = np.array([4000.0, 0.05, 0.05, 0.02, 230e3, 10.0])
    reach = {0: (-50, 12000), 1: (-2, 2), 2: (-1.55, 1.55), 3: (-0.3, 0.3), 4: (5e3, 1.2e6), 5: (-3, 3)}
    for column, (low, high) in reach.items():
        rows = np.tile(start, (20001, 1))
        rows[:, column] = np.linspace(low, high, len(rows))
        forces = formula.evaluate(*rows.T)
        for name in ALL:
            values = getattr(forces, name)
            assert np.abs(np.diff(values)).max() < 0.01 * np.abs(values).max(), (column, name)


def test_slip_forces_stay_at_standstill(compact: MagicFormula) -> None:
    """At rest slip is the deflection of the carcass, and the force that holds a parked car on a slope may not fade."""
    moving, resting = compact.evaluate(4000.0, 0.02, 0.02, vx_mps=[10.0, 0.0]).fx_N
    assert resting == pytest.approx(moving, rel=0.02)
    assert compact.evaluate(4000.0, 0.0, 0.02, vx_mps=0.0).mz_Nm == pytest.approx(0.0, abs=3.0)


def test_an_input_out_of_range_is_evaluated_at_the_limit_and_says_so(compact: MagicFormula) -> None:
    parameters = compact.parameters
    outside = compact.evaluate(4000.0, 0.0, 2.0)
    assert outside.fy_N == compact.evaluate(4000.0, 0.0, parameters["ALPMAX"]).fy_N
    assert outside.saturated(Limit.SLIP_ANGLE)
    assert compact.evaluate(4000.0, 0.0, [parameters["ALPMIN"], parameters["ALPMAX"]]).limits.tolist() == [0, 0]
    flags = compact.evaluate([50, 2e4, 4e3, 4e3, 4e3, 4e3], [0, 0, 9, 0, 0, 0], 0, [0, 0, 0, 1, 0, 0],
                             [2.3e5, 2.3e5, 2.3e5, 2.3e5, 9e5, 2.3e5]).limits  # fmt: skip
    assert flags.tolist() == [1, 2, 4, 16, 32, 0]


def test_turn_slip_opposes_turning_and_parking_is_heaviest(compact: MagicFormula) -> None:
    moments = compact.evaluate(4000.0, 0.0, 0.0, vx_mps=0.0, turn_slip_1pm=[-1e6, -1.0, 1.0, 1e6]).mz_Nm
    assert moments[0] > moments[1] > 0.0 > moments[2] > moments[3]
    assert moments[0] == pytest.approx(165.0, rel=0.05)


def test_turn_slip_to_the_left_pushes_outwards(compact: MagicFormula) -> None:
    straight, left = compact.evaluate(4000.0, 0.0, 0.0, turn_slip_1pm=[0.0, 0.05]).fy_N
    assert left < straight


def test_a_vanishing_turn_slip_changes_nothing() -> None:
    formula = MagicFormula(tyre())
    none, tiny = formula.evaluate(4000.0, 0.02, 0.03, turn_slip_1pm=[0.0, 1e-9]).fy_N
    assert tiny == pytest.approx(none, rel=1e-6)


def test_no_slip_of_an_mf52_tyre_takes_turn_slip() -> None:
    old = tyre("pacejka2012_205_60R15").with_values(FITTYP=6)
    with raises(ParameterError, key="turn_slip_1pm"):
        MagicFormula(old).evaluate(4000.0, 0.0, 0.0, turn_slip_1pm=0.1)


def test_arrays_broadcast_and_agree_with_the_scalar_kernel(compact: MagicFormula) -> None:
    loads, angles = np.array([[2000.0], [5000.0]]), np.linspace(-0.2, 0.2, 7)
    forces = compact.evaluate(loads, 0.03, angles)
    assert forces.mz_Nm.shape == (2, 7)
    parameters = compact.parameters
    scalar = magic_formula(
        parameters.record, 5000.0, 0.03, float(angles[2]), 0.0, parameters["INFLPRES"], parameters["LONGVL"], 1.0
    )
    assert tuple(float(getattr(forces, name)[1, 2]) for name in ALL) == scalar


def test_inputs_that_do_not_fit_together_are_refused(compact: MagicFormula) -> None:
    with raises(ParameterError, cause=ValueError):
        compact.evaluate([1.0, 2.0, 3.0], [0.0, 0.0], 0.0)
    with raises(ParameterError, key="alpha_rad"):
        compact.evaluate(4000.0, 0.0, np.nan)


def test_road_friction_scales_the_peak_and_keeps_the_slope(compact: MagicFormula) -> None:
    alpha = np.radians(np.linspace(0, 20, 400))
    dry, ice = compact.evaluate(4000.0, 0.0, alpha).fy_N, compact.evaluate(4000.0, 0.0, alpha, road_friction=0.4).fy_N
    assert ice.min() == pytest.approx(0.4 * dry.min(), rel=0.01)
    stiffness = [
        float(compact.evaluate(4000.0, 0.0, 0.0, road_friction=mu).cornering_stiffness_Nprad) for mu in (1.0, 0.4)
    ]
    assert stiffness[0] == stiffness[1]


@pytest.mark.parametrize("old", [False, True])
def test_the_factors_of_the_moments_scale_what_they_are_named_after(old: bool) -> None:
    """Pacejka 2012, eq. 4.E69 and 4.E70: LVMX scales the offset QSX1, LMX and LMY whole moments."""
    start = tyre("synthetic_all_terms").with_values(QSX1=0.02, LVMX=1.0, LMX=1.0, LMY=1.0)
    start = start.with_values(FITTYP=6) if old else start

    def moments(**changed: float) -> tuple[float, float]:
        forces = MagicFormula(start.with_values(**changed)).evaluate(4000.0, 0.01, 0.03, 0.02)
        return float(forces.mx_Nm), float(forces.my_Nm)

    (mx_Nm, my_Nm), without, twice = moments(), moments(QSX1=0.0)[0], moments(LVMX=2.0)[0]
    assert mx_Nm - without == pytest.approx(0.02 * start["UNLOADED_RADIUS"] * 4000.0)
    assert twice - without == pytest.approx(2.0 * (mx_Nm - without))
    assert moments(LMX=1.5)[0] == pytest.approx(1.5 * mx_Nm)
    assert moments(LMY=1.5)[1] == pytest.approx(1.5 * my_Nm)


@pytest.mark.parametrize(("mu", "low_deg", "high_deg"), [(0.9, 7.0, 11.0), (0.3, 2.0, 4.0)])
@pytest.mark.parametrize("name", ["compact_205_55R16", "sedan_pac02"])
def test_the_largest_side_force_is_at_the_slip_angle_that_explore_names(
    name: str, mu: float, low_deg: float, high_deg: float
) -> None:
    formula, angles_deg = MagicFormula(tyre(name)), np.linspace(0.5, 25.0, 246)
    for load_N in (2500.0, 4000.0, 6000.0):
        force = np.abs(formula.evaluate(load_N, 0.0, np.radians(angles_deg), road_friction=mu).fy_N)
        assert low_deg < angles_deg[force.argmax()] < high_deg
        assert force[-1] < 0.99 * force.max()


def test_a_road_without_friction_gives_finite_forces(compact: MagicFormula) -> None:
    forces = compact.evaluate(4000.0, [0.0, 0.5], [0.0, 0.5], road_friction=0.0)
    assert np.abs(forces.fx_N).max() < 1e-3
    assert np.isfinite(forces.mz_Nm).all()
