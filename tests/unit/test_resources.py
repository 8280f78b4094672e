"""Models and manoeuvres are found by name and by path, in a checkout and in an installed package."""

from __future__ import annotations

from pathlib import Path

import pytest

from activesteer import resources
from activesteer.errors import ManeuverError, ModelError, ParameterError
from tests.raising import raises


@pytest.fixture
def checkout(tmp_path, monkeypatch) -> Path:
    """Return a synthetic checkout with two manoeuvres and one vehicle."""
    for file in ("maneuvers/step_steer.toml", "maneuvers/slalom.toml", "models/vehicles/compact.toml"):
        path = tmp_path / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    monkeypatch.setattr(resources, "_PACKAGE", tmp_path / "activesteer")
    return tmp_path


def test_the_real_ones_are_there():
    assert "step_steer" in resources.list_maneuvers()
    assert "compact" in resources.list_vehicles()
    assert (resources.models_dir() / "mjcf" / "compact" / "compact.xml").is_file()


def test_names_are_found_beside_the_package(checkout):
    assert resources.list_maneuvers() == ["slalom", "step_steer"]
    assert resources.find_maneuver("slalom") == checkout / "maneuvers" / "slalom.toml"
    assert resources.find_vehicle("compact") == checkout / "models" / "vehicles" / "compact.toml"


def test_what_travels_inside_the_package_comes_first(checkout):
    inside = checkout / "activesteer" / "_data" / "maneuvers"
    inside.mkdir(parents=True)
    (inside / "step_steer.toml").write_text("")
    assert resources.list_maneuvers() == ["step_steer"]
    assert resources.find_maneuver("step_steer") == inside / "step_steer.toml"


def test_a_path_is_taken_as_it_is(checkout):
    path = checkout / "mine.toml"
    path.write_text("")
    assert resources.find_maneuver(path) == path
    assert resources.find_vehicle(str(path)) == path


def test_a_path_without_the_usual_ending_is_a_path(checkout):
    path = checkout / "mine.txt"
    path.write_text("")
    assert resources.find_maneuver(f"{checkout}/mine.txt") == path


def test_a_misspelt_name_is_answered_with_the_nearest(checkout):
    with raises(ManeuverError, value="step_ster"):
        resources.find_maneuver("step_ster")
    with raises(ParameterError, value="truck"):
        resources.find_vehicle("truck")


def test_a_missing_file_is_answered_with_its_neighbours(checkout):
    path = checkout / "maneuvers" / "slalon.toml"
    with raises(ManeuverError, value=str(path)) as refused:
        resources.find_maneuver(path)
    assert "did you mean 'slalom'?" in refused.value.problem


def test_a_file_in_a_missing_folder_is_an_error(checkout):
    with raises(ParameterError, value="nowhere/mine.toml"):
        resources.find_vehicle("nowhere/mine.toml")


def test_an_incomplete_installation_says_where_it_looked(tmp_path, monkeypatch):
    monkeypatch.setattr(resources, "_PACKAGE", tmp_path / "activesteer")
    with raises(ModelError, value="models", allowed=(tmp_path / "activesteer/_data/models", tmp_path / "models")):
        resources.models_dir()
    with raises(ManeuverError, value="maneuvers"):
        resources.maneuvers_dir()


def test_a_vehicle_may_be_named_by_its_folder(checkout, tmp_path, monkeypatch):
    folder = tmp_path / "mine"
    folder.mkdir()
    with raises(ParameterError, value=folder, allowed=[]):
        resources.find_vehicle(str(folder))
    for name in ("table", "other"):
        (folder / f"{name}.toml").touch()
    monkeypatch.chdir(tmp_path)
    assert resources.find_vehicle("mine") == Path("mine/other.toml")
    (folder / "mine.toml").touch()
    assert resources.find_vehicle(folder) == folder / "mine.toml"
    (tmp_path / "compact").mkdir()  # a name is a name, whatever lies about
    assert resources.find_vehicle("compact") == checkout / "models" / "vehicles" / "compact.toml"


def test_a_file_of_an_installed_package_is_not_changed(tmp_path):
    resources.check_own(tmp_path / "mine.toml")
    theirs = tmp_path / "lib" / "site-packages" / "activesteer" / "_data" / "compact.toml"
    with raises(ParameterError, value=theirs):
        resources.check_own(theirs)
