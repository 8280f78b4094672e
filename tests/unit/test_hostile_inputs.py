"""Every wrong input causes an error of the package, with one line of bounded length."""

from __future__ import annotations

import copy
import math
import os
import random
import re
import shutil
import tomllib
from pathlib import Path
from typing import Any

import pytest

from activesteer.config import key_paths
from activesteer.errors import ActiveSteerError, ModelError, ParameterError
from activesteer.maneuver import KINDS
from activesteer.resources import find_maneuver, list_maneuvers, models_dir
from activesteer.scenario import VehicleConfig, load_car, resolve

STRAIGHT = {"kind": "open_loop", "speed_kmh": 50, "duration_s": 1.0}
DEEP: list[Any] = []
for _ in range(5000):
    DEEP = [DEEP]
VALUES: list[Any] = [
    math.nan, math.inf, -math.inf, 1e308, -1e308, 1e-308, 10**400, 10**5000, -1, 0, 1, True, False, None, 1 + 2j, float,
    "", "x", "x" * 10**6, "\n\x1b[31m", "\udcff", b"\xff", "/proc/self/mem", "/dev/zero", "~nobody_of_this_name/x.toml",
    "x" * 300, "a\0b", "..", "/", ".", [], [1], [[1]], [math.nan], ["x"], [0.0, 1.0], [1.0, 0.0], {}, {"a": 1}, {1: 2},
    DEEP, object(),
]  # fmt: skip


def refused(call: Any, *, may_pass: bool = True) -> ActiveSteerError | None:
    """Return the error of a call, which must be ours and short; None if the call succeeds."""
    try:
        call()
    except ActiveSteerError as error:
        text = str(error)
        assert text
        assert text.isprintable()
        assert len(text) <= 1000
        return error
    assert may_pass, "was accepted"
    return None


def fuzzed(count: int, seed: int) -> int:
    """Set random keys to random values, alone and in pairs; return the number of refused overrides."""
    choose = random.Random(seed)
    keys = {name: key_paths(kind) for name, kind in KINDS.items()}
    vehicle_keys = key_paths(VehicleConfig)
    maneuvers = {name: tomllib.loads(find_maneuver(name).read_text()) for name in list_maneuvers()}
    light = [name for name, table in maneuvers.items() if table["kind"] != "lane_change"]
    number = 0
    for _ in range(count):
        name = choose.choice(light)
        overrides = {}
        for _ in range(choose.choice((1, 1, 1, 2))):
            part = choose.choice(("maneuver", "vehicle"))
            known = keys[maneuvers[name]["kind"]] if part == "maneuver" else vehicle_keys
            key = choose.choice(known)
            cut = choose.random()
            if cut < 0.1:
                key = key.rpartition(".")[0] or key
            elif cut < 0.2:
                key += choose.choice((".x", ".0", ".0.mu", ".", "..", "." * 999, "\n", "x" * 9999))
            overrides[f"{part}.{key}"] = choose.choice(VALUES)
        number += refused(lambda name=name, given=overrides: resolve(name, overrides=given)) is not None
    return number


def test_random_overrides_end_in_an_error_of_ours_or_in_a_scenario():
    assert 100 < fuzzed(250, 1) <= 250


@pytest.mark.slow
def test_many_random_overrides_end_in_an_error_of_ours_or_in_a_scenario():
    assert fuzzed(8000, 2) > 4000


def mangled(table: dict[str, Any], choose: random.Random) -> dict[str, Any]:
    """Return a table with another value or key at some depth."""
    result = within = copy.deepcopy(table)
    while True:
        key = choose.choice(list(within)) if within else "x"
        if isinstance(within.get(key), dict) and choose.random() < 0.8:
            within = within[key]
            continue
        if choose.random() < 0.2:
            within[choose.choice(("x", "", "\n", "name", "kind", "x" * 9999))] = within.pop(key, 1)
        else:
            within[key] = choose.choice(VALUES)
        return result


def test_mangled_tables_end_in_an_error_of_ours_or_in_a_scenario():
    choose = random.Random(3)
    car = tomllib.loads((models_dir() / "vehicles" / "compact.toml").read_text())
    number = 0
    for name in list_maneuvers():
        table = tomllib.loads(find_maneuver(name).read_text())
        if table["kind"] == "lane_change":
            continue
        for _ in range(5):
            maneuver, vehicle = mangled(table, choose), mangled(car, choose)
            number += refused(lambda given=maneuver: resolve(given)) is not None
            number += refused(lambda given=vehicle: load_car(given)) is not None
    assert number > 60


def kind_of(value: object) -> str:
    return type(value).__name__


@pytest.mark.parametrize("value", VALUES, ids=kind_of)
def test_kind_of_any_type_is_answered(value):
    refused(lambda: resolve({**STRAIGHT, "kind": value}), may_pass=False)


@pytest.mark.parametrize("value", [value for value in VALUES if not isinstance(value, dict)], ids=kind_of)
def test_name_of_any_type_is_answered(value):
    refused(lambda: resolve(value), may_pass=False)
    refused(lambda: load_car(value), may_pass=False)


