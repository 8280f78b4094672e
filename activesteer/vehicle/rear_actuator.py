"""The rear steering actuator in a vehicle file: the model's hinges, or screws in the toe links.

The presets of the screws are classes of actuators, not products. Published data of products (angles, arrangement, kind
of screw) are in docs/actuators.md; forces, speeds, motors and friction are assumptions for the class.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, Final, Literal, Self

from activesteer.config import Range
from activesteer.vehicle.electric_actuator import ElectricActuator

_HINGE: Final = "hinge"


@dataclass(frozen=True)
class RearActuator(ElectricActuator):
    """The rear steering actuator. With `hinge` the other keys have no effect."""

    preset: Literal["hinge", "screw_3deg", "screw_10deg"] = "hinge"
    """`hinge`: the model's own; `screw_3deg`, `screw_10deg`: screws in the toe links, with the keys below as overrides.
    """
    arrangement: Literal["per_side", "central"] | None = None
    """One actuator at each side, or one in the middle that moves both toe links."""
    limit_rad: Annotated[float, Range(math.radians(0.5), math.radians(15.0))] | None = None
    """Largest wheel angle to either side as a demand; the end stops lie 3 % beyond [rad]."""
    lead_m: Annotated[float, Range(1e-4, 0.05)] | None = None
    """Travel per turn of the screw [m]."""
    screw_stiffness_Npm: Annotated[float, Range(1e5, 1e10)] | None = None
    """Nut, thread, bearing and housing, in series with the link [N/m]."""
    backlash_m: Annotated[float, Range(0.0, 5e-3)] | None = None
    """Free play between link and screw, from end to end [m]."""
    position_tolerance_m: Annotated[float, Range(0.0, 1e-3)] | None = None
    """Error of the screw's position at which the motor is switched off, if the screw then holds by itself [m]."""

    def __post_init__(self) -> None:
        """Refuse a key without effect.

        Raises:
            ParameterError: a key of screws is given for the hinge.
        """
        if self.preset == _HINGE:
            self.refuse_keys("has no effect on the hinge, whose numbers are in the model; preset screw_3deg is a screw")

    @property
    def is_screw(self) -> bool:
        """True if screws move the toe links."""
        return self.preset != _HINGE

    @property
    def is_central(self) -> bool:
        """True if one screw in the middle moves both toe links."""
        return self.is_screw and self.resolved().arrangement == "central"

    def smooth(self) -> Self:
        """Return it without play, dry friction and position tolerance, within which slopes mean nothing."""
        if not self.is_screw:
            return self
        return replace(self, backlash_m=0.0, friction_torque_Nm=0.0, load_friction=0.0, position_tolerance_m=0.0)

    def resolved(self) -> Self:
        """Return it with the preset's value for every missing key."""
        return self.filled(PRESETS[self.preset])


_COMMON: Final = {
    # Assumptions [K]: nut, thread and two axial bearings in a light-metal housing; some hundredths of play when new;
    # 13 V on board; loops of 8 Hz, the bandwidth that series actuators are said to have.
    "screw_stiffness_Npm": 5e7,
    "backlash_m": 3e-5,
    "nominal_voltage_V": 13.0,
    "supply_voltage_V": 13.0,
    "position_gain_1ps": 50.0,
    "speed_gain_1ps": 200.0,
    "position_tolerance_m": 2e-5,
}
PRESETS: Final = {
    # 3 deg and a concentric motor on a screw: BMW Integral Active Steering (FISITA F2008-03-047). One a side, or
    # central: ZF AKC. Trapezoidal thread, self-locking (as Schaeffler says of what its planetary roller screw
    # replaces): 3 mm of lead on 20 mm, friction 0.1 on 15 deg flanks: 0.10 / 0.048 = 2.2. The motor is an assumption:
    # 250 W; 100 rad/s are 12 deg/s at the compact, whose toe link steers by an arm of 0.22 m.
    "screw_3deg": {
        **_COMMON,
        "arrangement": "per_side",
        "limit_rad": math.radians(3.0),
        "lead_m": 3e-3,
        "gear": 1.0,
        "friction_torque_Nm": 0.15,
        "load_friction": 2.2,
        "rotor_inertia_kgm2": 6e-5,
        "peak_torque_Nm": 4.0,
        "stall_torque_Nm": 7.0,
        "no_load_speed_radps": 250.0,
        "speed_limit_radps": 100.0,
        "supply_power_W": 250.0,
    },
    # 10 deg by motor, belt and spindle, one for the axle: Mercedes EQS and S (group-media.mercedes-benz.com). Belt 2.5,
    # lead 5 mm on 22 mm, friction 0.1: 0.10 / 0.072 = 1.4. The motor is an assumption: 500 W, 16 deg/s
    # at the compact.
    "screw_10deg": {
        **_COMMON,
        "arrangement": "central",
        "limit_rad": math.radians(10.0),
        "lead_m": 5e-3,
        "gear": 2.5,
        "friction_torque_Nm": 0.10,
        "load_friction": 1.4,
        "rotor_inertia_kgm2": 8e-5,
        "peak_torque_Nm": 4.5,
        "stall_torque_Nm": 10.0,
        "no_load_speed_radps": 420.0,
        "speed_limit_radps": 200.0,
        "supply_power_W": 500.0,
    },
}
"""Preset -> defaults of its keys."""
