"""Properties of a car that estimators know: those of its files, without load and other changes."""

from __future__ import annotations

from typing import Final

import numpy as np

from activesteer.conventions import GRAVITY_MPS2
from activesteer.estimation import EstimatorSetup, KnownTyre
from activesteer.estimation.setup import GRID
from activesteer.scenario.car import CarSpec
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.tyre_parameters import TyreParameters

_LARGEST_SLIP_ANGLE_RAD: Final = np.radians(20.0)
"""Largest slip angle of the grid; beyond it the force stays constant [rad]."""
_LARGEST_LOAD: Final = 3.0
"""Largest load of the grid over the static load; beyond it the force stays constant."""
_SPEED_MPS: Final = 20.0
"""Speed at which the tyres are evaluated [m/s]."""


def estimator_setup(car: CarSpec) -> EstimatorSetup | None:
    """Return the properties that estimators may know; None if the vehicle file has no table [two_track]."""
    config, body = car.config, car.config.single_track
    if config.two_track is None:
        return None
    per_metre = 0.5 * body.mass_kg * GRAVITY_MPS2 / body.wheelbase_m
    loads_N = per_metre * body.cg_to_rear_m, per_metre * body.cg_to_front_m
    front, rear = (_known(*pair) for pair in zip(car.new_tyres, loads_N, strict=True))
    pressure_Pa = config.brakes.hydraulics.full_pedal_pressure_Pa
    fl, fr, rl, rr = (torque_Nm / pressure_Pa for torque_Nm in config.brakes.torques_Nm)
    air = config.aerodynamics
    return EstimatorSetup(
        body, config.two_track, config.steering.ratio, (front, rear), config.powertrain.wheel_fractions,
        (fl, fr, rl, rr), 0.5 * air.air_density_kgpm3 * air.drag_area_m2, config.sensors,
    )  # fmt: skip


def _known(parameters: TyreParameters, load_N: float) -> KnownTyre:
    """Evaluate a tyre with this static load."""
    tyre = MagicFormula(parameters)
    loads_N, angles_rad = map(np.linspace, (0.0, 0.0), (_LARGEST_LOAD * load_N, _LARGEST_SLIP_ANGLE_RAD), GRID)
    left, right = (
        tyre.evaluate(loads_N[:, np.newaxis], 0.0, sign * angles_rad, vx_mps=_SPEED_MPS).fy_N for sign in (-1.0, 1.0)
    )
    force_N = tuple(map(tuple, (0.5 * (left - right)).tolist()))
    standing = tyre.evaluate(load_N, 0.0, 0.0, vx_mps=_SPEED_MPS)
    return KnownTyre(
        float(angles_rad[1]), float(loads_N[1]), force_N, float(standing.relaxation_length_y_m),
        float(standing.slip_stiffness_N) / load_N, float(standing.effective_radius_m),
    )  # fmt: skip
