"""Full braking with and without anti-lock system: locked wheels, stopping distance, energy, yaw."""

from __future__ import annotations

import functools
from typing import Any

import mujoco
import numpy as np
import pytest

from activesteer import ActuatorCommand, DriverCommand, Recording, Simulation, simulate
from activesteer.core.conventions import CORNERS, GRAVITY_MPS2
from activesteer.resources import models_dir
from activesteer.theory.single_track import SingleTrack
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.file.tir import load_tir
from activesteer.vehicle import Vehicle
from tests.physics.runs import car, corners, mass_kg, run

SLIPPERY = {"road__mu": 0.3, "duration_s": 11.5}
ICE = {"road__mu": 0.1, "duration_s": 40.0}
WITHOUT = {"vehicle__brakes__abs": False}
COASTING = {
    "kind": "open_loop", "name": "coasting", "speed_kmh": 80, "duration_s": 1.0, "settle_s": 1.0, "drive": "coast",
}  # fmt: skip


def from_100(changes: dict[str, Any] | None = None) -> Recording:
    return run("straight_braking", settle_s=0.5, **(changes or {}))


def stop_from_100(vehicle: str, changes: dict[str, Any]) -> Recording:
    return from_100(changes) if vehicle == "compact" else _of_sedan(tuple(changes.items()))


@functools.cache
def _of_sedan(changes: tuple[tuple[str, Any], ...]) -> Recording:
    overrides = {key.replace("__", "."): value for key, value in changes}
    return simulate("straight_braking", vehicle="sedan", overrides=overrides)


@pytest.mark.parametrize(
    ("changes", "vehicle"),
    [
        ({}, "compact"), ({}, "sedan"), (SLIPPERY, "compact"),
        *(pytest.param(changes, vehicle, marks=pytest.mark.slow)
          for changes, vehicle in ((SLIPPERY, "sedan"), (ICE, "compact"), (ICE, "sedan"))),
    ],
)  # fmt: skip
def test_no_wheel_locks_and_nine_tenths_of_the_friction_are_used(vehicle: str, changes: dict[str, Any]) -> None:
    """Half of the sedan's brake torque acts at the rear wheels, so these reach their limit first."""
    found = stop_from_100(vehicle, changes).metrics
    assert found["wheel_slip_max"] < 0.5
    assert 0.9 <= found["braking_efficiency"] <= 1.0


@pytest.mark.parametrize(
    ("vehicle", "friction"),
    [
        ("compact", 1.0), ("sedan", 1.0), ("sedan", 0.3),
        *(pytest.param(vehicle, friction, marks=pytest.mark.slow) for vehicle, friction in (
            ("compact", 0.6), ("compact", 0.3), ("sedan", 0.6), ("bmw_m8", 1.0), ("bmw_m8", 0.6), ("bmw_m8", 0.3)
        )),
    ],
)  # fmt: skip
def test_a_full_stop_keeps_its_deceleration_to_walking_pace(vehicle: str, friction: float) -> None:
    """Within a tenth of that around 10 m/s, down to 0.5 m/s, as production cars do."""
    changes = {"speed_kmh": 60, "road.mu": friction, "maneuver.duration_s": 2.0 + 3.0 / friction}
    recording = simulate("straight_braking", vehicle=vehicle, overrides=changes)
    time_s, speed_mps = recording.time_s, recording["vx_mps"]

    def deceleration_mps2(from_mps: float, to_mps: float) -> float:
        first, last = (int(np.argmax(speed_mps < limit)) for limit in (from_mps, to_mps))
        return (speed_mps[first] - speed_mps[last]) / (time_s[last] - time_s[first])

    fast_mps2 = deceleration_mps2(11.5, 8.0)
    for from_mps, to_mps in ((4.0, 2.5), (2.5, 1.5), (1.5, 1.0), (1.0, 0.5)):
        assert deceleration_mps2(from_mps, to_mps) == pytest.approx(fast_mps2, rel=0.1), (from_mps, to_mps)


