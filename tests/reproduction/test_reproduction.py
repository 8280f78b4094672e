"""Five scenarios with three systems: every run exists, and every claim has its published verdict."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer.analysis.claims.judge import SCENARIOS, STATEMENTS, SYSTEMS
from activesteer.analysis.claims.scorecard import not_reproduced
from activesteer.analysis.figures import BY_SCENARIO, OF_ANY_RUN
from activesteer.commands.cli import main
from activesteer.errors import ParameterError
from activesteer.recording import Recording
from activesteer.studies.reproduction import Reproduction, draw_figures, reproduce
from tests.raising import raises

Runs = dict[str, dict[str, Recording]]


def test_every_run_is_complete_and_in_a_file_of_its_own(reproduced: Reproduction, runs: Runs) -> None:
    assert reproduced.failures == {}
    paths = [path for systems in reproduced.paths.values() for path in systems.values()]
    assert len(set(paths)) == len(SCENARIOS) * len(SYSTEMS)
    for scenario, systems in runs.items():
        for system, recording in systems.items():
            assert recording.metadata["complete"], (scenario, system)
            assert recording.metadata["controller"] == system
            assert recording.metadata["maneuver"]["name"] == scenario


@pytest.mark.parametrize("number", STATEMENTS)
def test_a_claim_passes_unless_it_is_known_not_to(reproduced: Reproduction, number: str) -> None:
    judged = next(item for item in reproduced.scorecard.judged if item.claim.id == number)
    known = number in not_reproduced("compact")
    assert judged.claim.passed is not known, f"{judged.verdict}: {judged.claim}"


def test_all_systems_are_driven_the_same_way(runs: Runs) -> None:
    """Driver, road and lanes are the same; in open-loop manoeuvres also the steering wheel angle."""
    for systems in runs.values():
        first = systems["none"].metadata
        for recording in systems.values():
            assert recording.metadata["maneuver"] == first["maneuver"]
            assert recording.metadata["vehicle"] == first["vehicle"]
    for scenario in ("step_steer", "sine_with_dwell"):
        demands = [recording["steering_wheel_demand_rad"] for recording in runs[scenario].values()]
        assert np.ptp(demands, axis=0).max() == 0.0


def test_the_limits_of_the_actuators_are_kept(runs: Runs) -> None:
    maximum = np.radians(3.0) + 1e-7  # the file keeps 32 bit
    for systems in runs.values():
        for recording in systems.values():
            assert np.abs(recording["rear_steer_demand_rad"]).max() <= maximum
            assert np.abs(recording["superposition_demand_rad"]).max() <= maximum


def test_the_steering_wheel_angle_is_not_wrapped(runs: Runs) -> None:
    """The paper's tool jumped at half a turn."""
    for systems in runs.values():
        for recording in systems.values():
            assert np.abs(np.diff(recording["steering_wheel_rad"])).max() < np.radians(3.0)


@pytest.mark.parametrize(
    ("scenarios", "numbers"),
    [
        (("step_steer",), (1, 2, 7, 9, 11)),
        pytest.param(tuple(SCENARIOS), (1, 2, 7, 9, *range(11, 25)), marks=pytest.mark.slow),
    ],
)
def test_the_figures_are_drawn_from_the_files(
    runs: Runs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scenarios: tuple[str, ...], numbers: tuple[int, ...]
) -> None:
    monkeypatch.setattr("activesteer.plotting.drawing.DOTS_PER_INCH", 100)
    figure = pytest.importorskip("matplotlib.figure").Figure
    savefig = figure.savefig
    every = len(scenarios) > 1

    def drawn(name: str) -> bool:  # one figure once or in all formats, and every figure once
        is_one = "figure_11" in name
        return (is_one or ".png" in name) if every else (is_one and ".png" in name)

    def save(self: Any, path: Path, **how: Any) -> None:
        if drawn(path.name):
            savefig(self, path, **how)
        else:
            path.touch()

    monkeypatch.setattr(figure, "savefig", save)
    folder = tmp_path / "figures"
    names = {path.name for path in draw_figures({name: runs[name] for name in scenarios}, folder, "compact")}
    for number in numbers:
        assert {".png", ".svg", ".pdf"} == {
            Path(name).suffix for name in names if name.startswith(f"figure_{number:02}_")
        }
    assert len(names) == 3 * (2 + len(OF_ANY_RUN) + sum(len(BY_SCENARIO[name]) for name in scenarios))
    assert all((folder / name).stat().st_size > 5000 for name in names if drawn(name))


def test_the_number_of_processes_is_checked(tmp_path: Path) -> None:
    with raises(ParameterError, value=0) as caught:
        reproduce(tmp_path, jobs=0)
    assert caught.value.allowed.low == 1


def test_a_run_that_fails_ends_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine.py").write_text(
        "class Mine:\n    def step(self, command, measurement):\n        raise RuntimeError('after all')\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("activesteer.studies.reproduction.SCENARIOS", {"step_steer": SCENARIOS["step_steer"]})
    monkeypatch.setattr("activesteer.studies.reproduction.SYSTEMS", ("none", "mine.py:Mine"))
    result = reproduce(tmp_path)
    assert list(result.failures) == [("step_steer", "mine.py:Mine")]
    assert "after all" in result.failures["step_steer", "mine.py:Mine"]
    assert result.scorecard.judged == ()
    assert result.exit_status == 1
    assert Recording.open(result.paths["step_steer"]["none"]).metadata["complete"]


def test_what_cannot_be_written_is_told_before_anything_is_driven(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "slalom-ars.mcap").mkdir()
    assert main(["reproduce", "-o", str(tmp_path)]) == 1
    assert "slalom-ars.mcap" in capsys.readouterr().err
    assert list(tmp_path.glob("*.mcap")) == [tmp_path / "slalom-ars.mcap"]
