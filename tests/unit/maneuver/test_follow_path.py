"""A user's own path, from a list or a CSV, and the messages for impossible ones."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from activesteer.errors import ManeuverError
from activesteer.maneuver.follow_path import FollowPath
from activesteer.resources import find_vehicle
from activesteer.scenario import describe, resolve
from tests.raising import raises
from tests.unit.maneuver.made import made

X = [5.0 * index for index in range(21)]
Y = [3.0 * math.sin(x / 40.0) ** 2 for x in X]
TOML = 'kind = "follow_path"\nspeed_kmh = 50\nduration_s = 9.0\n\n[path]\ncsv = "track.csv"\n'


def follow(x: list[float], y: list[float], **keys: object) -> FollowPath:
    table = {"kind": "follow_path", "speed_kmh": 50, "duration_s": 9.0, "path": {"x_m": x, "y_m": y}}
    return made(FollowPath, table | keys)


@pytest.fixture
def track(tmp_path):
    """A manoeuvre file with a CSV beside it."""

    def write(text: str | None = None, toml: str = TOML) -> Path:
        rows = [f"{x},{y:.4f}" for x, y in zip(X, Y, strict=True)]
        (tmp_path / "track.csv").write_text(text or "\n".join(["x_m,y_m", *rows]))
        path = tmp_path / "my_track.toml"
        path.write_text(toml)
        return path

    return write


def test_course_goes_through_the_points():
    course = follow(X, Y).course
    assert np.interp(X, course.path.x_m, course.path.y_m) == pytest.approx(Y, abs=0.01)
    assert course.lanes == ()
    assert len(course.cones_m) == 0
    assert course.last_gate_x_m is None


def test_path_may_close_on_itself():
    angles = np.linspace(0.0, 2.0 * np.pi, 60)
    course = follow((30.0 * np.sin(angles)).tolist(), (30.0 - 30.0 * np.cos(angles)).tolist()).course
    assert course.path.length_m == pytest.approx(2.0 * np.pi * 30.0, rel=1e-3)


def test_csv_is_found_beside_the_manoeuvre_file_and_kept(track, monkeypatch, tmp_path):
    file = track()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    scenario = resolve(file)
    assert isinstance(scenario.maneuver, FollowPath)
    assert scenario.maneuver.path.x_m == tuple(X)
    assert scenario.files["path/track.csv"] == (tmp_path / "track.csv").read_bytes()


def test_csv_of_a_table_is_found_where_one_is(track, monkeypatch, tmp_path):
    track()
    monkeypatch.chdir(tmp_path)
    table = {"kind": "follow_path", "speed_kmh": 50, "duration_s": 9.0, "path": {"csv": "track.csv"}}
    assert resolve(table).maneuver.course is not None
    override = resolve(table | {"path": {"x_m": X, "y_m": Y}}, overrides={"path.csv": str(tmp_path / "track.csv")})
    assert "path/track.csv" in override.files


def test_described_manoeuvre_needs_the_csv_no_more(track, tmp_path):
    scenario = resolve(track())
    (tmp_path / "track.csv").unlink()
    again = resolve(json.loads(json.dumps(describe(scenario)))["maneuver"])
    assert again.maneuver == scenario.maneuver


def test_other_columns_and_spaces_in_a_csv_do_not_matter(track):
    rows = "\n".join(f"{number}, {y:.4f}, {x}" for number, (x, y) in enumerate(zip(X, Y, strict=True)))
    maneuver = resolve(track("n, y_m, x_m\n" + rows)).maneuver
    assert isinstance(maneuver, FollowPath)
    assert maneuver.path.x_m == tuple(X)


@pytest.mark.parametrize(
    ("text", "line", "value"),
    [
        ("x_m,y_m\n0,0\n5,0\n10,0\n45,0\n50,0", 5, (45.0, 0.0)),  # a jump
        ("x_m,y_m\n0,0\n5,0\n3,0\n8,0", 3, (5.0, 0.0)),  # back
        ("x_m,y_m\n0,0\n5,0\n8,3\n11,0\n16,0", 4, (8.0, 3.0)),  # a kink
        ("x_m,y_m\n0,0\n5,0\n5,0\n8,0", 4, (5.0, 0.0)),  # twice the same
        ("x_m,y_m\n0,0\n5,0\nten,0\n8,0", 4, "ten"),
        ("x_m,y_m\n0,0\n5\n10,0\n15,0", 3, ""),
        ("x,y\n0,0\n5,0", 1, None),
        ("x_m,y_m\n0,0\n5,0", None, (2, 2)),  # too few
        ("x_m,y_m\n100,20\n105,20\n110,20\n115,20", 2, (100.0, 20.0)),  # elsewhere
        ("x_m,y_m\n0,0\n0,5\n0,10\n0,15", 2, (0.0, 0.0)),  # across
    ],
)
def test_path_that_cannot_be_driven_is_answered_with_its_line(track, text, line, value):
    with raises(ManeuverError, file="my_track.toml", line=6, key="path.csv", value=value) as refused:
        resolve(track(text))
    assert line is None or refused.value.problem.startswith(f"track.csv, line {line}: ")


def test_points_in_the_file_are_counted_from_1():
    with raises(ManeuverError, file="mine.toml", key="path", value=(60.0, 0.0)) as refused:
        follow([0.0, 10.0, 60.0, 70.0], [0.0, 0.0, 0.0, 0.0])
    assert refused.value.problem.startswith("point 3: ")
    with raises(ManeuverError, file="mine.toml", key="path"):
        follow([0.0, 10.0, 20.0, 30.0], [0.0, 0.0, 0.0])


def test_missing_csv_is_answered_with_its_neighbours(track):
    with raises(ManeuverError, file="my_track.toml", key="path.csv", value="tracks.csv"):
        resolve(track(toml=TOML.replace("track.csv", "tracks.csv")))
    with raises(ManeuverError, file="my_track.toml", key="path"):
        resolve(track(toml=TOML.replace('csv = "track.csv"', "")))
    with raises(ManeuverError, file="my_track.toml", key="path.csv"):
        resolve(track(toml=TOML + "x_m = [0, 5, 10, 15]\ny_m = [0, 0, 0, 0]\n"))


def test_negative_speed_is_answered():
    with raises(ManeuverError, file="mine.toml", key="speed_kmh", value=-20.0):
        follow(X, Y, speed_kmh=-20)


def test_vehicle_does_not_matter_for_the_points(track):
    assert resolve(track(), find_vehicle("compact")).maneuver.course is not None
