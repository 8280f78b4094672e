"""The loaded car: wheel loads, spring travel and centre of gravity against a calculation by hand."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS, GRAVITY_MPS2
from activesteer.errors import ParameterError
from activesteer.scenario import load_car
from activesteer.vehicle import Vehicle
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.statics import mass_properties, point_mass_inertia
from tests.raising import raises
from tests.unit.vehicle.cars import dof, record

LOADS: dict[str, dict[str, Any]] = {
    "boot": {"load.payload_kg": 300.0},
    "rear seats": {"load.payload_kg": 200.0, "load.payload_forward_change_m": 0.9},
    "right rear seat": {"load.payload_kg": 90.0, "load.payload_position_m": [-1.9, -0.4, 0.6]},
    "roof": {"load.roof_kg": 75.0, "load.roof_height_m": 1.65},
    "empty tank": {"load.fuel_kg": -35.0},
    "all": {"load.payload_kg": 200.0, "load.roof_kg": 50.0, "load.fuel_kg": 20.0, "factors.mass": 1.1},
}


def car(overrides: dict[str, Any] | None = None, vehicle: str = "compact") -> Vehicle:
    return load_car(vehicle, overrides).on()


def carried(vehicle: Vehicle, overrides: dict[str, Any]) -> list[tuple[float, np.ndarray]]:
    """Masses and their places in the design position, as documented."""
    load = {key.removeprefix("load."): value for key, value in overrides.items()}
    dimensions = vehicle.dimensions()
    rear_m = -float(dimensions["wheelbase_m"]) + float(_design(vehicle, "fl")[0])  # type: ignore[arg-type]
    middle_m = 0.5 * (rear_m + float(_design(vehicle, "fl")[0]))
    return [
        (
            load.get("payload_kg", 0.0),
            np.array(load.get("payload_position_m", (rear_m + load.get("payload_forward_change_m", 0.0), 0.0, 0.6))),
        ),
        (load.get("fuel_kg", 0.0), np.array((rear_m + 0.4, 0.0, 0.35))),
        (load.get("roof_kg", 0.0), np.array((middle_m, 0.0, load.get("roof_height_m", 1.6)))),
    ]


def _design(vehicle: Vehicle, corner: str) -> np.ndarray:
    data = mujoco.MjData(vehicle.model)
    mujoco.mj_kinematics(vehicle.model, data)
    return data.xpos[vehicle.model.body(f"{corner}_wheel").id].copy()


@pytest.mark.parametrize("vehicle", ["compact", "sedan"])
@pytest.mark.parametrize("name", LOADS)
def test_wheel_loads_are_those_of_a_calculation_by_hand(name: str, vehicle: str) -> None:
    """Sums of forces and of moments about both axes of the road, from masses and places alone, to 1 N."""
    overrides = LOADS[name]
    empty, loaded = car(vehicle=vehicle), car(overrides, vehicle)
    bare = mass_properties(empty.model)
    factor = overrides.get("factors.mass", 1.0)
    chassis = empty.model.body("chassis")
    extra_kg = (factor - 1.0) * bare.mass_kg
    points = [(bare.mass_kg, bare.cg_m), (extra_kg, chassis.ipos.copy()), *carried(empty, overrides)]
    mass_kg = sum(mass for mass, _ in points)
    # Body and wheels settle by some centimetres: what is sprung goes with the chassis, the rest with the wheels.
    standing = mass_properties(loaded.model, loaded.data)
    assert standing.mass_kg == pytest.approx(mass_kg)
    rotation = loaded.data.body("chassis").xmat.reshape(3, 3)
    origin = loaded.data.body("chassis").xpos
    unsprung = [body for body in range(2, loaded.model.nbody)]
    moment = sum(loaded.model.body_mass[body] * loaded.data.xipos[body] for body in unsprung)
    sprung = [
        (float(empty.model.body_mass[chassis.id]), chassis.ipos),
        (extra_kg, chassis.ipos),
        *carried(empty, overrides),
    ]
    moment = moment + sum(mass * (origin + rotation @ place) for mass, place in sprung)
    cg_m = np.asarray(moment) / mass_kg
    loads, places = [], []
    for corner in CORNERS:
        loads.append(record(loaded, corner, "fz_N"))
        places.append([record(loaded, corner, "contact_x_m"), record(loaded, corner, "contact_y_m")])
    total = mass_kg * GRAVITY_MPS2
    assert sum(loads) == pytest.approx(total, abs=1.0)
    by_axle = np.array(places)[:, 0].reshape(2, 2).mean(axis=1)
    front_by_hand = total * (cg_m[0] - by_axle[1]) / (by_axle[0] - by_axle[1])
    assert loads[0] + loads[1] == pytest.approx(front_by_hand, abs=1.0)


def test_centre_of_gravity_moves_with_the_load_and_results_are_given_for_it() -> None:
    overrides = LOADS["all"]
    empty, loaded = car(), car(overrides)
    for vehicle in (empty, loaded):
        assert vehicle.model.site("cg").pos == pytest.approx(mass_properties(vehicle.model).cg_m, abs=2e-3)
    moved = loaded.model.site("cg").pos - empty.model.site("cg").pos
    assert moved == pytest.approx(mass_properties(loaded.model).cg_m - mass_properties(empty.model).cg_m)
    higher = car({"load.cg_height_change_m": 0.05})
    assert higher.model.site("cg").pos - empty.model.site("cg").pos == pytest.approx([0.0, 0.0, 0.05])
    further = car({"load.cg_forward_change_m": 0.05})
    assert mass_properties(further.model).cg_m - mass_properties(empty.model).cg_m == pytest.approx([0.05, 0.0, 0.0])


def test_yaw_inertia_grows_by_masses_that_move_along_the_car() -> None:
    plain, spread = mass_properties(car().model), mass_properties(car({"factors.yaw_inertia": 1.1}).model)
    more_kgm2 = 0.1 * plain.inertia_kgm2[2, 2]
    np.testing.assert_allclose(
        spread.inertia_kgm2 - plain.inertia_kgm2, np.diag([0.0, more_kgm2, more_kgm2]), atol=1e-6
    )
    assert spread.mass_kg == pytest.approx(plain.mass_kg)
    assert spread.cg_m == pytest.approx(plain.cg_m)


def test_inertia_of_the_loaded_car_is_that_of_its_parts() -> None:
    overrides = LOADS["boot"]
    bare, loaded = mass_properties(car().model), mass_properties(car(overrides).model)
    weight_kg, place_m = carried(car(), overrides)[0]
    expected = bare.inertia_kgm2 + bare.mass_kg * point_mass_inertia(bare.cg_m - loaded.cg_m)
    expected = expected + weight_kg * point_mass_inertia(place_m - loaded.cg_m)
    np.testing.assert_allclose(loaded.inertia_kgm2, expected, rtol=1e-6, atol=1e-6)


def test_mass_factor_is_that_of_the_whole_car() -> None:
    assert mass_properties(car({"factors.mass": 1.1}).model).mass_kg == pytest.approx(1.1 * 1430.0, abs=1.0)


def test_payload_lets_the_rear_sink_and_softer_springs_let_it_sink_further() -> None:
    def rear_height_m(overrides: dict[str, Any]) -> float:
        vehicle = car(overrides)
        return float(vehicle.data.site("rl_spring_inner").xpos[2])

    empty = rear_height_m({})
    loaded = rear_height_m({"load.payload_kg": 200.0})
    # Two rear springs, 22.4 N/mm each at the wheels, and the tyres' 200 N/mm.
    assert empty - loaded == pytest.approx(200.0 * GRAVITY_MPS2 / 2.0 / 20.1e3, rel=0.15)
    assert rear_height_m({"load.payload_kg": 200.0, "factors.spring_rate": 0.8}) < loaded - 0.005
    # Without a load the rate alone changes nothing: what a spring carries in the design position stays.
    assert rear_height_m({"factors.spring_rate": 0.8}) == pytest.approx(empty, abs=1e-3)


def test_factors_reach_springs_bars_dampers_and_tyres() -> None:
    plain = car()
    for name, factor in (("front_anti_roll_bar", 1.5), ("fl_spring", 1.2)):
        key = "anti_roll_bar" if name.endswith("bar") else "spring_rate"
        changed = car({f"factors.{key}": factor})
        index = plain.model.tendon(name).id
        assert changed.model.tendon_stiffness[index] == pytest.approx(factor * plain.model.tendon_stiffness[index])
    tyre = load_car(overrides={"factors.tyre_friction": 0.8, "factors.tyre_cornering_stiffness": 1.1}).tyres[0]
    standard = load_car().tyres[0]
    assert tyre["LMUY"] == pytest.approx(0.8 * standard["LMUY"])
    assert tyre["LKY"] == pytest.approx(1.1 * standard["LKY"])
    axles = {"factors.tyre_cornering_stiffness": 1.1, "factors.rear_cornering_stiffness": 0.9}
    stiffnesses = [tyre["LKY"] / standard["LKY"] for tyre in load_car(overrides=axles).tyres]
    assert stiffnesses == pytest.approx([1.1, 1.1 * 0.9])
    worn = {"factors.tyre_friction": 0.9, "factors.rear_tyre_friction": 0.8}
    frictions = [
        (tyre["LMUX"] / standard["LMUX"], tyre["LMUY"] / standard["LMUY"]) for tyre in load_car(overrides=worn).tyres
    ]
    assert frictions == [pytest.approx((0.9, 0.9)), pytest.approx((0.72, 0.72))]


def test_damper_factor_multiplies_the_force_of_a_damper() -> None:
    def force_N(factor: float) -> float:
        vehicle = car({"factors.damper": factor})
        vehicle.data.qvel[dof(vehicle, "fl_jounce")] = 0.3
        mujoco.mj_forward(vehicle.model, vehicle.data)
        return float(vehicle.data.userdata[len(CORNERS) * fb.USERDATA_PER_WHEEL])

    assert force_N(1.0) > 100.0
    assert force_N(2.0) == pytest.approx(2.0 * force_N(1.0))


@pytest.mark.parametrize("key", ["mass_kg", "payload_kg", "load.mass_factor"])
def test_who_looks_for_the_mass_is_led_to_the_load(key: str) -> None:
    with raises(ParameterError, key=key) as refused:
        load_car(overrides={key: 1800.0})
    assert all(name in refused.value.problem for name in ("load.payload_kg", "factors.mass"))


def test_position_of_two_numbers_is_refused() -> None:
    with raises(ParameterError, file="compact.toml", key="load.payload_position_m", value=(1.0, 2.0)):
        load_car(overrides={"load.payload_kg": 10.0, "load.payload_position_m": [1.0, 2.0]})
