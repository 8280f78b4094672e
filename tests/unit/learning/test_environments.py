"""Gymnasium environments: valid, repeatable, and many at once equal to one by one."""

import math
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from activesteer.analysis.lanes import path_distance
from activesteer.errors import ParameterError, PlaybackError
from activesteer.learning import TASKS, CarEnv, CarVectorEnv, normalised
from activesteer.theory.single_track import SingleTrack, yaw_rate_gain
from tests.raising import raises

SHORT = {"overrides": {"settle_s": 0.2, "duration_s": 0.8}, "interval_s": 0.1}
"""Episodes of eight steps, so that some end while others go on."""


@pytest.mark.parametrize("name", TASKS)
def test_each_environment_passes_the_checks_without_a_warning(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(f"activesteer/{name}-v0").unwrapped, skip_render_check=True)


def test_an_episode_repeats_to_the_last_bit_with_its_seed() -> None:
    env = CarEnv("SineWithDwell", actuators=("rear", "brakes"), sensors="production", cars=3)
    runs = []
    for _ in range(2):
        first, info = env.reset(seed=5)
        env.action_space.seed(5)
        runs.append([(info["car"], first), *(env.step(env.action_space.sample())[:2] for _ in range(60))])
    for (one, seen), (other, again) in zip(*runs, strict=True):
        assert np.array_equal(one, other)
        assert np.array_equal(seen, again)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_many_at_once_equal_one_by_one(mode: AutoresetMode) -> None:
    options: dict[str, Any] = {**SHORT, "cars": 2}
    makers = [lambda: CarEnv("SplitMuBraking", **options)] * 3
    alone, together = (
        SyncVectorEnv(makers, autoreset_mode=mode),
        CarVectorEnv("SplitMuBraking", 3, mode, threads=2, **options),
    )
    assert together.metadata["autoreset_mode"] == mode
    rng = np.random.default_rng(1)
    pair = [env.reset(seed=3) for env in (alone, together)]
    same(pair[0], pair[1])
    done = np.zeros(3, dtype=bool)
    for number in range(20):
        if mode == AutoresetMode.DISABLED and done.any():
            same(*(env.reset(options={"reset_mask": done.copy()}) for env in (alone, together)))
        elif number == 2:
            mask = np.array([False, True, False])
            same(*(env.reset(options={"reset_mask": mask.copy()}) for env in (alone, together)))
        actions = rng.uniform(-1.0, 1.0, (3, 1)).astype(np.float32)
        results = [env.step(actions) for env in (alone, together)]
        same(*results)
        done = results[0][2] | results[0][3]


def same(one: Any, other: Any) -> None:
    """Assert that two results of environments are equal, with their infos."""
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            same(one[key], other[key])
    elif isinstance(one, tuple) or (isinstance(one, np.ndarray) and one.dtype == object):
        for left, right in zip(one, other, strict=True):
            same(left, right)
    else:
        assert np.array_equal(one, other), (one, other)


@pytest.mark.parametrize(("task", "options"), [
    ("SineWithDwell", {"actuators": ("rear", "front", "brakes"), "cars": 3}),
    ("SplitMuBraking", {"driver": "agent", "overrides": {"duration_s": 0.75}}),
])  # fmt: skip
def test_the_recording_of_an_episode_is_the_episode(task: str, options: dict[str, Any]) -> None:
    env = CarEnv(task, interval_s=0.1, **options)
    first, _ = env.reset(seed=2)
    env.action_space.seed(2)
    seen, truncated = [first], False
    while len(seen) < 12 and not truncated:
        observation, _, _, truncated, _ = env.step(1.2 * env.action_space.sample())
        seen.append(observation)
    recording = env.recording()
    names = [name for name, _, _ in env.episodes.observations]
    assert recording.metadata["complete"] == truncated
    for number, observation in enumerate(seen[1:-1], 1):
        for name in ("fl_wheel_speed_radps", "rr_wheel_speed_radps", "steering_wheel_rad"):
            recorded = recording[name][100 * number - 1]
            assert observation[names.index(name)] == pytest.approx(recorded, rel=1e-6, abs=1e-7)
    assert len(recording) == min(100 * (len(seen) - 1), env.episodes.batch.steps[0])


def test_the_registered_name_makes_many_at_once() -> None:
    env = gymnasium.make_vec("activesteer/Slalom-v0", 2, vectorization_mode="vector_entry_point", interval_s=0.05)
    assert isinstance(env.unwrapped, CarVectorEnv)
    env.reset(seed=1)
    shape = env.unwrapped.single_observation_space.shape
    assert env.step(np.zeros((2, 1), np.float32))[0].shape == (2, *(shape or ()))


def test_the_reward_is_the_sum_of_its_terms_and_ends_have_reasons() -> None:
    env = CarEnv("Drift")
    env.reset(seed=1)
    for _ in range(600):
        _, reward, terminated, _, info = env.step(np.array([0.5, 1.0, 0.0], np.float32))
        assert reward == pytest.approx(sum(info["reward_terms"].values()))
        if terminated:
            break
    else:
        pytest.fail("the episode has no end")
    assert info["end"] in ("lost", "off course", "stopped")


