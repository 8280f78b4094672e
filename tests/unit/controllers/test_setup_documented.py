"""The guide names every attribute that a `setup` offers."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

from activesteer.controllers import ControllerParameters, ControllerSetup, SingleTrackParameters
from activesteer.driver import DriverSetup
from activesteer.estimation import EstimatorSetup, KnownTyre
from activesteer.theory.single_track import TwoTrackParameters

DOCS = Path(__file__).parents[3] / "docs"
OF_CONTROLLERS = (
    ControllerSetup, SingleTrackParameters, ControllerParameters, EstimatorSetup, TwoTrackParameters, KnownTyre,
)  # fmt: skip


@pytest.mark.parametrize(
    ("page", "kinds"), [("reference/controllers.md", OF_CONTROLLERS), ("driver.md", (DriverSetup,))]
)
def test_guide_names_every_attribute_of_setup(page, kinds):
    table = (DOCS / page).read_text(encoding="utf-8").partition("| attribute of `setup` |")[2].partition("\n\n")[0]
    named = set(re.findall(r"\w+", " ".join(re.findall(r"`[^`]+`", table))))
    assert {field.name for kind in kinds for field in fields(kind)} <= named
