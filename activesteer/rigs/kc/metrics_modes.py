"""Metrics of the standing car on its tyres: natural frequencies, damping, lean. Each docstring is the definition."""

from __future__ import annotations

import math

import numpy as np

from activesteer.conventions import GRAVITY_MPS2
from activesteer.rigs.kc.definitions import DEFINITIONS, Axle, AxleName, Definition, metric
from activesteer.rigs.kc.modes import NAMES


def _enter_modes() -> None:
    words = {
        "body_bounce": "the body going up and down",
        "body_pitch": "the body pitching",
        "body_roll": "the body rolling, tyres holding the road sideways",
        "wheel_hop_front": "both front wheels going up and down together",
        "wheel_hop_rear": "both rear wheels going up and down together",
        "tramp_front": "the front wheels going up and down against each other",
        "tramp_rear": "the rear wheels going up and down against each other",
    }
    for name in NAMES:
        axle: AxleName = "front" if name.endswith("_front") else "rear" if name.endswith("_rear") else "car"
        short = name.removesuffix("_front").removesuffix("_rear")

        def frequency(axle: Axle, name: str = name) -> float:
            return axle.measured.modes.by_name[name].frequency_Hz

        def damping(axle: Axle, name: str = name) -> float:
            return axle.measured.modes.by_name[name].damping_ratio

        text = f"Eigenvalue of the linearised standing car on its tyres: {words[name]}."
        DEFINITIONS.append(Definition(f"{short}_frequency", "Hz", (axle,), f"Magnitude over 2 pi. {text}", frequency))
        DEFINITIONS.append(Definition(f"{short}_damping", "-", (axle,), f"Damping ratio. {text}", damping))


_enter_modes()


@metric("Hz", "car")
def body_roll_frequency_sliding(axle: Axle) -> float:
    """Natural frequency of body roll with tyres that slide sideways without resistance, as on air bearings."""
    return axle.measured.modes.body_roll_sliding.frequency_Hz


@metric("deg/g", "car")
def roll_gradient(axle: Axle) -> float:
    """Roll angle per lateral acceleration of the standing car on its tyres, linearised (ISO 4138 drives)."""
    return math.degrees(axle.measured.modes.roll_gradient_radps2pm) * GRAVITY_MPS2


@metric("deg/g", "car")
def braking_pitch_gradient(axle: Axle) -> float:
    """Pitch angle per deceleration, positive nose down, linearised, with the brake distribution at full pedal."""
    return math.degrees(axle.measured.modes.pitch_gradient_radps2pm) * GRAVITY_MPS2


@metric("-")
def damper_asymmetry(axle: Axle) -> float:
    """Force of the damper in rebound over the force in bump, at 0.3 m/s."""
    dampers = axle.measured.parameters.dampers
    curve = dampers.front if axle.name == "front" else dampers.rear
    bump, rebound = (abs(float(np.interp(speed, curve.velocity_mps, curve.force_N))) for speed in (0.3, -0.3))
    return rebound / bump if bump > 0.0 else math.inf
