"""Power balance of an electric car: battery to wheels to kinetic energy, losses included."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer import ActuatorCommand, DriverCommand, Simulation
from activesteer.core.conventions import CORNERS
from activesteer.vehicle.statics import mass_properties

DT_S = 0.001
CARS = {"compact_electric": (0.92, 150.0, 400.0, ("rl", "rr")), "tesla_model_s": (0.9, 300.0, 500.0, ("front", "rear"))}
"""Car -> efficiency, idle loss of a motor [W], auxiliary power [W], and places of its motors."""


@pytest.mark.parametrize("car", CARS)
@pytest.mark.parametrize(
    ("speed_kmh", "torque_Nm", "split_Nm"), [(40.0, 1800.0, 0.0), (90.0, -900.0, 0.0), (60.0, 400.0, 60.0)]
)
def test_what_the_battery_gives_becomes_kinetic_energy_and_losses(
    car: str, speed_kmh: float, torque_Nm: float, split_Nm: float
) -> None:
    efficiency, idle_W, auxiliary_W, places = CARS[car]
    overrides = {"speed_kmh": speed_kmh, "duration_s": 3.0, "settle_s": 0.5}
    simulation = Simulation("step_steer", "none", vehicle=car, overrides=overrides)
    added = ActuatorCommand(wheel_torque_demand_Nm=(0.0, 0.0, -split_Nm, split_Nm))
    vehicle = simulation.loop.vehicle
    simulation.advance(3000, DriverCommand(drive_torque_demand_Nm=torque_Nm), added)
    run = simulation.recording()
    speeds = np.array([run[f"{corner}_wheel_speed_radps"] for corner in CORNERS])
    drives = np.array([run[f"{corner}_drive_torque_Nm"] for corner in CORNERS])

    # The battery feeds the motors and the auxiliaries; each motor's power follows from torque, speed and efficiency.
    motors = np.array([run[f"motor_{place}_power_W"] for place in places])
    np.testing.assert_allclose(run["battery_power_W"], motors.sum(axis=0) + auxiliary_W, rtol=1e-5)
    energy_J = run["battery_energy_J"][-1] - run["battery_energy_J"][0]
    assert energy_J == pytest.approx(np.sum(run["battery_power_W"][1:]) * DT_S, rel=1e-4)
    wheel_W = drives * speeds
    shafts_W = wheel_W[2:] if len(places) == 2 and places[0] == "rl" else wheel_W.reshape(2, 2, -1).sum(axis=1)
    loss_W = np.where(shafts_W > 0.0, shafts_W * (1.0 / efficiency - 1.0), -shafts_W * (1.0 - efficiency))
    gave_W = shafts_W.sum(axis=0) + loss_W.sum(axis=0) + idle_W * len(places) + auxiliary_W
    # Torque and speed of a row are those of the same instant; the motor used the speed of a step before.
    assert energy_J == pytest.approx(gave_W[1:].sum() * DT_S, rel=1e-2)

    # The torques at the wheels become kinetic energy, or heat in tyres, air, brakes and dampers.
    mass_kg = mass_properties(vehicle.model).mass_kg
    radius_m = np.array([run[f"{corner}_loaded_radius_m"] for corner in CORNERS])
    inertia_kgm2 = np.array(vehicle.brakes[0]["inertia_kgm2"][0])
    kinetic_J = 0.5 * mass_kg * run["speed_mps"] ** 2 + 0.5 * (inertia_kgm2[:, None] * speeds**2).sum(axis=0)
    force_N = np.array([run[f"{corner}_tyre_fx_N"] for corner in CORNERS])
    rolling_Nm = np.array([run[f"{corner}_tyre_my_Nm"] for corner in CORNERS])
    side_W = [-run[f"{c}_tyre_fy_N"] * np.tan(run[f"{c}_slip_angle_rad"]) * run["vx_mps"] for c in CORNERS]
    tyre_W = (force_N * (radius_m * speeds - run["vx_mps"]) - rolling_Nm * speeds + side_W).sum(axis=0)
    air = vehicle.parameters.aerodynamics
    air_W = 0.5 * air.air_density_kgpm3 * air.drag_area_m2 * run["speed_mps"] ** 3
    brake_W = 4.0 * vehicle.parameters.brakes.drag_torque_Nm * speeds.mean(axis=0)
    to_wheels_J = wheel_W.sum() * DT_S
    lost_J = (tyre_W + air_W + brake_W).sum() * DT_S
    assert to_wheels_J == pytest.approx(kinetic_J[-1] - kinetic_J[0] + lost_J, rel=1e-2)
    # From the battery to the road in one sum.
    total_J = kinetic_J[-1] - kinetic_J[0] + lost_J + loss_W.sum() * DT_S + (len(places) * idle_W + auxiliary_W) * 3.0
    assert energy_J == pytest.approx(total_J, rel=1e-2)
