"""What a command imports: help and lists answer at once, and only `replay` needs the viewer."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = """
import sys
class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {refused!r}:
            raise ImportError(f"{{name}} is refused here", name=name)
sys.meta_path.insert(0, Refuse())
from activesteer.cli import main
sys.exit(main())
"""


def call(folder: Path, refused: set[str], *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", PROGRAM.format(refused=refused), *words],
        cwd=folder, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def recording(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    done = call(folder, {"rerun", "rerun_cli"}, "run", "straight_line", "--set", "duration_s=0.3", "-o", "run.mcap")
    assert done.returncode == 0, done.stderr
    return folder / "run.mcap"


@pytest.mark.parametrize("words", [("--help",), ("run", "--help"), ("list",), ("info", "run.mcap"), ("--version",)])
def test_help_list_and_info_need_neither_engine_nor_compiler(recording, words):
    done = call(recording.parent, {"mujoco", "numba", "scipy", "rerun", "matplotlib"}, *words)
    assert done.returncode == 0, done.stderr


def test_what_needs_no_viewer_works_without_rerun(recording):
    rerun = {"rerun", "rerun_sdk", "rerun_cli"}
    assert call(recording.parent, rerun, "report", "run.mcap").returncode == 0
    done = call(recording.parent, rerun, "replay", "run.mcap")
    assert done.returncode == 1
    assert done.stderr == "activesteer: replay needs the viewer rerun: pip install rerun-sdk\n"
