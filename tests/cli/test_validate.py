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
