"""Time of a step and its parts. All values come from one run, interleaved, so that their ratios are meaningful."""

from __future__ import annotations

import importlib.util
import multiprocessing
import os
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Final

import mujoco
import numpy as np

from activesteer.scenario import Scenario, resolve
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.preparation import prepared
from activesteer.simulation.recorder import Recorder
from activesteer.simulation.runner import run_scenario
from activesteer.simulation.simulation import Simulation
from activesteer.studies.chassis_benchmark import DrivenStop
from activesteer.tyre.benchmark import bench as tyre_bench
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.native_forces import install_native_forces, remove_native_forces

_ROUNDS: Final = 5
"""Rounds; the best one counts, because a disturbance only makes a machine slower."""
_CALLS: Final = 5000
_CONTROLLER: Final = "ars"
"""The most expensive of the paper's controllers."""
_LQR: Final = "estimator_lqr_us"
"""Metric of `lqr`, which runs in native code: against the loop with `_CONTROLLER`."""
_FAMILY: Final = {"integrated_us": "integrated"}
"""Metric of a controller with an estimator that runs in Python -> controller, which needs a solver from an extra."""
_GIVEN: Final = "given_"
"""Prefix of the stages that replay the commands of such a controller: a car with moving actuators costs the engine
more than one with resting actuators."""
_RUNS_PER_PROCESS: Final = 4


def bench(rounds: int = _ROUNDS) -> dict[str, float]:
    """Measure one step at several stages, and the blocks of the loop; `docs/performance.md` explains the results.

    Args:
        rounds: How often everything is measured; the best counts.
    """
    scenario, along_path = prepared(resolve("step_steer")), resolve("slalom")
    sedan = prepared(resolve("step_steer", "sedan"))
    sensed = prepared(resolve("step_steer", overrides={"sensors.preset": "production"}))
    stop = DrivenStop()
    driven, along_path_driven = _KeptInputs(scenario), _KeptInputs(along_path)
    with tempfile.TemporaryDirectory() as folder:
        stages: dict[str, Callable[[], float]] = {
            "bare_step_us": lambda: _bare(scenario),
            "plant_step_us": lambda: _plant(scenario),
            "engine_step_us": driven.replay_us,
            "path_engine_step_us": along_path_driven.replay_us,
            "closed_loop_step_us": lambda: _closed_loop(scenario),
            "path_following_step_us": lambda: _closed_loop(along_path),
            "with_file_step_us": lambda: _with_file(scenario, Path(folder) / "bench.mcap"),
            "sedan_step_us": lambda: _closed_loop(sedan),
            _LQR: lambda: _closed_loop(sensed, "lqr"),
            "production_step_us": lambda: _closed_loop(sensed),
            "sensors_and_brakes_us": stop.step_us,
            "two_threads_step_us": lambda: _in_threads(scenario, 2),
        }
        solver = importlib.util.find_spec("daqp") is not None
        family = _FAMILY if solver else {}
        for name, system in family.items():
            asked = _asked(sensed, system)
            stages[name] = lambda system=system: _closed_loop(sensed, system)
            stages[_GIVEN + name] = lambda system=system, asked=asked: _closed_loop(sensed, system, _Given(asked))
        best = {name: min(measured) for name, measured in _interleaved(stages, rounds).items()}
    best |= {name: best[name] - best.pop(_GIVEN + name) for name in family}
    best[_LQR] -= best["production_step_us"]
    step_us = 1e6 * driven.vehicle.timestep_s
    for stage in ("closed_loop", "path_following", "with_file"):
        engine = "path_engine" if stage == "path_following" else "engine"
        best[f"{stage}_to_bare_ratio"] = best[f"{stage}_step_us"] / best["bare_step_us"]
        best[f"{stage}_to_engine_ratio"] = best[f"{stage}_step_us"] / best[f"{engine}_step_us"]
    best["production_to_ideal_ratio"] = best["production_step_us"] / best["closed_loop_step_us"]
    best["real_time_factor"] = step_us / best["closed_loop_step_us"]
    best["real_time_factor_with_file"] = step_us / best["with_file_step_us"]
    best["sedan_real_time_factor"] = step_us / best["sedan_step_us"]
    best["threads_2_speedup"] = best["closed_loop_step_us"] / best.pop("two_threads_step_us")
    best["step_steers_per_min"] = _runs_per_min()
    return best | _blocks(scenario)