def test_dead_travel_and_build_up_of_pressure_delay_a_hard_stop_by_half_a_second() -> None:
    """From the pedal to 0.4 g a hard, not panicked stop takes 0.5 to 0.7 s."""

    def delay_s(**hydraulics: float) -> float:
        changes = {f"vehicle.brakes.hydraulics.{key}": value for key, value in hydraulics.items()}
        recording = simulate(
            "straight_braking", overrides={"brake.rise_s": 0.7, "brake.pedal": 0.6, "duration_s": 2.0} | changes
        )
        strong = recording["ax_mps2"] < -0.4 * GRAVITY_MPS2
        return float(recording.time_s[int(np.argmax(strong))]) - 0.5

    assert delay_s() < 0.42
    assert 0.5 < delay_s(dead_travel=0.2, rise_Paps=10e6) < 0.7


@pytest.mark.parametrize("vehicle", ["compact", "sedan"])
def test_a_car_rocks_back_at_the_stop_by_its_suspension_and_tyres_alone(vehicle: str) -> None:
    """Two amplitudes of a swing, whose first is what deceleration over stiffness bends both by: some centimetres.

    Locked wheels are released by what a sliding patch can hold of its deflection, not by what it had at speed. The
    sedan's tyre file has a relaxation length of 1 m, a softer carcass.
    """
    for recording in (stop_from_100(vehicle, {}), stop_from_100(vehicle, WITHOUT)):
        x_m, stops = recording["x_m"], int(recording["x_m"].argmax())
        assert 0.01 < x_m[stops] - x_m[stops:].min() < (0.08 if vehicle == "compact" else 0.13)
        # It stays at rest, and the swing is no direction that the car drives in.
        assert abs(x_m[-1] - x_m[-200]) < 0.01
        assert np.abs(recording["sideslip_rad"]).max() < 1e-6


def test_it_works_with_the_sensors_of_production_cars() -> None:
    """Noisy pulse wheels and a late, biased acceleration: less friction is used, and no wheel locks."""
    recording = from_100({"vehicle__sensors__preset": "production"})
    assert recording.metrics["braking_efficiency"] >= 0.88
    assert np.abs(corners(recording, "slip_ratio")[recording["speed_mps"] > 15.0 / 3.6]).max() < 0.5


def test_without_it_all_wheels_lock_the_front_ones_first_and_the_way_is_longer() -> None:
    locked = from_100(WITHOUT)
    at_s = [locked.time_s[int(np.argmax(locked[f"{corner}_slip_ratio"] < -0.8))] for corner in CORNERS]
    assert min(at_s) > 0.5
    assert max(at_s[:2]) < min(at_s[2:])
    assert np.abs(locked["yaw_rad"]).max() < 1e-6
    assert from_100().metrics["stopping_distance_m"] < 0.9 * locked.metrics["stopping_distance_m"]


def test_locked_wheels_slide_as_far_as_their_friction_says() -> None:
    """v^2 / (2 mu_slide g); drag and the lag of the last tenth of a second are the tolerance."""
    locked = from_100(WITHOUT)
    begin = int(np.argmax(locked.time_s >= 1.2))
    assert (corners(locked, "slip_ratio")[begin:][locked["speed_mps"][begin:] > 2.0] < -0.97).all()
    end = int(np.argmax(locked["speed_mps"] < 2.0))
    tyre = MagicFormula(load_tir(models_dir() / "tyres" / "compact_205_55R16.tir"))
    loads_N = corners(locked, "tyre_fz_N")[begin:end].mean(axis=0)
    sliding = -tyre.evaluate(loads_N, -1.0, 0.0, road_friction=0.9).fx_N.sum() / loads_N.sum()
    way_m = (locked["speed_mps"][begin] ** 2 - 2.0**2) / (2.0 * sliding * GRAVITY_MPS2)
    assert locked["x_m"][end] - locked["x_m"][begin] == pytest.approx(way_m, rel=0.03)


def wheel_inertia_kgm2(vehicle: Vehicle) -> float:
    """Return the inertia of a wheel about its axis, with the clutch open."""
    spin = int(vehicle.model.joint("rl_spin").dofadr[0])
    product = np.empty(vehicle.model.nv)
    mujoco.mj_mulM(vehicle.model, vehicle.data, product, np.eye(vehicle.model.nv)[spin])
    return float(product[spin])


