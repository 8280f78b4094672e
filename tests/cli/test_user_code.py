"""User code on the command line: output, exceptions, imports."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Call
from tests.cli.process import ended

SHORT = ("--set", "settle_s=0", "--set", "duration_s=0.2", "--set", "steer.start_s=0.05")
PRINTS = """
if self.steps == 1:
    import os, sys
    print("said")
    os.write(1, b"written")
return ActuatorCommand()
"""


@pytest.mark.parametrize(
    "text",
    [
        "raise type('Ends', (Exception,), {'__str__': exits})()",
        "return type('Ends', (ActuatorCommand,), {'__len__': exits})()",
        "return ActuatorCommand(type('Ends', (float,), {'__float__': exits, '__le__': exits, '__ge__': exits})())",
        "return type('Ends', (), {'__repr__': exits})()",
        "return type('Ends', (), {'__getattribute__': exits})()",
    ],
)
def test_a_value_or_error_of_user_code_that_ends_the_program_fails_the_run(
    call: Call, controller: Callable[..., str], text: str
) -> None:
    given = controller(f"import sys\ndef exits(*_):\n    sys.exit(0)\n{text}\n")
    told = call("run", "step_steer", "-c", given, *SHORT, "-o", "run.mcap")
    assert told.status == 1
    assert "mine.py" in told.err


def test_prints_of_user_code_do_not_disturb_json(controller: Callable[..., str], tmp_path: Path) -> None:
    given = controller(PRINTS)
    words = "run", "step_steer", "-c", given, *SHORT, "--json"
    done = ended(tmp_path, *words)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["runs"]
    assert "said" in done.stderr
    assert "written" in done.stderr


def test_prints_of_user_code_are_seen_without_json(call: Call, controller: Callable[..., str]) -> None:
    given: Any = controller('print("said")\nreturn ActuatorCommand()\n')
    assert "said" in call("run", "step_steer", "-c", given, *SHORT).out


def test_controller_that_fails_leaves_the_table_to_the_others(call: Call, controller: Callable[..., str]) -> None:
    given = controller("if self.steps > 100:\n    raise ValueError('no')\nreturn ActuatorCommand()\n")
    short = ("--set", "settle_s=0", "--set", "duration_s=2.2", "--set", "steer.start_s=0.05")
    told = call("run", "step_steer", "-c", given, "-c", "none", *short, "-o", "runs")
    assert told.status == 1
    assert "steady-state yaw rate" in told.out
    assert "Mine.step raised ValueError: no" in told.err
    failed, other = call("run", "step_steer", "-c", given, "-c", "none", *short, "-o", "runs", "--json").json["runs"]
    assert "metrics" not in failed
    assert "ValueError" in failed["error"]
    assert other["metrics"]
    assert "error" not in other
