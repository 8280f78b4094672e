"""Accuracy and consistency of the estimator on each car, while it only observes.

    python tools/estimation_table.py [--vehicles V,V...] [--courses NAME,NAME...] [--sensors production,ideal]
                                     [--seed 1] [--jobs N]

It prints one row for each car, course and preset of the sensors. Samples count at a speed above 5 m/s and a sideslip
angle below 8 deg, while all wheels are on the same friction. A sample is *loaded* if an axle has used 50 % of its
friction for 0.3 s; the columns of errors are over these samples, and a course without any has none.
"""

from __future__ import annotations

import argparse
import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer import simulate
from activesteer.core.conventions import CORNERS, Array
from activesteer.errors import ModelError, SimulationDiverged
from activesteer.recording import Recording
from activesteer.studies.engine.workers import in_parallel

VEHICLES: Final = ("compact", "compact_electric", "sedan", "tesla_model_s")
COURSES: Final[dict[str, tuple[str, dict[str, Any]]]] = {
    "step_30": ("step_steer", {"steer.steering_wheel_deg": 30.0}),
    "step_50": ("step_steer", {"steer.steering_wheel_deg": 50.0}),
    "step_80": ("step_steer", {"steer.steering_wheel_deg": 80.0}),
    "ramp": ("ramp_steer", {}),
    "sine_with_dwell": ("sine_with_dwell", {}),
    "mu_jump": ("mu_jump", {}),
    "banked_curve": ("banked_curve", {}),
    "straight_rough": ("rough_road", {"duration_s": 12.0}),
}
"""Name of a course -> its manoeuvre and changes of it."""
SLOWEST_MPS: Final = 5.0
LARGEST_SIDESLIP_RAD: Final = math.radians(8.0)
"""Slower samples, and samples with a larger sideslip angle, do not count."""
LOADED_SHARE: Final = 0.5
LOADED_S: Final = 0.3
"""An axle shows the friction after it has used this share of it for this time [s]."""
COLUMNS: Final = ("samples", "friction_rms", "friction_max", "inside", "inside_all", "front", "rear")


class Accuracy(NamedTuple):
    """Errors of one run, or nan without samples.

    Attributes:
        samples: Share of the samples that are loaded.
        friction_rms: RMS error of the friction in loaded samples.
        friction_max: Its largest error there.
        inside: Share of the loaded samples with the true friction inside two stated deviations.
        inside_all: The same share of all samples that count.
        front: Mean front stiffness less 1 in loaded samples, or in all samples of a course without any.
        rear: The same of the rear stiffness.
    """

    samples: float
    friction_rms: float
    friction_max: float
    inside: float
    inside_all: float
    front: float
    rear: float


def accuracy(run: Recording) -> Accuracy:
    """Return the errors of an estimator in a recording."""
    mu = np.array([run[f"{corner}_mu"] for corner in CORNERS], np.float64)
    timestep_s = float(run.time_s[1] - run.time_s[0])
    waits = round(LOADED_S / timestep_s)
    counts = (run["vx_mps"] > SLOWEST_MPS) & (np.abs(run["sideslip_rad"]) < LARGEST_SIDESLIP_RAD)
    counts &= np.ptp(mu, axis=0) < 1e-6
    loaded = np.zeros(len(run.time_s), bool)
    for axle in ("f", "r"):
        loaded |= _lasts(counts & _known_friction(mu) & (_used(run, axle, mu) > LOADED_SHARE), waits)
    error, std = run["estimated_friction"] - mu[0], run["estimated_friction_std"]
    inside, shows = np.abs(error) < 2.0 * std, loaded.any()
    where = loaded if shows else counts
    front, rear = (float(np.mean(run[f"estimated_{axle}_stiffness"][where])) - 1.0 for axle in ("front", "rear"))
    return Accuracy(
        float(loaded.sum() / max(counts.sum(), 1)),
        float(np.sqrt(np.mean(error[loaded] ** 2))) if shows else math.nan,
        float(np.abs(error[loaded]).max()) if shows else math.nan,
        float(inside[loaded].mean()) if shows else math.nan,
        float(inside[counts].mean()),
        front,
        rear,
    )


def _used(run: Recording, axle: str, mu: Array) -> Array:
    """Return the share of an axle's friction that its wheels use, weighted by their loads."""
    wheels = [corner for corner in CORNERS if corner[0] == axle]
    load_N = np.array([run[f"{wheel}_tyre_fz_N"] for wheel in wheels], np.float64)
    used = np.array([run[f"{wheel}_friction_utilisation"] for wheel in wheels], np.float64)
    return np.sum(load_N * used, axis=0) / np.maximum(load_N.sum(axis=0), 1.0)


def _known_friction(mu: Array) -> NDArray[np.bool_]:
    """Return where the friction is the same as at the sample before: a jump starts the time anew."""
    return np.concatenate(([True], np.abs(np.diff(mu[0])) < 1e-6))


def _lasts(holds: NDArray[np.bool_], samples: int) -> NDArray[np.bool_]:
    """Return where a condition has held for a number of samples."""
    index = np.arange(len(holds))
    broken = np.maximum.accumulate(np.where(holds, -1, index))
    return holds & (index - broken > samples)


def observed(vehicle: str, course: str, sensors: str, seed: int) -> Accuracy | None:
    """Drive a course with the observer, or None if the car or its estimator cannot."""
    maneuver, changes = COURSES[course]
    noise = {} if sensors == "ideal" else {"sensors.seed": seed}
    try:
        run = simulate(maneuver, "observer", vehicle, {"sensors.preset": sensors, **noise, **changes})
    except (SimulationDiverged, ModelError):
        return None
    return accuracy(run)


def _names(text: str) -> list[str]:
    return [name for name in text.split(",") if name]


def main() -> None:
    """Run the tool."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vehicles", type=_names, default=list(VEHICLES), metavar="V,V...")
    parser.add_argument(
        "--courses", type=_names, default=list(COURSES), metavar="NAME,NAME...", help=", ".join(COURSES)
    )
    parser.add_argument("--sensors", type=_names, default=["production", "ideal"], metavar="PRESET,...")
    parser.add_argument("--seed", type=int, default=1, help="of the sensors")
    parser.add_argument("--jobs", type=int)
    asked = parser.parse_args()
    tasks = [
        (vehicle, course, sensors, asked.seed)
        for vehicle in asked.vehicles
        for course in asked.courses
        for sensors in asked.sensors
    ]
    print(f"{'vehicle':17}{'course':16}{'sensors':11}" + "".join(f"{name:>13}" for name in COLUMNS))
    for (vehicle, course, sensors, _), found in zip(tasks, in_parallel(observed, tasks, asked.jobs), strict=True):
        cells = "".join(f"{value:13.2f}" for value in found) if found else "       failed"
        print(f"{vehicle:17}{course:16}{sensors:11}{cells}", flush=True)


if __name__ == "__main__":
    main()
