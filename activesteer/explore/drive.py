"""A car driven by hand in real time: courses, inputs of steering wheel and pedals, and the drive itself."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from msgspec import UNSET

from activesteer.core.conventions import CORNERS, Array
from activesteer.core.signals import DriverCommand, Measurement, Motion, Setpoint
from activesteer.driver import DriverSetup
from activesteer.driver.open_loop import SpeedHold
from activesteer.errors import ActiveSteerError
from activesteer.explore.choice import Folder
from activesteer.explore.messages import Act, Start
from activesteer.explore.runs import BODIES, Reply, free_path, shape_of
from activesteer.road.course import CONE_RADIUS_M, Course, Footprint
from activesteer.scenario import resolve
from activesteer.simulation.live_view import FramePacer
from activesteer.simulation.simulation import Simulation

_LONGEST_S: Final = 900.0
_HANDS_RADPS: Final = math.radians(500.0)
"""Rate of the steering wheel [rad/s]: below the 700 to 1000 deg/s that humans reach for a moment."""
_FASTEST_MPS2: Final = 11.0
"""Lateral acceleration of a full turn by key [m/s2], a little more than dry tyres transmit."""
_PEDAL_PER_S: Final = 4.0
"""Rate of the pedals [1/s]: a foot needs a quarter of a second for the whole way."""
_LINE_EVERY: Final = 4
"""Steps of 0.5 m of a course's path between two points of the line that is painted on the road."""
_CONE_S: Final = 2.0
"""Time that each cone hit adds [s]: as in the autocross of Formula SAE and in SCCA Solo."""
_PLANE: Final = "straight_line"


class DrivingCourse(NamedTuple):
    """A course for driving by hand: road, start speed and friction."""

    title: str  # its name in words
    goal: str  # what there is to do, for a driver who sees it for the first time
    maneuver: Any  # manoeuvre whose road and course it has
    speed_kmh: float  # speed at the start [km/h]
    radius_m: float = 0.0  # radius of a circle to the left that begins at the start [m]; 0 for none
    mu: float = 0.9  # friction of the road [-]
    vehicle: str = ""  # car that shows best what there is to see; empty for any


COURSES: Final = {
    "lane_change": DrivingCourse(
        "Double lane change",
        f"Drive through the three lanes, as fast as you can. Each cone adds {_CONE_S:g} s.",
        "double_lane_change",
        70.0,
    ),
    "slalom": DrivingCourse(
        "Slalom",
        f"Drive along the dashed line, as fast as you can. Each cone adds {_CONE_S:g} s.",
        "slalom",
        60.0,
    ),
    "skid_pad": DrivingCourse(
        "Skid pad, radius 40 m",
        "Follow the white circle to the left, as fast as you can.",
        _PLANE,
        50.0,
        radius_m=40.0,
        mu=1.0,
    ),
    "plane": DrivingCourse("Free plane, dry", "Drive where you like, and switch the control.", _PLANE, 60.0, mu=1.0),
    "slippery": DrivingCourse(
        "Free plane, packed snow",
        "Hold left for 1 s, then right. Without control (none) the BMW spins; with lqr or esc it does not.",
        _PLANE,
        70.0,
        mu=0.3,
        vehicle="bmw_m8",
    ),
}
"""Courses by name."""


