"""Times of parts of a step: blocks called from Python, controllers in the loop, and the engine with both solvers.

    python tools/bench_blocks.py                            # docs/performance.md: blocks, sensors and brakes
    python tools/bench_blocks.py controllers                # docs/performance.md: additional time of each controller
    python tools/bench_blocks.py engine compact sedan ...   # docs/engine.md: MuJoCo's solver and the direct solution
    python tools/bench_blocks.py accuracy compact sedan     # docs/engine.md: tolerances of MuJoCo's solver

`activesteer bench` measures whole runs.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.controllers.registry import CONTROLLERS
from activesteer.core.conventions import CORNERS
from activesteer.native.compilation import compiled
from activesteer.scenario import Scenario, resolve
from activesteer.sensors.block import AX, WHEEL_SPEEDS, measure
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.preparation import with_amplitude_found
from activesteer.simulation.recorder import Recorder
from activesteer.simulation.runner import run_scenario
from activesteer.studies.benchmark import KeptInputs, closed_loop_us, per_call_us
from activesteer.vehicle.brakes.brake_control_unit import step_brakes

_CALLS: Final = 5000
_ROUNDS: Final = 5
"""Rounds. The best one counts, because a disturbance only makes a machine slower."""


def blocks(scenario: Scenario) -> dict[str, float]:
    """Measure each block of the loop on its own, in the order of the data, with rows that the vehicle writes."""
    loop = ClosedLoop(scenario, "ars")
    vehicle = loop.vehicle
    measurement, motion, setpoint = vehicle.measure(), vehicle.motion(), loop.maneuver.setpoint(0.6)
    command = loop.driver.step(setpoint, measurement, motion)
    steer = loop.controller.step(command, measurement)
    found = {
        "maneuver_us": per_call_us(loop.maneuver.setpoint, _CALLS, 0.6),
        "driver_us": per_call_us(loop.driver.step, _CALLS, setpoint, measurement, motion),
        "controller_us": per_call_us(loop.controller.step, _CALLS, command, measurement),
        "vehicle_us": 0.0,
        "recorder_us": 0.0,
    }
    recorder = Recorder(vehicle, _CALLS)
    vehicle.record_on(recorder.tape)
    while recorder.rows < _CALLS:
        start = time.perf_counter()
        recorder.make_room()
        found["recorder_us"] += (time.perf_counter() - start) / _CALLS * 1e6
        steps = min(recorder.tape.record["room"].item(), _CALLS - recorder.rows)
        found["vehicle_us"] += per_call_us(vehicle.step, steps, command, steer) * steps / _CALLS
    found["recorder_us"] += per_call_us(recorder.flush, 1) / _CALLS
    return found


_SCALARS: Final = (
    "speed_mps", "yaw_rate_radps", "ay_mps2", "ax_mps2", "steering_wheel_rad", "rear_steer_rad", "superposition_rad",
)  # fmt: skip
_WHEELS: Final = 1 + len(_SCALARS)
_PEDAL: Final = _WHEELS + len(CORNERS)


class DrivenStop:
    """A stop from 100 km/h with a working anti-lock system and the sensors of production cars.

    Sensors, brakes and anti-lock system alone repeat it in native code.
    """

    def __init__(self) -> None:
        scenario = resolve("straight_braking", overrides={"sensors.preset": "production"})
        recording = run_scenario(scenario)
        speeds = [recording[f"{corner}_wheel_speed_radps"] for corner in CORNERS]
        scalars = [recording[name] for name in _SCALARS]
        self._rows = np.column_stack([recording.time_s, *scalars, *speeds, recording["brake_pedal"]])
        # Use the state at the beginning of the recording, so that the brakes decide as they did.
        self._vehicle = ClosedLoop(scenario).vehicle
        self.anti_lock_fraction = self._drive()[1] / len(self._rows)

    def _drive(self) -> tuple[float, int]:
        """Return the duration of the work [s] and the number of steps with pressure reduced by the anti-lock system."""
        (setup, state), sensors = self._vehicle.brakes, self._vehicle.sensors
        assert sensors is not None
        work = (
            self._rows, sensors.chains, sensors.memory.copy(), setup["rolling_radius_m"][0] / len(CORNERS),
            self._vehicle.timestep_s, *(record.copy().view(np.recarray)[0] for record in (setup, state)),
        )  # fmt: skip
        start = time.perf_counter()
        held = _sense_and_brake(*work)
        return time.perf_counter() - start, held

    def step_us(self) -> float:
        """Return the time of sensors, brakes and anti-lock system together in a step of the stop [us]."""
        return 1e6 * self._drive()[0] / len(self._rows)


@compiled
def _sense_and_brake(rows, chains, memory, radii_m, timestep_s, setup, state):
    """Step sensors and brakes as `native_step.step` does, and return the number of steps with reduced pressure."""
    asked_Nm, held = np.zeros(4), 0
    for row in rows:
        speeds = memory[WHEEL_SPEEDS : WHEEL_SPEEDS + 4]
        step_brakes(setup, state, speeds, memory[AX], row[_PEDAL], 0.0, asked_Nm, 0.0)
        held += state.allowed_Pa[0] < state.demand_Pa[0]
        wheels, p = row[_WHEELS:_PEDAL], state.pressure_Pa
        memory[:7] = row[1:8]
        memory[WHEEL_SPEEDS : WHEEL_SPEEDS + 4], memory[WHEEL_SPEEDS + 4 : WHEEL_SPEEDS + 8] = wheels, p
        measure(chains, memory, radii_m, timestep_s)
    return held


_PRODUCTION: Final = {"sensors.preset": "production"}


def print_blocks() -> None:
    """Print the time of each block, and of sensors, brakes and anti-lock system together."""
    scenario, stop = with_amplitude_found(resolve("step_steer")), DrivenStop()
    rounds = [{**blocks(scenario), "sensors_and_brakes_us": stop.step_us()} for _ in range(_ROUNDS)]
    for name in rounds[0]:
        print(f"{name:28} {min(times[name] for times in rounds):8.2f}")


def print_controllers() -> None:
    """Print the additional time per step of each controller in the step steer, with production sensors."""
    compact = with_amplitude_found(resolve("step_steer", overrides=_PRODUCTION))
    motors = with_amplitude_found(resolve("step_steer", "compact_electric", overrides=_PRODUCTION))
    for name in CONTROLLERS:
        if name == "none":
            continue
        car = motors if name == "tv" else compact
        rounds = [(closed_loop_us(car, "none"), closed_loop_us(car, name)) for _ in range(_ROUNDS)]
        without_us, with_us = np.min(rounds, axis=0)
        print(f"{name:14} {with_us - without_us:6.2f} us in addition to {without_us:.1f} us")


def print_engine(vehicles: Sequence[str]) -> None:
    """Print the engine's time per step in the first 1.5 s of three manoeuvres, with MuJoCo's solver and directly."""
    for vehicle in vehicles:
        for maneuver in ("step_steer", "slalom", "sine_with_dwell"):
            driven = KeptInputs(with_amplitude_found(resolve(maneuver, vehicle)), 1500)
            solver_us, direct_us = np.min(
                [(_replay_us(driven, 0), _replay_us(driven, 1)) for _ in range(_ROUNDS)], axis=0
            )
            print(f"{vehicle:20} {maneuver:16} {solver_us:6.1f} {direct_us:6.1f} us")


def _replay_us(driven: KeptInputs, direct: int) -> float:
    """Return the engine's time per step with MuJoCo's solver (0) or the direct solution (1) [us]."""
    driven.vehicle._implicit.plan["direct"] = direct
    return driven.replay_us()


def _positions_m(driven: KeptInputs) -> NDArray[np.float64]:
    """Return the position of the chassis after each step [m], shape (steps, 3)."""
    driven.vehicle.restore_state(driven.start)
    positions_m = np.empty((len(driven.inputs), 3))
    for row, inputs in zip(positions_m, driven.inputs, strict=True):
        driven.vehicle.replay(inputs[None])
        row[:] = driven.vehicle.data.qpos[:3]
    return positions_m


def print_accuracy(vehicles: Sequence[str]) -> None:
    """Print time per step and error of the position after 2.5 s of slalom, for tolerances of MuJoCo's solver."""
    for vehicle in vehicles:
        driven = KeptInputs(resolve("slalom", vehicle), 2500)
        direct_us = min(_replay_us(driven, 1) for _ in range(_ROUNDS))
        exact = _positions_m(driven)
        print(f"{vehicle:16} direct {direct_us:6.1f} us")
        for exponent in (13, 12, 10, 8, 6, 5, 4, 3):
            driven.vehicle.model.opt.tolerance = 10.0**-exponent
            solver_us = min(_replay_us(driven, 0) for _ in range(_ROUNDS))
            error_m = np.linalg.norm(_positions_m(driven) - exact, axis=1).max()
            print(f"{vehicle:16} 1e-{exponent:<4} {solver_us:6.1f} us {error_m:8.0e} m")


if __name__ == "__main__":
    table, *vehicles = sys.argv[1:] or ["blocks"]
    tables = {
        "blocks": lambda _: print_blocks(),
        "controllers": lambda _: print_controllers(),
        "engine": print_engine,
        "accuracy": print_accuracy,
    }
    tables[table](vehicles)
