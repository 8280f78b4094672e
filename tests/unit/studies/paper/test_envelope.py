"""Entry speeds by bisection, and the map that checks the assumption of the bisection."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from activesteer.cli import main
from activesteer.errors import ParameterError, SimulationDiverged, StudyError
from activesteer.plotting import save
from activesteer.recording import Recording
from activesteer.studies.paper import envelope as module
from activesteer.studies.paper.envelope import LINES, RANGE_KMH, RESOLUTION_KMH, Envelope, State, _map_row, envelope
from activesteer.studies.paper.envelope_figure import envelope_figure
from tests.raising import raises

LANES = LINES["lane_change"]


def entry_speed(monkeypatch: pytest.MonkeyPatch, most_kmh: float) -> float | None:
    """Return the result of the bisection for a car that stays in the lanes up to a speed."""

    def drive(scenario: Any, _controller: str) -> Any:
        return SimpleNamespace(metrics={"stays_in_lanes": float(3.6 * scenario.maneuver.speed_mps <= most_kmh)})

    monkeypatch.setattr(module, "run_scenario", drive)
    return module.entry_speed("double_lane_change", "compact", {}, LANES, "typical", "none")


@pytest.mark.parametrize("most_kmh", [41.3, 77.7, 149.9])
def test_the_highest_speed_is_found(monkeypatch: pytest.MonkeyPatch, most_kmh: float) -> None:
    found = entry_speed(monkeypatch, most_kmh)
    assert found is not None
    assert found <= most_kmh < found + RESOLUTION_KMH


def test_a_car_that_gets_through_nowhere_or_everywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    assert entry_speed(monkeypatch, RANGE_KMH[0] - 1.0) is None
    assert entry_speed(monkeypatch, RANGE_KMH[1] + 1.0) == RANGE_KMH[1]


def test_a_run_that_ends_early_is_lost_and_a_wrong_input_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def diverge(*_: Any) -> Any:
        error = SimulationDiverged("at 1 s")
        error.recording = Recording([], [], [])
        raise error

    monkeypatch.setattr(module, "run_scenario", diverge)
    assert module.entry_speed("slalom", "compact", {}, LINES["slalom"], "typical", "none") is None
    monkeypatch.setattr(module, "run_scenario", lambda *_: (_ for _ in ()).throw(ParameterError("no such controller")))
    with pytest.raises(ParameterError):
        module.entry_speed("slalom", "compact", {}, LINES["slalom"], "typical", "none")


def row(controller: str, speed: float, line: float, kept: bool) -> dict[str, Any]:
    return {"driver": "typical", "controller": controller, "speed_kmh": speed, "line_m": line, "kept": kept}


def made() -> Envelope:
    """At 60 km/h all cars pass; at 70 the systems; at 80 only ars; at 90 none; at 100 afs again."""
    kept = {60.0: ("none", "ars", "afs"), 70.0: ("ars", "afs"), 80.0: ("ars",), 90.0: (), 100.0: ("afs",)}
    rows = [row(name, speed, 0.1, name in kept[speed]) for speed in kept for name in ("none", "ars", "afs")]
    entries = [
        {"driver": "typical", "controller": name, "entry_speed_kmh": speed}
        for name, speed in (("none", 64.0), ("ars", 83.0), ("afs", None))
    ]
    return Envelope("lanes", LANES, (80.0, 0.1), entries, rows)


def test_cells_say_who_is_lost() -> None:
    cells = made().cells("typical")
    states = [State.NOBODY, State.NONE_ONLY, State.SOME, State.ALL, State.SOME]
    assert [cells[speed, 0.1] for speed in (60.0, 70.0, 80.0, 90.0, 100.0)] == states
    assert made().kept("typical")[80.0, 0.1] == {"none": False, "ars": True, "afs": False}


def test_cells_that_speak_against_bisection_are_found() -> None:
    found = made().exceptions
    assert found == [{"driver": "typical", "controller": "afs", "line_m": 0.1, "lost_kmh": 90.0, "kept_kmh": 100.0}]


def test_json_and_picture(tmp_path: Path) -> None:
    table = made().to_json()
    assert table["line"] == "lane.margin_m"
    assert {cell["state"] for cell in table["cells"]} == {state.value for state in State}
    assert save(envelope_figure(made()), tmp_path / "map.png").stat().st_size > 5000


def test_command_draws_several_manoeuvres_into_one_folder(monkeypatch, tmp_path, capsys) -> None:
    monkeypatch.setattr(module, "envelope", lambda maneuver, *_, **__: replace(made(), maneuver=maneuver))
    words = ["envelope", "double_lane_change", "slalom", "-o", str(tmp_path)]
    assert main([*words, "--json"]) == 0
    files = [tmp_path / f"envelope_{name}.png" for name in ("double_lane_change", "slalom")]
    found = json.loads(capsys.readouterr().out)["envelopes"]
    assert [one["maneuver"] for one in found] == ["double_lane_change", "slalom"]
    assert [one["figures"] for one in found] == [[str(file)] for file in files]
    assert sorted(tmp_path.iterdir()) == files
    assert main(words) == 0
    assert "slalom: highest entry speed" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("slalom", "step_steer"), "maneuver: "),
        (("slalom", "double_lane_change", "--lines-m", "0.1"), "--lines-m: "),
        (("slalom", "slalom"), "MANEUVER: "),
    ],
)
def test_command_says_what_is_wrong_before_it_drives(monkeypatch, capsys, words, named) -> None:
    monkeypatch.setattr(module, "envelope", lambda *_, **__: pytest.fail("it drives"))
    assert main(["envelope", *words]) == 1
    assert f"activesteer: {named}" in capsys.readouterr().err


def test_what_has_no_gates_has_no_entry_speed() -> None:
    with raises(ParameterError, key="maneuver", value="step_steer", allowed=tuple(LINES)):
        envelope("step_steer")


def test_a_map_is_driven(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(module, "in_parallel", lambda _, pairs, *__, **___: [50.0] * len(pairs))
    axes = {"speeds_kmh": (60.0, 140.0), "lines_m": (0.15,)}
    found = envelope("double_lane_change", ("none",), **axes, output=tmp_path, jobs=1)
    assert (tmp_path / "double_lane_change" / "typical" / "study.toml").is_file()
    assert found.cells("typical") == {(60.0, 0.15): State.NOBODY, (140.0, 0.15): State.ALL}
    assert found.nominal == (80.0, 0.2)
    assert found.exceptions == []


@pytest.mark.parametrize(
    ("status", "error", "lost"),
    [
        ("failed", "SimulationDiverged: yaw rate", True),
        ("failed", "ModelError: gone", False),
        ("crashed", "killed", False),
    ],
)
def test_a_run_that_failed_for_another_reason_than_its_motion_is_no_car_that_is_lost(status, error, lost):
    row = {"controller": "none", "speed_kmh": 80.0, LANES.key: 0.1, "status": status, "error": error}
    if lost:
        assert _map_row("typical", LANES, row)["kept"] is False
    else:
        with pytest.raises(StudyError):
            _map_row("typical", LANES, row)
