"""Constants and state of the native brakes: records of float64, at addresses that stay."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.brakes.parameters import Antilock, Brakes, Hydraulics, TractionControl
from activesteer.conventions import CORNERS
from activesteer.native_records import numbers_type

_HYDRAULICS: Final = ("full_pedal_pressure_Pa", "dead_travel", "rise_Paps", "fall_Paps", "pump_rise_Paps")
_ANTILOCK: Final = tuple(Antilock.__dataclass_fields__)
_OF_WHEELS: Final = (
    "rolling_radius_m", "torque_per_pressure_NmpPa", "parking_torque_Nm", "drive_fraction", "inertia_kgm2",
    "differential",
)  # fmt: skip
_TRACTION: Final = tuple(TractionControl.__dataclass_fields__)

BRAKE_SETUP: Final = numbers_type(
    *_HYDRAULICS, *_ANTILOCK, *_TRACTION, "timestep_s", "follow", "abs", "tcs", "interval_steps", "interval_s",
    *((name, len(CORNERS)) for name in _OF_WHEELS),
)  # fmt: skip
"""Constants of a run; names as in the vehicle file. `follow` is the fraction of the difference between pressure and
demand that closes in one step."""

PER_WHEEL: Final = (
    "demand_Pa", "pressure_Pa", "limit_Pa", "allowed_Pa", "traction_Pa", "phase", "phase_s", "friction_Nm",
    "borne_Nm", "mean_Nm", "regained_mps2", "wheel_mps", "wheel_mps2",
)  # fmt: skip
ALONE: Final = (
    "drive_limit_Nm", "traction_Nm", "reference_mps", "offset_mps2", "side_Pa", "steps_left",
    "tcs_active",
)  # fmt: skip
BRAKE_STATE: Final = numbers_type(*((name, len(CORNERS)) for name in PER_WHEEL), *ALONE)
"""Variables, saved and restored with the engine's state.

demand_Pa: pressure that driver and controller demand;
pressure_Pa: pressure in the wheel brake; limit_Pa: anti-lock limit of the wheel by itself; allowed_Pa: limit with
regard to the other wheels; traction_Pa: demand of traction control; phase, phase_s: phase of the anti-lock control, see
`antilock`, and time in it; friction_Nm: torque of the road from the wheel's motion; borne_Nm: last friction torque of
the wheel at its limit; mean_Nm: mean of the friction torque over some cycles; regained_mps2: largest acceleration of
the wheel in its recovery; wheel_mps, wheel_mps2: speed and acceleration of its circumference.

drive_limit_Nm: limit of the drive torque by traction control; traction_Nm: its integral; tcs_active: whether traction
control acts; reference_mps: estimated speed of the car; offset_mps2: estimated error of the acceleration; side_Pa:
allowed difference of the front wheels' pressures; steps_left: steps until the next decision.
"""

PLACES: Final = {name: len(CORNERS) * index for index, name in enumerate(PER_WHEEL)} | {
    name: len(CORNERS) * len(PER_WHEEL) + index for index, name in enumerate(ALONE)
}
"""Field of a `BRAKE_STATE` -> its (first) place among the numbers."""

NO_LIMIT_NM: Final = 1e9
"""Drive torque limit without effect [N m]."""


def brake_setup(
    brakes: Brakes,
    timestep_s: float,
    rolling_radius_m: Sequence[float],
    drive_fraction: Sequence[float],
    inertia_kgm2: Sequence[float],
    differential: Sequence[bool],
) -> NDArray[Any]:
    """Build the constants of a car's brakes.

    Args:
        brakes: The table of the vehicle file.
        timestep_s: Step of the engine [s].
        rolling_radius_m: Radius of each wheel that turns its rotation into a speed [m].
        drive_fraction: Fraction of the drive torque of each wheel.
        inertia_kgm2: Inertia of each wheel about its axis [kg m2].
        differential: Whether a differential drives the wheel.

    Returns:
        A `BRAKE_SETUP`, shape (1,).
    """
    setup = np.zeros(1, BRAKE_SETUP)
    for part, names in ((brakes.hydraulics, _HYDRAULICS), (brakes.antilock, _ANTILOCK), (brakes.traction, _TRACTION)):
        for name in names:
            setup[name] = getattr(part, name)
    hydraulics: Hydraulics = brakes.hydraulics
    steps = max(1, round(brakes.control_interval_s / timestep_s))
    setup["timestep_s"], setup["interval_steps"], setup["interval_s"] = timestep_s, steps, steps * timestep_s
    setup["follow"] = -math.expm1(-timestep_s / hydraulics.lag_s)
    setup["abs"], setup["tcs"] = brakes.abs, brakes.tcs
    setup["rolling_radius_m"] = rolling_radius_m
    setup["torque_per_pressure_NmpPa"] = np.array(brakes.torques_Nm) / hydraulics.full_pedal_pressure_Pa
    setup["parking_torque_Nm"] = (0.0, 0.0, brakes.parking_torque_Nm, brakes.parking_torque_Nm)
    setup["drive_fraction"], setup["inertia_kgm2"] = drive_fraction, inertia_kgm2
    setup["differential"] = differential
    return setup


def reset(state: NDArray[Any], setup: NDArray[Any], speed_mps: float) -> None:
    """Release the brakes of a car that rolls at a speed.

    Args:
        state: A `BRAKE_STATE`, shape (1,).
        setup: Its `BRAKE_SETUP`.
        speed_mps: Speed of car and wheels [m/s].
    """
    state[:] = 0
    state["limit_Pa"] = state["allowed_Pa"] = setup["full_pedal_pressure_Pa"]
    state["drive_limit_Nm"] = NO_LIMIT_NM
    state["wheel_mps"] = state["reference_mps"] = speed_mps
    state["steps_left"] = setup["interval_steps"]