@pytest.mark.parametrize(
    "text",
    [
        b"kind = " + b"[" * 3000 + b"]" * 3000,
        b"kind = " + b"{a=" * 3000 + b"1" + b"}" * 3000,
        b"a." * 400_000 + b"a = 1",
        b"[" + b"'a'." * 300_000 + b"a]",
        b"x = " + b"9" * 6000,
        b"\xff\xfe",
        b"x = 1\n" * 400_000,
        b"a" * 1_900_000,
        b"\0" * 1000,
        b"[a]\n[a]",
        b"",
    ],
)
def test_text_that_is_no_manoeuvre_is_answered(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_bytes(text)
    error = refused(lambda: resolve(path), may_pass=False)
    assert error is not None
    assert "mine.toml" in str(error)
    refused(lambda: load_car(path), may_pass=False)


@pytest.mark.parametrize(
    "make",
    [
        lambda path: path.mkdir(),
        os.mkfifo,
        lambda path: path.symlink_to("nothing"),
        lambda path: path.symlink_to(path),
        lambda path: path.symlink_to("/dev/zero"),
        lambda path: path.symlink_to("/proc/self/mem"),
    ],
    ids=["folder", "pipe", "dangling link", "circle", "device", "memory"],
)
@pytest.mark.parametrize("key", ["maneuver", "vehicle", "mjcf", "tyres.front", "path.csv", "steering_csv"])
def test_what_is_no_file_is_answered(tmp_path, make, key):
    path = tmp_path / "x.toml"
    make(path)
    follow = {"kind": "follow_path", "speed_kmh": 50, "duration_s": 1.0, "path": {"csv": str(path)}}
    calls = {
        "maneuver": lambda: resolve(path),
        "vehicle": lambda: load_car(path),
        "path.csv": lambda: resolve(follow),
        "steering_csv": lambda: resolve({**STRAIGHT, "steering_csv": str(path)}),
    }
    refused(calls.get(key, lambda: load_car(overrides={key: str(path)})), may_pass=False)


def test_content_of_a_file_that_is_not_ours_is_not_printed(tmp_path):
    secret = "root:x:0:0:secret_word"
    path = tmp_path / "passwd"
    path.write_text(f"{secret}\n" * 5)
    follow = {"kind": "follow_path", "speed_kmh": 50, "duration_s": 1.0, "path": {"csv": str(path)}}
    toml = tmp_path / "passwd.toml"
    toml.write_text(path.read_text())
    for call in (
        lambda: resolve(toml),
        lambda: load_car(toml),
        lambda: resolve(follow),
        lambda: resolve({**STRAIGHT, "steering_csv": str(path)}),
        lambda: load_car(overrides={"mjcf": str(path)}),
        lambda: load_car(overrides={"tyres.front": str(path)}),
    ):
        assert "secret_word" not in str(refused(call, may_pass=False))


@pytest.mark.parametrize("step_s", [0, -1e-3, math.nan, math.inf, 1, 1e-9, 9e-5, 6e-3, "x", None, True, 10**400])
def test_step_of_the_engine_outside_its_range_is_answered(step_s):
    with pytest.raises(ParameterError) as told:
        load_car().on(timestep_s=step_s)
    assert told.value.key == "timestep_s"


@pytest.mark.parametrize(
    "element",
    [
        '<asset><hfield name="h" nrow="30000" ncol="30000" size="1 1 1 1"/></asset>',
        '<asset><texture name="t" type="2d" builtin="flat" width="50000" height="50000"/></asset>',
        '<worldbody><replicate count="100000" offset="1 0 0"><geom size="1"/></replicate></worldbody>',
        '<worldbody><replicate count="200"><replicate count="200"><geom size="1"/></replicate></replicate></worldbody>',
        '<worldbody><flexcomp name="f" type="grid" count="300 300 300" spacing="1 1 1"/></worldbody>',
        '<custom><numeric name="n" size="2000000000"/></custom>',
        '<size memory="900G"/>',
        '<size nuserdata="2000000000"/>',
        '<option iterations="2000000000"/>',
        "<worldbody>" + "<geom size='1'/>" * 30_000 + "</worldbody>",
        "<worldbody>" + "<body>" * 3000 + "</body>" * 3000 + "</worldbody>",
        '<include file="compact.xml"/>' + '<include file="nothing.xml"/>',
        '<include file="/dev/zero"/>',
        '<asset><mesh file="pipe"/></asset>',
        '<asset><texture type="2d" file="bomb.png"/></asset>',
        "<asset>",
    ],
)
def test_model_that_asks_for_too_much_is_answered_before_it_is_compiled(tmp_path, element):
    folder = tmp_path / "car"
    shutil.copytree(models_dir() / "mjcf" / "compact", folder)
    os.mkfifo(folder / "pipe")
    (folder / "bomb.png").write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + (60_000).to_bytes(4, "big") * 2 + b"\0" * 40)
    main = folder / "compact.xml"
    main.write_text(main.read_text().replace("</mujoco>", element + "</mujoco>"))
    with pytest.raises(ModelError):
        load_car(overrides={"mjcf": str(main)})


def test_what_lies_beside_the_model_does_no_harm(tmp_path):
    folder = tmp_path / "car"
    shutil.copytree(models_dir() / "mjcf" / "compact", folder)
    (folder / "folder.xml").mkdir()
    (folder / "link.xml").symlink_to("nothing")
    os.mkfifo(folder / "pipe.xml")
    car = load_car(overrides={"mjcf": str(folder / "compact.xml")})
    names = {Path(name).name for name in car.files if name.startswith("mjcf/")}
    assert names == {"compact.xml", "front_axle.xml", "rear_axle.xml", "steering.xml", "keyframes.xml"}


def test_car_whose_springs_hold_nothing_is_answered(tmp_path):
    folder = tmp_path / "car"
    shutil.copytree(models_dir() / "mjcf" / "compact", folder)
    for file in folder.glob("*.xml"):
        file.write_text(re.sub(r'stiffness="[^"]*"', 'stiffness="0"', file.read_text()))
    with pytest.raises(ModelError):
        load_car(overrides={"mjcf": str(folder / "compact.xml")}).on()
