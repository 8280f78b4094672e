"""Episodes for learning: tasks, and many cars that are driven at once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from activesteer.core.conventions import Array
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement, Motion, arrays_of, numbers_of
from activesteer.errors import ParameterError, shown
from activesteer.road.native_path import PathSearches
from activesteer.simulation.batch import Batch
from activesteer.studies.engine.factor_values import FactorValues
from activesteer.studies.engine.study_file import read_study
from activesteer.theory.single_track import SingleTrack, yaw_rate_gain

ACTUATORS: Final[dict[str, tuple[tuple[str, float, float], ...]]] = {
    "rear": (("rear_steer_demand_rad", -1.0, math.radians(3.0)),),
    "front": (("superposition_demand_rad", -1.0, math.radians(3.0)),),
    "brakes": tuple((f"{corner}_brake_torque_demand_Nm", 0.0, 1500.0) for corner in ("fl", "fr", "rl", "rr")),
}
"""Number of the action, its lower bound, and the command at its upper bound 1, by actuators of a controller."""
HANDS: Final = (
    ("steering_wheel_demand_rad", -1.0, 2.0 * math.pi),
    ("drive_torque_demand_Nm", -1.0, 2500.0),
    ("brake_pedal", 0.0, 1.0),
)
"""Actions of an agent who drives."""
_POPULATION: Final = "population"
"""Study whose ranges cars are drawn from."""


@dataclass(frozen=True)
class Task:
    """A task for an agent: manoeuvre, driver, actuators and reward.

    Attributes:
        maneuver: Name of the manoeuvre.
        driver: `driver` or `agent`: who drives.
        actuators: Names from `ACTUATORS`.
        weights: Term of the reward -> weight; see `Episodes`.
        overrides: Overrides of manoeuvre and vehicle.
        most_offset_m: Distance from the path at which the course is left [m].
        most_sideslip_rad: Sideslip angle at which the car is lost [rad].
        radius_m: Radius of the circle to the left on which a drift is held [m]; 0 for the path of the manoeuvre.
        sideslip_rad: Sideslip angle of the drift [rad].
    """

    maneuver: str
    driver: str = "driver"
    actuators: tuple[str, ...] = ("rear",)
    weights: Mapping[str, float] = field(default_factory=dict)
    overrides: Mapping[str, Any] = field(default_factory=dict)
    most_offset_m: float = math.inf
    most_sideslip_rad: float = math.radians(30.0)
    radius_m: float = 0.0
    sideslip_rad: float = 0.0


_STEADY: Final = {"sideslip": 1.0, "effort": 0.02, "lost": 20.0}
TASKS: Final[dict[str, Task]] = {
    "SineWithDwell": Task("sine_with_dwell", weights={**_STEADY, "yaw_rate": 1.0}),
    "DoubleLaneChange": Task("double_lane_change", weights={**_STEADY, "offset": 1.0}, most_offset_m=4.0),
    "Slalom": Task("slalom", weights={**_STEADY, "offset": 1.0}, most_offset_m=4.0),
    "SplitMuBraking": Task(
        "split_mu_braking", weights={**_STEADY, "yaw_rate": 1.0, "offset": 1.0, "braking": 0.5}, most_offset_m=4.0
    ),
    "Drift": Task(
        "straight_line",
        driver="agent",
        actuators=(),
        weights={"drift": 1.0, "circle": 1.0, "effort": 0.02, "lost": 20.0},
        overrides={"powertrain.front_fraction": 0.0, "road.mu": 0.5, "speed_kmh": 36.0, "duration_s": 15.0},
        most_offset_m=15.0,
        most_sideslip_rad=math.radians(80.0),
        radius_m=25.0,
        sideslip_rad=-math.radians(25.0),
    ),
}
"""Tasks by name of the environment."""


def sampled_overrides(task: Task, vehicle: Any, count: int, seed: int) -> list[dict[str, Any]]:
    """Draw overrides of cars, roads and drivers from the package's population, except overrides of the task."""
    population = read_study(_POPULATION)
    keys = [key for key in population.keys if not key.startswith(("controllers.", "sensors."))]
    factors = [one for one in population.factors if one.key in keys and one.key not in task.overrides]
    if task.maneuver == "split_mu_braking":
        factors = [one for one in factors if one.key != "road.mu"]  # its sides have their own friction
    if task.driver == "agent":
        factors = [one for one in factors if not one.key.startswith("driver.")]
    table = {
        "maneuvers": [task.maneuver],
        "vehicles": [vehicle],
        "controllers": ["none"],
        "factors": {one.key: {k: v for k, v in one.to_table().items() if k != "maneuvers"} for one in factors
                    if not one.maneuvers or task.maneuver in one.maneuvers},
        "design": {"kind": "random", "samples": count},
        "seed": seed,
    }  # fmt: skip
    study = read_study(table)
    to_overrides, (samples, *_) = FactorValues(study), study.samples()
    return [dict(to_overrides.overrides(0, 0, samples[number])) for number in range(count)]


