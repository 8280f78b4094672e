from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer.errors import ParameterError
from activesteer.tyre import MagicFormula, TyreParameters
from activesteer.tyre.diagnostics import remarks
from activesteer.tyre.report import bench, describe, draw, envelope, key_figures, size
from tests.raising import raises
from tests.reference.tyre_tables import read_coefficients
from tests.unit.tyre.tyres import TYRES, tyre

PICTURES = ["side_force", "longitudinal_force", "friction_ellipse", "combined_slip", "relaxation_lengths"]


def _unusual(params: TyreParameters) -> str:
    return "\n".join(f"{what}: {why}" for what, why in remarks(params))


def test_the_description_says_what_the_tyre_is() -> None:
    text = describe(tyre())
    for words in ("205/55 R16", "MF 6.1 (FITTYP 61)", "left side", "nominal load 4000 N", "2.30 bar", "100 to 10000 N"):
        assert words in text
    assert max(len(line) for line in text.splitlines()) < 120


def test_the_key_figures_are_those_of_the_formula() -> None:
    over = key_figures(tyre())["over_load"]
    place = over["load_N"].index(4000.0)
    at = MagicFormula(tyre()).evaluate(4000.0, 0.0, 0.0)
    assert over["cornering_stiffness_Nprad"][place] == pytest.approx(-float(at.cornering_stiffness_Nprad))
    assert over["cornering_stiffness_Nprad"][place] * math.radians(1.0) == pytest.approx(1430.0, rel=0.01)
    assert over["lateral_friction_left"][place] == pytest.approx(1.0, abs=0.01)
    assert math.degrees(over["lateral_friction_at_rad"][place]) == pytest.approx(9.1, abs=0.3)
    assert over["braking_friction"][place] == pytest.approx(float(at.friction_x), rel=1e-3)
    assert over["relaxation_length_y_m"][place] == pytest.approx(0.51, abs=0.01)
    assert over["loaded_radius_m"][place] < over["effective_radius_m"][place] < tyre()["UNLOADED_RADIUS"]
    assert len({len(column) for column in over.values()}) == 1


@pytest.mark.parametrize("name", [path.stem for path in TYRES.glob("*.tir")])
def test_key_figures_are_json(name: str) -> None:
    figures = key_figures(tyre(name))
    assert json.loads(json.dumps(figures, allow_nan=False)) == figures


def test_an_ordinary_tyre_has_nothing_unusual() -> None:
    assert remarks(tyre()) == []
    assert "Nothing unusual." in describe(tyre())


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"LMUX": 0.9}, "LMUX = 0.9: the file scales what was measured; friction scaled here and a road's mu multiply"),
        ({"LTR": 1.1}, "LTR = 1.1: the file scales what was measured"),
        ({"PDY1": -1.0}, "PDY1 = -1 is negative"),
        ({"PDX1": 2.0}, "peak friction mu_x = 2.00 at the nominal load: road tyres reach 0.6 to 1.6"),
        ({"PDY2": -0.9}, "mu_y changes its sign at "),
        ({"PKY1": -5.0}, "cornering stiffness over load is 4.4 1/rad: 8 to 25 1/rad are usual"),
        ({"PKY1": 20.0}, "the side force would push the tyre sideways"),
        ({"PKX1": 2.0}, "slip stiffness over load is 2.0"),
        ({"QDZ1": 0.5}, "pneumatic trail"),
        ({"LATERAL_STIFFNESS": 2e4}, "lateral relaxation length"),
        ({"PVY1": 0.1}, "of side force straight ahead at the nominal load, as from"),
        ({"PVY1": 0.1}, "between left and right"),
        ({"PEY1": 1.5}, "E_y exceeds 1 between"),
        ({"REX1": 1.5}, "E_xalpha exceeds 1 between"),
        ({"QBZ1": 0.0, "QDZ1": 0.0}, "[ALIGNING_COEFFICIENTS] gives none of QBZ1, QDZ1: there is no pneumatic trail"),
        ({"RBX1": 0.0, "RCX1": 0.0}, "combined slip does not reduce the longitudinal force"),
        ({"VXLOW": 8.0}, "VXLOW = 8 m/s"),
        ({"FNOMIN": 700.0}, "FNOMIN = 700 N: car tyres have 1000 to 12000 N"),
        ({"VERTICAL_STIFFNESS": 2e6, "Q_FZ2": 0.0, "Q_FZ1": 0.0}, "the nominal load deflects the tyre by 0.6 %"),
        ({"UNLOADED_RADIUS": 0.35}, "rim and side wall make"),
        ({"INFLPRES": 300e3}, "INFLPRES is 130 % of NOMPRES: the tyre runs far from the pressure"),
        ({"FZMAX": 5000.0}, "FZMAX = 5000 N is 1.25 of the nominal load: beyond it the tyre is evaluated at the limit"),
        ({"FZMIN": 2000.0}, "FZMIN = 2000 N is 0.50 of the nominal load"),
        ({"KPUMIN": -0.3}, "KPUMIN, KPUMAX allow -0.3 to 1.5 only"),
        ({"ALPMAX": 0.1}, "ALPMIN, ALPMAX allow -85.9 to 5.73 deg only"),
        ({"CAMMIN": -0.01, "CAMMAX": 0.01}, "CAMMIN, CAMMAX allow -0.573 to 0.573 deg only"),
        ({"MC_CONTOUR_A": 0.5}, "the contour of a motorcycle tyre is not modelled"),
    ],
)
def test_what_is_unusual_is_said_with_a_reason(changes: dict[str, float], what: str) -> None:
    assert what in _unusual(tyre().with_values(**changes))


