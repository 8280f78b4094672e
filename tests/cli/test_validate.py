"""`activesteer validate`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from activesteer.cli import main


def test_validate_prints_json_and_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["comparisons"]
    assert len(rows) > 120
    assert {row["run"] for row in rows} >= {"static_80kmh", "wheel_travel", "rack", "tyre", "step_0p4g_L"}


@pytest.mark.slow
def test_validate_writes_page_json_and_every_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "-o", str(tmp_path)]) == 0
    assert "comparisons within tolerance" in capsys.readouterr().out
    page = (tmp_path / "validation.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 2 + 2 * 11
    assert "default-src 'none'" in page
    assert "<script" not in page
    assert json.loads((tmp_path / "validation.json").read_text(encoding="utf-8"))["comparisons"]
    runs = sorted((tmp_path / "runs").glob("*.csv"))
    assert len(runs) == 11
    header = runs[0].read_text(encoding="utf-8").splitlines()[0].split(",")
    assert {"t", "vx", "r", "ay", "beta", "roll", "rack", "delta_FL", "Fz_RR", "omega_FR"} <= set(header)
    # What it wrote can be given back as the reference: then nothing differs but the rounding of the file.
    assert main(["validate", "--reference", str(tmp_path / "runs"), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["comparisons"]
    own = [row for row in rows if row["run"].startswith(("step", "sine", "swd", "sis", "brake"))]
    assert {row["run"] for row in own} >= {"step_0p6g_L", "swd_0p7Hz", "brake_0p4g"}
    assert np.abs([row["error"] for row in own if row["error"] is not None]).max() < 2e-3


@pytest.mark.slow
def test_the_study_shows_the_effect_of_conventions_and_step_sizes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "--study", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    conventions = {row["name"]: row["steady_yaw_rate_radps"] for row in found["conventions"]}
    steps = {row["name"]: row["steady_yaw_rate_radps"] for row in found["step_sizes"]}
    assert conventions["as the other code"] == steps["1 ms"]
    assert steps["0.125 ms"] == pytest.approx(steps["1 ms"], rel=1e-3)
    assert conventions["with camber"] > 1.01 * conventions["as the other code"]


def test_the_options_of_another_comparison_are_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for name, option in (
        ("bmw_m8", ["--samples", "20"]),
        ("tesla_model_s", ["--study"]),
        ("sedan", ["--samples", "9"]),
    ):
        assert main(["validate", name, *option]) == 1
        assert f"{option[0]}: belongs to a comparison with" in capsys.readouterr().err
    assert main(["validate", "--new", str(tmp_path / "mine")]) == 0
    assert "validation.toml" in capsys.readouterr().out
    assert main(["validate", "--new", str(tmp_path / "mine")]) == 1
    assert "is not empty" in capsys.readouterr().err
