from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest

from activesteer.tyre.kernels.contact import WheelForces, tyre_on_road
from activesteer.tyre.kernels.magic_formula import steady_state
from activesteer.tyre.kernels.slip import carcass_stiffnesses
from activesteer.tyre.kernels.vertical import free_radius
from tests.tyre_rig import Motion, RigForces, TyreRig
from tests.unit.tyre.tyres import tyre

STEP_S = 0.001
LOW_SPEED_MPS = 2.0
DAMPING_NSPM = 1500.0
LOAD_N = 4000.0


@functools.cache
def _record() -> Any:
    """Return the record of the compact's tyre, which takes longer to fill than the kernel to call."""
    return tyre().record


def _contact(**changes: Any) -> WheelForces:
    """Return an upright wheel of the compact, rolling along x."""
    inputs: dict[str, Any] = {
        "p": _record(), "mu": 1.0, "pressure_Pa": 230e3, "low_speed_mps": LOW_SPEED_MPS,
        "low_speed_damping_Nspm": DAMPING_NSPM, "timestep_s": STEP_S, "centre_height_m": 0.295,
        "axis_x": 0.0, "axis_y": 1.0, "axis_z": 0.0, "velocity_x_mps": 0.0, "velocity_y_mps": 0.0,
        "velocity_z_mps": 0.0, "spin_x_radps": 0.0, "spin_y_radps": 0.0, "spin_z_radps": 0.0,
        "deflection_x_m": 0.0, "deflection_y_m": 0.0, "deflection_z_rad": 0.0,
    }  # fmt: skip
    assert changes.keys() <= inputs.keys()
    return WheelForces(*tyre_on_road(*(inputs | changes).values()))


def _standing_height_m(rig: TyreRig, load_N: float = LOAD_N) -> float:
    """Return the height at which a wheel at rest carries a load, with no effect of speed or force on stiffness."""
    return float(rig.formula.evaluate(load_N, 0.0, 0.0, vx_mps=0.0).loaded_radius_m)


def _moved(rig: TyreRig, velocity_mps: np.ndarray, **more: Any) -> RigForces:
    """Drag a wheel that does not spin over the road from rest."""
    rig.reset()
    time = np.arange(len(velocity_mps)) * rig.timestep_s
    return rig.transient(time, velocity_mps, 0.0, more.pop("height_m", _standing_height_m(rig)), **more)


def _distance_to_63_percent_m(force_N: np.ndarray, step_m: float) -> float:
    share = force_N / force_N[-1]
    # The force of a row is that at the end of its step.
    return float(np.interp(1.0 - math.exp(-1.0), share, (np.arange(len(share)) + 1) * step_m))


@pytest.mark.parametrize("load_N", [1000.0, 2000.0, 4000.0, 6000.0, 8000.0])
@pytest.mark.parametrize("speed_mps", [5.0, -5.0])
def test_a_small_step_of_slip_angle_takes_one_relaxation_length(load_N: float, speed_mps: float) -> None:
    rig = TyreRig(tyre())
    angle = math.radians(0.1)
    before = rig.steady(0.0, 0.0, 0.0, load_N, speed_mps)
    rig.reset()
    time = np.arange(700) * STEP_S
    velocity = (speed_mps, abs(speed_mps) * math.tan(angle))
    rolling = rig.transient(time, velocity, before.spin_radps, float(before.loaded_radius_m))
    lateral = rolling.force_N[:, 1] - before.force_N[1]
    expected = float(rig.formula.evaluate(load_N, 0.0, 0.0).relaxation_length_y_m)
    assert _distance_to_63_percent_m(lateral, STEP_S * abs(speed_mps)) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("load_N", [1000.0, 2000.0, 4000.0, 6000.0, 8000.0])
def test_a_small_step_of_slip_takes_one_relaxation_length(load_N: float) -> None:
    step_s, speed = 0.0002, 5.0
    rig = TyreRig(tyre(), timestep_s=step_s)
    before, after = (rig.steady(0.0, slip, 0.0, load_N, speed) for slip in (0.0, 0.002))
    rig.reset()
    time = np.arange(2500) * step_s
    rolling = rig.transient(time, (speed, 0.0), after.spin_radps, float(after.loaded_radius_m))
    longitudinal = rolling.force_N[:, 0] - before.force_N[0]
    assert longitudinal[-1] == pytest.approx(after.force_N[0] - before.force_N[0], rel=5e-3)
    expected = float(rig.formula.evaluate(load_N, 0.0, 0.0).relaxation_length_x_m)
    assert _distance_to_63_percent_m(longitudinal, step_s * speed) == pytest.approx(expected, rel=0.03)


