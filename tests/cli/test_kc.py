"""`activesteer kc`."""

from __future__ import annotations

import functools
import json
import re
import shutil

import pytest

from activesteer.commands.cli import main
from activesteer.plotting import drawing
from activesteer.rigs import kc


@pytest.fixture(scope="module", autouse=True)
def measured_once():
    """Measure the compact once for all tests of the command."""
    with pytest.MonkeyPatch.context() as patch:
        once = functools.cache(lambda vehicle: rigs_measure(vehicle, {}))
        rigs_measure = kc.kinematics_compliance
        patch.setattr(kc, "kinematics_compliance", lambda vehicle, overrides: once(vehicle))
        yield


def test_kc_prints_a_table_of_metrics_with_bands(capsys):
    assert main(["kc"]) == 0
    told = capsys.readouterr().out
    for words in ("wheel rate", "toe", "camber", "roll centre"):
        assert words in told.replace("_", " ")


def test_kc_json_has_what_is_promised(capsys):
    assert main(["kc", "--json"]) == 0
    metrics = json.loads(capsys.readouterr().out)["metrics"]
    assert len(metrics) >= 40
    for metric in metrics:
        assert {"name", "axle", "value", "unit", "band", "inside", "source"} <= set(metric)


@pytest.mark.slow
def test_kc_draws_into_a_folder(tmp_path, capsys, monkeypatch):
    # The page draws every picture; of the same as files, two are enough.
    save = drawing.save

    def some(figure, path):
        return (
            save(figure, path) if path.stem in {"targets", "steering"} else shutil.copy(path.with_stem("targets"), path)
        )

    monkeypatch.setattr(drawing, "save", some)
    assert main(["kc", "-o", str(tmp_path / "kc")]) == 0
    assert "figure: " in capsys.readouterr().out
    page = (tmp_path / "kc" / "kc.html").read_text(encoding="utf-8")
    pictures = list((tmp_path / "kc").glob("*.png"))
    assert len(re.findall(r'data-picture="\d', page)) == len(pictures)
    assert page.index("<h2>Metrics") < page.index("<h2>Target bands")
    assert "40 of 41 target bands are met" in page
    assert 'class="outside"' in page
    assert {picture.stem for picture in pictures} >= {"rear_camber", "parallel_travel", "steering", "targets"}
    assert len(pictures) >= 5
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in pictures)


def test_kc_names_the_vehicles_that_there_are(capsys):
    assert main(["kc", "--vehicle", "compakt"]) == 1
    assert "did you mean 'compact'" in capsys.readouterr().err
