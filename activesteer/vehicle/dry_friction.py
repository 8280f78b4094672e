"""Dry friction of a steering rack, and of a damper's seals on a vibrating road, compiled, on plain floats.

A guide or seal first deflects elastically, then slips: Dahl's model. Its state w is the elastic deflection, its force
-k w:

    dw/dt = v - |v| w / w_slip        w_slip = F / k

On a real road, however even, roughness keeps the dampers moving, much faster than a body rolls. Friction then acts
against the sum of both motions, and only the mean of its force acts on the slow one. For a vibration of normal
distribution with the standard deviation s, and a slow motion of speed v,

    mean of sign(v + vibration) = erf(v / (sqrt(2) s))

which at small speeds is a damper of sqrt(2/pi) F / s. (Control engineers know it as dither.) The road of this package
is perfectly even; without this mean its cars would ride on stuck dampers up to 0.1 g. So w_slip is multiplied by the
mean: friction is dry at rest and while the damper moves faster than the vibration, and smooth below.

Roughness: the velocity spectrum of a road is white and grows with the driving speed (ISO 8608), so s grows with the
root of that speed.

Source: Dahl, A solid friction model, Aerospace Corp. TOR-0158 (1968); Pervozvanski and Canudas de Wit, Asymptotic
analysis of the dither effect in systems with friction, Automatica 38 (2002).
"""

from __future__ import annotations

import math

from activesteer.compilation import compiled

_SLOW = 1e-4
"""Speed relative to the vibration's below which the error function is replaced by its tangent."""


@compiled
def friction_rate(
    deflection_m: float, speed_mps: float, vibration_mps: float, slip_m: float, timestep_s: float
) -> float:
    """Return the mean rate of the elastic deflection over a step, exact for a constant speed.

    Args:
        deflection_m: Elastic deflection w [m].
        speed_mps: Speed of the motion v [m/s].
        vibration_mps: Standard deviation of the vibration s [m/s], >= 0.
        slip_m: Deflection at which it slips F/k [m]; 0 means no friction and no deflection.
        timestep_s: Step h [s].

    Returns:
        dw/dt [m/s].
    """
    if slip_m <= 0.0:
        return -deflection_m / timestep_s
    speed = abs(speed_mps)
    if speed <= _SLOW * vibration_mps:
        per_m = math.sqrt(0.5 * math.pi) * vibration_mps
    else:
        per_m = speed if vibration_mps <= 0.0 else speed / math.erf(speed / (math.sqrt(2.0) * vibration_mps))
    decay = per_m / slip_m * timestep_s
    if decay < 1e-9:
        return speed_mps
    return (speed_mps * slip_m / per_m - deflection_m) * -math.expm1(-decay) / timestep_s
