"""Search for the single-track model of a car by driving it: two tests at constant speed, in the linear range.

Mass, yaw inertia and axle distances are those of the model at static ride; see `studies.linear.identification`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.analysis.handling import CarGeometry, Handling, evaluate
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import GRAVITY_MPS2
from activesteer.errors import ModelError
from activesteer.scenario import Car, FileOrTable, Scenario, resolve
from activesteer.theory.single_track import IDENTIFIED, SingleTrackParameters, characteristic_speed
from activesteer.vehicle.mass_properties import mass_properties

Run = Callable[[Scenario], RecordingLike]
"""Function that runs a scenario; an argument, because the runner itself calls this module."""

CONSTANT_SPEED_TESTS: Final = {"80 km/h": 80.0, "100 km/h": 100.0}
"""Tests at constant speed that give the single-track model: name -> speed [km/h]."""
_LINEAR: Final = {"duration_s": 12.0, "steer.end_deg": 50.0}
"""Overrides that limit a test at constant speed to the linear range."""


class Body(NamedTuple):
    """Mass properties of the whole car at static ride.

    Attributes:
        mass_kg: Mass [kg].
        yaw_inertia_kgm2: Inertia about the vertical axis through the centre of gravity [kg m2].
        cg_to_front_m: l_V [m].
        cg_to_rear_m: l_H [m].
    """

    mass_kg: float
    yaw_inertia_kgm2: float
    cg_to_front_m: float
    cg_to_rear_m: float


def linear_tests(vehicle: FileOrTable, overrides: Mapping[str, Any] | None = None) -> list[Scenario]:
    """Return the tests at constant speed, limited to the linear range."""
    return [
        resolve("slowly_increasing_steer", vehicle, {**(overrides or {}), **_LINEAR, "speed_kmh": speed})
        for speed in CONSTANT_SPEED_TESTS.values()
    ]


def single_track_of(scenarios: list[Scenario], run: Run) -> SingleTrackParameters:
    """Return the single-track model that fits the car in the tests."""
    body = body_of(scenarios[0].car)
    return fitted(body, [handling_in(scenario, body, run) for scenario in scenarios])


def with_identified_single_track(scenario: Scenario, run: Run) -> Scenario:
    """Return the scenario with the single-track model of the car as it is, including its load.

    Raises:
        ModelError: the car oversteers, so it has no characteristic speed.
    """
    car = scenario.car
    single_track = single_track_of([replace(test, car=car) for test in linear_tests("compact")], run)
    return replace(scenario, car=replace(car, config=replace(car.config, single_track=single_track)))


def body_of(car: Car) -> Body:
    """Return the mass properties of the whole car, from the model at static ride."""
    vehicle = car.on()
    body = mass_properties(vehicle.model, vehicle.data)
    front, rear = (vehicle.data.xpos[vehicle.model.body(f"{axle}l_wheel").id, 0] for axle in "fr")
    x_m = body.cg_m[0]
    return Body(body.mass_kg, float(body.inertia_kgm2[2, 2]), float(front - x_m), float(x_m - rear))


def handling_in(scenario: Scenario, body: Body, run: Run) -> Handling:
    """Return the steady-state handling of a car in a test."""
    return evaluate(
        run(scenario), CarGeometry(body.cg_to_front_m, body.cg_to_rear_m, scenario.car.config.steering.ratio)
    )


def fitted(body: Body, tests: list[Handling]) -> SingleTrackParameters:
    """Return the model with the mean slip angles and understeer of the tests at constant speed."""
    wheelbase = body.cg_to_front_m + body.cg_to_rear_m

    def mean(name: str) -> float:
        return float(np.mean([getattr(test, name) for test in tests]))

    understeer, front, rear = (mean(f"{name}_gradient_radpmps2") for name in ("understeer", "front_slip", "rear_slip"))
    if understeer <= 0.0:
        gradient_degpg = math.degrees(understeer) * GRAVITY_MPS2
        raise ModelError(
            f"the car oversteers: its understeer gradient is {gradient_degpg:.3g} deg/g, and the characteristic speed "
            "of the single-track model needs a positive gradient"
        )
    return SingleTrackParameters(
        source=IDENTIFIED,
        mass_kg=body.mass_kg,
        yaw_inertia_kgm2=body.yaw_inertia_kgm2,
        cg_to_front_m=body.cg_to_front_m,
        cg_to_rear_m=body.cg_to_rear_m,
        front_stiffness_Nprad=body.mass_kg * body.cg_to_rear_m / wheelbase / front,
        rear_stiffness_Nprad=body.mass_kg * body.cg_to_front_m / wheelbase / rear,
        characteristic_speed_mps=characteristic_speed(wheelbase, understeer),
    )