@pytest.mark.parametrize("task", ["SplitMuBraking", "Drift"])
def test_the_terms_of_the_reward_are_those_of_the_recorded_motion(task: str) -> None:
    short = {"duration_s": 2.0, "brake.start_s": 0.3} if task == "SplitMuBraking" else {"duration_s": 2.0}
    env = CarEnv(task, interval_s=0.1, overrides={"settle_s": 0.5, **short})
    env.reset(seed=1)
    env.action_space.seed(1)
    actions, terms = [], []
    for _ in range(16):
        # An agent who drives steers to the left and accelerates.
        actions.append(np.array([0.2, 0.3, 0.0]) if task == "Drift" else env.action_space.sample())
        terms.append(env.step(actions[-1].astype(np.float32))[4]["reward_terms"])
    run, rows = env.recording(), 100 * np.arange(1, 16) - 1

    def at(name: str) -> np.ndarray:
        return run[name][rows]

    sideslip = np.arctan2(at("vy_mps"), at("vx_mps"))
    mean_square = np.mean(np.square(actions[:15]), axis=1)
    if task == "Drift":
        offset = 25.0 - np.hypot(at("x_m"), 25.0 - at("y_m"))
        drift = (sideslip + math.radians(25.0)) / math.radians(10.0)
        expected = {
            "drift": np.exp(-(drift**2)), "circle": np.exp(-((offset / 3.0) ** 2)), "effort": -0.02 * mean_square,
        }  # fmt: skip
    else:
        # The desired yaw rate stays below its limit. The accelerometer pitches with the body, and shows gravity.
        braking = -(at("ax_mps2") / 9.81 - np.sin(at("pitch_rad")))
        config = env.episodes.loop(0).controller_setup.single_track
        gain = yaw_rate_gain(SingleTrack(config), at("vx_mps"))
        demand = at("front_steer_demand_rad")
        # The yaw rate of the motion is that of the body, and a step newer than its other members.
        turning = run["yaw_rate_radps"] * np.cos(run["roll_rad"]) * np.cos(run["pitch_rad"])
        newer = (turning - run["pitch_rate_radps"] * np.sin(run["roll_rad"]))[rows + 1]
        expected = {
            "sideslip": -((sideslip / math.radians(5.0)) ** 2), "effort": -0.02 * mean_square,
            "offset": -(at("y_m") ** 2), "braking": 0.5 * braking,
            "yaw_rate": -(((newer - gain * demand) / math.radians(10.0)) ** 2),
        }  # fmt: skip
        assert expected["braking"][-1] > 0.1
    for name, values in expected.items():
        found = np.array([each[name] for each in terms[:15]])
        assert found == pytest.approx(0.1 * values, rel=5e-3, abs=2e-5), name
        assert np.ptp(found) > 0.0 or name == "effort"


def test_the_offset_is_the_distance_from_the_path() -> None:
    env = CarEnv("Slalom", interval_s=0.2, overrides={"settle_s": 0.5})
    env.reset(seed=1)
    offsets = [env.step(np.zeros(1, np.float32))[4]["reward_terms"]["offset"] for _ in range(25)]
    run, rows = env.recording(), 200 * np.arange(1, 26) - 1
    path = env.episodes.loop(0).maneuver.course.path
    distance = path_distance(run["x_m"][rows], run["y_m"][rows], path.x_m, path.y_m)
    assert np.abs(distance).max() > 0.2
    # The offset is across a chord of 0.1 m at the nearest place; points of the path are 0.5 m apart.
    assert np.sqrt(-np.array(offsets) / 0.2) == pytest.approx(np.abs(distance), abs=4e-3)


def test_observations_are_normalised_on_request() -> None:
    env = normalised(CarEnv("SineWithDwell"))
    first, _ = env.reset(seed=1)
    assert env.observation_space.contains(first)
    assert first[0] == pytest.approx(80.0 / 3.6 / 100.0, abs=1e-3)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"task": "Parking"}, "SineWithDwell"),
        ({"actuators": ("wings",)}, "rear, front, brakes"),
        ({"actuators": ()}, "commands nothing"),
        ({"sensors": "good"}, "ideal, production"),
        ({"cars": 0}, "at least 1"),
        ({"interval_s": 0.0015}, "whole number"),
        ({"render_mode": "ascii"}, "rgb_array"),
    ],
)
def test_wrong_options_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        CarEnv(**options)


@pytest.mark.parametrize("action", ["left", [0.0, 1j], np.zeros(7), None, [10**400], [math.nan]])
def test_an_action_of_another_form_is_one_error(action: Any) -> None:
    env = CarEnv("SineWithDwell")
    env.reset(seed=1)
    with raises(ParameterError, key="action"):
        env.step(action)
    with raises(ParameterError, key="sensor"):
        CarEnv("SineWithDwell", sensor="production")


def test_a_window_without_a_display_is_refused_before_it_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(PlaybackError, match="no display to open a window on"):
        CarEnv("SineWithDwell", render_mode="human")
