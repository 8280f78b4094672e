"""Imports of commands: help and lists answer quickly, and only `replay` needs the viewer."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from activesteer import simulate
from tests.cli.process import ended

PROGRAM = """
import sys
class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {refused!r}:
            raise ImportError(f"{{name}} is refused here", name=name)
sys.meta_path.insert(0, Refuse())
from activesteer.commands.cli import main
status = 0
for words in {calls!r}:
    try:
        status = status or main(words)
    except SystemExit as end:
        status = status or end.code
sys.exit(status)
"""


def call(folder: Path, refused: set[str], *calls: str) -> subprocess.CompletedProcess[str]:
    """Call commands in sequence in one process where some packages cannot be imported."""
    return ended(folder, code=PROGRAM.format(refused=refused, calls=[words.split() for words in calls]))


@pytest.fixture(scope="module")
def recording(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    simulate("straight_line", overrides={"duration_s": 0.3}).save(folder / "run.mcap")
    return folder / "run.mcap"


def test_help_list_and_info_need_neither_engine_nor_compiler(recording):
    refused = {"mujoco", "numba", "scipy", "rerun", "matplotlib"}
    done = call(recording.parent, refused, "list", "info run.mcap", "--help", "run --help", "--version")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("run step_steer -c arss", "there is no controller 'arss'"),
        ("run step_ster", "no manoeuvre is named 'step_ster'"),
        ("run step_steer --vehicle compakt", "no vehicle is named 'compakt'"),
    ],
)
def test_a_wrong_name_is_answered_before_anything_is_compiled(tmp_path, words, said):
    done = call(tmp_path, {"mujoco"}, words)
    assert done.returncode == 1
    assert done.stderr.startswith(f"activesteer: {said}")


def test_help_needs_no_numpy(recording):
    """It takes longer to import than everything else of the command line."""
    done = call(recording.parent, {"numpy", "pyarrow", "tomllib"}, "--help", "--version")
    assert done.returncode == 0, done.stderr


def test_what_needs_no_viewer_works_without_rerun(recording):
    refused = {"rerun", "rerun_sdk", "rerun_cli"}
    run = "run straight_line --set duration_s=0.3 --set settle_s=0 -o again.mcap"
    done = call(recording.parent, refused, run, "report again.mcap", "replay again.mcap")
    assert done.returncode == 1
    assert done.stderr.endswith("activesteer: replay needs the viewer rerun: pip install rerun-sdk\n")
    assert (recording.parent / "report.html").exists()
