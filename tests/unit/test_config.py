"""TOML tables to dataclasses: accepted values, and errors for others."""

from __future__ import annotations

import json
import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import pytest

from activesteer.config import Range, Source, build, key_paths, merged, read_toml, to_table
from activesteer.errors import ManeuverError, ParameterError
from tests.raising import raises


@dataclass(frozen=True)
class Wheel:
    radius_m: Annotated[float, Range(0.1, 1.0)]
    name: str = "steel"


@dataclass(frozen=True)
class Axle:
    track_m: Annotated[float, Range(0.5, 3.0)]
    steer_rad: float = 0.0
    hubs: tuple[Wheel, ...] = ()


@dataclass(frozen=True)
class Car:
    speed_mps: Annotated[float, Range(0.0, 100.0)]
    steer_rad: Annotated[float, Range(-0.5, 0.5)] = 0.0
    yaw_rate_radps: float = 0.0
    ay_mps2: Annotated[float, Range(high=9.81)] = 0.0
    doors: int = 5
    open: bool = False
    curve: tuple[float, ...] = ()
    angles_rad: Annotated[tuple[float, ...], Range(-1.0, 1.0)] = ()
    spare: Wheel | None = None
    wheels: dict[str, Wheel] = field(default_factory=dict)
    limit_rad: Annotated[float, Range(0.0)] | None = None
    axles: tuple[Axle, ...] = ()

    def __post_init__(self) -> None:
        if self.doors == 13:
            raise ParameterError("13 bring bad luck", key="doors", value=13)


TEXT = """\
# A car.
speed_kmh = 90
spare.radius_m = 0.3

[wheels.front]  # with a comment
radius_m = 0.31
name = "alloy"
"""


def source(text: str = TEXT, name: str = "car.toml") -> Source:
    return Source(name, text)


def car(**keys: Any) -> Car:
    return build(Car, {"speed_mps": 10.0} | keys, source())


@pytest.fixture
def read(tmp_path):
    def read(text: str) -> Car:
        path = tmp_path / "car.toml"
        path.write_text(text)
        return build(Car, *read_toml(path))

    return read


def test_table_becomes_a_dataclass(read):
    assert read(TEXT) == Car(speed_mps=90 / 3.6, spare=Wheel(0.3), wheels={"front": Wheel(0.31, "alloy")})


@pytest.mark.parametrize(
    ("key", "value", "name", "si"),
    [
        ("speed_kmh", 36, "speed_mps", 10.0),
        ("steer_deg", 9.0, "steer_rad", math.radians(9.0)),
        ("yaw_rate_degps", -180, "yaw_rate_radps", -math.pi),
        ("ay_g", 0.5, "ay_mps2", 0.5 * 9.81),
        ("angles_deg", [0, 45], "angles_rad", (0.0, math.radians(45.0))),
        ("limit_deg", 3, "limit_rad", math.radians(3.0)),
    ],
)
def test_edge_units_become_si(key, value, name, si):
    table = {"speed_mps": 1.0, key: value}
    if name == "speed_mps":
        del table["speed_mps"]
    assert getattr(build(Car, table, source()), name) == pytest.approx(si, rel=1e-15)


@pytest.mark.parametrize(
    ("keys", "key", "value", "allowed"),
    [
        ({"speed_mps": 101}, "speed_mps", 101, "0 to 100"),
        ({"steer_deg": 45}, "steer_deg", 45, "-28.6479 to 28.6479"),
        ({"ay_g": 1.5}, "ay_g", 1.5, "at most 1"),
        ({"limit_deg": -1}, "limit_deg", -1, "at least 0"),
        ({"angles_deg": [0.0, 90.0]}, "angles_deg", 90.0, "-57.2958 to 57.2958"),
        ({"spare": {"radius_m": 2.0}}, "spare.radius_m", 2.0, "0.1 to 1"),
    ],
)
def test_value_out_of_range_is_answered_in_its_own_unit(keys, key, value, allowed):
    with pytest.raises(ParameterError) as told:
        car(**keys)
    assert (told.value.key, told.value.value, str(told.value.allowed)) == (key, value, allowed)
    assert str(told.value).endswith(f"{key}: {value} is out of range; allowed: {allowed}")


@pytest.mark.parametrize("key", ["yaw_rate_radps", "yaw_rate_degps", "limit_deg", "curve"])
@pytest.mark.parametrize("value", [1e300, 10**300])
def test_number_beyond_all_bounds_is_answered(key, value):
    with raises(ParameterError, key=key, value=value):
        car(**{key: [value] if key == "curve" else value})


