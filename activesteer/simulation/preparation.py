"""Preparation of a scenario: settling, search for a steering amplitude, and store of amplitudes.

A found amplitude is the input for every controller. It is kept under a key of everything that it depends on, in memory
and in `$XDG_CACHE_HOME/activesteer/amplitudes`, by default `~/.cache/activesteer/amplitudes`. You can delete this
folder at any time. A file holds the number and a hash of key and number, so a damaged or misplaced file is ignored. If
the folder cannot be read or written, nothing is stored there.

Mass, yaw inertia and axle distances come from the model at static ride; see `studies.linear.identification`.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import platform
import secrets
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np

from activesteer.analysis.handling import CarGeometry, evaluate
from activesteer.analysis.source import RecordingLike
from activesteer.analysis.step_response import FIT, angle_at
from activesteer.config import to_table
from activesteer.controllers import controller_spec
from activesteer.core.conventions import DEFAULT_TIMESTEP_S, GRAVITY_MPS2
from activesteer.core.files import read_bytes
from activesteer.core.version import __version__
from activesteer.errors import ActiveSteerError, ManeuverError, ModelError, ParameterError
from activesteer.maneuver.base import Search
from activesteer.maneuver.steering_tests import StepSteer
from activesteer.native.compilation import content_key, processor
from activesteer.plugins import Plugin
from activesteer.recording import Recording
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import CarSpec, FileOrTable, Scenario, resolve
from activesteer.scenario.run_context import RunContext
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.recorder import Recorder
from activesteer.theory.single_track import IDENTIFIED, IDENTIFY, SingleTrackParameters, characteristic_speed
from activesteer.vehicle.statics import mass_properties

MAX_KEPT: Final = 1000
"""Largest number of amplitudes in the process and in the folder. The oldest are deleted first."""
_MAX_BYTES: Final = 200
_SUFFIX: Final = ".amplitude"
_in_process: dict[str, float] = {}
_writes = True


def folder() -> Path:
    """Return the folder of the stored amplitudes. It may not exist."""
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    # XDG base directory specification: ignore a path that is not absolute.
    cache = given if given.is_absolute() else Path.home() / ".cache"
    return cache / "activesteer" / "amplitudes"


def recall(key: str) -> float | None:
    """Return a stored amplitude, or None."""
    if key not in _in_process:
        with contextlib.suppress(ActiveSteerError, RuntimeError, ValueError):
            text = read_bytes(folder() / f"{key}{_SUFFIX}", ActiveSteerError, _MAX_BYTES).decode("ascii")
            value = float.fromhex(text.partition(" ")[0])
            if text == _line(key, value) and math.isfinite(value):
                _remember(key, value)
    return _in_process.get(key)


def keep(key: str, value: float) -> None:
    """Store an amplitude in memory and, if allowed, on disk."""
    _remember(key, value)
    if not _writes:
        return
    with contextlib.suppress(OSError, RuntimeError):
        place = folder()
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        own, part = place / f"{key}{_SUFFIX}", place / f"{key}-{secrets.token_hex(4)}{_SUFFIX}"
        try:
            part.write_text(_line(key, value), encoding="ascii")
            # Not `files.atomic_write`, which follows links: a link here may point to any file of the user.
            part.replace(own)
        finally:
            part.unlink(missing_ok=True)
        # The newest one is kept also where a clock that was set back dates it before others.
        others = {file for file in place.glob(f"*{_SUFFIX}") if file != own}
        for file in sorted(others, key=lambda file: file.lstat().st_mtime)[: 1 - MAX_KEPT]:
            with contextlib.suppress(OSError):
                file.unlink()


@contextlib.contextmanager
def not_on_disk() -> Iterator[None]:
    """Context that keeps new amplitudes only in memory, because the cars of a study do not recur."""
    global _writes  # noqa: PLW0603 - one setting for the process, like the numbers
    before, _writes = _writes, False
    try:
        yield
    finally:
        _writes = before


def _remember(key: str, value: float) -> None:
    _in_process[key] = value
    for oldest in list(_in_process)[:-MAX_KEPT]:
        _in_process.pop(oldest, None)


def _line(key: str, value: float) -> str:
    digits = value.hex()
    return f"{digits} {hashlib.sha256(f'{key} {digits}'.encode()).hexdigest()}\n"


_TOLERANCE: Final = 5e-4
"""Relative error of the lateral acceleration at which the search for a steady turn stops."""
_RUNS: Final = 8
_STEADY_S: Final = 0.5
"""Length of the final part of a run that is averaged as the steady state [s]."""
_CHUNK_S: Final = 0.25
"""Interval between two checks of whether a ramp has reached its end [s]."""
_ROUNDED_RAD: Final = math.radians(0.1)
"""Resolution of A in FMVSS 126 [rad]: 0.1 deg, so that A is the same on every machine."""


def amplitude(scenario: Scenario, search: Search, timestep_s: float) -> float:
    """Find the steering wheel angle that a manoeuvre needs."""
    probed = replace(scenario, maneuver=search.probe, driver=scenario.driver.for_searches())
    key = _key(probed, search, timestep_s)
    angle = recall(key)
    if angle is None:
        wanted = search.lateral_acceleration_mps2
        if isinstance(search.probe, StepSteer):
            angle = _steady_turn(probed, search.probe, wanted, timestep_s)
        else:
            angle = _ramp_angle(probed, wanted, timestep_s)
        keep(key, angle)
    return angle


def _key(scenario: Scenario, search: Search, timestep_s: float) -> str:
    """Return a digest of everything that affects the amplitude; the model includes its files, road and step."""
    model = scenario.car.on(scenario.maneuver.ground, timestep_s).model
    compiled_model = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, compiled_model)
    parts = {
        "model": hashlib.sha256(compiled_model.tobytes()).hexdigest(),
        # Controllers have no influence, because the car is driven without control.
        "car": to_table(scenario.car.config) | {"controllers": None},
        "driver": to_table(scenario.driver.parameters) | {"name": "", "title": ""},
        "search": [to_table(search.probe), search.lateral_acceleration_mps2, timestep_s],
        "code": [__version__, content_key(Path(__file__)), platform.platform(), processor()],
    }
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _steady_turn(scenario: Scenario, probe: StepSteer, wanted: float, timestep_s: float) -> float:
    """Search with the secant method over complete step steers."""
    if wanted == 0.0:
        return 0.0
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
        f"{probe.name}: no steering wheel angle found that gives {wanted:.3g} m/s2 in the car without control; the "
        f"closest was {np.degrees(best[0]):.1f} deg with {best[1]:.3g} m/s2, at {3.6 * speed:.3g} km/h and road.mu "
        f"{probe.road.mu:g}",
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


def _ramp_angle(scenario: Scenario, wanted: float, timestep_s: float) -> float:
    """Return the steering wheel angle at a lateral acceleration, by a regression line over a slow ramp to one side."""
    probe, high = scenario.maneuver, FIT[1] * wanted
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
            f"{probe.name}: without control the car reaches {ay.max():.3g} m/s2 with {np.degrees(wheel.max()):.0f} deg "
            f"at the steering wheel, but {high:.3g} m/s2 ({high / GRAVITY_MPS2:.3g} g) are needed: is the road too "
            f"slippery (road.mu {probe.road.mu:g})? Give the amplitude instead (steering_wheel_deg)",
            value=high,
        )
    return round(angle_at(wheel, ay, wanted) / _ROUNDED_RAD) * _ROUNDED_RAD


def _rows(recorder: Recorder, name: str) -> np.ndarray:
    column = [channel.name for channel in recorder.channels].index(name)
    return recorder.result()[1][:, column]


Run = Callable[[Scenario], RecordingLike]
"""Function that runs a scenario. An argument, because the runner itself calls this module."""

CONSTANT_SPEED_TESTS: Final = {"80 km/h": 80.0, "100 km/h": 100.0}
"""Tests at constant speed that give the single-track model, with the speed of each test [km/h]."""
_LINEAR: Final = {"duration_s": 12.0, "steer.end_deg": 50.0}
"""Overrides that limit a test at constant speed to the linear range."""


class Body(NamedTuple):
    """Mass properties of the whole car at static ride."""

    mass_kg: float
    yaw_inertia_kgm2: float  # about the vertical axis through the centre of gravity
    cg_to_front_m: float  # l_V
    cg_to_rear_m: float  # l_H


def identified(car: CarSpec) -> SingleTrackParameters:
    """Return the single-track model of the loaded car from tests in the linear range."""
    body = body_of(car)
    keys = [{**_LINEAR, "speed_kmh": speed} for speed in CONSTANT_SPEED_TESTS.values()]
    tests = [replace(resolve("slowly_increasing_steer", overrides=each), car=car) for each in keys]
    return fitted(body, [handling_in(test, body, _test_drive) for test in tests])


def body_of(car: CarSpec) -> Body:
    """Return the mass properties of the whole car, from the model at static ride."""
    vehicle = car.on()
    body = mass_properties(vehicle.model, vehicle.data)
    front, rear = (vehicle.data.xpos[vehicle.model.body(f"{axle}l_wheel").id, 0] for axle in "fr")
    x_m = body.cg_m[0]
    return Body(body.mass_kg, float(body.inertia_kgm2[2, 2]), float(front - x_m), float(x_m - rear))


def handling_in(scenario: Scenario, body: Body, run: Run) -> dict[str, float]:
    """Return the steady-state handling of a car in a test."""
    return evaluate(
        run(scenario), CarGeometry(body.cg_to_front_m, body.cg_to_rear_m, scenario.car.config.steering.ratio)
    )


def fitted(body: Body, tests: list[dict[str, float]]) -> SingleTrackParameters:
    """Return the model with the mean slip angles and understeer of the tests at constant speed."""
    wheelbase = body.cg_to_front_m + body.cg_to_rear_m

    def mean(name: str) -> float:
        return float(np.mean([test[name] for test in tests]))

    understeer, front, rear = (mean(f"{name}_gradient_radpmps2") for name in ("understeer", "front_slip", "rear_slip"))
    if understeer <= 0.0:
        gradient_degpg = math.degrees(understeer) * GRAVITY_MPS2
        raise ModelError(
            f"the car oversteers: its understeer gradient is {gradient_degpg:.3g} deg/g, and the characteristic speed "
            "of the single-track model needs a positive gradient"
        )
    return SingleTrackParameters(
        source=IDENTIFIED,
        mass_kg=body.mass_kg,
        yaw_inertia_kgm2=body.yaw_inertia_kgm2,
        cg_to_front_m=body.cg_to_front_m,
        cg_to_rear_m=body.cg_to_rear_m,
        front_stiffness_Nprad=body.mass_kg * body.cg_to_rear_m / wheelbase / front,
        rear_stiffness_Nprad=body.mass_kg * body.cg_to_front_m / wheelbase / rear,
        characteristic_speed_mps=characteristic_speed(wheelbase, understeer),
    )


def searched_angle(scenario: Scenario, timestep_s: float = DEFAULT_TIMESTEP_S) -> float | None:
    """Return the steering wheel angle from the search of the manoeuvre [rad], or None without a search."""
    # The search drives the car without faults and with ideal sensors, so that the input does not depend on them.
    search = replace(scenario.maneuver, fault=()).search
    if search is None:
        return None
    return amplitude(replace(scenario, car=scenario.car.with_ideal_sensors()), search, timestep_s)


def with_amplitude_found(
    scenario: Scenario, timestep_s: float = DEFAULT_TIMESTEP_S, angle_rad: float | None = None
) -> Scenario:
    """Return the scenario with the results of all searches.

    Args:
        scenario: A scenario.
        timestep_s: Step of the simulation [s].
        angle_rad: An earlier `searched_angle`, which replaces a search [rad].

    Returns:
        A scenario whose input is the same for every controller.

    Raises:
        ManeuverError: no amplitude gives the lateral acceleration.
    """
    car = scenario.car
    if car.config.single_track.source == IDENTIFY:
        scenario = replace(scenario, car=replace(car, config=replace(car.config, single_track=identified(car))))
    search = scenario.maneuver.search
    angle_rad = searched_angle(scenario, timestep_s) if angle_rad is None else angle_rad
    if search is None or angle_rad is None:
        return scenario
    return replace(scenario, maneuver=search.accept(angle_rad))


def prepared(
    maneuver: FileOrTable | Scenario,
    controller: Plugin,
    vehicle: FileOrTable,
    overrides: Mapping[str, Any] | None,
    driver: Any,
    timestep_s: float,
) -> Scenario:
    """Return the scenario for the arguments of a `Simulation`, with the results of all searches."""
    if not isinstance(maneuver, Scenario):
        maneuver = resolve(maneuver, vehicle, overrides, driver, [controller])
    elif overrides or vehicle != "compact" or driver != DEFAULT_DRIVER:
        raise ParameterError(
            "a Scenario already includes vehicle, driver and overrides", key="vehicle, overrides, driver"
        )
    return with_amplitude_found(maneuver, timestep_s)


def _test_drive(scenario: Scenario) -> Recording:
    loop = ClosedLoop(replace(scenario, car=scenario.car.with_ideal_sensors()))
    recorder = Recorder(loop.vehicle, loop.steps)
    loop.run(recorder)
    return RunContext.of(scenario, loop.vehicle, controller_spec("none")).recording(*recorder.result())
