"""Comparison of the rolling car with the reference: loads, attitude, toe, camber, tyre forces."""

from __future__ import annotations

import math
from typing import Final

import mujoco
import numpy as np

from activesteer.core.conventions import CORNERS
from activesteer.core.signals import ActuatorCommand, DriverCommand
from activesteer.vehicle import Vehicle, engine_warnings_held
from tests.reference.chrono.comparison import Comparison, absolute, relative
from tests.reference.chrono.reference import ReferenceData

_ROLLING_S: Final = 4.0
_TOLERANCES: Final = {
    "reference_height": ("m", 1e-3),
    "pitch": ("deg", 0.03),
    "toe_in": ("deg", 0.03),
    "camber": ("deg", 0.03),
    "travel": ("mm", 0.5),
    "spring_length": ("mm", 0.3),
    "half_track": ("mm", 0.15),
}
"""Quantity -> unit and tolerance of the difference; other quantities have a tolerance of the relative error."""
_FRACTIONS: Final = {"load": 0.01, "side_force_inwards": 0.02}


def compare_static(vehicle: Vehicle, data: ReferenceData) -> list[Comparison]:
    """Compare the car rolling straight ahead, averaged over left and right.

    Args:
        vehicle: The car; its state afterwards is that of the last run.
        data: The reference.

    Returns:
        The comparisons, at each speed of the reference.
    """
    rows: dict[str, dict[str, float]] = {}
    for row in data.texts("static"):
        rows.setdefault(row["speed_kmh"], {})[row["quantity"]] = float(row["value"])
    units = {row["quantity"]: row["unit"] for row in data.texts("static")}
    comparisons = []
    for speed_kmh, theirs in rows.items():
        ours = _rolling(vehicle, float(speed_kmh) / 3.6)
        run = f"static_{speed_kmh}kmh"
        for quantity, reference in theirs.items():
            kind = quantity.removeprefix("front_").removeprefix("rear_")
            if kind in _FRACTIONS:
                comparisons.append(
                    relative(run, quantity, units[quantity], ours[quantity], reference, _FRACTIONS[kind])
                )
            else:
                tolerance = _TOLERANCES[kind][1]
                comparisons.append(absolute(run, quantity, units[quantity], ours[quantity], reference, tolerance))
    return comparisons


def _rolling(vehicle: Vehicle, speed_mps: float) -> dict[str, float]:
    vehicle.start(speed_mps)
    straight, nothing = DriverCommand(), ActuatorCommand()
    with engine_warnings_held():
        for _ in range(round(_ROLLING_S / vehicle.timestep_s)):
            vehicle.step(straight, nothing)
    vehicle.check()
    model, data = vehicle.model, vehicle.data
    mujoco.mj_forward(model, data)
    # The channels of one row, from the sensors and the callback at this instant.
    rows = vehicle.rows.empty(1)
    for row, live in zip(rows, vehicle.rows.live(), strict=True):
        row[0] = live
    values = vehicle.channels.evaluate(rows)
    channel = {entry.name: float(values[0, index]) for index, entry in enumerate(vehicle.channels.channels)}
    chassis = model.body("chassis").id
    rotation = data.xmat[chassis].reshape(3, 3)
    found = {
        "reference_height": float(data.xpos[chassis, 2]),
        "pitch": math.degrees(-math.asin(rotation[2, 0])),
    }
    for axle, corners in (("front", CORNERS[:2]), ("rear", CORNERS[2:])):
        sides: dict[str, list[float]] = {}
        for corner, side in zip(corners, (1.0, -1.0), strict=True):
            wheel = data.xmat[model.body(f"{corner}_wheel").id].reshape(3, 3)[:, 1]
            centre = rotation.T @ (data.xpos[model.body(f"{corner}_wheel").id] - data.xpos[chassis])
            tendon = model.tendon(f"{corner}_spring").id
            for key, value in {
                "load": channel[f"{corner}_tyre_fz_N"],
                "toe_in": -side * math.degrees(math.atan2(-wheel[0], wheel[1])),
                "camber": -side * math.degrees(math.asin(wheel[2])),
                "travel": 1e3 * channel[f"{corner}_travel_m"],
                "spring_length": 1e3 * float(data.ten_length[tendon]),
                "half_track": 1e3 * side * float(centre[1]),
                "side_force_inwards": -side * channel[f"{corner}_tyre_fy_N"],
            }.items():
                sides.setdefault(key, []).append(value)
        found |= {f"{axle}_{key}": float(np.mean(both)) for key, both in sides.items()}
    return found
