"""The table [brakes] of a vehicle file, and the records of the native brakes.

The records of float64 stay at their addresses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Range
from activesteer.core.conventions import CORNERS
from activesteer.native.records import numbers_type

NotNegative = Annotated[float, Range(0.0)]
Positive = Annotated[float, Range(1e-9)]
Fraction = Annotated[float, Range(0.0, 1.0)]


@dataclass(frozen=True)
class Hydraulics:
    """Pedal travel and pressures of the wheel brakes, all of them assumptions."""

    full_pedal_pressure_Pa: Annotated[float, Range(1e6, 3e7)] = 10e6
    """Pressure at full pedal, and the pump's highest pressure [Pa]."""
    dead_travel: Annotated[float, Range(0.0, 0.9)] = 0.0
    """Pedal position up to which no pressure builds up: play, clearance of the pads, cut-off holes [-]. With 0 the
    pedal position is the fraction of the pressure, as the manoeuvre files state it."""
    rise_Paps: Annotated[float, Range(1e6, 1e9)] = 100e6
    """Fastest rise while the pedal feeds the wheel [Pa/s]: booster and inlet valve, 0 to 100 bar in 0.1 s."""
    fall_Paps: Annotated[float, Range(1e6, 1e9)] = 100e6
    """Fastest fall through the outlet valve [Pa/s]."""
    pump_rise_Paps: Annotated[float, Range(1e6, 1e9)] = 30e6
    """Fastest rise beyond the pedal's pressure, by the pump of a stability control [Pa/s]."""
    lag_s: Annotated[float, Range(0.001, 0.5)] = 0.008
    """Time constant of the pressure relative to its demand: valves, lines, clearance of the pads [s]."""


@dataclass(frozen=True)
class Antilock:
    """Parameters of the anti-lock system (see `antilock`)."""

    select_low: bool = True
    """True if both rear wheels get the pressure of the wheel with less grip."""
    hold_speed_mps: Annotated[float, Range(0.5, 20.0)] = 5.0
    """Speed below which pressures are held and only slip releases a wheel [m/s]; a tyre of 0.4 m relaxation length
    then takes more than 0.08 s to build up its force."""
    hold_slip_mps: NotNegative = 0.3
    """Speed difference added to the largest slip below this speed, by which the estimated speed may be off [m/s]."""
    hold_rise_per_s: NotNegative = 0.03
    """Rate of the held pressure, as a fraction of the last limit per second [1/s]."""
    lowest_speed_mps: Annotated[float, Range(0.1, 10.0)] = 0.5
    """Speed below which the system hands the brakes over to the driver [m/s]."""
    hand_over_Paps: NotNegative = 4e6
    """Rate at which the pressures then rise to the driver's demand [Pa/s]."""
    first_deceleration_mps2: Positive = 20.0
    """Deceleration of a wheel relative to the car that releases it while the pedal is being pressed [m/s2]. The fastest
    rise of pressure causes 14 m/s2 at 100 km/h by the slip that it needs, without any risk of locking."""
    first_slip: Fraction = 0.08
    """Smallest slip for this release; below it the pedal or the road causes the deceleration."""
    deceleration_mps2: Positive = 6.0
    """Deceleration relative to the car that releases a wheel while pressure builds up slowly [m/s2]."""
    min_slip: Fraction = 0.02
    """Smallest slip for this release on a road without grip."""
    min_slip_gain_s2pm: NotNegative = 0.005
    """Rise of this slip with the deceleration of the car, as the slip at the peak of friction rises [s2/m]."""
    min_slip_speed_mps: NotNegative = 0.1
    """Speed difference added to this slip, which counts at low speed, where the speed estimate is uncertain [m/s]."""
    largest_slip: Annotated[float, Range(0.05, 0.9)] = 0.3
    """Slip relative to the estimated speed that releases a wheel in any case."""
    intervention_slip: Annotated[float, Range(0.05, 0.9)] = 0.5
    """Slip that releases a front wheel which a controller brakes beyond the pedal. A tyre at a large slip angle takes
    brake force only with a large slip, which also turns its force away from the side: both turn the car back."""
    release_fraction: Fraction = 0.9
    """Pressure of a released wheel, as a fraction of its friction torque."""
    regain_mps2: NotNegative = 10.0
    """Acceleration that a released wheel must reach [m/s2]. If it does not, as on ice, the pressure is reduced
    further."""
    rolls_fraction: Fraction = 0.5
    """Fraction of its peak acceleration below which a released wheel rolls with the car again [-]."""
    resume_fraction: Fraction = 0.97
    """Pressure of a wheel that rolls again, as a fraction of its friction torque."""
    build_per_s: Positive = 0.5
    """Initial rate of pressure from then on, as a fraction of the pressure per second [1/s]."""
    side_difference_Pa: NotNegative = 0.5e6
    """Initial limit by which a front wheel's pressure may exceed a released front wheel's on the other side [Pa]."""
    side_difference_rise_Paps: NotNegative = 4e6
    """Rate at which this limit grows, so that the driver can follow the yaw moment [Pa/s]."""
    rear_side_fraction: Fraction = 0.5
    """Fraction of the pressure difference allowed by a controller that the rear wheels get too: a rear axle braked to
    its limit has no lateral force."""