def test_both_ends_of_a_range_are_allowed():
    assert car(speed_mps=0.0).speed_mps == 0.0
    assert car(speed_mps=100).speed_mps == 100.0


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"speed_mps": "fast"}, "speed_mps"),
        ({"speed_mps": True}, "speed_mps"),
        ({"speed_mps": [1.0]}, "speed_mps"),
        ({"speed_mps": math.nan}, "speed_mps"),
        ({"yaw_rate_degps": math.inf}, "yaw_rate_degps"),
        ({"yaw_rate_radps": 10**400}, "yaw_rate_radps"),
        ({"yaw_rate_degps": 10**400}, "yaw_rate_degps"),
        ({"doors": 2.5}, "doors"),
        ({"doors": True}, "doors"),
        ({"open": 1}, "open"),
        ({"curve": 1.0}, "curve"),
        ({"curve": [1.0, "x"]}, "curve"),
        ({"spare": 3}, "spare"),
        ({"spare": {"radius_m": 0.3, "name": 7}}, "spare.name"),
        ({"wheels": 3}, "wheels"),
        ({"axles": 3}, "axles"),
        ({"axles": {"track_m": 1.5}}, "axles"),
        ({"axles": [1.5]}, "axles.0"),
        ({"axles": [{"track_m": 1.5}, {"track_m": 5}]}, "axles.1.track_m"),
        ({"axles": [{}]}, "axles.0.track_m"),
        ({"wheels": {"rear": {}}}, "wheels.rear.radius_m"),
    ],
)
def test_value_of_the_wrong_type_is_answered(keys, key):
    with raises(ParameterError, file="car.toml", key=key):
        car(**keys)


def test_whole_number_is_taken_for_a_number_and_becomes_one():
    speed = car(speed_mps=10).speed_mps
    assert isinstance(speed, float)


def test_unknown_key_is_answered_with_the_nearest_its_file_and_line(read):
    with raises(ParameterError, file="car.toml", line=2, key="sped_kmh"):
        read("# A car.\nsped_kmh = 90\n")


@pytest.mark.parametrize(
    ("text", "line", "key"),
    [
        (TEXT.replace("0.31", "31"), 6, "wheels.front.radius_m"),
        (TEXT.replace("0.3\n", "30\n"), 3, "spare.radius_m"),
        (TEXT.replace("90", "900"), 2, "speed_kmh"),
        (TEXT + "[wheels.rear]\nradius_m = 9\n", 9, "wheels.rear.radius_m"),
        (TEXT + "[wheels.rear]\nname = 'x'\n", 8, "wheels.rear.radius_m"),
        (TEXT.replace("spare", "curve = [\n  [1],\n]\nspare"), 3, "curve"),
    ],
)
def test_error_names_the_line(read, text, line, key):
    with raises(ParameterError, file="car.toml", line=line, key=key):
        read(text)


AXLES = """\
speed_kmh = 90

[[axles]]
track_m = 1.5
steer_deg = 1

[[axles]]  # the rear one
track_m = 1.4

[[axles.hubs]]
radius_m = 0.3

[[axles.hubs]]
radius_m = 0.32
"""


def test_tables_in_a_list_become_a_tuple_of_dataclasses(read):
    front, rear = read(AXLES).axles
    assert front == Axle(1.5, math.radians(1.0))
    assert rear == Axle(1.4, hubs=(Wheel(0.3), Wheel(0.32)))


@pytest.mark.parametrize(
    ("old", "new", "line", "key"),
    [
        ("1.5", "15", 4, "axles.0.track_m"),
        ("steer_deg", "stear_deg", 5, "axles.0.stear_deg"),
        ("1.4", "14", 8, "axles.1.track_m"),
        ("0.3\n", "30\n", 11, "axles.1.hubs.0.radius_m"),
        ("0.32", "32", 14, "axles.1.hubs.1.radius_m"),
        ("track_m = 1.4\n", "\n", 7, "axles.1.track_m"),
    ],
)
def test_error_in_a_list_names_the_element_and_the_line(read, old, new, line, key):
    with raises(ParameterError, file="car.toml", line=line, key=key):
        read(AXLES.replace(old, new))


def test_error_in_an_inline_table_names_the_line_of_its_key(read):
    with raises(ParameterError, file="car.toml", line=2, key="spare.radius_m", value=30):
        read("speed_kmh = 90\nspare = { radius_m = 30 }\n")
    with raises(ParameterError, file="car.toml", line=2, key="axles.1.track_m", value=9):
        read("speed_kmh = 90\naxles = [{ track_m = 1 }, { track_m = 9 }]\n")


def test_missing_key_is_answered_with_its_spellings():
    with raises(ParameterError, file="car.toml", key="speed_mps"):
        build(Car, {}, source())


def test_key_given_in_two_units_is_answered():
    with raises(ParameterError, file="car.toml", key="speed_kmh"):
        car(speed_kmh=36)


def test_checks_of_the_class_itself_are_told_with_the_file():
    with raises(ParameterError, file="car.toml", key="doors", value=13):
        car(doors=13)


def test_error_is_of_the_class_that_the_source_asks_for():
    with raises(ManeuverError, file="m.toml", key="speed_mps", value="x"):
        build(Car, {"speed_mps": "x"}, Source("m.toml", error=ManeuverError))


