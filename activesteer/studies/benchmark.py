"""Benchmarks of a step, of many cars and of a tyre, for `activesteer bench`.

All times of a table come from one process, interleaved, so that their ratios are meaningful.
"""

from __future__ import annotations

import importlib.util
import multiprocessing
import os
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np

from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement
from activesteer.scenario import Scenario, resolve
from activesteer.simulation.batch import Batch
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.preparation import with_amplitude_found
from activesteer.simulation.recorder import Recorder
from activesteer.simulation.runner import run_scenario
from activesteer.simulation.simulation import Simulation
from activesteer.tyre.report import bench as tyre_bench
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.native_forces import install_native_forces, remove_native_forces

ROUNDS: Final = 5
"""Number of rounds. The best one counts, because a disturbance only makes a machine slower."""
_CALLS: Final = 5000
_CONTROLLER: Final = "ars"
"""The most expensive of the paper's controllers."""
_RUNS_PER_PROCESS: Final = 4
_PRODUCTION: Final = {"sensors.preset": "production"}


def bench(rounds: int) -> dict[str, float]:
    """Measure the time of a step at several stages, and the speed of whole runs."""
    scenario, along_path = with_amplitude_found(resolve("step_steer")), resolve("slalom")
    sedan = with_amplitude_found(resolve("step_steer", "sedan"))
    sensed = with_amplitude_found(resolve("step_steer", overrides=_PRODUCTION))
    driven, along_path_driven = KeptInputs(scenario), KeptInputs(along_path)
    with tempfile.TemporaryDirectory() as folder:
        stages: dict[str, Callable[[], float]] = {
            "bare_step_us": lambda: _engine(scenario, forces=False),
            "plant_step_us": lambda: _engine(scenario, forces=True),
            "engine_step_us": driven.replay_us,
            "path_engine_step_us": along_path_driven.replay_us,
            "closed_loop_step_us": lambda: closed_loop_us(scenario),
            "path_following_step_us": lambda: closed_loop_us(along_path),
            "with_file_step_us": lambda: _with_file(scenario, Path(folder) / "bench.mcap"),
            "sedan_step_us": lambda: closed_loop_us(sedan),
            "own_controller_us": lambda: closed_loop_us(scenario, _Nothing),
            "estimator_lqr_us": lambda: closed_loop_us(sensed, "lqr"),
            "production_step_us": lambda: closed_loop_us(sensed),
            "two_threads_step_us": lambda: closed_loop_us(scenario, threads=2),
        }
        if importlib.util.find_spec("daqp") is not None:
            stages["integrated_us"] = lambda: closed_loop_us(sensed, "integrated")
        best = {name: min(measured) for name, measured in _interleaved(stages, rounds).items()}
    for name in {"integrated_us", "estimator_lqr_us"} & best.keys():
        best[name] -= best["production_step_us"]
    best["own_controller_us"] -= best["closed_loop_step_us"]
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
    return best


