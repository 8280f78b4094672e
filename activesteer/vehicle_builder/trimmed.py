"""Values from the standing car: spring forces, wheel angles, stops, dampers, pinion, chassis."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from activesteer.vehicle.curve_axles import AxleCurves
from activesteer.vehicle_builder.design import Solid


@dataclass
class TrimmedAxle:
    """One axle; values of the left side."""

    spring_rate_Npm: float = 25000.0
    spring_force_N: float = 4000.0
    """Spring force in the design position [N]."""
    wheel_x_rad: float = 0.0
    """First Euler angle of the wheel: minus camber, less the contribution of the loaded links."""
    wheel_z_rad: float = 0.0
    """Third Euler angle of the wheel: minus toe-in, less the contribution of the loaded links."""
    mount_m: dict[str, float] = field(default_factory=dict)
    """Spring length of the top mount in each direction; the standing car's load closes it [m]."""
    bump_stop_m: float = 0.035
    """Compression of the damper to its bump stop."""
    rebound_stop_m: float = 0.065
    stop_stiffness: tuple[float, ...] = (40000.0, 2.4e6, 9e7)
    """a, b, c of the force a x + b x2 + c x3 [N/m, N/m2, N/m3]."""
    friction_N: float = 0.0
    """Dry friction of the damper."""
    damper_velocity_mps: tuple[float, ...] = (-1.0, 0.0, 1.0)
    damper_force_N: tuple[float, ...] = (-1900.0, 0.0, 1900.0)
    curves: AxleCurves | None = None
    """Curves of a guided axle that give the measured curves on the rig, under load."""


@dataclass
class Trimmed:
    """Result of the trim."""

    front: TrimmedAxle = field(default_factory=TrimmedAxle)
    rear: TrimmedAxle = field(default_factory=TrimmedAxle)
    pinion_radius_m: float = 0.0075
    """Rack travel per angle of the steering wheel [m/rad]."""
    ratio: float = 16.0
    """Steering wheel angle over mean steer angle."""
    chassis: Solid = field(
        default_factory=lambda: Solid(1200.0, np.array([-1.1, 0.0, 0.55]), np.array([450.0, 1800.0, 1850.0]))
    )
    cg_m: tuple[float, float] = (-1.2, 0.55)
    """x and height of the whole car's centre of gravity."""

    def axle(self, name: str) -> TrimmedAxle:
        """Return the axle `front` or `rear`."""
        return self.front if name == "front" else self.rear