def test_overridden_value_is_not_blamed_on_the_file():
    overridden = Source("car.toml", TEXT, overridden=frozenset({"speed_kmh", "spare"}))
    with raises(ParameterError, file="car.toml", key="speed_kmh", value=900):
        build(Car, {"speed_kmh": 900}, overridden)
    with raises(ParameterError, file="car.toml", key="spare.radius_m", value=9):
        build(Car, {"speed_mps": 9, "spare": {"radius_m": 9}}, overridden)
    with raises(ParameterError, file="car.toml", line=6, key="wheels.front.radius_m", value=9):
        build(Car, {"speed_mps": 9, "wheels": {"front": {"radius_m": 9}}}, overridden)


def test_file_that_is_no_toml_is_answered_with_path_and_line(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text("speed_kmh = 80\nroad = = 1\n")
    with raises(ManeuverError, cause=tomllib.TOMLDecodeError, file="bad.toml"):
        read_toml(path, ManeuverError)


@pytest.mark.parametrize("make", [lambda path: None, Path.mkdir, lambda path: path.write_bytes(b"\xff\xfe\x00")])
def test_file_that_cannot_be_read_is_answered(tmp_path, make):
    path = tmp_path / "bad.toml"
    make(path)
    with raises(ParameterError, value=path):
        read_toml(path)


def replaced(path: str, value: Any, table: dict[str, Any] | None = None) -> dict[str, Any]:
    given = {"speed_kmh": 90, "spare": {"radius_m": 0.31}} if table is None else table
    return merged(Car, given, path.split("."), value, Source(f"override {path}"))


def test_override_in_another_unit_replaces_the_value_of_the_file():
    assert replaced("speed_mps", 10)["speed_mps"] == 10
    assert "speed_kmh" not in replaced("speed_mps", 10)
    assert replaced("speed_kmh", 36, {"speed_mps": 1.0}) == {"speed_kmh": 36}


def test_override_reaches_nested_keys_and_leaves_the_rest():
    assert replaced("spare.radius_m", 0.4)["spare"] == {"radius_m": 0.4}
    assert replaced("spare.radius_m", 0.4, {"speed_kmh": 90})["spare"] == {"radius_m": 0.4}
    assert replaced("spare.name", "x")["spare"] == {"radius_m": 0.31, "name": "x"}


def test_override_reaches_one_element_of_a_list():
    table = {"speed_kmh": 90, "axles": [{"track_m": 1.5, "steer_deg": 1.0}, {"track_m": 1.4}]}
    assert replaced("axles.0.steer_rad", 0.1, table)["axles"] == [{"track_m": 1.5, "steer_rad": 0.1}, {"track_m": 1.4}]
    assert replaced("axles.1", {"track_m": 2.0}, table)["axles"][1] == {"track_m": 2.0}
    assert replaced("axles", [], table)["axles"] == []


def test_override_does_not_change_the_table_it_is_given():
    table = {"speed_kmh": 90, "spare": {"radius_m": 0.31}, "axles": [{"track_m": 1.5}]}
    before = json.dumps(table)
    replaced("spare.radius_m", 0.4, table)
    replaced("axles.0.track_m", 1.4, table)
    replaced("speed_mps", 1.0, table)
    assert json.dumps(table) == before


@pytest.mark.parametrize(
    ("path", "key"),
    [
        ("sped_kmh", "sped_kmh"),
        ("spare.radus_m", "spare.radus_m"),
        ("speed_mps.x", "speed_mps.x"),
        ("axles.2.track_m", "axles.2.track_m"),
        ("axles.x.track_m", "axles.x.track_m"),
        ("axles.0.trak_m", "axles.0.trak_m"),
        ("wheels.front.radius_m", "wheels.front.radius_m"),
    ],
)
def test_override_of_a_key_that_does_not_exist_is_answered(path, key):
    table = {"wheels": {"front": {"radius_m": 0.31}}, "axles": [{"track_m": 1.5}, {"track_m": 1.4}]}
    with raises(ParameterError, key=key):
        replaced(path, 1.0, table)


def test_override_of_an_element_of_an_empty_list_is_answered():
    with raises(ParameterError, file="override axles.0", key="axles.0", value="0"):
        replaced("axles.0", {})


def test_tables_come_back_as_they_went():
    given = Car(
        12.5, 0.1, curve=(1.0, 2.0), spare=Wheel(0.3), wheels={"a": Wheel(0.2, "b")}, limit_rad=0.1,
        axles=(Axle(1.5), Axle(1.4, hubs=(Wheel(0.3),))),
    )  # fmt: skip
    table = to_table(given)
    assert json.loads(json.dumps(table)) == table
    assert build(Car, table, source()) == given


def test_values_that_are_not_given_are_left_out_of_the_table():
    table = to_table(Car(1.0))
    assert "spare" not in table
    assert "limit_rad" not in table
    assert build(Car, table, source()) == Car(1.0)


def test_all_keys_are_known_in_all_their_units():
    paths = key_paths(Car)
    for path in ("speed_mps", "speed_kmh", "yaw_rate_degps", "ay_g", "spare.radius_m", "spare.name", "doors", "axles"):
        assert path in paths
