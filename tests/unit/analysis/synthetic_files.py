"""Recordings as read from a file, made of the formulas in `synthetic`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from activesteer.core.signals import Channel
from activesteer.recording import Recording
from tests.unit.analysis.synthetic import SyntheticRun, along_path, sine_with_dwell, step_steer

CORNERS = ("fl", "fr", "rl", "rr")


def recording_of(
    run: SyntheticRun,
    controller: str = "none",
    maneuver: Mapping[str, Any] | None = None,
    metrics: Mapping[str, float] | None = None,
    **metadata: Any,
) -> Recording:
    """A recording with the channels and metadata of a synthetic run."""
    channels = [Channel(name, "", "", "vehicle", single=False) for name in run.channels]
    loads = [Channel(f"{corner}_tyre_fz_N", "N", "", "corners") for corner in CORNERS]
    values = np.column_stack([*run.channels.values(), *(np.full_like(run.time_s, 3000.0) for _ in CORNERS)])
    told = {
        **run.metadata,
        "controller": controller,
        "maneuver": {"name": run.metadata["maneuver"]["kind"], **run.metadata["maneuver"], **(maneuver or {})},
        "vehicle": {"name": "synthetic", **run.metadata["vehicle"]},
        "versions": {"activesteer": "0.0.1"},
        "timestep_s": 0.001,
        **metadata,
    }
    return Recording([*channels, *loads], run.time_s, values, metadata=told, metrics=metrics)


def step_steers() -> dict[str, Recording]:
    """Return step steers of the three systems, by file."""
    runs = {
        "none": step_steer(),
        "ars": step_steer(yaw_radps=0.17, sideslip_rad=-0.012, rear_rad=-0.002),
        "afs": step_steer(yaw_radps=0.14, superposition_rad=0.001),
    }
    peaks = {"none": 0.25, "ars": 0.2, "afs": 0.22}
    return {
        f"runs/step-{name}.mcap": recording_of(run, name, metrics={"yaw_rate_peak_radps": peaks[name]})
        for name, run in runs.items()
    }


def lane_changes() -> dict[str, Recording]:
    """Return two runs through cones, by file."""
    cones = ((30.0, 1.2), (45.0, 1.2), (30.0, -1.2), (45.0, -1.2))
    maneuver = {"name": "cones", "title": "Through <cones> & lanes"}
    return {
        f"lanes-{name}.mcap": recording_of(along_path(cones=cones, yaw_rate=rate), name, maneuver)
        for name, rate in (("none", 0.1), ("ars", 0.05))
    }


def sines() -> dict[str, Recording]:
    """Return a sine with dwell, by file."""
    return {"sine.mcap": recording_of(sine_with_dwell())}
