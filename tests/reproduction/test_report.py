"""The report of all fifteen runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from activesteer.analysis.claims.judge import STATEMENTS
from activesteer.commands.cli import main
from activesteer.recording import Recording
from activesteer.studies import reproduction
from activesteer.studies.reproduction import Reproduction


def test_reproduce_writes_a_report_of_all_runs(
    reproduced: Reproduction, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reproduction, "reproduce", lambda *_, **__: reproduced)
    written: list[str] = []

    def write(recordings: dict[str, Recording], path: Path) -> Path:
        written.extend(recordings)
        path.touch()
        return path

    monkeypatch.setattr(reproduction, "write_report", write)  # the slow test below writes it
    main(["reproduce", "-o", str(tmp_path)])
    assert written == [str(path) for systems in reproduced.paths.values() for path in systems.values()]
    lines = capsys.readouterr().out.splitlines()
    assert f"report: {tmp_path / 'report.html'}" in lines
    counts = [found for line in lines if (found := re.fullmatch(r"(\w+) +(\d+) of (\d+) claims reproduced", line))]
    assert [found[1] for found in counts] == [*reproduced.paths, "all"]
    for place in (2, 3):
        assert sum(int(found[place]) for found in counts[:-1]) == int(counts[-1][place])
    others = [item.claim for item in reproduced.scorecard.judged if not item.claim.passed]
    assert len(others) == int(counts[-1][3]) - int(counts[-1][2])
    told = " ".join(" ".join(lines).split())
    assert all(re.search(rf"{claim.id} (not reproduced|FAILED) {re.escape(claim.text)}", told) for claim in others)
    assert lines[-2].startswith("--all ")
    assert lines[-1].startswith("--setting paper ")
    main(["reproduce", "-o", str(tmp_path), "--all"])
    told = capsys.readouterr().out.splitlines()
    assert not [line for line in told if line.startswith("--all ")]
    assert all(any(line.startswith(f"{number}  ") for line in told) for number in STATEMENTS)
    assert not [line for line in told if len(line) > 80 and str(tmp_path) not in line]


@pytest.mark.slow
def test_report_of_all_runs_has_all_claims_and_is_small(folder: Path, tmp_path: Path) -> None:
    files = [str(path) for path in sorted(folder.glob("*.mcap"))]
    assert main(["report", *files, "-o", str(tmp_path / "report.html")]) == 0
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "15 runs of 5 manoeuvres" in page
    assert "vehicle compact" in page
    for number in STATEMENTS:
        assert f'-{number}"' in page
    assert "not judged" not in page
    assert (tmp_path / "report.html").stat().st_size < 5e6
