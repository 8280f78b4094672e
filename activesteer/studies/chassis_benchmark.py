"""Cost of sensors, brakes and anti-lock system in a step: their native code alone, fed with a recorded stop."""

from __future__ import annotations

import time
from typing import Final

import numpy as np

from activesteer.brakes.control_unit import step_brakes
from activesteer.compilation import compiled
from activesteer.conventions import CORNERS
from activesteer.scenario import resolve
from activesteer.sensors.block import AX, WHEEL_SPEEDS, measured
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.runner import run_scenario

_STOP: Final = "straight_braking"
_PRODUCTION: Final = {"sensors.preset": "production"}
_SCALARS: Final = (
    "speed_mps", "yaw_rate_radps", "ay_mps2", "ax_mps2", "steering_wheel_rad", "rear_steer_rad", "superposition_rad",
)  # fmt: skip
_WHEELS: Final = 1 + len(_SCALARS)
_PEDAL: Final = _WHEELS + len(CORNERS)


class DrivenStop:
    """A stop from 100 km/h with a working anti-lock system and the sensors of production cars."""

    def __init__(self) -> None:
        scenario = resolve(_STOP, overrides=_PRODUCTION)
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
    """Step sensors and brakes as `native_step.step` does; return the number of steps with reduced pressure."""
    asked_Nm, held = np.zeros(4), 0
    for row in rows:
        speeds = memory[WHEEL_SPEEDS : WHEEL_SPEEDS + 4]
        step_brakes(setup, state, speeds, memory[AX], row[_PEDAL], 0.0, asked_Nm, 0.0)
        held += state.allowed_Pa[0] < state.demand_Pa[0]
        wheels, p = row[_WHEELS:_PEDAL], state.pressure_Pa
        truth = (
            row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7],
            (wheels[0], wheels[1], wheels[2], wheels[3]), (p[0], p[1], p[2], p[3]),
        )  # fmt: skip
        measured(chains, memory, radii_m, timestep_s, truth)
    return held
