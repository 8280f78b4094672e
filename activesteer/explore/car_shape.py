"""The shape of a car for the 3D view: triangles of its body and its wheels."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import CORNERS
from activesteer.drawing.car_model import scene_of
from activesteer.drawing.cars import CHASSIS, dressed
from activesteer.recording import Recording
from activesteer.road.course import Footprint
from activesteer.vehicle import Vehicle

BODIES: Final = (CHASSIS, *(f"{corner}_wheel" for corner in CORNERS))
"""Bodies whose poses the page gets, in this order."""
POSE_HZ: Final = 50.0
"""Rate of the poses of a recorded run [1/s]; the page interpolates between them."""


def shape_of(vehicle: Vehicle) -> tuple[dict[str, Any], list[NDArray[np.float32]]]:
    """Return the surfaces of a car."""
    size = Footprint.from_table(vehicle.dimensions())
    _, panels = dressed(scene_of(vehicle.model), size)
    shown = [panel for panel in panels if panel.body in BODIES]
    header = {
        "bodies": list(BODIES),
        "size": {"front_m": size.front_m, "rear_m": size.rear_m, "width_m": size.width_m},
        "panels": [{"body": panel.body, "rgb": panel.rgb} for panel in shown],
    }
    arrays = [
        np.asarray(values[panel.faces.reshape(-1)], np.float32)
        for panel in shown
        for values in (panel.vertices_m, panel.normals)
    ]
    return header, arrays


def poses_of(recording: Recording) -> tuple[float, NDArray[np.float32]]:
    """Return the poses of `BODIES` of a recorded run."""
    poses = recording.poses
    step_s = float(np.median(np.diff(poses.time_s))) if len(poses.time_s) > 1 else 1.0 / POSE_HZ
    every = max(1, round(1.0 / (POSE_HZ * step_s)))
    columns = [poses.names.index(name) for name in BODIES]
    both = np.concatenate([poses.positions_m[::every, columns], poses.quaternions[::every, columns]], axis=2)
    return every * step_s, both.astype(np.float32)