def test_a_tyre_run_in_reaches_the_steady_state() -> None:
    rig = TyreRig(tyre())
    steady = rig.steady(0.06, 0.04, 0.0, LOAD_N, 10.0)
    rig.reset()
    velocity = (10.0, 10.0 * math.tan(0.06))
    rolling = rig.transient(np.arange(1500) * STEP_S, velocity, steady.spin_radps, float(steady.loaded_radius_m))
    assert rolling.force_N[-1] == pytest.approx(steady.force_N, rel=1e-6)
    assert rolling.moment_Nm[-1] == pytest.approx(steady.moment_Nm, rel=1e-6)


@pytest.mark.parametrize("load_N", [2000.0, 4000.0, 8000.0])
@pytest.mark.parametrize("direction", [0, 1])
def test_a_tyre_at_rest_is_the_spring_of_its_carcass(load_N: float, direction: int) -> None:
    rig = TyreRig(tyre())
    velocity = np.zeros((400, 2))
    velocity[:200, direction] = 0.005
    forces = _moved(rig, velocity, height_m=_standing_height_m(rig, load_N))
    pushed_m = 0.005 * 200 * STEP_S
    stiffness = carcass_stiffnesses(tyre().record, load_N, rig.pressure_Pa)[direction]
    assert -forces.force_N[-1, direction] / pushed_m == pytest.approx(stiffness, rel=0.05)
    # It stays wound up, and the viscous force acts while it moves.
    assert forces.force_N[-1] == pytest.approx(forces.force_N[300], rel=1e-12)
    viscous = abs(forces.force_N[199, direction]) - abs(forces.force_N[201, direction])
    assert viscous == pytest.approx(DAMPING_NSPM * 0.005, rel=0.1)


@pytest.mark.parametrize("mu", [0.4, 1.0])
@pytest.mark.parametrize("velocity_mps", [(0.3, 0.0), (0.0, 0.3), (-0.2, 0.2), (1.2, -0.4), (0.0, 5.0)])
def test_a_sliding_tyre_at_rest_pulls_with_its_friction(mu: float, velocity_mps: tuple[float, float]) -> None:
    rig = TyreRig(tyre(), mu=mu)
    forces = _moved(rig, np.tile(velocity_mps, (1000, 1)))
    horizontal = np.hypot(*forces.force_N[:, :2].T)
    kappa, alpha = np.meshgrid(np.linspace(-1.5, 1.5, 301), np.linspace(-1.5, 1.5, 301))
    envelope = rig.formula.evaluate(LOAD_N, kappa, alpha, vx_mps=velocity_mps[0], road_friction=mu)
    friction = float(np.hypot(envelope.fx_N, envelope.fy_N).max())
    assert horizontal.max() <= 1.001 * friction
    assert horizontal[-1] >= 0.6 * friction
    assert forces.force_N[-1, :2] @ velocity_mps < -0.9 * horizontal[-1] * math.hypot(*velocity_mps)


@pytest.mark.parametrize("mu", [0.4, 1.0])
@pytest.mark.parametrize("angle_deg", range(-150, 181, 30))
def test_a_tyre_dragged_from_rest_pulls_against_its_sliding(mu: float, angle_deg: float) -> None:
    direction = np.array([math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))])
    force = _moved(TyreRig(tyre(), mu=mu), np.tile(0.2 * direction, (1000, 1))).force_N[-1, :2]
    # The formula's own forces at combined slip are some degrees off the direction of slip.
    assert -(force @ direction) > math.cos(math.radians(8.0)) * np.hypot(*force)
    assert np.hypot(*force) == pytest.approx(mu * LOAD_N, rel=0.1)


def _pushed(share_of_friction: float, direction: tuple[float, float], seconds: float) -> np.ndarray:
    """Return the displacement of a quarter car on a locked wheel along the push [m], every millisecond."""
    rig = TyreRig(tyre())
    height, mass = _standing_height_m(rig), LOAD_N / 9.81
    push = share_of_friction * LOAD_N * np.asarray(direction)
    velocity, place, path = np.zeros(2), np.zeros(2), []
    for _ in range(round(seconds / STEP_S)):
        forces = rig.advance(Motion(height, (velocity[0], velocity[1], 0.0)))
        velocity = velocity + STEP_S * (push + forces.force_N[:2]) / mass
        place = place + STEP_S * velocity
        path.append(place @ direction)
    return np.asarray(path)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, 1.0), (-0.6, 0.8)])
