"""Live view: the simulation at the pace of a clock, and its scene."""

from __future__ import annotations

import math
import re
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

from activesteer.core.conventions import run_looks
from activesteer.core.units import quantity_of
from activesteer.drawing.car_model import scene_of
from activesteer.drawing.cars import SLOWEST_MPS
from activesteer.errors import PlaybackError
from activesteer.maneuver import Maneuver
from activesteer.road.course import Footprint
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.video import FilmedCar, RenderScene
from activesteer.video.film import CUTAWAY

FRAME_S: Final = 0.016
"""Shortest time between two frames [s]: a screen shows 60 per second."""
_MAX_S: Final = 0.1  # a slower drive is better than a jerky one
"""Longest time between two frames [s]; longer drawing or simulating slows the drive down."""
_SLOWER: Final = (ord("-"), 333)
_FASTER: Final = (ord("="), ord("+"), 334)
"""Codes of minus and plus, also on the number pad."""
_SLOWEST, _FASTEST = 0.01, 100.0
_LONGEST_CLOSING_S: Final = 5.0
_TURN_S: Final = 0.4
"""Time constant of the camera's direction behind the car's direction of motion [s]."""


class FramePacer:
    """Pacer that synchronises simulated time with a clock, `speed` simulated seconds per second."""

    def __init__(
        self,
        speed: float = 1.0,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], object] = time.sleep,
    ) -> None:
        """Set the clock, which starts with the first frame."""
        self.speed, self._clock, self._sleep = speed, clock, sleep
        self._start_s: float | None = None
        self.lost_s = 0.0

    def change_speed(self, factor: float) -> None:
        """Change the speed by a factor, from the next frame on."""
        self.speed, self._start_s = min(max(self.speed * factor, _SLOWEST), _FASTEST), None

    def wait(self) -> None:
        """Wait for the duration of one frame while simulated time stands still."""
        self._sleep(FRAME_S)
        self._start_s = None

    def next(self, shown_s: float) -> float:
        """Wait until the next frame is due."""
        now_s = self._clock()
        if self._start_s is None:
            self._start_s = now_s - shown_s / self.speed
        passed_s = now_s - self._start_s - shown_s / self.speed
        if passed_s < FRAME_S:
            self._sleep(FRAME_S - passed_s)
            passed_s = FRAME_S
        elif passed_s > _MAX_S:
            self._start_s += passed_s - _MAX_S
            self.lost_s += passed_s - _MAX_S
            passed_s = _MAX_S
        return shown_s + passed_s * self.speed


class Keys:
    """Keys of the window: space pauses, R restarts, minus and plus halve and double the speed before the next frame."""

    def __init__(self) -> None:
        """Start with a drive that runs."""
        self.paused = self.restart = False
        self.faster = 1.0

    def __call__(self, code: int) -> None:
        """Handle a key of the window, given by its GLFW code."""
        if code == ord(" "):
            self.paused = not self.paused
        elif code == ord("R"):
            self.restart, self.paused = True, False
        elif code in _SLOWER:
            self.faster *= 0.5
        elif code in _FASTER:
            self.faster *= 2.0


def scene_for(
    simulation: ClosedLoop, maneuver: Maneuver, controller: str = "none", *, cutaway: bool = False
) -> RenderScene:
    """Return the scene for a simulation's car."""
    vehicle = simulation.vehicle
    size = Footprint.from_table(vehicle.dimensions())
    colour = run_looks([controller])[controller].on_dark
    car = FilmedCar(scene_of(vehicle.model), vehicle.body_names, colour, CUTAWAY if cutaway else 1.0, size=size)
    return RenderScene([car], maneuver.course, maneuver.ground)


def drive(simulation: ClosedLoop, scene: RenderScene, viewer: Any, pacer: FramePacer, keys: Keys) -> tuple[float, bool]:
    """Drive and show a manoeuvre, and return the simulated time [s] and whether it was driven to its end."""
    vehicle, timestep_s = simulation.vehicle, simulation.vehicle.timestep_s
    follow = _Follow(simulation)
    keys.restart = False
    done = 0
    while viewer.is_running() and not keys.restart:
        now_s = done * timestep_s
        if keys.faster != 1.0:
            pacer.change_speed(keys.faster)
            keys.faster = 1.0
        # Font and place are the default ones.
        viewer.set_texts((None, None, *_texts(simulation, now_s, pacer.speed, paused=keys.paused)))
        # Under one lock: a picture in between would combine the camera of one instant with the car of another.
        with viewer.lock():
            scene.place(0, vehicle.data.xpos[1:], vehicle.data.xquat[1:])
            scene.update()
            follow(viewer.cam, now_s)
            viewer.sync()
        if done >= simulation.steps:
            return now_s, True
        if keys.paused:
            pacer.wait()
            continue
        target = round(pacer.next(now_s) / timestep_s)
        steps = max(1, min(target, simulation.steps) - done)
        simulation.advance(steps)
        done += steps
    return done * timestep_s, False


