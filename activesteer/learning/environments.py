"""The environments: one car, and many cars in one native call."""

from __future__ import annotations

from contextlib import suppress
from inspect import signature
from typing import Any, Final

import gymnasium
import numpy as np
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from mujoco import MjvCamera
from numpy.typing import NDArray

from activesteer.errors import ParameterError, SimulationDiverged, nearest_names, shown
from activesteer.learning.episodes import Episodes, Outcome, Task
from activesteer.recording import Recording
from activesteer.simulation.simulation import Simulation

_SIZE: Final = (640, 360)
_FPS: Final = 25


class CarEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """A car in a manoeuvre, whose actuators the agent commands every 10 ms.

    Actions (`Box`, float32, -1 to 1 or 0 to 1), in the order of `episodes.actions`, by the options. The command is the
    action times its scale:

        driver="agent"       steering wheel 2 pi rad, drive torque 2500 N m (-1 to 1); brake pedal 1 (0 to 1)
        actuators "rear"     rear wheels 0.0524 rad (3 deg), left positive (-1 to 1)
        actuators "front"    superposition 0.0524 rad at the road wheels, left positive (-1 to 1)
        actuators "brakes"   brake torques of fl, fr, rl and rr 1500 N m (0 to 1)

    Observations (`Box`, float32), in the order of `episodes.observations`: speed_mps [m/s] +-100, yaw_rate_radps
    [rad/s] +-5, ay_mps2 and ax_mps2 [m/s2] +-30, steering_wheel_rad [rad] +-15, rear_steer_rad and superposition_rad
    [rad] +-0.2, four wheel speeds [rad/s] +-400, the driver's front_steer_demand_rad [rad] +-1.5 and brake_pedal 0 to
    1. If the agent drives on a path: offset_m to its left [m] +-50, heading_error_rad [rad] +-pi, and the distance of
    the path to the left of the line straight ahead after 0.3, 0.6, 1.0 and 1.5 s [m] +-100. `normalised` scales them to
    -1 to 1.

    The reward and the reasons for an end follow `Episodes`; `info` has `reward_terms`, `sideslip_rad` and `end`, after
    a reset the number of the `car` that was drawn.

    Attributes:
        episodes: The simulation.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": _FPS}  # noqa: RUF012 - its base's

    def __init__(self, task: str | Task = "SineWithDwell", render_mode: str | None = None, **options: Any) -> None:
        """Build the car.

        Args:
            task: Name of a task, or your own.
            render_mode: `rgb_array`, `human` or None.
            options: Options of `Episodes`: `vehicle`, `actuators`, `driver`, `sensors`, `cars`, `cars_seed`,
                `interval_s`, `overrides`.

        Raises:
            ActiveSteerError: an input is wrong, or there is no display for `human`.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            allowed = ", ".join(self.metadata["render_modes"])
            raise ParameterError(f"is {shown(render_mode)}; {allowed} or None is needed", key="render_mode")
        if render_mode == "human":
            from activesteer.simulation.live_view import check_display  # noqa: PLC0415 - graphics only where asked for

            check_display()
        self.render_mode = render_mode
        self.episodes = Episodes(task, 1, **{"threads": 1, **_known(options)})
        self.action_space = self.episodes.action_space
        self.observation_space = self.episodes.observation_space
        self._picture: _Picture | None = None
        self._given: list[NDArray[Any]] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode at the start of the manoeuvre (see `gymnasium.Env.reset`)."""
        super().reset(seed=seed)
        (observation,) = self.episodes.reset([0], [self.np_random])
        self.close()
        self._given = []
        if self.render_mode == "human":
            self.render()
        return observation, {"car": int(self.episodes.active[0])}

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Drive until the next decision (see `gymnasium.Env.step`)."""
        found = self.episodes.step([action])
        self._given.append(np.array(action, dtype=np.float64))
        info = {
            "reward_terms": {name: float(value[0]) for name, value in found.terms.items()},
            "sideslip_rad": float(found.sideslip_rad[0]),
            "end": str(found.end[0]),
        }
        if self.render_mode == "human":
            self.render()
        return (
            found.observation[0], float(found.reward[0]), bool(found.terminated[0]), bool(found.truncated[0]), info
        )  # fmt: skip

    def render(self) -> Any:
        """Return an image, or show it in MuJoCo's viewer."""
        if self.render_mode is None:
            return None
        loop = self.episodes.loop(0)
        if self._picture is None:
            self._picture = _Picture(loop, window=self.render_mode == "human")
        return self._picture.drawn(loop)

    def recording(self) -> Recording:
        """Repeat the episode with the actions so far, and return its recording.

        The recording is bit-identical to the episode. Its `save` writes a file for `activesteer replay`, `video`
        and `report`.
        """
        simulation = Simulation(self.episodes.loop(0).scenario)
        with suppress(SimulationDiverged):  # the episode has diverged too
            for action in self._given:
                driver, controller = self.episodes.commands(self.episodes.within_bounds(action[np.newaxis]))
                steps = min(self.episodes.steps, simulation.steps - simulation.loop.step_count)
                simulation.advance(steps, None if driver is None else _first(driver), _first(controller))
        return simulation.recording()

    def close(self) -> None:
        """Close the window or the canvas."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None


def _first(command: Any) -> Any:
    """Return the command of the first car of a batch."""
    first = (value[0].tolist() if isinstance(value, np.ndarray) else value for value in command)
    return type(command)(*(tuple(value) if isinstance(value, list) else value for value in first))


def _known(options: dict[str, Any]) -> dict[str, Any]:
    """Return options of `Episodes`, after a check of their names."""
    names = [name for name in signature(Episodes).parameters if name not in ("task", "n")]
    for name in options:
        if name not in names:
            raise ParameterError(f"is not an option; {nearest_names(name, names)}", key=name, allowed=names)
    return options


class _Picture:
    """A camera behind a car, offscreen or in a window."""

    def __init__(self, loop: Any, *, window: bool) -> None:
        from activesteer.simulation.live_view import scene_for  # noqa: PLC0415 - graphics only where asked for
        from activesteer.video.offscreen import Offscreen  # noqa: PLC0415

        self._scene = scene_for(loop, loop.maneuver)
        self._canvas = self._viewer = None
        if window:
            from mujoco.viewer import launch_passive  # noqa: PLC0415

            self._viewer = launch_passive(self._scene.model, self._scene.data)
            self._camera = self._viewer.cam
        else:
            self._scene.model.vis.global_.offwidth = max(_SIZE[0], self._scene.model.vis.global_.offwidth)
            self._canvas, self._camera = Offscreen(self._scene.model, _SIZE), MjvCamera()

    def drawn(self, loop: Any) -> Any:
        motion, data = loop.motion, loop.vehicle.data
        self._scene.place(0, data.xpos[1:], data.xquat[1:])
        self._scene.update()
        camera = self._camera
        camera.lookat[:] = motion.x_m, motion.y_m, 0.5
        camera.distance, camera.elevation, camera.azimuth = 9.0, -17.0, np.degrees(motion.yaw_rad)
        if self._viewer is not None:
            self._viewer.sync()
            return None
        assert self._canvas is not None
        self._canvas.prepare(self._scene.data, camera)
        return self._canvas.draw().copy()

    def close(self) -> None:
        for shown_in in (self._canvas, self._viewer):
            if shown_in is not None:
                shown_in.close()


class CarVectorEnv(gymnasium.vector.VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[Any]]):
    """Many `CarEnv` in one native call, bit-identical to `SyncVectorEnv` in every autoreset mode.

    Attributes:
        episodes: The simulation.
    """

    def __init__(
        self,
        task: str | Task = "SineWithDwell",
        num_envs: int = 1,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        """Build the cars.

        Args:
            task: Name of a task, or your own.
            num_envs: Number of environments.
            autoreset_mode: `NextStep`, `SameStep` or `Disabled`.
            render_mode: Must be None; render a `CarEnv` instead.
            options: Options of `Episodes`.

        Raises:
            ActiveSteerError: an input is wrong.
        """
        if render_mode is not None:
            raise ParameterError("is available in the single environment only", key="render_mode", value=render_mode)
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**CarEnv.metadata, "autoreset_mode": self.autoreset_mode}
        self.num_envs, self.episodes = num_envs, Episodes(task, num_envs, **_known(options))
        self.single_action_space = self.episodes.action_space
        self.single_observation_space = self.episodes.observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._generators = [np.random.default_rng() for _ in range(num_envs)]
        self._over = np.zeros(num_envs, dtype=bool)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start all episodes, or only `options["reset_mask"]` (see `gymnasium.vector.VectorEnv.reset`)."""
        seeds = [seed + number for number in range(self.num_envs)] if isinstance(seed, int) else seed
        mask = np.ones(self.num_envs, dtype=bool)
        if options is not None and "reset_mask" in options:
            mask = options["reset_mask"]
            if not isinstance(mask, np.ndarray) or mask.shape != (self.num_envs,) or mask.dtype != np.bool_:
                raise ParameterError(f"is {shown(mask)}; a mask of {self.num_envs} is needed", key="reset_mask")
        for number, own in enumerate(seeds or ()):
            if mask[number] and own is not None:
                self._generators[number], _ = np_random(own)
        observation = self._restart(mask)
        return observation, self._drawn(mask)

    def _restart(self, mask: NDArray[np.bool_]) -> NDArray[np.float32]:
        numbers = np.flatnonzero(mask).tolist()
        self._over[mask] = False
        return self.episodes.reset(numbers, [self._generators[number] for number in numbers])

    def _drawn(self, mask: NDArray[np.bool_]) -> dict[str, Any]:
        return {"car": np.where(mask, self.episodes.active, 0), "_car": mask.copy()} if mask.any() else {}

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Drive all cars until the next decision (see `gymnasium.vector.VectorEnv.step`)."""
        over = self._over.copy()
        if over.any() and self.autoreset_mode == AutoresetMode.DISABLED:
            raise ParameterError(f"episodes {np.flatnonzero(over).tolist()} are over; reset them", key="reset_mask")
        found = self.episodes.step(actions, ~over)
        reward, terminated, truncated = found.reward, found.terminated & ~over, found.truncated & ~over
        observation, infos = found.observation, {}
        if over.any():
            reward, observation = np.where(over, 0.0, reward), self._restart(over)
            infos |= self._drawn(over)
        done = terminated | truncated
        if self.autoreset_mode == AutoresetMode.SAME_STEP and done.any():
            final = np.full(self.num_envs, None, dtype=object)
            for number in np.flatnonzero(done).tolist():
                final[number] = observation[number].copy()
            infos |= {"final_obs": final, "_final_obs": done.copy()}
            infos |= {"final_info": self._told(found, done), "_final_info": done.copy()}
            observation = self._restart(done)
            infos |= self._drawn(done) | self._told(found, ~done)
        else:
            self._over = done
            infos |= self._told(found, ~over)
        return observation, reward, terminated, truncated, infos

    @staticmethod
    def _told(found: Outcome, mask: NDArray[np.bool_]) -> dict[str, Any]:
        """Return the infos of the masked environments in the format of `VectorEnv`."""
        if not mask.any():
            return {}
        terms: dict[str, Any] = {}
        for name, value in found.terms.items():
            terms |= {name: np.where(mask, value, 0.0), f"_{name}": mask.copy()}
        ends = found.end.copy()
        ends[~mask] = None
        infos = {"reward_terms": terms, "sideslip_rad": np.where(mask, found.sideslip_rad, 0.0), "end": ends}
        return infos | {f"_{name}": mask.copy() for name in infos}


def normalised(env: gymnasium.Env[Any, Any]) -> gymnasium.Env[Any, Any]:
    """Scale the observations of an environment to -1 to 1, linearly between their bounds."""
    return gymnasium.wrappers.RescaleObservation(env, np.float32(-1.0), np.float32(1.0))
