"""Contents of a recording except its rows, as needed to repeat and draw the run."""

from __future__ import annotations

import functools
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.config import is_overruled
from activesteer.controllers.find import interval_s
from activesteer.core.conventions import Array
from activesteer.core.signals import Channel
from activesteer.core.version import __version__
from activesteer.drawing.car_model import scene_of
from activesteer.plugins import Plugin
from activesteer.recording import McapWriter, Poses, Recording, ScenePart
from activesteer.road.drawn import DrawnSurface, places_to_draw
from activesteer.road.surface import surface_of
from activesteer.scenario.scenario import Scenario, describe
from activesteer.tyre.evaluation import MagicFormula
from activesteer.vehicle import Vehicle

_BEYOND_M: Final = 30.0
"""Length of road that is drawn beyond the distance at the speed of the manoeuvre [m]."""


class RunContext(NamedTuple):
    """Contents of a recording except its rows."""

    channels: tuple[Channel, ...]  # the table of channels
    body_names: tuple[str, ...]  # bodies whose poses are recorded
    metadata: dict[str, Any]  # resolved parameters, versions
    files: dict[str, bytes]  # manoeuvre, vehicle, model and tyre files, and the code of a user's controller and driver
    scene: tuple[ScenePart, ...]  # appearance of the car

    @classmethod
    def of(cls, scenario: Scenario, vehicle: Vehicle, controller: Plugin) -> RunContext:
        """Return the context of a run of a scenario, before the run."""
        own_s = interval_s(controller, scenario.car.config.controllers, vehicle.timestep_s)
        metadata = {
            "controller": controller.name,
            **(
                {"controller_parameters": values}
                if (values := controller.parameters_with(scenario.user_parameters))
                else {}
            ),
            **describe(scenario),
            **({"controller_uses_truth": True} if controller.uses_truth else {}),
            **({"controller_interval_s": own_s} if own_s != vehicle.timestep_s else {}),
            "car": vehicle.dimensions(),
            **({} if (slip_rad := slip_limit_rad(scenario)) is None else {"slip_limit_rad": slip_rad}),
            "timestep_s": vehicle.timestep_s,
            "versions": _versions(),
        }
        if (course := scenario.maneuver.course) is not None:
            metadata["course"] = course.to_table()
        road = scenario.maneuver.ground
        if road.is_uneven:
            surface = surface_of(road)
            length_m = abs(scenario.maneuver.speed_mps) * scenario.maneuver.duration_s + _BEYOND_M
            s_m, d_m = places_to_draw(road, length_m)
            places = np.meshgrid(s_m, d_m, indexing="ij")
            z_m = surface.at(*(place.ravel() for place in places))[:, 0].reshape(len(s_m), len(d_m))
            metadata["surface"] = DrawnSurface(s_m, d_m, z_m).to_table()
        files = {**scenario.files, **controller.files}
        return cls(vehicle.channels.channels, vehicle.body_names, metadata, files, scene_of(vehicle.model))

    def recording(self, time_s: Array, values: Array, poses: Poses) -> Recording:
        """Return the recording with given rows."""
        return Recording(
            self.channels, time_s, values, poses=poses, metadata=self.metadata, attachments=self.files, scene=self.scene
        )

    def writer(self, path: Path) -> McapWriter:
        """Return the writer of a new recording file, which takes the rows of the run."""
        return McapWriter(path, self.channels, self.body_names, self.metadata, self.files, self.scene)


@functools.cache
def _versions() -> dict[str, str]:
    found = {"activesteer": __version__, "python": platform.python_version(), "platform": platform.platform()}
    for package in ("mujoco", "numpy", "numba"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found


_SLIPS_RAD: Final = np.radians(np.arange(0.5, 20.0, 0.1))
"""Slip angles that are compared [rad]: beyond 15 to 20 deg, no tyre file has measured values."""
_CLEAR_DROP: Final = 0.01
"""Share by which the side force must fall behind its largest value. A flat curve has no slip angle to warn of."""
_SPEED_MPS: Final = 20.0
"""Speed of the wheel [m/s]; the side force hardly depends on it."""


def slip_limit_rad(scenario: Scenario) -> float | None:
    """Return the slip angle at which a rear tyre's side force peaks [rad], None without a clear or a single peak."""
    road = scenario.maneuver.road
    if is_overruled(road, "mu") or road.patches:
        return None
    tyre, load_N = scenario.car.tyres[1], scenario.car.config.single_track.wheel_loads_N[1]
    friction = road.mu / tyre.conventions.reference_friction
    forces = MagicFormula(tyre).evaluate(load_N, 0.0, _SLIPS_RAD, vx_mps=_SPEED_MPS, road_friction=friction)
    force_N = np.abs(forces.fy_N)
    largest = int(np.argmax(force_N))
    clear = force_N[-1] < (1.0 - _CLEAR_DROP) * force_N[largest]
    return float(_SLIPS_RAD[largest]) if clear else None
