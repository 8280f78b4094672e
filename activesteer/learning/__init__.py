"""Gymnasium environments on `Batch`, registered on import.

Examples:
    >>> import gymnasium
    >>> import activesteer.learning
    >>> env = gymnasium.make("activesteer/SineWithDwell-v0")
    >>> observation, info = env.reset(seed=1)
    >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

In: actions of an agent.
Out: observations, rewards, and recordings of episodes.
"""

from __future__ import annotations

from activesteer.errors import ParameterError, not_installed

try:
    import gymnasium
except ImportError as reason:
    raise not_installed(ParameterError, "activesteer.learning", "gymnasium", "gym") from reason

from activesteer.learning.environments import CarEnv, CarVectorEnv, normalised
from activesteer.learning.episodes import TASKS, Episodes, Task

__all__ = ["TASKS", "CarEnv", "CarVectorEnv", "Episodes", "Task", "normalised"]

for _name in TASKS:
    if (_id := f"activesteer/{_name}-v0") not in gymnasium.registry:
        gymnasium.register(
            _id,
            entry_point="activesteer.learning.environments:CarEnv",
            vector_entry_point="activesteer.learning.environments:CarVectorEnv",
            kwargs={"task": _name},
        )