def test_a_force_below_friction_is_held_without_drift(direction: tuple[float, float]) -> None:
    path = _pushed(0.5, direction, 12.0)
    assert 0.0 < path[-1] < 0.05
    assert abs(path[-1] - path[-4000]) < 1e-6


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, 1.0), (-0.6, 0.8)])
def test_a_force_above_friction_slides(direction: tuple[float, float]) -> None:
    path = _pushed(1.3, direction, 3.0)
    assert path[-1] > 1.0


@pytest.mark.parametrize("amplitude_m", [0.002, 0.02, 0.1])
@pytest.mark.parametrize("phase_rad", [0.0, 0.8, math.pi / 2])
@pytest.mark.parametrize("damping_Nspm", [0.0, DAMPING_NSPM])
def test_no_closed_path_at_rest_gives_energy(amplitude_m: float, phase_rad: float, damping_Nspm: float) -> None:
    rig = TyreRig(tyre(), low_speed_damping_Nspm=damping_Nspm)
    period = 1000
    angle = 2 * math.pi * (np.arange(3 * period) + 0.5) / period
    rate = 2 * math.pi / (period * STEP_S) * amplitude_m
    velocity = rate * np.column_stack([np.cos(angle), np.cos(angle + phase_rad)])
    forces = _moved(rig, velocity)
    # The forces belong to the end of a step.
    power = -np.einsum("ij,ij->i", forces.force_N[:, :2], velocity).reshape(3, period)
    energy = STEP_S * power.sum(axis=1)
    assert (energy >= -1e-6 * LOAD_N * amplitude_m).all()
    assert energy[-1] > 0.0


def _largest_jump_N(steps: int, **state: float) -> float:
    """Return the largest change of a force between neighbouring speeds, from reverse to beyond the low speed."""
    speeds = np.linspace(-1.5 * LOW_SPEED_MPS, 1.5 * LOW_SPEED_MPS, steps)
    forces = [
        _contact(velocity_x_mps=float(v), spin_y_radps=float(v) / 0.3 + 0.2, velocity_y_mps=0.05, **state)[:6]
        for v in speeds
    ]
    return float(np.abs(np.diff(np.asarray(forces), axis=0)).max())


def test_forces_are_continuous_in_speed_through_standstill_and_the_low_speed() -> None:
    state = {"deflection_x_m": 0.003, "deflection_y_m": -0.01}
    coarse, fine = _largest_jump_N(1201, **state), _largest_jump_N(12001, **state)
    # A jump would stay as it is; a steep slope shrinks with the step.
    assert fine < 0.15 * coarse
    for speed in (LOW_SPEED_MPS, -LOW_SPEED_MPS, 0.0, tyre()["VXLOW"]):
        below, above = (
            np.asarray(_contact(velocity_x_mps=speed + d, spin_y_radps=speed / 0.3, **state)) for d in (-1e-9, 1e-9)
        )
        assert below == pytest.approx(above, abs=1e-3)


def _ramp(timestep_s: float) -> RigForces:
    """Return a stop and reversal, 5 m/s to -5 m/s in 2 s, at a small slip angle with a free-rolling wheel."""
    rig = TyreRig(tyre(), timestep_s=timestep_s)
    time = np.arange(round(2.0 / timestep_s)) * timestep_s
    speed = 5.0 - 5.0 * time
    velocity = np.column_stack([speed, 0.03 * np.abs(speed)])
    radius = float(rig.formula.evaluate(LOAD_N, 0.0, 0.0).effective_radius_m)
    return rig.transient(time, velocity, speed / radius, _standing_height_m(rig))


def test_a_stop_and_a_reversal_are_smooth() -> None:
    coarse, fine = _ramp(0.001), _ramp(0.0005)
    for forces in (coarse, fine):
        assert np.isfinite(forces.force_N).all()
        assert np.hypot(*forces.force_N[:, :2].T).max() < LOAD_N
    jump_coarse, jump_fine = (np.abs(np.diff(f.force_N[50:, 1])).max() for f in (coarse, fine))
    assert jump_coarse < 30.0
    assert jump_fine < 0.7 * jump_coarse
    assert fine.force_N[1::2][:900] == pytest.approx(coarse.force_N[:900], abs=30.0)


def test_a_tyre_without_load_has_neither_forces_nor_stiffness_nor_friction() -> None:
    for load_N in (0.0, -10.0):
        assert set(steady_state(_record(), load_N, 0.1, 0.05, 0.02, 230e3, 20.0, 1.0, 0.0)) == {0.0}


