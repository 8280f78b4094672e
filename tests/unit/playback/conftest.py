"""A drive of the real car, for tests of files for other tools."""

from __future__ import annotations

from pathlib import Path

import pytest

from activesteer.scenario import resolve
from activesteer.simulation.runner import run_scenario


@pytest.fixture(scope="session")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A double lane change with active rear steering."""
    path = tmp_path_factory.mktemp("driven") / "run.mcap"
    run_scenario(resolve("double_lane_change"), "ars", path=path)
    return path
