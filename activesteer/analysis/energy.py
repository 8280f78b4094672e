"""Energy of a run of an electric car: from its battery, in its steering actuators, and lost in its brakes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.source import RecordingLike
from activesteer.conventions import CORNERS

METRICS: Final = ("battery_energy_J", "steering_energy_J", "brake_energy_J")
"""Metrics of an electric car."""


def energy_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the energies of a run; nothing for a car without motors."""
    vehicle = recording.metadata.get("vehicle")
    if not isinstance(vehicle, Mapping) or not vehicle.get("motors"):
        return {}
    time_s = recording.time_s
    battery_J = recording["battery_energy_J"]
    brakes_W = sum(-recording[f"{c}_brake_torque_Nm"] * recording[f"{c}_wheel_speed_radps"] for c in CORNERS)
    steering_J = sum(np.trapezoid(np.maximum(power_W, 0.0), time_s) for power_W in _steering(recording, vehicle))
    return dict(
        zip(
            METRICS,
            (float(battery_J[-1] - battery_J[0]), float(steering_J), float(np.trapezoid(brakes_W, time_s))),
            strict=True,
        )
    )


def _steering(recording: RecordingLike, vehicle: Mapping[str, Any]) -> Iterator[NDArray[np.float64]]:
    """Yield the mechanical powers of the steering actuators."""
    rear = np.gradient(recording["rear_steer_rad"], recording.time_s)
    added = vehicle["steering"]["ratio"] * np.gradient(recording["superposition_rad"], recording.time_s)
    presets = vehicle["rear_actuator"], vehicle["superposition_actuator"]
    motors: list[str] = []
    if (preset := presets[0]["preset"]) == "hinge":
        yield from (recording[f"{name}_steer_torque_Nm"] * rear for name in ("rl", "rr"))
    else:
        central = presets[0].get("arrangement", "central" if preset == "screw_10deg" else "") == "central"
        motors += ["rear"] if central else ["rl", "rr"]
    if presets[1]["preset"] == "servo":
        yield recording["superposition_torque_Nm"] * added
    else:
        motors.append("superposition")
    yield from (recording[f"{name}_motor_torque_Nm"] * recording[f"{name}_motor_speed_radps"] for name in motors)
