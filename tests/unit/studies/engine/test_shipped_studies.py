"""Studies of the package: each can be planned, also with another car and controller."""

from __future__ import annotations

import pytest

from activesteer.commands.cli import main
from activesteer.resources import list_studies
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.study_file import changed_study, read_study


@pytest.mark.parametrize("name", ["envelope", "envelope_slalom", "fault_map", "side_by_side"])
def test_a_shipped_study_can_be_planned_for_another_car_and_controller(name: str) -> None:
    assert name in list_studies()
    changes = {"vehicles": ["sedan"], "controllers": ["none", "lqr"], "overrides": {"factors.mass": 1.1}}
    changed = changed_study(name, changes)
    assert (changed.vehicles, changed.controllers) == (("sedan",), ("none", "lqr"))
    assert changed.factors == read_study(name).factors
    request = Plan(changed).request(0)
    assert request.overrides["factors.mass"] == 1.1


def test_fewer_samples_and_faults_as_texts() -> None:
    assert changed_study("population", {"samples": 3}).design.samples == 3
    plan = Plan(read_study("fault_map"))
    faults = {plan.request(run).overrides["fault"] for run in range(len(plan))}
    assert "" in faults
    assert "rear:runaway=left@2.0-2.05" in faults


def test_a_folder_keeps_its_study_and_removed_options_name_their_successor(tmp_path, capsys) -> None:
    assert main(["study", str(tmp_path), "-c", "ars"]) == 1
    assert "give a study file instead" in capsys.readouterr().err
    for words, told in (
        (["study", "population", "-o", "p", "--samples", "0"], "0"),
        (["study", "population", "--status", "-c", "ars"], "drive no runs"),
    ):
        assert main(words) != 0
        assert told in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["reproduce", "--population", "3"])
    assert "activesteer study population" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["reproduce", "-c", "none,lqr"])
    assert "activesteer study side_by_side" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["fault-map", "-c", "ars"])
    assert "activesteer study fault_map" in capsys.readouterr().err