_MEASURED: Final = (
    ("speed_mps", -100.0, 100.0),
    ("yaw_rate_radps", -5.0, 5.0),
    ("ay_mps2", -30.0, 30.0),
    ("ax_mps2", -30.0, 30.0),
    ("steering_wheel_rad", -15.0, 15.0),
    ("rear_steer_rad", -0.2, 0.2),
    ("superposition_rad", -0.2, 0.2),
)
_MEASUREMENTS: Final = [number.name for number in numbers_of(Measurement)]
_COMMANDS: Final = [number.name for number in numbers_of(DriverCommand)]
_SPEEDS: Final = tuple((f"{corner}_wheel_speed_radps", -400.0, 400.0) for corner in ("fl", "fr", "rl", "rr"))
_DEMANDS: Final = (("front_steer_demand_rad", -1.5, 1.5), ("brake_pedal", 0.0, 1.0))
_AHEAD_S: Final = (0.3, 0.6, 1.0, 1.5)
_ROAD: Final = (
    ("offset_m", -50.0, 50.0),
    ("heading_error_rad", -math.pi, math.pi),
    *((f"path_left_{ahead:g}s_m", -100.0, 100.0) for ahead in _AHEAD_S),
)
_DISTANCES_M, _DISTANCES_S = np.array([0.0, 0.1, *(0.0 for _ in _AHEAD_S)]), np.array([0.0, 0.0, *_AHEAD_S])
"""Points of the path in an observation: distances [m], and times at the current speed [s]."""
_WINDOW_M: Final = 5.0
"""Least distance to either side of a car's last place on its path in which the car is searched [m]."""
_FASTEST_MPS: Final = 70.0
"""Speed up to which a car is found on its path after any interval [m/s]."""
_ENDS: Final = ("", "time", "off course", "lost", "stopped", "diverged")
_END_NAMES: Final = np.array(_ENDS, dtype=object)
_SIDESLIP_RAD, _RATE_RADPS, _OFFSET_M = math.radians(5.0), math.radians(10.0), 1.0
"""Errors of equal cost."""
_SLOW_MPS: Final = 2.0
"""Speed below which there is no sideslip angle, and a drift has ended [m/s]."""
_MOST_AY_MPS2: Final = 8.0
"""Lateral acceleration up to which the desired yaw rate rises, as for the paper's controllers [m/s2]."""
SENSORS: Final = ("ideal", "production")


class Outcome(NamedTuple):
    """Outcome of a step, for all cars."""

    observation: NDArray[np.float32]  # shape (n, numbers), float32
    reward: Array  # shape (n,)
    # Whether the car is lost, has left its course, or the simulation diverged, shape (n,)
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]  # whether the manoeuvre is over, shape (n,)
    terms: dict[str, Array]  # term of the reward -> its part, shape (n,)
    sideslip_rad: Array  # shape (n,)
    end: NDArray[Any]  # reason of the end: "", "lost", "off course", "stopped", "diverged" or "time", shape (n,)


