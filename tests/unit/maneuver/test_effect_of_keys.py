"""Every key of a manoeuvre has an effect, or names the key that makes it ineffective."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from activesteer.config import key_paths, to_table
from activesteer.errors import ActiveSteerError, ManeuverError, ParameterError
from activesteer.maneuver import Maneuver
from activesteer.maneuver.phases import Phases, PhaseSequence
from activesteer.resources import list_maneuvers
from activesteer.road.road import Road
from activesteer.scenario import resolve

LABELS = ("kind", "name", "title", "steering_csv", "drive_csv", "path.csv", "road.crg", "road.profile")
"""Keys that name things."""
WITHOUT_EFFECT = {
    ("hill_hold", "drive"), ("parking", "drive"), ("slalom", "vehicle_width_m"), ("split_mu_braking", "road.along"),
    ("rough_braking", "road.along"),
}  # fmt: skip
"""The drive is off while the brake is pressed; a slalom's cones must be passed, but do not depend on the width; a
straight path is the world's x axis."""
NUMBERS = (0.0, 0.05, 0.3, 0.7, 1.0, 1.7, 3.1, 5.0, 12.0, 33.0, 61.0)


def seen(maneuver: Maneuver) -> str:
    """All inputs of driver and wheels: setpoints over time, friction and its places, path, lanes, cones."""
    times = np.linspace(0.0, maneuver.duration_s, 300)
    search = maneuver.search
    if search is not None:
        maneuver = search.accept(1.0)
    road, course = maneuver.road, maneuver.course
    frictions = []
    for x in np.linspace(0.0, maneuver.duration_s * abs(maneuver.speed_mps), 200):
        for y in (-2.0, 2.0):
            inside = [area.mu for area in road.areas() if _inside(area, x, y)]
            frictions.append(inside[-1] if inside else road.mu)
    met: list[Any] = [[maneuver.setpoint(time) for time in times], maneuver.settling_setpoint(), maneuver.settle_s]
    if isinstance(maneuver, Phases):
        sequence = PhaseSequence(maneuver)
        met += [[sequence.setpoint(time, _waves(time)) for time in times]]
    met += [maneuver.duration_s, maneuver.speed_mps, frictions, road.grade]
    met += [road.bank_rad, *_surface(road)]
    met += [None if course is None else course.to_table()]
    met += [getattr(maneuver, key, None) for key in ("sensor_ahead_m", "sensor_offset")]  # what `fit` and `compare` use
    if road.is_uneven or road.areas():
        along = np.linspace(0.0, 100.0, 20)
        met += [np.round(np.stack(road.laid(course).placed(along, 0.1 * along)), 6)]
    met += [None if search is None else [search.lateral_acceleration_mps2, search.accept(1.0), search.probe]]
    return json.dumps([to_table(one) for one in met], default=_short)


def _waves(time_s: float) -> tuple[float, ...]:
    """Return a motion that passes every condition of a phase again and again, in the order of `Seen`."""
    up = np.sin(3.0 * time_s)
    return (0.5 * up, 0.2 * up, 5.0 * up, 10.0 + 10.0 * up, 20.0 * time_s, 3.0 * up)


def _short(value: Any) -> str:
    """Return a digest of the first seven digits of an array: a setpoint carries the whole path at each time."""
    return (
        hashlib.sha256(value.astype(np.float32).tobytes()).hexdigest() if isinstance(value, np.ndarray) else str(value)
    )


def _surface(road: Road) -> list[Any]:
    """Everything that makes an uneven surface; the surfaces themselves take too long to make."""
    made_of = (road.obstacle, road.heights, road.roughness, road.banking, road.crg_data)
    return [*map(to_table, made_of), road.contact_used, road.start_m, road.outside] if road.is_uneven else []


def _inside(area: Any, x: float, y: float) -> bool:
    return area.start_m <= x < area.end_m and area.right_m < y <= area.left_m


def candidates(maneuver: str, key: str) -> Iterator[Any]:
    """Possible values of a key."""
    try:
        resolve(maneuver, overrides={key: "?"})
    except ActiveSteerError as error:
        if isinstance(error.allowed, (list, tuple)) and all(isinstance(word, str) for word in error.allowed):
            yield from error.allowed
    yield from NUMBERS
    yield from (number for number in (2, 4, 9))
    yield from ([low, low + 0.5] for low in (0.0, 0.5))
    yield [0.0]
    yield [{"start_m": 1.0, "end_m": 50.0, "mu": 0.123}]


QUICK = ("step_steer", "split_mu_braking")
"""One manoeuvre with a search, and one with a road of its own."""


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in list_maneuvers()]
)
def test_every_key_of_a_manoeuvre_changes_what_is_driven_or_is_refused(name):
    usual = resolve(name).maneuver
    silent, before = [], seen(usual)
    for path in key_paths(type(usual)):
        if path in LABELS or path.endswith(("_deg", "_kmh", "_degps", "_g")):
            continue
        key, changed, accepted = f"maneuver.{path}", False, 0
        for value in candidates(name, key):
            try:
                other = resolve(name, overrides={key: value}).maneuver
            except ActiveSteerError:
                continue
            accepted += 1
            if seen(other) != before:
                changed = True
                break
        if accepted > 1 and not changed and (name, path) not in WITHOUT_EFFECT:
            silent.append(path)
    assert silent == []


@pytest.mark.parametrize(
    ("name", "overrides", "key", "other"),
    [
        ("split_mu_braking", {"road.mu": 0.2}, "road.mu", "mu_left"),
        ("standstill", {"road.mu_left": 0.5, "road.mu_right": 0.4, "road.mu": 0.2}, "road.mu", "mu_right"),
        (
            "step_steer",
            {"steer.steering_wheel_deg": 50, "steer.lateral_acceleration_g": 0.3},
            "steer.lateral_acceleration_g",
            "steering_wheel_rad",
        ),
        (
            "sine_with_dwell",
            {"steer.amplitude_factor": 3.0, "steer.steering_wheel_rad": 1.0},
            "steer.amplitude_factor",
            "steering_wheel_rad",
        ),
        ("double_lane_change", {"lane.path": "middle", "lane.margin_m": 0.1}, "lane.margin_m", "'middle'"),
    ],
)
def test_key_without_effect_is_answered_with_the_one_that_overrules_it(name, overrides, key, other):
    with pytest.raises(ParameterError) as told:
        resolve(name, overrides=overrides)
    assert told.value.key == key
    assert "has no effect together with" in told.value.problem
    assert other in told.value.problem


def test_file_with_a_key_without_effect_is_answered_with_its_line(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(
        'kind = "step_steer"\nspeed_kmh = 80\nduration_s = 3\n[steer]\n'
        "lateral_acceleration_g = 0.4\nsteering_wheel_deg = 30\n"
    )
    with pytest.raises(ManeuverError) as told:
        resolve(file)
    assert (told.value.line, told.value.key) == (5, "steer.lateral_acceleration_g")


@pytest.mark.parametrize(
    ("key", "of"),
    [("steering.factor", "standstill"), ("steering.delay_s", "straight_line"), ("steering.factor", "cleat")],
)
def test_scale_and_delay_of_a_wheel_that_stands_still_are_refused(key, of):
    with pytest.raises(ManeuverError, match="has no effect on a steering wheel"):
        resolve(of, overrides={key: 1.7})