@pytest.mark.parametrize("changes", [{}, WITHOUT, SLIPPERY])
def test_brakes_tyres_and_air_take_the_energy(changes: dict[str, Any]) -> None:
    recording = from_100(changes)
    first, last = int(np.argmax(recording.time_s >= 0.5)), int(np.argmax(recording["speed_mps"] < 3.0))
    part = slice(first, last)
    spin, speed = corners(recording, "wheel_speed_radps")[part], recording["speed_mps"][part]
    brakes_W = -(corners(recording, "brake_torque_Nm")[part] * spin).sum(axis=1)
    slower_mps = speed[:, None] - corners(recording, "loaded_radius_m")[part] * spin
    sliding_W = -(corners(recording, "tyre_fx_N")[part] * slower_mps).sum(axis=1)
    air_W = 0.5 * 1.2 * 0.65 * speed**3
    rolling_W = -(corners(recording, "tyre_my_Nm")[part] * spin).sum(axis=1)
    lost_J = np.trapezoid(brakes_W + sliding_W + air_W + rolling_W, recording.time_s[part])
    inertia_kgm2 = wheel_inertia_kgm2(car())
    before_J, after_J = (
        0.5 * mass_kg(car()) * speed[row] ** 2 + 0.5 * inertia_kgm2 * (spin[row] ** 2).sum() for row in (0, -1)
    )
    assert lost_J == pytest.approx(before_J - after_J, rel=0.01)
    in_brakes = np.trapezoid(brakes_W, recording.time_s[part]) / lost_J
    assert in_brakes < 0.1 if changes is WITHOUT else in_brakes > 0.85


def test_the_driver_keeps_a_car_on_split_friction_and_without_him_it_turns_to_the_grip() -> None:
    held = run("split_mu_braking")
    assert held.metrics["lateral_deviation_max_m"] < 1.0
    assert np.degrees(np.abs(held["yaw_rad"]).max()) < 10.0
    assert held.metrics["wheel_slip_max"] < 0.5
    # Also where it is handed over to the driver, just before it stands.
    assert np.degrees(held.metrics["yaw_rate_peak_abs_radps"]) < 6.0
    # UN R13-H, annex 6, 5.3.6: what has to come of both sides' friction.
    assert held.metrics["mean_deceleration_mps2"] > 0.75 * (4.0 * 0.3 + 0.9) / 5.0 * GRAVITY_MPS2
    left = run("split_mu_braking", hold_line=False, duration_s=3.0)
    assert left["yaw_rad"][-1] > 0.1
    # The rear wheels get what the slippery side bears, the front one on the grip more.
    later = (held.time_s > 1.0) & (held["speed_mps"] > 5.0)
    pressures = {corner: held[f"{corner}_brake_pressure_Pa"][later].mean() for corner in CORNERS}
    assert pressures["rl"] == pytest.approx(pressures["rr"], rel=1e-6)
    assert pressures["fl"] > 1.5 * pressures["fr"]


def coasting_with(brakes_Nm: tuple[float, float, float, float]) -> Recording:
    simulation = Simulation(COASTING)
    command = DriverCommand(gear=0)
    simulation.advance(simulation.steps, command, ActuatorCommand(brake_torque_demand_Nm=brakes_Nm))
    return simulation.recording()


