"""Runs of a tenth of a second, for tests of the code around runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

MANEUVER: dict[str, Any] = {
    "name": "short", "kind": "step_steer", "speed_kmh": 80, "duration_s": 2.3, "settle_s": 0.1,
    "steer": {"start_s": 0.05, "steering_wheel_deg": 20.0},
}  # fmt: skip

RATIO: Final = "steering.ratio"
"""The key that those controllers look at."""

CONTROLLER = '''
import os
import signal
from pathlib import Path

from activesteer import ActuatorCommand


class Kills:
    """Ends its process in a sample of its own choice: always, or where the file does not exist, once."""

    def __init__(self, ratio):
        if ratio == {kills_at!r} and not ({once!r} and Path({once!r}).exists()):
            if {once!r}:
                Path({once!r}).touch()
            os.kill(os.getpid(), signal.SIGKILL)

    @classmethod
    def from_vehicle(cls, setup):
        return cls(setup.steering_ratio)

    def step(self, command, measurement):
        return ActuatorCommand(0.0, 0.0)


class Fails(Kills):
    """Raises in that sample instead."""

    def __init__(self, ratio):
        self.fails = ratio == {kills_at!r}

    def step(self, command, measurement):
        if self.fails and measurement.steering_wheel_rad > 0.1:
            raise RuntimeError("on purpose")
        return ActuatorCommand(0.0, 0.0)
'''


def write_controller(folder: Path, kills_at: float, once: str = "") -> str:
    """Return a file with controllers that fail at a steering ratio."""
    path = folder / "bad.py"
    path.write_text(CONTROLLER.format(kills_at=kills_at, once=once), encoding="utf-8")
    return str(path)


TIMESTEP_S: Final = 0.002
"""Twice the default step, which halves the time of a run."""


def short_study(*values: float, key: str = "road.mu", **more: Any) -> dict[str, Any]:
    """Return a study of short runs over the friction of the road, or another key."""
    return {"maneuvers": [MANEUVER], "timestep_s": TIMESTEP_S, "factors": {key: {"grid": list(values)}}, **more}