def test_a_lifted_tyre_has_no_forces_and_forgets_its_deflection() -> None:
    forces = _contact(centre_height_m=0.4, velocity_x_mps=20.0, deflection_x_m=0.01, deflection_y_m=-0.02)
    assert forces[:6] == (0.0,) * 6
    assert forces.deflection_x_rate_mps < 0.0 < forces.deflection_y_rate_mps
    assert forces.limited == 0.0


@pytest.mark.parametrize("vertical_mps", [-2.0, -0.3, 0.0, 0.3])
def test_touching_down_and_lifting_off_is_continuous_at_any_vertical_speed(vertical_mps: float) -> None:
    free_m = free_radius(tyre().record, 0.0)
    above, below = (
        _contact(centre_height_m=free_m + d, velocity_z_mps=vertical_mps, velocity_y_mps=0.5, deflection_y_m=0.01)
        for d in (1e-7, -1e-7)
    )
    assert above.fz_N == 0.0
    assert (below.fz_N > 0.0) == (vertical_mps <= 0.0)
    assert 0.0 <= below.fz_N < 0.1
    assert np.abs(below[:6]).max() < 0.2


def test_a_hop_unloads_and_lands_without_a_jump() -> None:
    time = np.arange(600) * STEP_S
    height = 0.295 + 0.03 * (1.0 - np.cos(2 * math.pi * time / 0.3))
    rig = TyreRig(tyre())
    speed = 20.0
    forces = rig.transient(time, (speed, speed * math.tan(0.03)), speed / 0.3, height)
    lifted = forces.force_N[:, 2] == 0.0
    assert 100 < lifted.sum() < 500
    assert (forces.force_N[lifted] == 0.0).all()
    assert (forces.force_N[:, 2] >= 0.0).all()
    # At most what stiffness and vertical speed make of one step, with the damper's share.
    steepest = 1.5 * tyre()["VERTICAL_STIFFNESS"] * np.abs(np.gradient(height, time)).max() * STEP_S
    assert np.abs(np.diff(forces.force_N[1:, 2])).max() < steepest


def test_the_damper_acts_in_full_under_load() -> None:
    still, closing = _contact(), _contact(velocity_z_mps=-0.5)
    assert closing.fz_N - still.fz_N == pytest.approx(0.5 * tyre()["VERTICAL_DAMPING"])


@pytest.mark.parametrize("heading", [0.4, -1.2, 2.5])
def test_the_heading_of_a_cambered_wheel_turns_its_contact_point_and_changes_no_force(heading: float) -> None:
    def rolling(heading: float) -> WheelForces:
        camber, spin_radps, course = 0.08, 70.0, heading + 0.05
        axis = -math.sin(heading) * math.cos(camber), math.cos(heading) * math.cos(camber), math.sin(camber)
        velocity = {"velocity_x_mps": 20.0 * math.cos(course), "velocity_y_mps": 20.0 * math.sin(course)}
        turning = {f"axis_{name}": part for name, part in zip("xyz", axis, strict=True)}
        turning |= {f"spin_{name}_radps": spin_radps * part for name, part in zip("xyz", axis, strict=True)}
        return _contact(deflection_x_m=0.002, deflection_y_m=0.004, **velocity, **turning)

    ahead, turned = rolling(0.0), rolling(heading)
    cos, sin = math.cos(heading), math.sin(heading)
    assert (turned.arm_x_m, turned.arm_y_m) == pytest.approx(
        (cos * ahead.arm_x_m - sin * ahead.arm_y_m, sin * ahead.arm_x_m + cos * ahead.arm_y_m), abs=1e-12
    )
    assert (turned.heading_x, turned.heading_y) == pytest.approx((cos, sin), abs=1e-12)
    for name in ("fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm"):
        assert getattr(turned, name) == pytest.approx(getattr(ahead, name), rel=1e-9)


def test_speed_lifts_the_tyre_as_its_radius_grows() -> None:
    slow, fast = (_contact(velocity_x_mps=v, spin_y_radps=v / 0.3) for v in (5.0, 60.0))
    growth = tyre()["UNLOADED_RADIUS"] * tyre()["Q_V1"] * (200.0 * tyre()["UNLOADED_RADIUS"] / tyre()["LONGVL"]) ** 2
    assert fast.fz_N - slow.fz_N > 0.9 * growth * tyre()["VERTICAL_STIFFNESS"]