class _Follow:
    """Camera that follows the car at the direction and distance that the user chooses."""

    def __init__(self, simulation: ClosedLoop) -> None:
        self._simulation = simulation
        self._direction_rad: float | None = None
        self._time_s = 0.0

    def __call__(self, camera: Any, time_s: float) -> None:
        motion = self._simulation.vehicle.motion()
        if self._direction_rad is None:
            self._direction_rad = motion.yaw_rad
            camera.distance, camera.elevation, camera.azimuth = 9.0, -17.0, math.degrees(motion.yaw_rad)
        wanted = self._direction_rad
        if math.hypot(motion.speed_mps, motion.lateral_speed_mps) > SLOWEST_MPS:
            wanted = motion.yaw_rad + math.atan2(motion.lateral_speed_mps, motion.speed_mps)
        turn = math.remainder(wanted - self._direction_rad, math.tau) * -math.expm1((self._time_s - time_s) / _TURN_S)
        self._direction_rad += turn
        self._time_s = time_s
        camera.azimuth += math.degrees(turn)
        camera.lookat[:] = motion.x_m, motion.y_m, 0.5


def _texts(simulation: ClosedLoop, time_s: float, speed: float, *, paused: bool) -> tuple[str, str]:
    """Return the lines of the overlay: names and values, and the keys."""
    vehicle = simulation.vehicle
    measured, motion = vehicle.measure(), vehicle.motion()
    moving = motion.speed_mps > SLOWEST_MPS
    sideslip = math.atan2(motion.lateral_speed_mps, motion.speed_mps) if moving else 0.0
    values = {
        "time_s": time_s,
        "speed_mps": measured.speed_mps,
        "steering_wheel_rad": measured.steering_wheel_rad,
        "sideslip_rad": sideslip,
        "rear_steer_rad": measured.rear_steer_rad,
        "superposition_rad": measured.superposition_rad,
    }
    shown = {quantity_of(channel): value for channel, value in values.items()}
    names = [*(item.short for item in shown), "pace", "space", "R", "- +"]
    pace = "paused" if paused else f"{speed:g} x real time"
    told = [*(f"{item.value_text(value)} {item.unit.name}" for item, value in shown.items()), pace]
    return "\n".join(names), "\n".join([*told, "pause", "restart", "slower, faster"])


def check_display() -> None:
    """Check that there is a display with OpenGL. Without one, the viewer would wait forever."""
    import glfw  # noqa: PLC0415 - looks for its library when it is imported

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        window = None
        if glfw.init():
            glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
            window = glfw.create_window(16, 16, "activesteer", None, None)
            if window:
                glfw.destroy_window(window)
            glfw.terminate()
    if not window:
        # GLFW's messages come as "(number) b'words'".
        reasons = [re.sub(r"^\(\d+\) b'(.*)'$", r"\1", str(warning.message)) for warning in caught]
        msg = f"there is no display to open a window on: {reasons[-1] if reasons else 'GLFW gives no reason'}"
        raise PlaybackError(f"{msg}; `activesteer video` makes a film of a recording without a window")


def watch(scenario: Any, controller: str, speed: float, *, cutaway: bool) -> None:
    """Drive a scenario repeatedly in a window until it is closed, without a recording."""
    import mujoco.viewer  # noqa: PLC0415 - needs a display

    simulation, keys = ClosedLoop(scenario, controller), Keys()
    scene = scene_for(simulation, scenario.maneuver, controller, cutaway=cutaway)
    with (
        _threads_joined(),
        mujoco.viewer.launch_passive(
            scene.model, scene.data, show_left_ui=False, show_right_ui=False, key_callback=keys
        ) as viewer,
    ):
        pacer = FramePacer(speed)
        while viewer.is_running():
            simulated_s, finished = drive(simulation, scene, viewer, pacer, keys)
            slow = f", {pacer.lost_s:.1f} s slower than the clock" if pacer.lost_s >= 0.1 else ""
            if finished:
                print(f"{simulated_s:.1f} s driven{slow}; press R to drive again, or close the window", file=sys.stderr)
            elif not keys.restart:
                print(f"closed at {simulated_s:.1f} s{slow}", file=sys.stderr)
            while finished and viewer.is_running() and not keys.restart:
                time.sleep(0.05)
                viewer.sync()
            pacer = FramePacer(pacer.speed)
            simulation = ClosedLoop(scenario, controller)


@contextmanager
def _threads_joined() -> Iterator[None]:
    """Wait for the viewer's thread at the end, to prevent a crash when Python shuts down."""
    before = set(threading.enumerate())
    try:
        yield
    finally:
        for thread in set(threading.enumerate()) - before:
            thread.join(_LONGEST_CLOSING_S)
