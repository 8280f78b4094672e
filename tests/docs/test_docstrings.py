"""The examples in docstrings run, and the main objects have one."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

import activesteer

PACKAGE = Path(activesteer.__file__).parent
PUBLIC = (
    "activesteer.controllers.find.Controller",
    "activesteer.driver.base.Driver",
    "activesteer.maneuver.base.Maneuver",
    "activesteer.recording.recording.Recording",
    "activesteer.rigs.kc.result.kinematics_compliance",
    "activesteer.scenario.car.load_car",
    "activesteer.scenario.scenario.resolve",
    "activesteer.simulation.runner.simulate",
    "activesteer.simulation.simulation.Simulation",
    "activesteer.studies.linear.linearisation.linearise",
    "activesteer.studies.engine.study.study",
    "activesteer.tyre.evaluation.MagicFormula",
    "activesteer.tyre.file.tir.load_tir",
    "activesteer.vehicle_builder.build.new_vehicle",
)


LONG = ("activesteer.studies.engine.study.", "activesteer.vehicle_builder.build.", "activesteer.rigs.kc.result.")
"""Modules with examples that make a study or a car, or measure a car on the rig."""


def examples() -> dict[str, doctest.DocTest]:
    """Return all examples by the name of their object."""
    finder = doctest.DocTestFinder(exclude_empty=True)
    found = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        if ">>> " in file.read_text(encoding="utf-8"):
            name = ".".join(file.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
            found |= {test.name: test for test in finder.find(importlib.import_module(name), name) if test.examples}
    return found


EXAMPLES = examples()


@pytest.mark.parametrize("name", PUBLIC)
def test_what_people_use_first_has_an_example(name: str) -> None:
    assert name in EXAMPLES


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name.startswith(LONG) else []) for name in EXAMPLES]
)
def test_example_does_what_it_says(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    test = EXAMPLES[name]
    test.globs = {}  # a reader has only what the example imports
    printed: list[str] = []
    flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    doctest.DocTestRunner(verbose=False, optionflags=flags).run(test, out=printed.append)
    assert not printed, "".join(printed)
