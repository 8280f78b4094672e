"""A viewer without a window, and drives of the three systems."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from activesteer.recording import Recording
from activesteer.scenario import resolve
from activesteer.simulation.runner import run_scenario
from tests.render.headless import Headless, ViewerDied

_NOTHING_DRAWS: Final = ("No graphics adapter was found", "Failed to get render context")
"""What the viewer ends with where there is no Vulkan driver: without OpenGL, and with one that does not suffice."""


@pytest.fixture(scope="session")
def viewer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Headless]:
    """Skip the test if nothing can be drawn."""
    try:
        headless = Headless(tmp_path_factory.mktemp("viewer"))
    except ViewerDied as error:
        if any(message in str(error) for message in _NOTHING_DRAWS):
            pytest.skip("no Vulkan driver here: apt-get install mesa-vulkan-drivers brings one in software")
        raise
    yield headless
    headless.close()


@pytest.fixture(scope="session")
def drives() -> dict[str, Recording]:
    """A double lane change on a slippery road, at a speed at which the cars differ."""
    scenario = resolve("double_lane_change_low_mu", overrides={"maneuver.speed_kmh": 95.0, "duration_s": 10.0})
    return {controller: run_scenario(scenario, controller) for controller in ("none", "ars", "afs")}


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder for files and pictures; `--basetemp` sets it."""
    return tmp_path_factory.mktemp("pictures")
