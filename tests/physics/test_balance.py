"""Newton's laws between recorded channels: forces and accelerations, loads and moments, losses and deceleration."""

from __future__ import annotations

import functools

import mujoco
import numpy as np
import pytest

import activesteer
from activesteer.core.conventions import CORNERS, GRAVITY_MPS2
from activesteer.recording import Recording
from activesteer.scenario import load_car
from activesteer.tyre.kernels.magic_formula import magic_formula
from activesteer.vehicle.force_block import USERDATA_PER_WHEEL
from tests.physics.runs import COAST_OR_BRAKE, car, corners, in_the_corner, last, mass_kg, run, step_steer

PARAMETERS = load_car().config
DRAG_NS2PM2 = 0.5 * PARAMETERS.aerodynamics.air_density_kgpm3 * PARAMETERS.aerodynamics.drag_area_m2


@functools.cache
def rolling(mu: float = 1.0, pedal: float = 0.0) -> Recording:
    """Return a run that coasts from 80 km/h, or brakes without anti-lock system."""
    table = COAST_OR_BRAKE | {"road": {"mu": mu}, "brake": {"time_s": [0.1, 0.3], "pedal": [0.0, pedal]}}
    return activesteer.simulate(table, overrides={"vehicle.brakes.abs": False})


def forces_in_car_axes(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Return the sums of the tyre forces along and across the car, in the road plane [N], shape (n,) each."""
    steer, fx, fy = (corners(recording, name) for name in ("steer_rad", "tyre_fx_N", "tyre_fy_N"))
    cos, sin = np.cos(steer), np.sin(steer)
    return (cos * fx - sin * fy).sum(axis=1), (sin * fx + cos * fy).sum(axis=1)


@pytest.mark.parametrize("controller", ["none", "ars", "afs"])
def test_lateral_forces_make_the_lateral_acceleration(controller: str) -> None:
    recording = step_steer(controller)
    end = last(recording, 0.5)
    _, across = forces_in_car_axes(recording)
    drag = DRAG_NS2PM2 * recording["speed_mps"] * recording["vy_mps"]
    inertia = mass_kg(car()) * recording["ay_mps2"]
    assert (across - drag)[end].mean() == pytest.approx(inertia[end].mean(), rel=2e-3)


def test_vertical_forces_carry_the_weight_in_a_corner() -> None:
    recording = step_steer()
    loads = corners(recording, "tyre_fz_N").sum(axis=1)
    end = last(recording, 0.5)
    assert loads[end].mean() == pytest.approx(mass_kg(car()) * GRAVITY_MPS2, rel=1e-3)


def test_longitudinal_forces_make_the_longitudinal_acceleration() -> None:
    recording = rolling(pedal=0.2)
    end = last(recording, 0.5)
    along, _ = forces_in_car_axes(recording)
    drag = DRAG_NS2PM2 * recording["speed_mps"] * recording["vx_mps"]
    inertia = mass_kg(car()) * recording["ax_mps2"]
    assert inertia[end].mean() < -1000.0
    assert (along - drag)[end].mean() == pytest.approx(inertia[end].mean(), rel=5e-3)


def test_change_of_momentum_is_the_impulse_of_the_outer_forces() -> None:
    """In the transient, by the engine's momentum: only tyres, drag and weight act on the car."""
    simulation = in_the_corner("ars", 560)
    vehicle = simulation.vehicle
    model, data = vehicle.model, vehicle.data
    mass = mass_kg(vehicle)
    impulse = np.zeros(3)

    def momentum() -> np.ndarray:
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        return mass * data.subtree_linvel[model.body("chassis").id].copy()

    before = momentum()
    for _ in range(200):
        simulation.advance(1)
        for index, corner in enumerate(CORNERS):
            axis = data.xmat[model.body(f"{corner}_wheel").id].reshape(3, 3)[:, 1]
            heading = np.array([axis[1], -axis[0], 0.0]) / np.hypot(axis[0], axis[1])
            fx, fy, fz = data.userdata[index * USERDATA_PER_WHEEL : index * USERDATA_PER_WHEEL + 3]
            left = np.array([-heading[1], heading[0], 0.0])
            impulse += 1e-3 * (fx * heading + fy * left + np.array([0.0, 0.0, fz]))
        velocity = data.subtree_linvel[model.body("chassis").id]
        impulse[:2] -= 1e-3 * DRAG_NS2PM2 * np.hypot(velocity[0], velocity[1]) * velocity[:2]
        impulse[2] -= 1e-3 * mass * GRAVITY_MPS2
    change = momentum() - before
    np.testing.assert_allclose(change, impulse, atol=2e-3 * np.abs(change).max())


def test_load_transfer_carries_the_moment_of_the_lateral_acceleration() -> None:
    """Moments about the road: m a_y h = sum of dFz times half the track, plus the shift of the weight by roll."""
    recording = step_steer()
    vehicle = car()
    model, data = vehicle.model, vehicle.data
    end = last(recording, 0.5)
    loads = corners(recording, "tyre_fz_N")[end].mean(axis=0)
    half_track = [float(data.xpos[model.body(f"{corner}_wheel").id, 1]) for corner in CORNERS]
    moment = -float(loads @ half_track)
    centre = data.subtree_com[model.body("chassis").id]
    shift = centre[2] * float(np.sin(recording["roll_rad"][end].mean()))
    expected = mass_kg(vehicle) * (recording["ay_mps2"][end].mean() * centre[2] + GRAVITY_MPS2 * shift)
    without_roll = mass_kg(vehicle) * recording["ay_mps2"][end].mean() * centre[2]
    # The body rolls about an axis above the road and the contact points move inwards under side force: between both.
    assert 0.99 * without_roll < moment < 1.01 * expected


def test_braking_shifts_load_to_the_front() -> None:
    """m a_x h = dFz l, on a straight road."""
    recording = rolling(pedal=0.2)
    vehicle = car()
    model, data = vehicle.model, vehicle.data
    end = last(recording, 0.5)
    height = float(data.subtree_com[model.body("chassis").id, 2])
    wheelbase = float(data.xpos[model.body("fl_wheel").id, 0] - data.xpos[model.body("rl_wheel").id, 0])
    loads = corners(recording, "tyre_fz_N")
    shifted = loads[end][:, :2].sum(axis=1).mean() - corners(run("standstill"), "tyre_fz_N")[-1, :2].sum()
    inertia = -mass_kg(vehicle) * recording["ax_mps2"][end].mean() * height / wheelbase
    drag = DRAG_NS2PM2 * recording["speed_mps"][end].mean() ** 2
    drag_moment = drag * (PARAMETERS.aerodynamics.pressure_point_m[2] - 0.0) / wheelbase
    # Drag slows the car too, but acts at its own height; rolling resistance moments are some per cent of the rest.
    assert shifted == pytest.approx(inertia - drag_moment, rel=0.05)


def test_coasting_loses_what_drag_rolling_and_released_brakes_take() -> None:
    recording = rolling()
    end = slice(500, None)
    speed = recording["speed_mps"][end]
    radius = corners(recording, "loaded_radius_m")[end]
    spin = corners(recording, "wheel_speed_radps")[end]
    # In power: air, rolling resistance moments on turning wheels, dry friction of the brakes.
    loss_W = (
        DRAG_NS2PM2 * speed**3
        - (corners(recording, "tyre_my_Nm")[end] * spin).sum(axis=1)
        + PARAMETERS.brakes.drag_torque_Nm * spin.sum(axis=1)
    )
    vehicle = car()
    inertia = vehicle.model.body_inertia[[vehicle.model.body(f"{corner}_wheel").id for corner in CORNERS]].max(axis=1)
    energy = 0.5 * mass_kg(vehicle) * speed**2 + 0.5 * (inertia * spin**2).sum(axis=1)
    time_s = recording.time_s[end]
    lost_W = -(energy[-1] - energy[0]) / (time_s[-1] - time_s[0])
    assert radius.min() > 0.28
    assert lost_W == pytest.approx(loss_W.mean(), rel=0.03)


def locked(mu: float) -> tuple[float, float]:
    """Return deceleration over gravity, and the utilised friction of the tyres with locked wheels."""
    recording = rolling(mu=mu, pedal=1.0)
    end = (recording.time_s > 1.5) & (recording.time_s < 2.3)
    assert np.abs(corners(recording, "wheel_speed_radps")[end]).max() < 0.5
    assert recording["speed_mps"][end].min() > 3.0
    share = -corners(recording, "tyre_fx_N")[end].sum(axis=1) / corners(recording, "tyre_fz_N")[end].sum(axis=1)
    return float(-recording["ax_mps2"][end].mean()) / GRAVITY_MPS2, float(share.mean())


@pytest.mark.parametrize("mu", [0.4, 1.0])
def test_full_braking_locks_the_wheels_and_they_slide_at_the_friction_of_the_road(mu: float) -> None:
    deceleration, share = locked(mu)
    tyre = load_car().tyres[0].record
    sliding = -magic_formula(tyre, 3500.0, -1.0, 0.0, 0.0, tyre["INFLPRES"], 10.0, mu)[0] / 3500.0
    assert share == pytest.approx(sliding, rel=0.05)
    assert 0.6 * mu < sliding < 1.1 * mu
    # Drag helps, most at the speed at which it began.
    assert 0.99 * share < deceleration < 1.05 * share


def test_the_same_pedal_stops_the_car_in_proportion_to_the_friction() -> None:
    assert locked(0.4)[0] / locked(1.0)[0] == pytest.approx(0.4, rel=0.1)


def test_no_tyre_uses_more_than_the_road_gives() -> None:
    """The limit is the peak of the tyre's curve, scaled by friction, at the smallest load of the run."""
    recording = rolling(mu=0.4, pedal=1.0)
    loads = corners(recording, "tyre_fz_N")
    used = np.hypot(corners(recording, "tyre_fx_N"), corners(recording, "tyre_fy_N")) / loads
    tyre = load_car().tyres[0].record
    slips = np.linspace(-1.0, 0.0, 400)
    pressure = tyre["INFLPRES"]
    peak = max(abs(magic_formula(tyre, loads.min(), slip, 0.0, 0.0, pressure, 10.0, 0.4)[0]) for slip in slips)
    assert 0.4 * 0.9 < used.max() < 1.02 * peak / loads.min()
