"""`tools/validate.py`: page, runs and study of the comparison with Project Chrono."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

PROGRAM = Path(__file__).resolve().parents[2] / "tools" / "validate.py"

pytestmark = pytest.mark.slow


def printed(*words: str) -> dict[str, Any]:
    return json.loads(
        subprocess.run([sys.executable, PROGRAM, *words], capture_output=True, text=True, check=True).stdout
    )


def test_it_writes_page_json_and_every_run(tmp_path: Path) -> None:
    assert printed("-o", str(tmp_path), "--json")["comparisons"]
    page = (tmp_path / "validation.html").read_text(encoding="utf-8")
    assert len(re.findall(r'data-picture="\d', page)) == 2 + 2 * 11
    assert "default-src 'none'" in page
    assert not re.search(r"<script[^>]*\ssrc=", page)  # nothing is loaded
    runs = sorted((tmp_path / "runs").glob("*.csv"))
    assert len(runs) == 11
    header = runs[0].read_text(encoding="utf-8").splitlines()[0].split(",")
    assert {"t", "vx", "r", "ay", "beta", "roll", "rack", "delta_FL", "Fz_RR", "omega_FR"} <= set(header)
    # What it wrote can be given back as the reference: then nothing differs but the rounding of the file.
    rows = printed("--reference", str(tmp_path / "runs"), "--json")["comparisons"]
    own = [row for row in rows if row["run"].startswith(("step", "sine", "swd", "sis", "brake"))]
    assert {row["run"] for row in own} >= {"step_0p6g_L", "swd_0p7Hz", "brake_0p4g"}
    assert np.abs([row["error"] for row in own if row["error"] is not None]).max() < 2e-3


def test_the_study_shows_the_effect_of_conventions_and_step_sizes() -> None:
    found = printed("--study", "--json")
    conventions = {row["name"]: row["steady_yaw_rate_radps"] for row in found["conventions"]}
    steps = {row["name"]: row["steady_yaw_rate_radps"] for row in found["step_sizes"]}
    assert conventions["as the other code"] == steps["1 ms"]
    assert steps["0.125 ms"] == pytest.approx(steps["1 ms"], rel=1e-3)
    assert conventions["with camber"] > 1.01 * conventions["as the other code"]