@pytest.mark.parametrize("slip_ratio", [0.5, -0.5])
def test_slip_beyond_the_range_of_the_file_is_held_at_the_limit_and_flagged(slip_ratio: float) -> None:
    rig = TyreRig(tyre().with_values(KPUMIN=-0.2, KPUMAX=0.3))
    outside = rig.steady(0.0, slip_ratio, 0.0, LOAD_N, 20.0)
    inside = rig.steady(0.0, 0.1, 0.0, LOAD_N, 20.0)
    assert (float(inside.limited), float(outside.limited)) == (0.0, 1.0)
    at_limit = rig.formula.evaluate(LOAD_N, max(min(slip_ratio, 0.3), -0.2), 0.0, vx_mps=20.0)
    assert outside.force_N[0] == pytest.approx(float(at_limit.fx_N), rel=1e-6)


@pytest.mark.parametrize(
    "changes",
    [{"slip_angle_rad": 0.4}, {"slip_angle_rad": -0.4}, {"inclination_rad": 0.2}, {"load_N": 10_500.0}],
)
def test_every_range_is_flagged(changes: dict[str, float]) -> None:
    rig = TyreRig(tyre().with_values(ALPMIN=-0.3, ALPMAX=0.3))
    at = {"slip_angle_rad": 0.1, "slip_ratio": 0.0, "inclination_rad": 0.0, "load_N": LOAD_N, "speed_mps": 20.0}
    assert float(rig.steady(**at).limited) == 0.0
    assert float(rig.steady(**(at | changes)).limited) == 1.0


def test_pressure_outside_its_range_is_flagged() -> None:
    assert _contact(velocity_x_mps=20.0, spin_y_radps=66.0).limited == 0.0
    assert _contact(velocity_x_mps=20.0, spin_y_radps=66.0, pressure_Pa=900e3).limited == 1.0


@pytest.mark.parametrize("softening", [{}, {"Q_FCX": 0.15, "Q_FCY": 0.4, "VERTICAL_DAMPING": 5000.0}])
@pytest.mark.parametrize("name", ["compact_205_55R16", "synthetic_all_terms"])
def test_nothing_a_wheel_can_do_gives_a_force_that_is_not_finite(name: str, softening: dict, rng) -> None:
    p = tyre(name).with_values(**softening).record
    for _ in range(2000):
        tilt, heading = rng.uniform(-0.5, 0.5), rng.uniform(-3.0, 3.0)
        axis = (-math.sin(heading) * math.cos(tilt), math.cos(heading) * math.cos(tilt), math.sin(tilt))
        scale = 10.0 ** rng.uniform(-12, 2, 6)
        motion = rng.standard_normal(6) * scale * (1, 1, 0.1, 3, 3, 3)
        forces = _contact(
            p=p, centre_height_m=rng.uniform(0.2, 0.33), axis_x=axis[0], axis_y=axis[1], axis_z=axis[2],
            velocity_x_mps=motion[0], velocity_y_mps=motion[1], velocity_z_mps=motion[2], spin_x_radps=motion[3],
            spin_y_radps=motion[4], spin_z_radps=motion[5], deflection_x_m=rng.uniform(-0.3, 0.3),
            deflection_y_m=rng.uniform(-0.3, 0.3), mu=rng.choice([0.05, 0.4, 1.0]),
        )  # fmt: skip
        assert np.isfinite(forces).all()
        assert forces.fz_N >= 0.0


def test_steering_at_rest_twists_the_patch_and_the_moment_resists() -> None:
    left, right = _contact(deflection_z_rad=0.03), _contact(deflection_z_rad=-0.03)
    assert left.mz_Nm < -20.0
    assert right.mz_Nm > 20.0
    assert _contact(spin_z_radps=0.2).deflection_z_rate_radps == pytest.approx(0.2, rel=0.01)


def test_the_twist_stops_growing_where_the_patch_slides_about_its_middle() -> None:
    twist_rad = 0.0
    for _ in range(20_000):
        twist_rad += STEP_S * _contact(spin_z_radps=0.3, deflection_z_rad=twist_rad).deflection_z_rate_radps
    assert twist_rad == pytest.approx(0.12, rel=1e-3)


def test_rolling_untwists_the_patch_within_its_own_length_and_above_low_speed_it_has_no_moment() -> None:
    rolled = _contact(velocity_x_mps=1.0, spin_y_radps=1.0 / 0.31, deflection_z_rad=0.05)
    assert rolled.deflection_z_rate_radps < -0.3
    free, twisted = (
        _contact(velocity_x_mps=1.1 * LOW_SPEED_MPS, spin_y_radps=1.1 * LOW_SPEED_MPS / 0.31, deflection_z_rad=twist)
        for twist in (0.0, 0.05)
    )
    assert twisted.mz_Nm == free.mz_Nm