class Episodes:
    """Episodes of n independent cars.

    The parts of the reward, each times its weight and the time between two decisions:

        sideslip   -(beta / 5 deg)^2                     offset    -(distance from the path / 1 m)^2
        yaw_rate   -((r - r_desired) / 10 deg/s)^2       braking   deceleration / g
        effort     -mean square of the actions
        drift      exp(-((beta - target) / 10 deg)^2)    circle    exp(-(distance from the circle / 3 m)^2)
        lost       -1 once, without the time, if the episode ends by termination

    Attributes:
        task: The task.
        batch: The cars: `cars` of each episode, of which one drives.
        actions: Name, lower bound and scale of each number of an action: the command is the action times the scale.
        observations: Name and bounds of each number of an observation.
        action_space: Space of an action.
        observation_space: Space of an observation.
    """

    def __init__(
        self,
        task: str | Task,
        n: int,
        *,
        vehicle: Any = "compact",
        actuators: Sequence[str] | None = None,
        driver: str | None = None,
        sensors: str = "ideal",
        cars: int = 1,
        cars_seed: int = 0,
        interval_s: float = 0.01,
        overrides: Mapping[str, Any] | None = None,
        threads: int | None = None,
    ) -> None:
        """Build the cars of all episodes.

        Args:
            task: Name of a task, or your own.
            n: Number of episodes at a time.
            vehicle: Name, path, or table of a vehicle.
            actuators: Actuators that the agent commands: `rear`, `front`, `brakes`; default: from the task.
            driver: `driver` or `agent`: who drives; by default as in the task.
            sensors: `ideal` or `production`.
            cars: 1 for the nominal car; more for so many cars, roads and drivers from the ranges of the package's
                population, of which each episode draws one.
            cars_seed: Seed of these cars.
            interval_s: Time between two decisions [s].
            overrides: Dotted key -> value, for all cars.
            threads: Number of threads; by default as many as there are processors.

        Raises:
            ActiveSteerError: an input is wrong.
        """
        self.task = task = task if isinstance(task, Task) else TASKS[_one_of("task", task, tuple(TASKS))]
        used = tuple(task.actuators if actuators is None else actuators)
        self._agent_drives = _one_of("driver", driver or task.driver, ("driver", "agent")) == "agent"
        for name in used:
            _one_of("actuators", name, tuple(ACTUATORS))
        _one_of("sensors", sensors, SENSORS)
        self.actions = (*(HANDS if self._agent_drives else ()), *(part for name in used for part in ACTUATORS[name]))
        if not self.actions:
            raise ParameterError("the agent commands nothing; give actuators, or driver = 'agent'", key="actuators")
        common = {**task.overrides, **(overrides or {})}
        if sensors != "ideal":
            common["sensors.preset"] = sensors
        if isinstance(cars, bool) or not isinstance(cars, int) or cars < 1:
            raise ParameterError(f"is {shown(cars)}; at least 1 is needed", key="cars", value=cars)
        drawn = [{}] if cars == 1 else sampled_overrides(task, vehicle, cars, cars_seed)
        each = [{**one, **common} for one in drawn] * n
        self.batch = Batch(task.maneuver, n * cars, "none", vehicle, each, threads=threads)
        self._n, self._cars = n, cars
        self._active = np.arange(n) * cars
        self.interval_s = interval_s
        self.steps = round(interval_s / self.batch.loops[0].vehicle.timestep_s)
        if self.steps < 1 or abs(self.steps * self.batch.loops[0].vehicle.timestep_s - interval_s) > 1e-9:
            raise ParameterError(f"is {shown(interval_s)} s; a whole number of steps is needed", key="interval_s")
        self._low = np.array([low for _, low, _ in self.actions])
        paths = [path for loop in self.batch.loops if (path := loop.maneuver.setpoint(0.0).path) is not None]
        self._paths = PathSearches(paths) if paths else None
        self._on_road = task.radius_m > 0.0 or bool(paths)
        road = _ROAD if self._on_road and self._agent_drives else ()
        self.observations = (*_MEASURED, *_SPEEDS, *_DEMANDS, *road)
        self._measured = [_MEASUREMENTS.index(name) for name, _, _ in (*_MEASURED, *_SPEEDS)]
        self._demands = [_COMMANDS.index(name) for name, _, _ in _DEMANDS]
        lows, highs = (np.array([part[side] for part in self.observations], np.float32) for side in (1, 2))
        self._bounds = lows, highs
        ones = np.ones(len(self.actions), np.float32)
        self.action_space = gymnasium.spaces.Box(self._low.astype(np.float32), ones)
        self.observation_space = gymnasium.spaces.Box(*self._bounds)
        tracks = [SingleTrack(loop.controller_setup.single_track) for loop in self.batch.loops]
        self._model: Any = SimpleNamespace(
            characteristic_speed_mps=np.array([track.characteristic_speed_mps for track in tracks]),
            wheelbase_m=np.array([track.wheelbase_m for track in tracks]),
        )
        self._steps = self.batch.steps
        self._along_m = np.zeros(n * cars)
        self._started = np.zeros(n, dtype=bool)

    def reset(self, episodes: Sequence[int], generators: Sequence[np.random.Generator]) -> NDArray[np.float32]:
        """Restart some episodes, each with a newly drawn car, and return all observations."""
        for episode, generator in zip(episodes, generators, strict=True):
            self._active[episode] = episode * self._cars + int(generator.integers(self._cars))
        cars = self._active[list(episodes)]
        self.batch.reset(cars)
        self._along_m[cars] = 0.0
        self._started[list(episodes)] = True
        return self._observe(self._tracked())

    @property
    def active(self) -> NDArray[np.intp]:
        """Index of the active car of each episode."""
        return self._active % self._cars

    def loop(self, episode: int) -> Any:
        """Return the closed loop of the active car of an episode."""
        return self.batch.loops[int(self._active[episode])]

    def step(self, actions: ArrayLike, episodes: Sequence[int] | NDArray[Any] | None = None) -> Outcome:
        """Apply the actions until the next decision.

        Args:
            actions: Shape (n, numbers); an action beyond its bounds is limited to them.
            episodes: Mask of the episodes that continue; by default all. The others wait.

        Raises:
            ParameterError: an action is not finite, or an episode has not been reset.
        """
        chosen = np.ones(self._n, dtype=bool) if episodes is None else np.asarray(episodes, dtype=bool)
        given = self._checked(actions, chosen)
        if not self._started[chosen].all():
            raise ParameterError("reset the environment before its first step", key="step")
        given = self.within_bounds(np.where(chosen[:, np.newaxis], given, 0.0))
        every = np.zeros((len(self.batch), len(self.actions)))
        every[self._active] = given
        self.batch.advance(self.steps, *self.commands(every), self._active[chosen])
        tracked = self._tracked()
        terms, sideslip = self._terms(given, tracked)
        cars = self._active
        end = np.where(self.batch.step_count[cars] >= self._steps[cars], _ENDS.index("time"), 0)
        if self._on_road:
            end[np.abs(tracked[0]) > self.task.most_offset_m] = _ENDS.index("off course")
        end[np.abs(sideslip) > self.task.most_sideslip_rad] = _ENDS.index("lost")
        if self.task.radius_m:
            end[self.batch.motion.speed_mps[cars] < _SLOW_MPS] = _ENDS.index("stopped")
        if self.batch.failures:
            end[np.isin(cars, list(self.batch.failures))] = _ENDS.index("diverged")
        truncated = end == _ENDS.index("time")
        terminated = (end != 0) & ~truncated
        terms["lost"] = -self.task.weights.get("lost", 0.0) * terminated
        reward = np.nan_to_num(sum(terms.values()), nan=-self.task.weights.get("lost", 0.0))
        return Outcome(self._observe(tracked), reward, terminated, truncated, terms, sideslip, _END_NAMES[end])

    def _checked(self, actions: Any, chosen: NDArray[np.bool_]) -> Array:
        """Convert actions to an array, shape (n, numbers)."""
        shape = self._n, len(self.actions)
        with suppress(TypeError, ValueError, OverflowError):
            given = np.asarray(actions)
            if given.dtype.kind in "fiub" and given.shape == shape and np.isfinite(given[chosen]).all():
                return given.astype(np.float64)
        raise ParameterError(
            f"is {shown(actions)}; finite real numbers of shape {shape} are needed", key="action", value=actions
        )

    def within_bounds(self, actions: Array) -> Array:
        """Limit actions to their bounds."""
        return np.clip(actions, self._low, 1.0)

    def commands(self, actions: Array) -> tuple[DriverCommand | None, ActuatorCommand]:
        """Convert bounded actions to commands, arrays of length n or zeros; no driver command without an agent."""
        columns: dict[str, Any] = {
            name: scale * actions[:, place] for place, (name, _, scale) in enumerate(self.actions)
        }
        brakes = [columns.pop(name) for name, _, _ in ACTUATORS["brakes"] if name in columns]
        if brakes:
            columns["brake_torque_demand_Nm"] = np.column_stack(brakes)
        hands = {name: columns.pop(name) for name, _, _ in HANDS if name in columns}
        return DriverCommand(**hands) if self._agent_drives else None, ActuatorCommand(**columns)

    def _tracked(self) -> tuple[Array, Array, Array]:
        """Return the observations of the path: lateral distance, relative heading, and points ahead."""
        if not self._on_road:
            return np.zeros(self._n), np.zeros(self._n), np.zeros((self._n, len(_AHEAD_S)))
        motion, cars = arrays_of(Motion, self.batch.rows(Motion, self._active)), self._active
        x, y, yaw = (np.nan_to_num(place, posinf=0.0, neginf=0.0) for place in (motion.x_m, motion.y_m, motion.yaw_rad))
        distances = np.nan_to_num(motion.speed_mps)[:, np.newaxis] * _DISTANCES_S + _DISTANCES_M
        if radius := self.task.radius_m:
            around = np.arctan2(x, radius - y)[:, np.newaxis] + distances / radius
            px, py = radius * np.sin(around), radius - radius * np.cos(around)
        else:
            assert self._paths is not None  # the task has a path
            window_m = max(_WINDOW_M, self.interval_s * _FASTEST_MPS)
            found = self._paths.ahead(cars, x, y, self._along_m[cars], window_m, distances)
            self._along_m[cars], px, py = found
        heading = np.arctan2(py[:, 1] - py[:, 0], px[:, 1] - px[:, 0])
        offset = np.cos(heading) * (y - py[:, 0]) - np.sin(heading) * (x - px[:, 0])
        error = (yaw - heading + math.pi) % math.tau - math.pi
        ahead = np.cos(yaw) * (py[:, 2:] - y[:, np.newaxis]).T - np.sin(yaw) * (px[:, 2:] - x[:, np.newaxis]).T
        return offset, error, ahead.T

    def _observe(self, tracked: tuple[Array, Array, Array]) -> NDArray[np.float32]:
        parts = [self.batch.rows(Measurement, self._active)[:, self._measured]]
        parts.append(self.batch.rows(DriverCommand, self._active)[:, self._demands])
        if len(self.observations) > len(self._measured) + len(self._demands):
            parts += [tracked[0][:, np.newaxis], tracked[1][:, np.newaxis], tracked[2]]
        return np.clip(np.nan_to_num(np.hstack(parts)).astype(np.float32), *self._bounds)

    def _terms(self, actions: Array, tracked: tuple[Array, Array, Array]) -> tuple[dict[str, Array], Array]:
        cars, task = self._active, self.task
        motion = arrays_of(Motion, self.batch.rows(Motion, cars))
        speed, rate, lateral = motion.speed_mps, motion.yaw_rate_radps, motion.lateral_speed_mps
        sideslip = np.where(np.hypot(speed, lateral) > _SLOW_MPS, np.arctan2(lateral, speed), 0.0)

        def yaw_rate_error() -> Array:
            model: Any = SimpleNamespace(**{name: value[cars] for name, value in vars(self._model).items()})
            most = _MOST_AY_MPS2 / np.maximum(speed, 3.0)
            front_rad = self.batch.rows(DriverCommand, cars)[:, _COMMANDS.index("front_steer_demand_rad")]
            return rate - np.clip(yaw_rate_gain(model, speed) * front_rad, -most, most)

        formulas = {
            "sideslip": lambda: -((sideslip / _SIDESLIP_RAD) ** 2),
            "yaw_rate": lambda: -((yaw_rate_error() / _RATE_RADPS) ** 2),
            "offset": lambda: -((tracked[0] / _OFFSET_M) ** 2),
            "braking": lambda: -self.batch.rows(Measurement, cars)[:, _MEASUREMENTS.index("ax_mps2")] / 9.81,
            "effort": lambda: -np.mean(actions**2, axis=1),
            "drift": lambda: np.exp(-(((sideslip - task.sideslip_rad) / math.radians(10.0)) ** 2)),
            "circle": lambda: np.exp(-((tracked[0] / 3.0) ** 2)),
        }
        weights = {name: weight for name, weight in task.weights.items() if name in formulas}
        return {name: weight * self.interval_s * formulas[name]() for name, weight in weights.items()}, sideslip


def _one_of(key: str, value: Any, allowed: tuple[str, ...]) -> Any:
    if value not in allowed:
        raise ParameterError(f"is {shown(value)}; one of {', '.join(allowed)} is needed", key=key, value=value)
    return value