def _interleaved(stages: dict[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    results: dict[str, list[float]] = {name: [] for name in stages}
    for _ in range(rounds):
        for name, measure in stages.items():
            results[name].append(measure())
    return results


def _per_step_us(function: Callable[[], object], steps: int) -> float:
    start = time.perf_counter()
    function()
    return (time.perf_counter() - start) / steps * 1e6


def _bare(scenario: Scenario) -> float:
    """Return the time of the engine alone: same model, same start, no callbacks.

    The force of the callbacks at the start is applied as a constant, so that the car stays near its place. A falling
    car, with its springs at their stops, would be another problem for the engine's solver.
    """
    simulation = ClosedLoop(scenario, _CONTROLLER)
    model, data, steps = simulation.vehicle.model, simulation.vehicle.data, simulation.steps
    mujoco.mj_forward(model, data)
    carried = data.qfrc_passive.copy()
    remove_native_forces()
    try:
        mujoco.mj_forward(model, data)
        data.qfrc_applied[:] = carried - data.qfrc_passive
        return _per_step_us(lambda: _repeat(mujoco.mj_step, model, data, steps), steps)
    finally:
        install_native_forces()


def _plant(scenario: Scenario) -> float:
    simulation = ClosedLoop(scenario, _CONTROLLER)
    model, data, steps = simulation.vehicle.model, simulation.vehicle.data, simulation.steps
    return _per_step_us(lambda: _repeat(mujoco.mj_step, model, data, steps), steps)


class _KeptInputs:
    """A run with the recorded inputs of the engine."""

    def __init__(self, scenario: Scenario) -> None:
        simulation = ClosedLoop(scenario, _CONTROLLER)
        self.vehicle = simulation.vehicle
        self._start = self.vehicle.save_state()
        self._inputs = np.empty((simulation.steps, self.vehicle.model.nu))
        for inputs in self._inputs:
            simulation.advance(1)
            inputs[:] = self.vehicle.data.ctrl

    def replay_us(self) -> float:
        """Return the time of the engine alone per step of the same drive [us], all in one native call."""
        self.vehicle.restore_state(self._start)
        return _per_step_us(lambda: self.vehicle.replay(self._inputs), len(self._inputs))


def _repeat(step: Callable[..., object], model: mujoco.MjModel, data: mujoco.MjData, steps: int) -> None:
    for _ in range(steps):
        step(model, data)


def _asked(scenario: Scenario, controller: str) -> list[ActuatorCommand]:
    """Return the commands of a controller in each step, without its estimates."""
    simulation, asked = ClosedLoop(scenario, controller), []
    for _ in range(simulation.steps):
        simulation.advance(1)
        asked.append(simulation.commands[1]._replace(estimate=None))
    return asked


class _Given:
    """Controller that replays commands."""

    def __init__(self, asked: Sequence[ActuatorCommand]) -> None:
        self._next = iter(asked).__next__

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        return self._next()


def _closed_loop(scenario: Scenario, controller: str = _CONTROLLER, given: _Given | None = None) -> float:
    simulation = ClosedLoop(scenario, controller)
    recorder = Recorder(simulation.vehicle, simulation.steps)

    def run() -> None:
        simulation.advance(simulation.steps, recorder, controller=given)
        recorder.flush()

    return _per_step_us(run, simulation.steps)


def _in_threads(scenario: Scenario, count: int) -> float:
    """Return the time per step of all simulations together [us], each in a thread of its own."""
    simulations = [ClosedLoop(scenario, _CONTROLLER) for _ in range(count)]
    recorders = [Recorder(simulation.vehicle, simulation.steps) for simulation in simulations]
    pairs = zip(simulations, recorders, strict=True)
    threads = [threading.Thread(target=simulation.run, args=(recorder,)) for simulation, recorder in pairs]

    def run() -> None:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for recorder in recorders:
            recorder.flush()

    return _per_step_us(run, sum(simulation.steps for simulation in simulations))


def _runs_per_min() -> float:
    processes = os.cpu_count() or 1
    # Spawn the processes: a process with threads, as ours is by now, must not be forked.
    with ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool:
        # The first runs load the compiled code and search the amplitude.
        list(pool.map(_step_steers, [1] * processes))
        start = time.perf_counter()
        list(pool.map(_step_steers, [_RUNS_PER_PROCESS] * processes))
        return 60.0 * processes * _RUNS_PER_PROCESS / (time.perf_counter() - start)


def _step_steers(count: int) -> None:
    scenario = prepared(resolve("step_steer"))
    for _ in range(count):
        run_scenario(scenario, _CONTROLLER)


def _with_file(scenario: Scenario, path: Path) -> float:
    """Return the time per step of a run as on the command line [us], without building, settling and opening."""
    simulation = Simulation(scenario, _CONTROLLER)
    with simulation.recorded_to(path):
        start = time.perf_counter()
        simulation.run()
    return (time.perf_counter() - start) / simulation.steps * 1e6


def bench_tyre(rounds: int = _ROUNDS) -> dict[str, float]:
    """Measure the cost of the tyres: one evaluation of the front tyre, and all four in the engine.

    `four_tyres_us` are the microseconds that four tyres with contact, relaxation and the application of their forces
    add to the engine's passive forces, in the same state.
    """
    scenario = resolve("straight_line")
    simulation = ClosedLoop(scenario)
    model, data = simulation.vehicle.model, simulation.vehicle.data
    header = fb.header_of(model)
    wheels = float(header["n_wheels"][0])
    with_tyres: list[float] = []
    without: list[float] = []
    for _ in range(rounds):
        for measured, present in ((with_tyres, wheels), (without, 0.0)):
            header["n_wheels"] = present
            measured.append(_per_step_us(lambda: _repeat(mujoco.mj_passive, model, data, _CALLS), _CALLS))
    return tyre_bench(scenario.car.tyres[0], rounds) | {"four_tyres_us": min(with_tyres) - min(without)}


def _blocks(scenario: Scenario) -> dict[str, float]:
    """Measure each block of the loop on its own, in the order of the data; the vehicle writes the rows."""
    simulation = ClosedLoop(scenario, _CONTROLLER)
    maneuver, driver, controller, vehicle = (
        simulation.maneuver,
        simulation.driver,
        simulation.controller,
        simulation.vehicle,
    )
    measurement, motion = vehicle.measure(), vehicle.motion()
    setpoint = maneuver.setpoint(0.6)
    command = driver.step(setpoint, measurement, motion)
    steer = controller.step(command, measurement)
    blocks: dict[str, Callable[[], object]] = {
        "maneuver_us": lambda: maneuver.setpoint(0.6),
        "driver_us": lambda: driver.step(setpoint, measurement, motion),
        "controller_us": lambda: controller.step(command, measurement),
    }
    found = {name: _per_step_us(lambda block=block: _call(block, _CALLS), _CALLS) for name, block in blocks.items()}
    recorder = Recorder(vehicle, _CALLS)
    vehicle.record_on(recorder.tape)
    parts = recorder.blocks(range(_CALLS))

    def step() -> None:
        vehicle.step(command, steer)

    found |= {"vehicle_us": 0.0, "recorder_us": 0.0}
    while recorder.rows < _CALLS:
        start = time.perf_counter()
        part = next(parts)
        found["recorder_us"] += (time.perf_counter() - start) / _CALLS * 1e6
        found["vehicle_us"] += _per_step_us(lambda part=part: _call(step, len(part)), _CALLS)
    found["recorder_us"] += _per_step_us(recorder.flush, _CALLS)
    return found


def _call(block: Callable[[], object], count: int) -> None:
    for _ in range(count):
        block()
