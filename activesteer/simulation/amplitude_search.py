"""Search for the steering wheel amplitude of a manoeuvre by driving the control-free car.

The result is the input for every controller. It is kept under a key of everything that it depends on; see
`amplitude_store`.
"""

from __future__ import annotations

import hashlib
import json
import math
import platform
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np

from activesteer.analysis.slow_ramp import FIT, angle_at
from activesteer.compilation import content_key, processor
from activesteer.config import to_table
from activesteer.conventions import GRAVITY_MPS2
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Search
from activesteer.maneuver.slowly_increasing_steer import RampAngle
from activesteer.maneuver.step_steer import SteadyTurn, StepSteer
from activesteer.scenario import Scenario
from activesteer.simulation import amplitude_store
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.recorder import Recorder
from activesteer.version import __version__

_TOLERANCE: Final = 5e-4
"""Relative error of the lateral acceleration at which the search for a steady turn stops."""
_RUNS: Final = 8
_STEADY_S: Final = 0.5
"""Length of the final part of a run that is averaged as the steady state [s]."""
_CHUNK_S: Final = 0.25
"""Interval between two checks of whether a ramp has reached its end [s]."""
_ROUNDED_RAD: Final = math.radians(0.1)
"""FMVSS 126 rounds A to 0.1 deg, which also makes A the same on every machine."""


def amplitude(scenario: Scenario, search: Search, timestep_s: float) -> float:
    """Find the steering wheel angle that a manoeuvre needs.

    Args:
        scenario: Manoeuvre, car and driver.
        search: Search of the manoeuvre.
        timestep_s: Step of the simulation [s].

    Returns:
        Steering wheel angle [rad].

    Raises:
        ManeuverError: no angle gives the lateral acceleration.
    """
    probed = replace(scenario, maneuver=search.probe, driver=scenario.driver.for_searches())
    key = _key(probed, search, timestep_s)
    angle = amplitude_store.recall(key)
    if angle is None:
        if isinstance(search, RampAngle):
            angle = _ramp_angle(probed, search, timestep_s)
        else:
            assert isinstance(search, SteadyTurn)
            angle = _steady_turn(probed, search, timestep_s)
        amplitude_store.keep(key, angle)
    return angle


def _key(scenario: Scenario, search: Search, timestep_s: float) -> str:
    """Digest of everything that the amplitude depends on.

    The compiled model includes the content of all model and tyre files, the road and the step. Controllers have no
    influence, because the car is driven without control.
    """
    model = scenario.car.on(scenario.maneuver.ground, timestep_s).model
    compiled_model = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, compiled_model)
    parts = {
        "model": hashlib.sha256(compiled_model.tobytes()).hexdigest(),
        "car": to_table(scenario.car.config) | {"controllers": None},
        "driver": to_table(scenario.driver.parameters) | {"name": "", "title": ""},
        "search": [type(search).__name__, to_table(search.probe), search.lateral_acceleration_mps2, timestep_s],
        "code": [__version__, content_key(Path(__file__)), platform.platform(), processor()],
    }
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _steady_turn(scenario: Scenario, search: SteadyTurn, timestep_s: float) -> float:
    """Secant search over whole step steers."""
    wanted = search.lateral_acceleration_mps2
    if wanted == 0.0:
        return 0.0
    probe = search.probe
    car, speed = scenario.car.config.single_track, max(probe.speed_mps, 1.0)
    # First guess: Ackermann angle with the understeer of a typical car, about 2.5 deg/g.
    angle = scenario.car.config.steering.ratio * wanted * (car.wheelbase_m / speed**2 + 0.0044)
    tried: list[tuple[float, float]] = []
    simulation = ClosedLoop(replace(scenario, maneuver=probe.with_amplitude(angle)), "none", timestep_s)
    # Until the wheel turns, the runs are the same.
    simulation.advance(int(probe.steer.start_s / timestep_s))
    start = simulation.save_state()
    for _ in range(_RUNS):
        reached = _steady_acceleration(simulation, probe.with_amplitude(angle), start)
        if abs(reached / wanted - 1.0) < _TOLERANCE:
            return angle
        tried.append((angle, reached))
        if len(tried) == 1:
            angle *= wanted / reached if reached * wanted > 0.0 else 1.2
        else:
            (a0, r0), (a1, r1) = tried[-2:]
            if r1 == r0:
                break
            angle = a1 + (wanted - r1) * (a1 - a0) / (r1 - r0)
    best = min(tried, key=lambda pair: abs(pair[1] - wanted))
    raise ManeuverError(
        f"{probe.name}: no steering wheel angle found that gives {wanted:.3g} m/s2 in the control-free car; the "
        f"closest was {np.degrees(best[0]):.1f} deg with {best[1]:.3g} m/s2: is the road too slippery "
        f"(road.mu {probe.road.mu:g})?",
        value=wanted,
    )


def _steady_acceleration(simulation: ClosedLoop, maneuver: StepSteer, start: Any) -> float:
    simulation.restore_state(start)
    simulation.maneuver = maneuver
    steady = round(_STEADY_S / simulation.vehicle.timestep_s)
    simulation.advance(simulation.steps - simulation.step_count - steady)
    recorder = Recorder(simulation.vehicle, steady)
    simulation.run(recorder)
    return float(_rows(recorder, "ay_mps2").mean())


def _ramp_angle(scenario: Scenario, search: RampAngle, timestep_s: float) -> float:
    """Evaluate the regression line of the lateral acceleration over the angle at the required acceleration.

    The model is symmetric, so one side represents both.
    """
    wanted, probe = search.lateral_acceleration_mps2, search.probe
    high = FIT[1] * wanted
    simulation = ClosedLoop(scenario, "none", timestep_s)
    recorder = Recorder(simulation.vehicle, simulation.steps)
    chunk, left = round(_CHUNK_S / timestep_s), simulation.steps
    # Drive slightly beyond the range of the line, so that all of the range is settled.
    ay = np.zeros(1)
    while left > 0 and ay[-1] < 1.05 * high:
        simulation.advance(min(chunk, left), recorder)
        left -= chunk
        ay = _rows(recorder, "ay_mps2")
    wheel = _rows(recorder, "steering_wheel_rad")
    if ay.max() < high:
        raise ManeuverError(
            f"{probe.name}: the control-free car reaches {ay.max():.3g} m/s2 with {np.degrees(wheel.max()):.0f} deg at "
            f"the steering wheel, but {high:.3g} m/s2 ({high / GRAVITY_MPS2:.3g} g) are needed: is the road too "
            f"slippery (road.mu {probe.road.mu:g})? Give the amplitude instead (steering_wheel_deg)",
            value=high,
        )
    return round(angle_at(wheel, ay, wanted) / _ROUNDED_RAD) * _ROUNDED_RAD


def _rows(recorder: Recorder, name: str) -> np.ndarray:
    column = [channel.name for channel in recorder.channels].index(name)
    return recorder.result()[1][:, column]
