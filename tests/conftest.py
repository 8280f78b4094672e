"""Shared fixtures: a seeded generator, no network, distribution of tests over processes."""

from __future__ import annotations

import contextlib
import gc
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pytest
from xdist.scheduler import LoadScopeScheduling

if TYPE_CHECKING:
    from playwright.sync_api import Browser

ROOT: Final = Path(__file__).resolve().parents[1]
PHONE: Final[dict[str, Any]] = {
    "viewport": {"width": 390, "height": 844}, "device_scale_factor": 2, "is_mobile": True, "has_touch": True,
}  # fmt: skip
"""How a browser shows a page on a telephone."""

# With several processes (pytest-xdist), the tests of a file stay together and share its fixtures. These folders stay
# together as a whole, since they share dear ones (all runs of the paper; the viewer) ...
TOGETHER: Final = ("tests/reproduction/", "tests/render/")
# ... and each test of these files is by itself: a page or a signal each.
BY_ITSELF: Final = ("tests/docs/test_documents.py", "tests/cli/test_stopping.py")
# What takes long is begun first, so that no process is left with it in the end.
LONG_FIRST: Final = (
    *TOGETHER[:1],
    *BY_ITSELF[:1],
    "tests/cli/test_w",
    "tests/cli/test_v",
    "tests/cli/",
    "tests/examples/",
)
NEEDED: Final = {
    "mesa-vulkan-drivers": "no Vulkan driver",
    "libosmesa6": "OSMesa",
    "chromium": "needs a browser",
    "gcc": "needs a C compiler",
}
"""Debian package -> words in the reason of a test that is skipped without it."""


def pytest_configure(config: pytest.Config) -> None:
    """Prepare several processes: compile once before they start, and keep each on its own processor.

    A shell starts background jobs with Ctrl-C ignored, and their children inherit this; here it is restored.
    """
    if hasattr(config, "workerinput"):
        # Another process of the tests uses each other processor: a study without `jobs` starts none of its own.
        os.sched_getaffinity = lambda _pid: {0}
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if getattr(config.option, "numprocesses", None):
        # Threads of the BLAS would wait for processors longer than they calculate.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        # Without byte code, each program that a test starts would translate the package again.
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        # The kernels of the car, of all blocks and of the estimator, which several files of tests need.
        drive = (
            "from activesteer import simulate\n"
            "simulate('step_steer', 'lqr', overrides={'duration_s': 1.5, 'sensors.preset': 'production'})"
        )
        subprocess.run([sys.executable, "-c", drive], cwd=ROOT, check=True)


class ByFile(LoadScopeScheduling):
    """Distribution of whole files, folders or single tests; pytest-xdist 3.8 does not see its groups in pytest 9.2."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        return nodeid if file in BY_ITSELF else next((folder for folder in TOGETHER if file.startswith(folder)), file)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> ByFile | None:
    return ByFile(config, log) if config.getoption("dist") == "loadgroup" else None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not hasattr(config, "workerinput"):
        return
    order = dict(zip(LONG_FIRST, range(len(LONG_FIRST)), strict=True))
    items.sort(
        key=lambda item: next((place for start, place in order.items() if item.location[0].startswith(start)), 99)
    )


def pytest_collection_finish() -> None:
    """Exempt modules and collected tests from garbage collection: they live until the end, and walking them costs."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> Iterator[None]:
    """End with the number of skipped tests and the packages that they miss."""
    yield
    skipped = [report for report in terminalreporter.stats.get("skipped", []) if report.when != "collect"]
    if skipped:
        reasons = " ".join(str(report.longrepr) for report in skipped)
        missing = [package for package, reason in NEEDED.items() if reason in reasons]
        needed = f"missing: {', '.join(missing)}" if missing else "see the reasons above"
        terminalreporter.write_line(f"{len(skipped)} tests were skipped; {needed}", yellow=True)


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers that are equal in every run."""
    return np.random.default_rng(20121121)


@pytest.fixture(autouse=True, scope="session")
def no_network() -> Iterator[None]:
    """Fail a test that connects to another machine."""
    connect = socket.socket.connect

    def only_here(self: socket.socket, address: Any) -> None:
        if self.family in {socket.AF_INET, socket.AF_INET6} and address[0] not in {"127.0.0.1", "::1", "localhost"}:
            pytest.fail(f"a test tried to reach {address[0]}: tests use no network")
        connect(self, address)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(socket.socket, "connect", only_here)
        yield


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Every figure that is saved to a file, which stays empty; pages get their pictures."""
    figure_class = pytest.importorskip("matplotlib.figure").Figure
    kept, drawn = [], figure_class.savefig

    def keep(self: Any, target: Any, **how: Any) -> None:
        kept.append(self)
        if isinstance(target, (str, Path)):
            Path(target).touch()
        else:
            drawn(self, target, **how)

    monkeypatch.setattr(figure_class, "savefig", keep)
    return kept


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A browser without a window; skip the test if there is none."""
    with started_browser() as started:
        yield started


@contextlib.contextmanager
def started_browser() -> Iterator[Browser]:
    """Start a browser without a window; skip the test if there is none."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="needs playwright, of the extra `dev`")
    names = ("chromium", "chromium-browser", "google-chrome")
    found = next((path for name in names if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip("needs a browser: apt-get install chromium")
    # As root, as in a container, Chromium refuses to start with its sandbox.
    arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
    # Chromium brings its own Vulkan driver; variables that hide the machine's driver would hide that one too.
    environment: dict[str, str | float | bool] = {
        name: value for name, value in os.environ.items() if not name.startswith("VK_")
    }
    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=found, args=arguments, env=environment)
        yield started
        started.close()
