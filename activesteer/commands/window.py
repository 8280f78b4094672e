"""The window in which `activesteer run --watch` shows a manoeuvre while it is driven."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

_LONGEST_CLOSING_S: Final = 5.0


def watch(scenario: Any, controller: str, speed: float, *, cutaway: bool) -> None:
    """Drive a scenario again and again in a window until it is closed; nothing is recorded."""
    import mujoco.viewer

    from activesteer.simulation.closed_loop import ClosedLoop
    from activesteer.simulation.live_view import Keys, Pacer, drive, scene_for

    simulation, keys = ClosedLoop(scenario, controller), Keys()
    scene = scene_for(simulation, scenario.maneuver, controller, cutaway=cutaway)
    with (
        _threads_joined(),
        mujoco.viewer.launch_passive(
            scene.model, scene.data, show_left_ui=False, show_right_ui=False, key_callback=keys
        ) as viewer,
    ):
        pacer = Pacer(speed)
        while viewer.is_running():
            driven = drive(simulation, scene, viewer, pacer, keys)
            slow = f", {pacer.lost_s:.1f} s slower than the clock" if pacer.lost_s >= 0.1 else ""
            if driven.finished:
                print(
                    f"{driven.simulated_s:.1f} s driven{slow}; R drives again, close the window to end", file=sys.stderr
                )
            elif not keys.restart:
                print(f"closed at {driven.simulated_s:.1f} s{slow}", file=sys.stderr)
            while driven.finished and viewer.is_running() and not keys.restart:
                time.sleep(0.05)
                viewer.sync()
            pacer = Pacer(pacer.speed)
            simulation = ClosedLoop(scenario, controller)


@contextmanager
def _threads_joined() -> Iterator[None]:
    """Wait for the thread of the viewer at the end; without it, the shutdown of Python crashes."""
    before = set(threading.enumerate())
    try:
        yield
    finally:
        for thread in set(threading.enumerate()) - before:
            thread.join(_LONGEST_CLOSING_S)