@dataclass(frozen=True)
class TractionControl:
    """Slip limits of traction control by engine and brakes."""

    slip: Annotated[float, Range(0.005, 0.5)] = 0.05
    """Allowed slip, relative to the speed of the wheels that are not driven."""
    spin_mps: Annotated[float, Range(0.05, 5.0)] = 0.6
    """Speed difference that is allowed in addition to this slip [m/s]."""
    engine_gain_Nmspm: NotNegative = 400.0
    """Proportional reduction of the drive torque per excess speed [Nm/(m/s)]."""
    engine_integral_gain_Nmpm: NotNegative = 1500.0
    """Integral reduction of the drive torque per excess speed and second [Nm/m]."""
    brake_gain_Paspm: NotNegative = 1.5e6
    """Pressure at a driven wheel per speed above the speed of its axle's other wheel [Pa/(m/s)]."""
    brake_limit_Pa: NotNegative = 6e6
    """Highest pressure that traction control applies [Pa]."""


@dataclass(frozen=True)
class Brakes:
    """Friction brakes: torque per wheel at full pedal, and the stiffness of pads and caliper in their holder."""

    front_torque_Nm: NotNegative
    """Torque of a front wheel at full pedal; divided by the pressure there, it is the torque per pressure [N m]."""
    rear_torque_Nm: NotNegative
    """Torque of a rear wheel at full pedal. Both torques together set the balance [N m]."""
    drag_torque_Nm: NotNegative = 0.0
    """Dry friction of released pads, bearings and seals, per wheel [N m]."""
    stiffness_Nmprad: Positive = 1e5
    """Torque per angle of wind-up while the brake holds [N m/rad]."""
    parking_torque_Nm: NotNegative = 700.0
    """Torque of a rear wheel with the parking brake fully applied, by cable or spindle, without pressure [N m]."""
    hydraulics: Hydraulics = Hydraulics()
    """Hydraulics of the pedal and the wheel brakes."""
    control_interval_s: Annotated[float, Range(0.001, 0.02)] = 0.005
    """Interval of the decisions of anti-lock and traction control [s]."""
    abs: bool = True
    """True if the anti-lock system is on. It is inactive while no wheel is close to locking."""
    tcs: bool = False
    """True if traction control is on."""
    antilock: Antilock = Antilock()
    """Settings of the anti-lock system."""
    traction: TractionControl = TractionControl()
    """Settings of traction control."""

    @property
    def torques_Nm(self) -> tuple[float, float, float, float]:
        """Torques of the wheels at full pedal [N m], in the order of `CORNERS`."""
        return self.front_torque_Nm, self.front_torque_Nm, self.rear_torque_Nm, self.rear_torque_Nm


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
_ALONE: Final = (
    "drive_limit_Nm", "traction_Nm", "reference_mps", "offset_mps2", "side_Pa", "steps_left",
    "tcs_active",
)  # fmt: skip
BRAKE_STATE: Final = numbers_type(*((name, len(CORNERS)) for name in PER_WHEEL), *_ALONE)
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

PLACES: Final = {name: place[1] // 8 for name, place in (BRAKE_STATE.fields or {}).items()}
"""First place of each field of a `BRAKE_STATE` among its numbers."""

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
    """Return the constants of a car's brakes as a `BRAKE_SETUP` record, with rows in the order of `CORNERS`."""
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
    """Reset a `BRAKE_STATE` record to released brakes in a car that rolls at a speed."""
    state[:] = 0
    state["limit_Pa"] = state["allowed_Pa"] = setup["full_pedal_pressure_Pa"]
    state["drive_limit_Nm"] = NO_LIMIT_NM
    state["wheel_mps"] = state["reference_mps"] = speed_mps
    state["steps_left"] = setup["interval_steps"]
