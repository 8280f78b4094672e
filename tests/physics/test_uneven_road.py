"""The car on banked and uneven roads against hand calculations."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.errors import ManeuverError, ParameterError, SimulationDiverged
from activesteer.recording import Recording
from activesteer.road.obstacles import Obstacle
from activesteer.road.road import Road
from activesteer.scenario import load_car
from activesteer.vehicle.linear_state import LocalState
from tests.physics.runs import car, corners, last, mass_kg


def drive(road: dict[str, Any], speed_kmh: float = 60.0, duration_s: float = 3.0, **more: Any) -> Recording:
    """Drive straight ahead over a road."""
    table = {
        "kind": "open_loop",
        "speed_kmh": speed_kmh,
        "duration_s": duration_s,
        "settle_s": 0.5,
        "road": road,
    } | more
    return activesteer.simulate(table)


RAMP = {"kind": "cross_slope_ramp", "start_m": 5.0, "length_m": 20.0, "slope": math.tan(math.radians(3.0))}
BANKS: dict[str, dict[str, Any]] = {"bank": {"bank_deg": 3.0}, "cross slope": {"obstacle": [RAMP]}}


@functools.cache
def on_bank(road: str) -> Recording:
    """Return a run on a bank, whose driver holds a straight line: at the end there is no lateral acceleration."""
    path = {"kind": "follow_path", "path": {"x_m": [20.0 * i for i in range(10)], "y_m": [0.0] * 10}}
    return drive(BANKS[road], duration_s=9.0, **path)


@pytest.mark.parametrize("road", BANKS)
def test_on_a_bank_the_tyres_carry_the_weight_and_its_part_down_the_slope(road: str) -> None:
    recording = on_bank(road)
    end, bank, weight_N = last(recording, 1.0), math.radians(3.0), mass_kg(car()) * GRAVITY_MPS2
    loads, across = corners(recording, "tyre_fz_N")[end].mean(axis=0), corners(recording, "tyre_fy_N")[end].mean(axis=0)
    steer = corners(recording, "steer_rad")[end].mean(axis=0)
    assert loads.sum() == pytest.approx(weight_N * math.cos(bank), rel=2e-3)
    # The tyres push uphill, to the left; the drive's part of it is small.
    drag_part = (corners(recording, "tyre_fx_N")[end].mean(axis=0) * np.sin(steer)).sum()
    assert (across * np.cos(steer)).sum() + drag_part == pytest.approx(weight_N * math.sin(bank), rel=0.02)
    # Moments about the contact line: m g h sin(bank) = (sum of right loads - left loads) x half track, within the few
    # millimetres by which roll and compliance move the weight and the contact points.
    sizes, height_m = car().dimensions(), float(recording["z_m"][0])
    half_track = 0.25 * (sizes["front_track_m"] + sizes["rear_track_m"])  # type: ignore[operator]
    moved = 0.5 * (loads[1] + loads[3] - loads[0] - loads[2])
    assert moved == pytest.approx(weight_N * math.sin(bank) * height_m / (2.0 * half_track), rel=0.06)


def test_a_bank_of_the_whole_road_and_a_cross_slope_give_the_same_loads() -> None:
    one, other = (on_bank(road) for road in BANKS)
    end = last(one, 0.5)
    for name in ("tyre_fz_N", "tyre_fy_N"):
        expected = corners(one, name)[end].mean(axis=0)
        assert corners(other, name)[end].mean(axis=0) == pytest.approx(expected, rel=5e-3, abs=10.0)


def test_a_bump_on_the_other_side_gives_the_mirrored_run() -> None:
    bump = {"kind": "cosine_bump", "start_m": 8.0, "length_m": 1.2, "height_m": 0.04}
    left, right = (drive({"obstacle": [bump | {"side": side}]}, duration_s=1.5) for side in ("left", "right"))
    for name in ("z_m", "pitch_rad", "vx_mps"):
        assert left[name] == pytest.approx(right[name], abs=1e-9)
    for name in ("roll_rad", "yaw_rate_radps", "ay_mps2"):
        assert np.abs(left[name]).max() > 1e-3
        assert left[name] == pytest.approx(-right[name], abs=1e-8)
    assert left["fl_tyre_fz_N"] == pytest.approx(right["fr_tyre_fz_N"], abs=1e-4)


def test_the_loads_of_a_long_wave_follow_mass_times_gravity_and_vertical_acceleration() -> None:
    wave = {"kind": "sine_wave", "start_m": 5.0, "length_m": 40.0, "height_m": 0.2}
    recording = drive({"obstacle": [wave]}, 60.0, 6.0)
    end = last(recording, 2.4)  # one wave
    carried = corners(recording, "tyre_fz_N")[end].sum(axis=1)
    # The whole car, wheels included: the sum of the forces is the rate of its momentum. The wave of 40 m at 60 km/h has
    # 0.42 Hz, and the slope of 0.03 tilts the forces by 0.0005 of their size.
    curvature = 0.2 * (2.0 * math.pi / 40.0) ** 2
    swing = 0.5 * np.ptp(carried)
    still = mass_kg(car()) * curvature * (60.0 / 3.6) ** 2
    # Below the body's 1.2 Hz the car follows the road, and its own resonance adds (0.42/1.2)^2, 12 to 20 %.
    assert carried.mean() == pytest.approx(mass_kg(car()) * GRAVITY_MPS2, rel=0.01)
    assert 1.0 < swing / still < 1.25


def test_contact_on_a_smooth_bump_hardly_depends_on_its_model_and_on_a_cleat_it_does() -> None:
    def peak_N(obstacle: dict[str, Any], contact: str) -> float:
        return float(drive({"contact": contact, "obstacle": [obstacle]}, 30.0, 1.5)["fl_tyre_fz_N"].max())

    bump = {"kind": "cosine_bump", "start_m": 6.0, "length_m": 3.0, "height_m": 0.05}
    single = peak_N(bump, "single_point")
    for contact in ("four_point", "enveloping"):
        assert peak_N(bump, contact) == pytest.approx(single, rel=0.03)
    cleat = {"kind": "cleat", "start_m": 6.0, "length_m": 0.05, "height_m": 0.01}
    # A tyre swallows a cleat shorter than its contact patch; a single point drops from it.
    assert peak_N(cleat, "enveloping") < 0.95 * peak_N(cleat, "single_point")


def test_friction_and_heights_follow_a_path() -> None:
    turn = np.linspace(0.0, 1.2, 40)
    x, y = 80.0 * np.sin(turn), 80.0 * (1.0 - np.cos(turn))
    table = {"kind": "follow_path", "path": {"x_m": list(x), "y_m": list(y)}}
    bump = {"kind": "cosine_bump", "start_m": 50.0, "length_m": 4.0, "height_m": 0.06, "side": "left"}
    recording = drive({"along": "path", "obstacle": [bump]}, 40.0, 7.0, **table)
    # The left wheels meet the bump 50 m along the arc, the right ones not at all.
    when = recording["fl_road_z_m"] > 1e-4
    arc = 80.0 * np.arctan2(recording["fl_contact_x_m"], 80.0 - recording["fl_contact_y_m"])
    assert arc[when].min() == pytest.approx(50.1, abs=0.3)
    assert arc[when].max() == pytest.approx(53.9, abs=0.3)
    assert recording["fl_road_z_m"].max() == pytest.approx(0.06, abs=1e-3)
    assert np.abs(recording["fr_road_z_m"]).max() == 0.0


def test_linear_analyses_refuse_an_uneven_or_banked_road() -> None:
    bump = Obstacle("cosine_bump", 10.0, 3.0, 0.05)
    for road in (Road(bank_rad=0.05), Road(obstacle=(bump,))):
        with pytest.raises(ParameterError, match="not an equilibrium on an uneven or banked road"):
            LocalState(load_car().on(road))


@pytest.mark.parametrize(
    ("road", "problem"),
    [
        ({"contact": "single_point"}, "no effect on a road without such a surface"),
        ({"obstacle": [{"kind": "cleat", "start_m": 6.0, "height_m": 0.01}]}, "a cleat needs it"),
        ({"obstacle": [{"kind": "bump", "start_m": 6.0}]}, "allowed: 'cosine_bump'"),
        ({"obstacle": [{"kind": "cosine_bump", "start_m": 1.0, "length_m": 1.0, "height_m": 0.1}]}, "at least 2"),
        ({"obstacle": [{"kind": "kerb", "start_m": 6.0, "height_m": 0.1, "waves": 3}]}, "no effect on this kerb"),
        ({"banking": {"s_m": [0.0, 10.0], "bank_deg": [0.0]}}, "bank_deg: has 1 values, but s_m has 2"),
        ({"bank": 3.0}, "give bank_deg for the whole road"),
        ({"bumps": []}, "give tables"),
    ],
)
def test_a_wrong_road_is_refused_with_its_key(road: dict[str, Any], problem: str) -> None:
    with pytest.raises(ManeuverError, match=problem):
        drive(road)


def test_over_a_crest_and_through_a_dip_the_loads_carry_mass_times_gravity_less_or_more_the_centripetal_part() -> None:
    radius_m, speed = 400.0, 25.0
    s = np.arange(0.0, 321.0)
    bends = np.select([(s > 40) & (s <= 100), (s > 100) & (s <= 220), (s > 220) & (s <= 280)], [1.0, -1.0, 1.0])
    slope = np.concatenate([[0.0], np.cumsum(0.5 * (bends[1:] + bends[:-1]))]) / radius_m
    z = np.concatenate([[0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]))])
    road = {"heights": {"s_m": list(s), "left_z_m": list(z)}, "start_m": 3.0}
    recording = drive(road, 3.6 * speed, 9.0)
    loads, x = corners(recording, "tyre_fz_N").sum(axis=1), recording["x_m"]
    mass, centripetal = mass_kg(car()), speed**2 / radius_m
    # The body's heave has decayed 45 m into each bend; the slope there is at most 0.14 (cosine 0.99).
    for places, expected in (((85.0, 97.0), GRAVITY_MPS2 + centripetal), ((150.0, 170.0), GRAVITY_MPS2 - centripetal)):
        inside = (x > places[0]) & (x < places[1])
        assert loads[inside].mean() == pytest.approx(mass * expected, rel=0.015)


def test_on_a_rough_road_the_energy_of_a_coasting_car_only_falls_and_dampers_take_it() -> None:
    # Coasting without drag of brakes: what the car loses beyond a plane road goes into dampers and tyres.
    coast = {"drive": "coast", "settle_s": 2.0}
    plane = drive({}, 80.0, 6.0, **coast)
    rough = drive({"roughness": {"class": "D", "seed": 4, "length_m": 200.0}}, 80.0, 6.0, **coast)

    def energy_J(recording: Recording) -> np.ndarray:
        mass = mass_kg(car())
        return (
            0.5 * mass * (recording["vx_mps"] ** 2 + recording["vz_mps"] ** 2) + mass * GRAVITY_MPS2 * recording["z_m"]
        )

    lost = [float(energy_J(run)[0] - energy_J(run)[-200:].mean()) for run in (plane, rough)]
    travel = corners(rough, "travel_m")
    dissipated = -np.sum(corners(rough, "damper_force_N")[1:] * -np.diff(travel, axis=0))
    assert lost[1] > lost[0] > 0.0
    # The dampers, at ratios of 0.9 to 1 to the wheel, take most of the difference; the rest is slip of the tyres.
    assert 0.5 * dissipated < lost[1] - lost[0] < 2.0 * dissipated


def test_leaving_the_known_surface_ends_the_run_if_that_is_an_error() -> None:
    roughness = {"class": "A", "length_m": 30.0}
    with pytest.raises(SimulationDiverged, match=r"f. wheel leaves the known surface of the road at x = 29\.9"):
        drive({"roughness": roughness, "outside": "error"}, 60.0, 4.0)
    run = drive({"roughness": roughness}, 60.0, 4.0)
    assert run["fl_road_z_m"][-1] == pytest.approx(0.0, abs=0.05)
    beyond = max(float(np.mean(run[f"{corner}_contact_x_m"] > 30.0)) for corner in ("fl", "fr"))
    assert 0.4 < beyond < 0.8
    assert run.metrics["extended_road_share"] == pytest.approx(beyond, abs=0.005)