class HandDriver:
    """A driver that follows steering and pedal inputs of a person, who steers at a limited rate."""

    def __init__(self, setup: DriverSetup, hold_mps: float | None) -> None:
        """Store the car, and start with straight wheels and released pedals."""
        car = setup.single_track
        # `hands` is what is asked for now. Without a foot on a pedal, the driver holds `hold_mps`, or coasts if None.
        self.hands, self.hold_mps = Act(steer=0.0), hold_mps
        self._wheelbase_m = car.wheelbase_m
        # A car that does not understeer has no characteristic speed.
        self._understeer_s2pm2 = 1.0 / car.characteristic_speed_mps**2 if car.characteristic_speed_mps else 0.0
        self._setup, self._angle_rad, self._throttle, self._brake = setup, 0.0, 0.0, 0.0
        self._hold = SpeedHold(setup.parameters, setup.drive, car.mass_kg, setup.wheel_radius_m, setup.timestep_s)

    def full_turn_rad(self, speed_mps: float) -> float:
        """Return the steering wheel angle of full steering at a speed [rad]."""
        # The angle of a steady turn at `_FASTEST_MPS2`, a (l / v^2) (1 + (v / v_ch)^2) times the steering ratio.
        square = max(speed_mps * speed_mps, 1.0)
        turn = _FASTEST_MPS2 * self._wheelbase_m * (1.0 / square + self._understeer_s2pm2)
        return min(self._setup.steering_ratio * turn, self._setup.steering_wheel_limit_rad)

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """Advance the inputs of hands and feet by one step."""
        step_s, hands = self._setup.timestep_s, self.hands
        target = (hands.steer or 0.0) * self.full_turn_rad(measurement.speed_mps)
        self._angle_rad = _towards(self._angle_rad, target, _HANDS_RADPS * step_s)
        self._throttle = _towards(self._throttle, hands.throttle, _PEDAL_PER_S * step_s)
        self._brake = _towards(self._brake, hands.brake, _PEDAL_PER_S * step_s)
        drive = self._setup.drive
        low, high = drive.limits_Nm(drive.speed_radps(measurement.wheel_speed_radps), 1)
        if self._throttle > 0.0 or self._brake > 0.0:
            torque = low + self._throttle * (high - low)
            self._hold.reset()
            if self.hold_mps is not None:
                self.hold_mps = max(measurement.speed_mps, 0.0)
        elif self.hold_mps is not None and self.hold_mps > 1.0:
            torque = self._hold.step(self.hold_mps, measurement)
        else:
            torque = low
        return DriverCommand(self._angle_rad, torque, self._brake)


def _towards(value: float, target: float, most: float) -> float:
    return value + min(max(target - value, -most), most)


