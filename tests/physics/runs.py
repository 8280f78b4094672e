"""Shared runs of the physics tests; each run is made once in a process."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

import activesteer
from activesteer import Simulation
from activesteer.analysis.metrics import KEY_METRICS
from activesteer.core.conventions import CORNERS, DEFAULT_TIMESTEP_S
from activesteer.recording import Recording
from activesteer.scenario import Scenario, resolve
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.recorder import Recorder
from activesteer.vehicle import Vehicle

STEP_DEG = 36.5
"""Steering wheel angle of the step steers whose input must not depend on a search: about 0.4 g at 80 km/h."""
COAST_OR_BRAKE = {"kind": "open_loop", "speed_kmh": 80, "duration_s": 3.0, "settle_s": 0.5, "drive": "coast"}
"""A car that rolls at 80 km/h with the clutch open, driven to that speed before."""


@functools.cache
def _run(maneuver: str, controller: str, overrides: tuple[tuple[str, Any], ...], timestep_s: float) -> Recording:
    given = {key: list(value) if isinstance(value, tuple) else value for key, value in overrides}
    return activesteer.simulate(maneuver, controller, overrides=given, timestep_s=timestep_s)


def run(
    maneuver: str, controller: str = "none", *, timestep_s: float = DEFAULT_TIMESTEP_S, **overrides: Any
) -> Recording:
    """Return a manoeuvre of the library; a double underscore in the name of an override is a dot."""
    keys = tuple(sorted((key.replace("__", "."), value) for key, value in overrides.items()))
    return _run(maneuver, controller, keys, timestep_s)


def step_steer(controller: str = "none", *, timestep_s: float = DEFAULT_TIMESTEP_S, side: float = 1.0) -> Recording:
    """Return a step steer of known amplitude, to the left (side 1) or to the right (side -1)."""
    return run("step_steer", controller, timestep_s=timestep_s, steer__steering_wheel_deg=side * STEP_DEG)


def step_steer_scenario() -> Scenario:
    """Return the same step steer, not yet run."""
    return resolve("step_steer", overrides={"steer.steering_wheel_deg": STEP_DEG})


def in_the_corner(controller: str = "none", steps: int = 900) -> ClosedLoop:
    """Return a step steer in its transient, 0.4 s after the beginning of steer."""
    simulation = ClosedLoop(step_steer_scenario(), controller)
    simulation.advance(steps)
    return simulation


def assert_goes_on_bit_by_bit(overrides: dict[str, Any], save_at: int, back_after: int) -> None:
    """A step steer with `ars`, saved at a step and restored some steps later, ends as without interruption."""
    whole = activesteer.simulate("step_steer", "ars", overrides=overrides)
    simulation = Simulation("step_steer", "ars", overrides=overrides)
    simulation.advance(save_at)
    state = simulation.save_state()
    simulation.advance(back_after)
    simulation.restore_state(state)
    simulation.advance(3)
    simulation.run()
    np.testing.assert_array_equal(simulation.recording().values, whole.values)


def go_on(simulation: ClosedLoop, steps: int) -> NDArray[np.float64]:
    """Return all channels of the next steps, shape (steps, number of channels)."""
    recorder = Recorder(simulation.vehicle, steps)
    simulation.advance(steps, recorder)
    return recorder.result()[1]


def assert_goes_on_from_its_state(simulation: ClosedLoop, steps: int, other: ClosedLoop | None = None) -> None:
    """After restoring a state, the next steps are bit-identical, in the same simulation and in another one."""
    state = simulation.save_state()
    uninterrupted = go_on(simulation, steps)
    restored = simulation if other is None else other
    restored.restore_state(state)
    np.testing.assert_array_equal(go_on(restored, steps), uninterrupted)


def assert_has_key_metrics(recording: Recording) -> None:
    """The key metrics of the manoeuvre's kind are metrics of its run."""
    names = set(KEY_METRICS[recording.metadata["maneuver"]["kind"]])
    # Only a car that stands has this one.
    stands = {"displacement_at_rest_m"} if recording["speed_mps"].max() < 1.0 else set()
    assert names - {"displacement_at_rest_m"} | stands <= recording.metrics.keys()


def car(maneuver: str = "standstill") -> Vehicle:
    """Return the car in static ride."""
    scenario = resolve(maneuver)
    return scenario.car.on(scenario.maneuver.road)


def mass_kg(vehicle: Vehicle) -> float:
    """Return the mass of the whole car."""
    return float(vehicle.model.body_mass.sum())


def corners(recording: Recording, quantity: str) -> NDArray[np.float64]:
    """Return a quantity of all corners, shape (n, 4), order of `CORNERS`."""
    return np.stack([recording[f"{corner}_{quantity}"] for corner in CORNERS], axis=1)


def last(recording: Recording, duration_s: float) -> NDArray[np.bool_]:
    """Return True for the rows at the end of a run, shape (n,)."""
    return recording.time_s > recording.time_s[-1] - duration_s
