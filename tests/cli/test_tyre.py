"""`activesteer tyre` and `activesteer bench --tyre`."""

from __future__ import annotations

import json

import pytest

from activesteer.commands.cli import main


def test_a_tyre_by_name_is_described_in_words(capsys):
    assert main(["tyre", "pacejka2012_205_60R15"]) == 0
    told = capsys.readouterr().out
    assert "205/60" in told
    assert "MF 6.1" in told
    assert "cornering stiffness" in told


def test_key_figures_as_json_and_nothing_else(capsys):
    assert main(["tyre", "compact_205_55R16.tir", "--json"]) == 0
    assert isinstance(json.loads(capsys.readouterr().out), dict)


@pytest.mark.usefixtures("figures")
def test_pictures_go_into_the_folder(tmp_path, capsys):
    assert main(["tyre", "compact_205_55R16", "-o", str(tmp_path / "pictures")]) == 0
    told = capsys.readouterr().out
    pictures = sorted((tmp_path / "pictures").glob("*.png"))
    assert len(pictures) == 5
    assert all(str(picture) in told for picture in pictures)


def test_a_misspelt_tyre_is_told_the_nearest_names(capsys):
    assert main(["tyre", "compact_205_55R17"]) == 1
    assert "compact_205_55R16" in capsys.readouterr().err


def test_a_broken_file_is_told_its_line(tmp_path, capsys):
    file = tmp_path / "broken.tir"
    file.write_text("[MODEL]\nFITTYP = sixty-one\n", encoding="utf-8")
    assert main(["tyre", str(file)]) == 1
    told = capsys.readouterr().err
    assert "broken.tir" in told
    assert "FITTYP" in told


def test_bench_tyre_measures_what_is_asked_of_it(capsys):
    assert main(["bench", "--tyre", "--json", "--rounds", "1"]) == 0
    measured = json.loads(capsys.readouterr().out)
    assert {"scalar_us", "vectorised_us_per_row", "four_tyres_us"} <= set(measured)
    assert all(value > 0.0 for value in measured.values())
