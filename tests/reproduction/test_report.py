"""The report of all fifteen runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from activesteer.analysis.claims import STATEMENTS
from activesteer.cli import main
from activesteer.studies import reproduction
from activesteer.studies.reproduction import Reproduction


def test_reproduce_writes_a_report_of_all_runs(
    reproduced: Reproduction, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reproduction, "reproduce", lambda *_, **__: reproduced)
    main(["reproduce", "-o", str(tmp_path)])
    assert f"report: {tmp_path / 'report.html'}" in capsys.readouterr().out
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "15 runs of 5 manoeuvres" in page
    assert "vehicle compact" in page
    for number in STATEMENTS:
        assert f'-{number}"' in page
    assert "not judged" not in page


def test_report_of_all_runs_is_small(folder: Path, tmp_path: Path) -> None:
    files = [str(path) for path in sorted(folder.glob("*.mcap"))]
    assert main(["report", *files, "-o", str(tmp_path / "report.html")]) == 0
    assert (tmp_path / "report.html").stat().st_size < 5e6