def _interleaved(stages: dict[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    results: dict[str, list[float]] = {name: [] for name in stages}
    for _ in range(rounds):
        for name, measure in stages.items():
            results[name].append(measure())
    return results


def per_call_us(function: Callable[..., object], count: int, *arguments: Any) -> float:
    """Return the mean time of a call [us]."""
    start = time.perf_counter()
    for _ in range(count):
        function(*arguments)
    return (time.perf_counter() - start) / count * 1e6


def _engine(scenario: Scenario, *, forces: bool) -> float:
    """Return the time of the engine's step on a standing car [us], with or without our forces."""
    # Without them, their value at the start is applied as a constant, so that the car stays near its place. A falling
    # car, with its springs at their stops, would be another problem for the engine's solver.
    loop = ClosedLoop(scenario, _CONTROLLER)
    model, data = loop.vehicle.model, loop.vehicle.data
    if forces:
        return per_call_us(mujoco.mj_step, loop.steps, model, data)
    mujoco.mj_forward(model, data)
    carried = data.qfrc_passive.copy()
    remove_native_forces()
    try:
        mujoco.mj_forward(model, data)
        data.qfrc_applied[:] = carried - data.qfrc_passive
        return per_call_us(mujoco.mj_step, loop.steps, model, data)
    finally:
        install_native_forces()


class KeptInputs:
    """A run with stored inputs of the engine."""

    def __init__(self, scenario: Scenario, steps: int | None = None) -> None:
        loop = ClosedLoop(scenario, _CONTROLLER)
        self.vehicle = loop.vehicle
        self.start = self.vehicle.save_state()
        self.inputs = np.empty((loop.steps if steps is None else steps, self.vehicle.model.nu))
        for inputs in self.inputs:
            loop.advance(1)
            inputs[:] = self.vehicle.data.ctrl

    def replay_us(self) -> float:
        """Return the engine's time per step when the stored inputs are replayed in one native call [us]."""
        self.vehicle.restore_state(self.start)
        return per_call_us(self.vehicle.replay, 1, self.inputs) / len(self.inputs)


class _Nothing:
    """A user's controller that does nothing."""

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        return ActuatorCommand()


def closed_loop_us(scenario: Scenario, controller: Any = _CONTROLLER, threads: int = 0) -> float:
    """Return the time per step of one run, or of several in separate threads [us]."""
    loops = [ClosedLoop(scenario, controller) for _ in range(max(threads, 1))]
    recorders = [Recorder(loop.vehicle, loop.steps) for loop in loops]

    def run() -> None:
        if threads:
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(lambda loop, recorder: loop.advance(loop.steps, recorder), loops, recorders))
        else:
            loops[0].advance(loops[0].steps, recorders[0])
        for recorder in recorders:
            recorder.flush()

    return per_call_us(run, 1) / sum(loop.steps for loop in loops)


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
    scenario = with_amplitude_found(resolve("step_steer"))
    for _ in range(count):
        run_scenario(scenario, _CONTROLLER)


def _with_file(scenario: Scenario, path: Path) -> float:
    """Return the time per step of a recorded run [us], without setup."""
    simulation = Simulation(scenario, _CONTROLLER)
    start = 0.0
    with simulation.recorded_to(path):
        start = time.perf_counter()
        simulation.run()
    return (time.perf_counter() - start) / simulation.steps * 1e6


def bench_tyre(rounds: int) -> dict[str, float]:
    """Measure one evaluation of a tyre, and what four tyres with contact and relaxation add to the engine [us]."""
    scenario = resolve("straight_line")
    vehicle = ClosedLoop(scenario).vehicle
    header = fb.header_of(vehicle.model)
    wheels = float(header["n_wheels"][0])

    def passive_us(present: float) -> float:
        header["n_wheels"] = present
        return per_call_us(mujoco.mj_passive, _CALLS, vehicle.model, vehicle.data)

    found = _interleaved({"with": lambda: passive_us(wheels), "without": lambda: passive_us(0.0)}, rounds)
    four_us = min(found["with"]) - min(found["without"])
    return tyre_bench(scenario.car.tyres[0], rounds) | {"four_tyres_us": four_us}


SIZES: Final = (1, 16, 256, 1024)
"""Numbers of cars of a batch."""
_MEASURED: Final = 256
"""Number of cars of the figures without a number of cars in their names."""
_CAR_STEPS: Final = 51_200
"""Car-steps of one measurement."""
_INTERVAL: Final = 10
"""Steps between two commands of the law in Python."""
_REAR_PER_YAW_RATE_S: Final = 0.05
"""Rear wheel angle of this law per yaw rate [s]."""


def bench_batch(rounds: int) -> dict[str, float]:
    """Measure batches of cars in the sine with dwell, best of several interleaved rounds."""
    found: dict[str, float] = {}
    for size in SIZES:
        before, threads = _memory_MB(), os.cpu_count() or 1
        batch = Batch("sine_with_dwell", size, threads=threads)
        held = _memory_MB() - before
        start = batch.save_state()
        steps = max(_INTERVAL, _CAR_STEPS // size // _INTERVAL * _INTERVAL)
        steps = min(steps, int(batch.steps[0]) // _INTERVAL * _INTERVAL)
        best = {}
        for _ in range(rounds):
            for name, count in (("one", 1), ("two", 2), ("controlled", threads)):
                batch.restore_state(start)
                batch.threads = count
                wall, cpu = time.perf_counter(), time.process_time()
                if name == "controlled":
                    measurement = batch.measurement
                    for _ in range(steps // _INTERVAL):
                        rear_rad = _REAR_PER_YAW_RATE_S * measurement.yaw_rate_radps
                        measurement = batch.advance(_INTERVAL, actuator_command=ActuatorCommand(rear_rad))
                else:
                    batch.advance(steps)
                spent = np.array([time.perf_counter() - wall, time.process_time() - cpu])
                best[name] = np.minimum(best.get(name, spent), spent)
        total = size * steps
        figures = {
            "batch_car_steps_per_s": total / float(best["controlled"][0]),
            "batch_cpu_us_per_car_step": float(best["one"][1]) / total * 1e6,
            "batch_cpu_us_two_threads": float(best["two"][1]) / total * 1e6,
            "batch_threads_2_speedup": float(best["one"][0] / best["two"][0]),
        }
        found |= {f"{name}_{size}": value for name, value in figures.items()}
        if size == _MEASURED:
            found = figures | found
        if size == SIZES[-1]:
            found["batch_MB_per_car"] = held / size
    return found


def _memory_MB() -> float:
    """Return the memory of this process [MB], or 0 if unknown."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (OSError, ValueError, AttributeError):
        return 0.0


def batch_table(found: dict[str, Any]) -> str:
    """Return the results of `bench_batch` as a table, a line for each number of cars."""
    lines = [f"{'cars':>6} {'us/car-step':>12} {'2 threads':>10} {'speed-up':>9} {'car-steps/s':>12}"]
    for size in SIZES:
        us, two, speedup, rate = (
            found[f"batch_{name}_{size}"]
            for name in ("cpu_us_per_car_step", "cpu_us_two_threads", "threads_2_speedup", "car_steps_per_s")
        )
        lines.append(f"{size:6d} {us:12.2f} {two:10.2f} {speedup:9.2f} {rate:12.0f}")
    return "\n".join([*lines, f"memory {found['batch_MB_per_car']:.2f} MB per car"])
