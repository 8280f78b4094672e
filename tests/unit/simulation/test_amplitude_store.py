"""A found steering wheel angle is stored under all inputs that determine it, and a damaged cache does no harm."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

import activesteer
from activesteer import compilation
from activesteer.conventions import GRAVITY_MPS2
from activesteer.errors import ManeuverError
from activesteer.resources import models_dir
from activesteer.scenario import resolve
from activesteer.simulation import amplitude_search, amplitude_store
from activesteer.simulation.preparation import prepared
from tests.raising import raises

SHORT = {"settle_s": 0.2, "duration_s": 1.5, "steer.start_s": 0.2}
KEY = "0123456789abcdef" * 4
ANGLE_RAD = 0.1 + 0.2


@pytest.fixture(autouse=True)
def folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """An empty cache of its own, and a process that has stored nothing."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    forget(monkeypatch)
    return tmp_path / "cache" / "activesteer" / "amplitudes"


def forget(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(amplitude_store, "_in_process", {})


@pytest.fixture
def searches(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the manoeuvres searched since; with a parameter, each search finds this angle without driving."""
    made: list[str] = []
    known: float | None = getattr(request, "param", None)

    def counted(find: Any) -> Any:
        def search(scenario: Any, *rest: Any) -> float:
            made.append(scenario.maneuver.name)
            return find(scenario, *rest) if known is None else known

        return search

    for name in ("_steady_turn", "_ramp_angle"):
        monkeypatch.setattr(amplitude_search, name, counted(getattr(amplitude_search, name)))
    return made


undriven = pytest.mark.parametrize("searches", [ANGLE_RAD], ids=["not driven"], indirect=True)
"""For tests of what is searched, not of what is found."""


def angle(overrides: dict[str, Any] | None = None, vehicle: Any = "compact", timestep_s: float = 1e-3) -> str:
    """Return the angle of a step steer, all bits."""
    maneuver: Any = prepared(resolve("step_steer", vehicle, SHORT | (overrides or {})), timestep_s).maneuver
    return maneuver.steer.steering_wheel_rad.hex()


def test_three_controllers_search_once_and_another_process_not_at_all(searches, monkeypatch):
    runs = [activesteer.simulate("step_steer", controller, overrides=SHORT) for controller in ("none", "ars", "afs")]
    assert len(searches) == 1
    assert len({run.metadata["maneuver"]["steer"]["steering_wheel_rad"] for run in runs}) == 1
    forget(monkeypatch)
    code = (
        "from activesteer.scenario import resolve\n"
        "from activesteer.simulation import amplitude_search\n"
        "from activesteer.simulation.preparation import prepared\n"
        "amplitude_search._steady_turn = None\n"
        f"print(prepared(resolve('step_steer', overrides={SHORT})).maneuver.steer.steering_wheel_rad.hex())"
    )
    root = Path(activesteer.__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == angle()
    assert len(searches) == 1


def test_kept_angle_is_that_of_a_fresh_search_bit_for_bit(searches, monkeypatch, tmp_path):
    first = angle()
    forget(monkeypatch)
    assert angle() == first
    assert len(searches) == 1
    forget(monkeypatch)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "other"))
    assert angle() == first
    assert len(searches) == 2


def test_angle_of_a_ramp_is_kept_too(searches, monkeypatch):
    found = []
    for factor in (5.0, 6.5):
        maneuver: Any = prepared(
            resolve("sine_with_dwell", overrides={"settle_s": 0.2, "steer.amplitude_factor": factor})
        ).maneuver
        found.append(maneuver.steer.steering_wheel_rad)
        forget(monkeypatch)
    assert found[1] == pytest.approx(1.3 * found[0])
    assert len(searches) == 1


@undriven
@pytest.mark.parametrize(
    "change",
    [
        {"overrides": {"factors.mass": 1.01}},
        {"overrides": {"load.payload_kg": 20.0}},
        {"overrides": {"single_track.mass_kg": 1501.0}},
        {"overrides": {"driver.speed_gain_1ps": 1.0}},
        {"overrides": {"road.mu": 0.99}},
        {"overrides": {"speed_kmh": 80.001}},
        {"overrides": {"settle_s": 0.25}},
        {"overrides": {"steer.lateral_acceleration_mps2": 3.9}},
        {"vehicle": "sedan"},
        {"timestep_s": 0.5e-3},
    ],
    ids=str,
)
def test_what_decides_is_searched_for_anew(searches, change):
    angle()
    angle(**change)
    assert len(searches) == 2


@pytest.fixture
def own_car(tmp_path: Path) -> Path:
    """Return a copy of a car, including tyres, in a folder."""
    place = tmp_path / "own"
    shutil.copytree(models_dir() / "mjcf" / "compact", place / "compact")
    for tyre in (models_dir() / "tyres").glob("*.tir"):
        shutil.copy(tyre, place)
    shutil.copy(models_dir() / "vehicles" / "compact.toml", place / "compact.toml")
    return place


@undriven
def test_files_count_by_their_content_wherever_they_are(searches, own_car, tmp_path):
    angle(vehicle=own_car / "compact.toml")
    shutil.move(own_car, tmp_path / "moved")
    angle(vehicle=tmp_path / "moved" / "compact.toml")
    angle()
    assert len(searches) == 1


@undriven
@pytest.mark.parametrize("file", ["tyre", "model", "included"])
def test_a_file_that_is_edited_counts(searches, own_car, file):
    vehicle = own_car / "compact.toml"
    angle(vehicle=vehicle)
    if file == "tyre":
        edited = own_car / resolve("step_steer", vehicle).car.config.tyres.front
        edit(edited, "LKY ", " = 0.9 $", line=True)
    else:
        model = own_car / "compact" / "compact.xml"
        text = model.read_text()
        assert "</worldbody>" in text
        body = '<body name="stone" pos="0 0 -50"><geom size="1" contype="0" conaffinity="0"/></body>'
        if file == "included":
            (model.parent / "stone.xml").write_text(f"<mujocoinclude>{body}</mujocoinclude>")
            body = '<include file="stone.xml"/>'
        model.write_text(text.replace("</worldbody>", f"{body}</worldbody>"))
        if file == "included":
            angle(vehicle=vehicle)
            edit(model.parent / "stone.xml", 'size="1"', 'size="2"')
    made = len(searches)
    angle(vehicle=vehicle)
    assert made == (2 if file == "included" else 1)
    assert len(searches) == made + 1


def edit(path: Path, old: str, new: str, line: bool = False) -> None:
    lines = path.read_text().splitlines(keepends=True)
    places = [index for index, text in enumerate(lines) if old in text]
    assert places, f"{path.name} has no {old!r}"
    place = places[0]
    lines[place] = f"{old}{new}\n" if line else lines[place].replace(old, new)
    path.write_text("".join(lines))


@undriven
@pytest.mark.parametrize(
    "what", ["content_key", "processor", "__version__"], ids=["sources and versions", "processor", "version"]
)
def test_other_code_and_another_machine_count(searches, monkeypatch, what):
    angle()
    monkeypatch.setattr(amplitude_search, what, "another" if what == "__version__" else lambda *_: "another")
    angle()
    assert len(searches) == 2


def test_key_covers_the_sources_of_every_block_that_is_driven():
    # What content_key follows are imports: the blocks of the loop must be among them.
    package = Path(activesteer.__file__).parent
    followed, left = set(), [Path(amplitude_search.__file__)]
    while left:
        file = left.pop()
        if file not in followed:
            followed.add(file)
            left.extend(compilation._imported(file, package))
    names = {file.relative_to(package).as_posix() for file in followed}
    for name in (
        "driver/speed_hold.py", "maneuver/step_steer.py", "maneuver/slowly_increasing_steer.py", "tyre/kernels/rows.py",
        "simulation/closed_loop.py", "simulation/recorder.py", "vehicle/load.py", "vehicle/equilibrium.py",
        "vehicle/native_step.py", "vehicle/native_forces.py", "road/road.py", "tyre/file/tir.py",
    ):  # fmt: skip
        assert name in names


def test_controllers_do_not_decide(searches, monkeypatch):
    # The search drives the control-free car; were that to change, the second search would find another angle.
    gains = {"controllers.ars.limit_deg": 1.0, "controllers.desired_yaw_rate.delay_s": 0.05}
    found = angle()
    assert angle(gains) == found
    assert len(searches) == 1
    monkeypatch.setattr(amplitude_store, "recall", lambda _: None)
    assert angle(gains) == found
    assert len(searches) == 2


def test_a_search_without_result_is_not_kept(searches, folder):
    for _ in range(2):
        with raises(ManeuverError, value=pytest.approx(0.4 * GRAVITY_MPS2)):
            angle({"road.mu": 0.1})
    assert len(searches) == 2
    assert not list(folder.parent.rglob("*.amplitude"))


def kept(folder: Path) -> Path:
    amplitude_store.keep(KEY, ANGLE_RAD)
    amplitude_store._in_process.clear()
    file = folder / f"{KEY}.amplitude"
    assert file.is_file()
    return file


def test_a_damaged_file_is_not_believed(folder):
    file = kept(folder)
    whole = file.read_bytes()
    assert amplitude_store.recall(KEY) == ANGLE_RAD
    for place in range(len(whole)):
        for wrong in (whole[:place], whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :]):
            amplitude_store._in_process.clear()
            file.write_bytes(wrong)
            assert amplitude_store.recall(KEY) is None
    for wrong in (whole + b"0", b"\xff" * 40, b"nan " * 20, b"0" * 10**6):
        file.write_bytes(wrong)
        assert amplitude_store.recall(KEY) is None
    amplitude_store.keep(KEY, ANGLE_RAD)
    assert file.read_bytes() == whole


def test_a_number_of_another_key_and_one_that_is_none_are_not_believed(folder):
    other = "f" * 64
    kept(folder).rename(folder / f"{other}.amplitude")
    assert amplitude_store.recall(other) is None
    for strange in (math.nan, math.inf):
        amplitude_store.keep(KEY, strange)
        amplitude_store._in_process.clear()
        assert amplitude_store.recall(KEY) is None


@pytest.mark.parametrize("what", ["folder", "pipe", "link", "link to nothing"])
def test_what_else_stands_in_the_place_is_neither_read_nor_written(folder, tmp_path, what):
    file = kept(folder)
    file.unlink()
    precious = tmp_path / "thesis.txt"
    precious.write_text("three years")
    if what == "folder":
        file.mkdir()
    elif what == "pipe":
        os.mkfifo(file)
    else:
        file.symlink_to(precious if what == "link" else tmp_path / "nothing")
    assert amplitude_store.recall(KEY) is None
    amplitude_store.keep(KEY, ANGLE_RAD)
    assert amplitude_store.recall(KEY) == ANGLE_RAD
    assert precious.read_text() == "three years"
    assert not (tmp_path / "nothing").exists()


@undriven
@pytest.mark.parametrize("place", ["file", "file/below", "no home", "relative"])
def test_where_nothing_can_be_kept_it_is_searched_for(searches, monkeypatch, tmp_path, place):
    (tmp_path / "file").write_text("")
    monkeypatch.chdir(tmp_path)
    if place == "no home":
        monkeypatch.delenv("XDG_CACHE_HOME")
        monkeypatch.setattr(Path, "home", refuse)
    elif place == "relative":
        monkeypatch.setenv("XDG_CACHE_HOME", "folder")
        monkeypatch.setenv("HOME", str(tmp_path / "file"))
    else:
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / place))
    first = angle()
    assert angle() == first  # the process remembers
    forget(monkeypatch)
    assert angle() == first
    assert len(searches) == 2
    assert not (tmp_path / "folder").exists()


def refuse() -> Path:
    raise RuntimeError("Could not determine home directory.")


def test_without_a_folder_named_it_is_that_of_the_home_folder(monkeypatch, tmp_path):
    for given in ("", "relative"):
        monkeypatch.setenv("XDG_CACHE_HOME", given)
        monkeypatch.setenv("HOME", str(tmp_path))
        assert amplitude_store.folder() == tmp_path / ".cache" / "activesteer" / "amplitudes"


def test_only_so_many_are_kept_and_the_oldest_make_room(folder, monkeypatch):
    monkeypatch.setattr(amplitude_store, "MAX_KEPT", 5)
    keys = [f"{number:064x}" for number in range(8)]
    for number, key in enumerate(keys):
        amplitude_store.keep(key, float(number))
        os.utime(folder / f"{key}.amplitude", (number, number))
    (folder / "readme.txt").write_text("someone's")
    amplitude_store.keep(KEY, ANGLE_RAD)
    assert sorted(file.stem for file in folder.glob("*.amplitude")) == sorted([*keys[4:], KEY])
    assert (folder / "readme.txt").exists()
    assert list(amplitude_store._in_process) == [*keys[4:], KEY]


def test_writers_at_the_same_time_leave_whole_files(folder):
    whole = kept(folder).read_text()
    wrong: list[str] = []
    done = threading.Event()

    def read() -> None:
        while not done.is_set():
            if (text := (folder / f"{KEY}.amplitude").read_text()) != whole:
                wrong.append(text)

    def write() -> None:
        for _ in range(200):
            amplitude_store.keep(KEY, ANGLE_RAD)

    reader, writers = threading.Thread(target=read), [threading.Thread(target=write) for _ in range(4)]
    for thread in (reader, *writers):
        thread.start()
    for thread in writers:
        thread.join()
    done.set()
    reader.join()
    assert not wrong
    assert [file.name for file in folder.iterdir()] == [f"{KEY}.amplitude"]
