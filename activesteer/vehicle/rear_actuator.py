"""The rear steering actuator in a vehicle file: the model's hinges, or screws in the toe links."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, Final, Literal, Self

from activesteer.config import Range
from activesteer.vehicle.electric_actuator import ElectricActuator, presets_of

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
        """Refuse a key without effect."""
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


PRESETS: Final = presets_of(RearActuator, "rear_actuator")
"""Preset -> defaults of its keys."""