def test_stand_ins_are_named() -> None:
    given = {key: value for key, value in tyre().given.items() if key not in ("LATERAL_STIFFNESS", "FZMAX")}
    said = _unusual(TyreParameters(given))
    assert "not in the file: FZMAX = 10000 N, LATERAL_STIFFNESS = 100000 N/m" in said


def test_a_key_that_no_formula_uses_is_named() -> None:
    params = TyreParameters(tyre().given, unused={("MODEL", "PKY8"): 1.0, ("MDI_HEADER", "FILE_VERSION"): 3.0})
    assert "no formula here uses PKY8: " in _unusual(params)


@pytest.mark.parametrize("name", ["mf52_235_85R16", "pac2002_235_60R16"])
def test_older_versions_are_described(name: str) -> None:
    text = describe(TyreParameters(read_coefficients(f"{name}_coefficients.csv")))
    assert "MF 5.2" in text
    assert "nan" not in text


def test_the_size_needs_all_its_dimensions() -> None:
    assert size(tyre()) == "205/55 R16"
    assert size(TyreParameters({key: value for key, value in tyre().given.items() if key != "WIDTH"})) is None


def test_pictures_are_drawn_into_a_new_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("activesteer.plotting.drawing.DOTS_PER_INCH", 100)
    paths = draw(tyre(), tmp_path / "new" / "folder")
    assert [path.stem for path in paths] == PICTURES
    for path in paths:
        assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
        assert path.stat().st_size > 10_000


def test_a_tyre_with_narrow_ranges_is_drawn(figures: list[Any], tmp_path: Path) -> None:
    narrow = tyre().with_values(
        FZMIN=4500.0, FZMAX=5000.0, KPUMIN=-0.05, KPUMAX=0.05, ALPMIN=-0.02, ALPMAX=0.02, CAMMIN=-0.01, CAMMAX=0.01
    )
    assert len(draw(narrow, tmp_path)) == len(figures) == len(PICTURES)


def test_a_folder_that_cannot_be_made_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with raises(ParameterError, cause=FileExistsError):
        draw(tyre(), tmp_path / "file")


def test_without_matplotlib_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with raises(ParameterError, cause=ImportError, value="matplotlib", allowed="plot"):
        draw(tyre(), tmp_path)


def test_the_envelope_goes_through_the_peaks_and_holds_every_point(rng: np.random.Generator) -> None:
    formula = MagicFormula(tyre())
    fx, fy = envelope(formula, 4000.0)
    peak = formula.evaluate(4000.0, 0.0, 0.0)
    assert fx.max() == pytest.approx(4000.0 * float(peak.friction_x), rel=2e-3)
    assert fy.max() == pytest.approx(4000.0 * 0.997, rel=2e-3)
    assert (fx[0], fy[0]) == (fx[-1], fy[-1])
    at = formula.evaluate(4000.0, rng.uniform(-1, 1, 500), rng.uniform(-1, 1, 500))
    angle = np.arctan2(fx, fy)
    order = np.argsort(angle)
    reach = np.interp(np.arctan2(at.fx_N, at.fy_N), angle[order], np.hypot(fx, fy)[order], period=2 * math.pi)
    assert (np.hypot(at.fx_N, at.fy_N) < 1.003 * reach).all()


def test_the_bench_measures_all_its_figures() -> None:
    figures: dict[str, Any] = bench(tyre(), rounds=1)
    assert set(figures) == {"scalar_us", "vectorised_us_per_row", "python_call_us"}
    assert all(0.0 < value < 1000.0 for value in figures.values())
    assert figures["python_call_us"] > figures["vectorised_us_per_row"]
