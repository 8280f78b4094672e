"""A viewer without a window, and drives of the three systems."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

from activesteer.recording import Recording
from activesteer.scenario import resolve
from activesteer.simulation.runner import run_scenario
from tests.conftest import started_browser
from tests.render.headless import Headless, ViewerDied

if TYPE_CHECKING:
    from playwright.sync_api import Browser

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
def drives() -> Mapping[str, Recording]:
    """A double lane change on a slippery road, at a speed at which the cars differ."""
    return _Drives()


class _Drives(Mapping[str, Recording]):
    """Runs of the three systems, each driven when it is first asked for."""

    def __init__(self) -> None:
        self._scenario = resolve(
            "double_lane_change_low_mu", overrides={"maneuver.speed_kmh": 95.0, "duration_s": 10.0}
        )
        self._driven: dict[str, Recording] = {}

    def __getitem__(self, controller: str) -> Recording:
        if controller not in self._driven:
            self._driven[controller] = run_scenario(self._scenario, controller)
        return self._driven[controller]

    def __iter__(self) -> Iterator[str]:
        return iter(("none", "ars", "afs"))

    def __len__(self) -> int:
        return 3


_browser = contextlib.ExitStack()


@functools.cache
def _started() -> Browser:
    return _browser.enter_context(started_browser())


@pytest.fixture
def browser() -> Browser:
    """One browser for all tests of this folder."""
    return _started()


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(nextitem: pytest.Item | None) -> None:
    """Close the browser after the last test of the folder: elsewhere, its event loop would be in the way."""
    if nextitem is None or not nextitem.location[0].startswith("tests/render/"):
        _started.cache_clear()
        _browser.close()


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder for files and pictures; `--basetemp` sets it."""
    return tmp_path_factory.mktemp("pictures")