class DriveSession:
    """A car that waits at the start of a course, and its drive in real time, recorded to a file."""

    def __init__(self, choice: Start, folder: Folder, pacer: FramePacer | None = None) -> None:
        """Put the car at the start of a course."""
        folder.check(choice, COURSES)
        self._folder, self._name = folder, choice.maneuver
        self._course = course = COURSES[choice.maneuver]
        self._speed_kmh = course.speed_kmh if choice.speed_kmh is None else choice.speed_kmh
        self._mu = course.mu if choice.mu is None else choice.mu
        chosen = {"speed_kmh": self._speed_kmh, "road.mu": self._mu}
        longest = chosen | {"duration_s": _LONGEST_S}
        scenario = resolve(course.maneuver, folder.located(choice.vehicle), longest, self._take)
        by_hand = replace(scenario.maneuver, title=f"{course.title}, driven by hand")
        scenario = replace(scenario, maneuver=by_hand, overrides=chosen)
        self._simulation = Simulation(scenario, folder.located(choice.controllers[0]))
        self._simulation.context.metadata["driver"]["name"] = "by hand"
        self._names = {"controller": choice.controllers[0]}
        self.path: Path | None = None
        self._files = ExitStack()
        vehicle = self._simulation.loop.vehicle
        self._size = Footprint.from_table(vehicle.dimensions())
        self._bodies = [vehicle.body_names.index(name) for name in BODIES]
        self._standing = np.ones(len(self._cones()), bool)
        self._pacer, self._lap_s, self._turned_rad, self._last_lap_s = pacer or FramePacer(), 0.0, 0.0, None
        self._bearing_rad, self._gate_s, self._seen = self._bearing(), None, 0
        self._front_x_m, self._missed = -math.inf, False
        self._longest_s = self._busy_s = 0.0

    def _take(self, setup: DriverSetup) -> HandDriver:
        self._driver = HandDriver(setup, self._speed_kmh / 3.6)
        return self._driver

    def _cones(self) -> Array:
        course = self._simulation.scenario.maneuver.course
        return np.empty((0, 2)) if course is None else course.cone_centres_m()

    @property
    def _hit(self) -> int:
        """Number of cones that the car has hit."""
        return int(np.sum(~self._standing))

    def start(self) -> Iterator[Reply]:
        """Yield the course with the shape of the car, then the frame at the start."""
        course = self._simulation.scenario.maneuver.course
        header, arrays = shape_of(self._simulation.loop.vehicle)
        lanes = [] if course is None else [lane._asdict() for lane in course.lanes]
        line = [] if course is None else np.column_stack([course.path.x_m, course.path.y_m])[::_LINE_EVERY]
        yield Reply(
            {
                "kind": "drive", "shape": header, "cones": self._cones().tolist(), "lanes": lanes,
                "line": [*map(list, line)], "radius_m": self._course.radius_m, "speed_kmh": self._speed_kmh,
                "mu": self._mu,
            },
            tuple(arrays),
        )  # fmt: skip
        yield self._picture()

    def go(self) -> Reply:
        """Start the drive, recorded to a new file."""
        self.path = free_path(self._folder.path, f"drive_{self._name}", ".mcap")
        self._files.enter_context(self._simulation.recorded_to(self.path))
        return Reply({"kind": "going", "file": self.path.name})

    def act(self, message: Act) -> None:
        """Apply a message of the page: hands, controller, speed to hold, friction."""
        if message.controller:
            self._folder.check_name("controller", message.controller)
            self._simulation.loop.replace_controller(self._folder.located(message.controller))
            self._simulation.note(f"controller = {message.controller}")
            self._names["controller"] = message.controller
        if message.speed_kmh is not UNSET:
            self._driver.hold_mps = None if message.speed_kmh is None else message.speed_kmh / 3.6
        if message.mu is not UNSET:
            self._simulation.set("road.mu", message.mu)
        if message.steer is not UNSET:
            self._driver.hands, self._seen = message, message.number

    @property
    def done(self) -> bool:
        """True when the longest allowed drive has ended."""
        return self._simulation.done

    def frame(self) -> Reply:
        """Wait until the next frame is due, drive to its time, and return it."""
        simulation = self._simulation
        until_s = self._pacer.next(simulation.time_s)
        begun_s = time.perf_counter()
        left = simulation.steps - simulation.loop.step_count
        simulation.advance(max(1, min(round((until_s - simulation.time_s) / 1e-3), left)))
        self._busy_s = time.perf_counter() - begun_s
        self._longest_s = max(self._longest_s, self._busy_s)
        return self._picture()

    def _picture(self) -> Reply:
        simulation = self._simulation
        loop, motion, truth = simulation.loop, simulation.motion, simulation.truth
        data = loop.vehicle.data
        fallen = self._hit_cones()
        self._time_laps()
        penalty_s = _CONE_S * self._hit
        speed_mps = math.hypot(motion.speed_mps, motion.lateral_speed_mps)
        sideslip_deg = math.degrees(math.atan2(motion.lateral_speed_mps, motion.speed_mps)) if speed_mps > 1.0 else 0.0
        header = {
            "kind": "frame", "time_s": round(simulation.time_s, 3),
            "speed_kmh": 3.6 * speed_mps,
            "steering_wheel_deg": math.degrees(loop.measurement.steering_wheel_rad),
            "sideslip_deg": sideslip_deg,
            "yaw_rate_degps": math.degrees(motion.yaw_rate_radps), "ay_mps2": truth["ay_mps2"],
            # None while the controller demands no such angle: what is left is the give of a hinge.
            "rear_deg": math.degrees(loop.measurement.rear_steer_rad) if truth["rear_steer_demand_rad"] else None,
            "superposition_deg": math.degrees(loop.measurement.superposition_rad)
            if truth["superposition_demand_rad"] else None,
            "friction_use": max(truth[f"{corner}_friction_utilisation"] for corner in CORNERS),
            "sliding": [truth[f"{corner}_friction_utilisation"] > 0.98 for corner in CORNERS],
            "cones": fallen, "penalty_s": penalty_s,
            "lap_s": self._lap_s + penalty_s,
            "last_lap_s": None if self._last_lap_s is None else self._last_lap_s + penalty_s, "missed": self._missed,
            "controller": self._names["controller"],
            "hold_kmh": None if self._driver.hold_mps is None else 3.6 * self._driver.hold_mps,
            "seen": self._seen, "behind_s": self._pacer.lost_s, "busy_ms": 1e3 * self._busy_s,
        }  # fmt: skip
        poses = np.concatenate([data.xpos[1:][self._bodies], data.xquat[1:][self._bodies]], axis=1)
        return Reply(header, (poses.astype(np.float32),))

    def _hit_cones(self) -> list[int]:
        """Return the cones that the body has hit since the last frame, by their numbers."""
        motion, size, cones = self._simulation.motion, self._size, self._cones()
        if not len(cones):
            return []
        chassis = self._simulation.truth
        ahead, left = (cones - [chassis["front_axle_x_m"], chassis["front_axle_y_m"]]).T
        cos, sin = math.cos(motion.yaw_rad), math.sin(motion.yaw_rad)
        along, beside = ahead * cos + left * sin, left * cos - ahead * sin
        inside = (along < size.front_m + CONE_RADIUS_M) & (along > size.rear_m - CONE_RADIUS_M)
        hit = self._standing & inside & (np.abs(beside) < 0.5 * size.width_m + CONE_RADIUS_M)
        self._standing &= ~hit
        return np.flatnonzero(hit).tolist()

    def _bearing(self) -> float:
        """Return the direction from the middle of the circle to the car [rad]."""
        motion = self._simulation.motion
        return math.atan2(motion.y_m - self._course.radius_m, motion.x_m)

    def _time_laps(self) -> None:
        """Measure the time of a lap of the circle, or from the first gate to the last gate."""
        now_s, course = self._simulation.time_s, self._simulation.scenario.maneuver.course
        if self._course.radius_m:
            bearing = self._bearing()
            self._turned_rad += math.remainder(bearing - self._bearing_rad, math.tau)
            self._bearing_rad = bearing
            self._gate_s = 0.0 if self._gate_s is None else self._gate_s
            if abs(self._turned_rad) >= math.tau:
                self._turned_rad = math.fmod(self._turned_rad, math.tau)
                self._last_lap_s, self._gate_s = now_s - self._gate_s, now_s
            self._lap_s = now_s - self._gate_s
        elif course is not None and course.last_gate_x_m is not None and self._last_lap_s is None:
            x_m = self._simulation.motion.x_m
            self._look_for_missed_gates(course)
            if self._gate_s is None and x_m >= course.first_gate_x_m:
                self._gate_s = now_s
            if self._gate_s is not None:
                self._lap_s = now_s - self._gate_s
                if x_m >= course.last_gate_x_m and not self._missed:
                    self._last_lap_s = self._lap_s

    def _look_for_missed_gates(self, course: Course) -> None:
        """Record whether the car has passed a cone on the wrong side."""
        x_m, y_m = (self._simulation.truth[f"front_axle_{axis}_m"] for axis in "xy")
        cones = self._cones()
        passed_x_m, passed_y_m = cones[(self._front_x_m < cones[:, 0]) & (cones[:, 0] <= x_m)].T
        path_y_m = np.interp(passed_x_m, course.path.x_m, course.path.y_m)
        self._missed |= bool(((passed_y_m - path_y_m) * (passed_y_m - y_m) <= 0.0).any())
        self._front_x_m = x_m

    def _result(self) -> str:
        """Describe the time of the last lap or of the gates, with the cones hit, or return an empty text."""
        penalty_s = _CONE_S * self._hit
        cones = f"{self._hit} cone{'' if self._hit == 1 else 's'} hit (+{penalty_s:g} s)" if self._hit else ""
        if self._missed:
            return ", ".join(filter(None, ("no time: a gate was missed", cones)))
        if self._last_lap_s is None:
            early = self._early()
            return ", ".join(filter(None, (f"no time: {early}" if early else "", cones)))
        word = "last lap" if self._course.radius_m else "time"
        return ", ".join(filter(None, (f"{word} {self._last_lap_s + penalty_s:.2f} s", cones)))

    def _early(self) -> str:
        """Describe the progress of a drive that did not pass the last gate, empty without gates."""
        course = self._simulation.scenario.maneuver.course
        if self._last_lap_s is not None or course is None or course.last_gate_x_m is None:
            return ""
        row = course.row_m()
        count = int(np.sum(row[:, 0] <= self._front_x_m))
        return "the last gate was not passed" if count == len(row) else f"ended after {count} of {len(row)} cones"

    def end(self) -> Reply:
        """Complete the recording of a drive."""
        simulation = self._simulation
        assert self.path is not None
        problem = ""
        try:
            with self._files:
                # A drive is as long as its driver wants.
                simulation.loop.end()
                if result := self._result():
                    with suppress(ActiveSteerError):  # a drive that failed has no result
                        simulation.note(result)
                simulation.end_file(simulation.recording())
        except ActiveSteerError as error:
            problem = str(error)
        return Reply(
            {
                "kind": "driven", "file": self.path.name, "folder": str(self.path.parent), "error": problem,
                "time_s": simulation.time_s, "behind_s": self._pacer.lost_s, "longest_ms": 1e3 * self._longest_s,
                "early": self._early(),
            }
        )  # fmt: skip
