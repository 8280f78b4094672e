"""Conventions in which programs with the same tyre file differ, because the file leaves them open.

A .tir file holds coefficients, not a program. The defaults are the conventions of this package. The alternatives are
those of other codes, so that a car can be compared with one of theirs, force by force.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from activesteer.errors import ParameterError, nearest_names

_CHOICES: Final = {
    "combined_slip": ("weights", "friction_ellipse"),
    "friction_scales": ("formula", "peaks"),
    "slip_velocity": ("contact_point", "wheel_centre"),
    "rolling_radius": ("file", "third_of_deflection"),
    "trail_load": ("nominal", "scaled"),
}
"""Allowed words of a key. The first is the default, the second is 1 in the tyre's record."""


@dataclass(frozen=True)
class TyreConventions:
    """Evaluation of a tyre's coefficients; keys of the table [tyres.conventions] in a vehicle file."""

    camber: bool = True
    """Whether camber enters the formula. Without it, camber still acts by geometry: contact point and direction of
    forces."""
    relaxation: bool = True
    """Whether slip builds up over the relaxation length. Without it, forces follow slip within 20 mm of road, except at
    walking speed, where the standing tyre needs its carcass."""
    combined_slip: str = "weights"
    """`weights`: the cosine functions of the formula, which are 1 without R.. coefficients in the file;
    `friction_ellipse`: longitudinal and lateral force scaled down to an ellipse by the ratio of the slips."""
    friction_scales: str = "formula"
    """Effect of the road's friction. `formula`: it scales all that LMUX and LMUY scale. `peaks`: it scales the peaks
    D_x and D_y only, not shifts, trail and residual moment."""
    slip_velocity: str = "contact_point"
    """Point whose lateral velocity is the slip: `contact_point` (with a part from the camber rate) or `wheel_centre`.
    """
    rolling_radius: str = "file"
    """Effective rolling radius. `file`: from BREFF, DREFF, FREFF. `third_of_deflection`: R_0 less a third of the
    deflection."""
    trail_load: str = "nominal"
    """Reference load of the pneumatic trail. `nominal`: FNOMIN. `scaled`: LFZO FNOMIN."""
    speed_offset_mps: float = 0.0
    """Speed added to the divisor of slip velocities [m/s], against division by zero; 0.1 m/s makes slips 0.45 % smaller
    at 80 km/h."""
    reference_friction: float = 1.0
    """Friction of the road to which the file's peaks belong. The road's friction is divided by it [-]."""

    def __post_init__(self) -> None:
        """Check the values."""
        for key, words in _CHOICES.items():
            if (word := getattr(self, key)) not in words:
                raise ParameterError(f"there is no {word!r}; {nearest_names(str(word), words)}", key=key, value=word)
        if not 0.0 <= self.speed_offset_mps <= 1.0:
            raise ParameterError(
                f"{self.speed_offset_mps:g} m/s is outside 0 to 1 m/s",
                key="speed_offset_mps",
                value=self.speed_offset_mps,
            )
        if not 0.1 <= self.reference_friction <= 2.0 or not math.isfinite(self.reference_friction):
            raise ParameterError(
                f"{self.reference_friction:g} is outside 0.1 to 2",
                key="reference_friction",
                value=self.reference_friction,
            )

    def numbers(self) -> dict[str, float]:
        """Numbers for the kernels, by field of the tyre's record."""
        second = {key: float(getattr(self, key) == words[1]) for key, words in _CHOICES.items()}
        return {
            "CAMBER_OFF": float(not self.camber),
            "RELAXATION_OFF": float(not self.relaxation),
            "FRICTION_ELLIPSE": second["combined_slip"],
            "SCALE_PEAKS_ONLY": second["friction_scales"],
            "SLIP_AT_CENTRE": second["slip_velocity"],
            "RADIUS_BY_DEFLECTION": second["rolling_radius"],
            "TRAIL_BY_SCALED_LOAD": second["trail_load"],
            "SPEED_OFFSET": self.speed_offset_mps,
            "REFERENCE_FRICTION": self.reference_friction,
        }