def test_a_braked_left_wheel_turns_the_car_left_by_its_lever() -> None:
    """Expected is the steady state of the single-track model with the moment of the force at half the track."""
    torque_Nm = 150.0
    left, right = coasting_with((torque_Nm, 0.0, torque_Nm, 0.0)), coasting_with((0.0, torque_Nm, 0.0, torque_Nm))
    np.testing.assert_allclose(left["yaw_rate_radps"], -right["yaw_rate_radps"], atol=1e-9)
    setup = Simulation(COASTING).loop.controller_setup
    car, speed = setup.single_track, float(left["speed_mps"][-1])
    front, rear = car.front_stiffness_Nprad, car.rear_stiffness_Nprad
    to_front, to_rear = car.cg_to_front_m, car.cg_to_rear_m
    wheelbase_m = SingleTrack(car).wheelbase_m
    moment_Nm = 2.0 * torque_Nm / 0.307 * 0.5 * 1.53
    resisting = front * rear * wheelbase_m**2 / speed + car.mass_kg * speed * (rear * to_rear - front * to_front)
    expected = moment_Nm * (front + rear) / resisting
    assert left["yaw_rate_radps"][-1] == pytest.approx(expected, rel=0.25)


def test_a_pedal_that_locks_no_wheel_leaves_the_anti_lock_system_without_a_trace() -> None:
    gentle = {**COASTING, "duration_s": 2.0, "brake": {"time_s": [0.1, 0.3], "pedal": [0.0, 0.3]}}
    on, off = simulate(gentle), simulate(gentle, overrides={"vehicle.brakes.abs": False})
    assert on["speed_mps"][-1] < on["speed_mps"][0] - 5.0
    for name in ("x_m", "fl_tyre_fx_N", "rr_brake_torque_Nm"):
        np.testing.assert_array_equal(on[name], off[name])


def test_a_state_saved_while_it_acts_goes_on_bit_for_bit() -> None:
    simulation = Simulation("straight_braking", overrides={"duration_s": 1.6})
    simulation.advance(900)
    saved = simulation.save_state()
    assert simulation.truth["fl_abs_phase"] > 0.0
    simulation.run()
    first = simulation.recording()
    simulation.restore_state(saved)
    simulation.run()
    again = simulation.recording()
    for name in ("x_m", "fl_brake_pressure_Pa", "rr_slip_ratio", "abs_speed_mps"):
        np.testing.assert_array_equal(first[name], again[name])


def test_on_ice_the_car_comes_to_rest_and_stays() -> None:
    ice = {**COASTING, "speed_kmh": 15, "duration_s": 9.0, "road": {"mu": 0.15},
           "brake": {"time_s": [0.2, 0.3], "pedal": [0.0, 1.0]}}  # fmt: skip
    recording = simulate(ice)
    rest = recording.time_s > 7.5
    assert np.abs(recording["speed_mps"][rest]).max() < 1e-3
    assert recording["x_m"].max() - recording["x_m"][-1] < 0.03
    assert np.abs(corners(recording, "wheel_speed_radps")[rest]).max() < 1e-2


def test_the_parking_brake_holds_the_car_on_a_hill() -> None:
    hill = {
        "kind": "open_loop", "speed_kmh": 0, "duration_s": 4.0, "settle_s": 0.0, "drive": "coast",
        "road": {"mu": 0.9, "grade": 0.15}, "parking_brake": {"time_s": [0.0], "applied": [0.6]},
    }  # fmt: skip
    held, rolling = simulate(hill), simulate(hill, overrides={"parking_brake.applied": [0.3]})
    assert abs(held["x_m"][-1] - held["x_m"][3000]) < 1e-4
    assert rolling["x_m"][-1] < -1.0


def test_traction_control_keeps_the_driven_wheels_from_spinning() -> None:
    start = {**COASTING, "speed_kmh": 10, "duration_s": 2.0, "road": {"mu": 0.3}}
    spin_mps, end_mps = {}, {}
    for tcs in (True, False):
        simulation = Simulation(start, overrides={"vehicle.brakes.tcs": tcs})
        simulation.advance(simulation.steps, DriverCommand(drive_torque_demand_Nm=2500.0))
        recording = simulation.recording()
        assert recording["tcs_active"].max() == tcs
        later = recording.time_s > 1.0
        spin_mps[tcs] = (0.305 * recording["fl_wheel_speed_radps"] - recording["speed_mps"])[later].max()
        end_mps[tcs] = recording["speed_mps"][-1]
    assert spin_mps[True] < 2.0
    assert spin_mps[False] > 20.0
    assert end_mps[True] > end_mps[False] > 10.0 / 3.6
