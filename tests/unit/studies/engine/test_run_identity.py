"""Inputs that change the identity of a run."""

from __future__ import annotations

from pathlib import Path

import pytest

from activesteer.errors import ActiveSteerError
from activesteer.scenario.car import model_files
from activesteer.studies.engine.factor_values import label_of
from activesteer.studies.engine.runs import controller_digest
from tests.raising import raises


def test_a_change_of_a_module_beside_the_controller_changes_its_digest(tmp_path: Path):
    (tmp_path / "mine.py").write_text("import numpy\nfrom gains import GAIN\nimport parts.filter\n")
    (tmp_path / "gains.py").write_text("import values\nGAIN = values.GAIN\n")
    (tmp_path / "values.py").write_text("import mine\nGAIN = 1.0\n")  # a circle, too
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts/__init__.py").touch()
    (tmp_path / "parts/filter.py").write_text("TIME_S = 0.1\n")
    (tmp_path / "other.py").write_text("NOT = 'imported'\n")
    digests = [controller_digest(f"{tmp_path}/mine.py:Mine")]
    for name in ("values.py", "parts/filter.py", "gains.py", "mine.py"):
        with (tmp_path / name).open("a") as file:
            file.write("# changed\n")
        digests.append(controller_digest(f"{tmp_path}/mine.py:Mine"))
    assert len(set(digests)) == 5
    (tmp_path / "other.py").write_text("changed = True\n")
    assert controller_digest(f"{tmp_path}/mine.py:Mine") == digests[-1]


def test_a_change_of_a_mesh_changes_the_files_of_a_model(tmp_path: Path):
    model = tmp_path / "car.xml"
    model.write_text('<mujoco><compiler meshdir="meshes"/><asset><mesh name="hull" file="hull.stl"/></asset></mujoco>')
    (tmp_path / "meshes").mkdir()
    found = []
    for content in (b"one", b"two"):
        (tmp_path / "meshes/hull.stl").write_bytes(content)
        found.append(model_files(model))
    assert found[0]["car.xml"] == found[1]["car.xml"]
    assert found[0]["meshes/hull.stl.sha256"] != found[1]["meshes/hull.stl.sha256"]


@pytest.mark.parametrize(
    ("given", "label"),
    [
        ("ars", "ars"),
        ("some/folder/mine.py:Mine", "mine.py:Mine"),
        ('some/folder/mine.py:Mine?side="a:b/c"&gain=2', 'mine.py:Mine?side="a:b/c"&gain=2'),
        ("cars/heavy.toml", "heavy"),
    ],
)
def test_labels_have_no_folders_and_keep_what_is_given_to_a_controller(given: str, label: str):
    assert label_of(given) == label


def test_a_controller_whose_file_is_missing_is_told_with_its_path(tmp_path):
    with raises(ActiveSteerError, cause=FileNotFoundError, value=tmp_path / "mine.py"):
        controller_digest(f"{tmp_path}/mine.py:Mine")
