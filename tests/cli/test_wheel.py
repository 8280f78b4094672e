"""The wheel contains all that a run needs: build it, install it outside the checkout, and run from there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def call(*words: str | Path, cwd: Path) -> str:
    """Run a program like a user's shell: without PYTHONPATH, so that nothing refers to the checkout."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(
        [str(word) for word in words], cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{words} failed:\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    call(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT, cwd=folder)
    (built,) = folder.glob("activesteer-*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the `bin` folder of a new environment with the wheel installed."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, with_pip=False, symlinks=True)
    python = folder / "bin" / "python"
    call(
        sys.executable,
        "-m",
        "pip",
        "--python",
        python,
        "install",
        "--no-deps",
        "--no-index",
        "--no-compile",
        wheel,
        cwd=folder,
    )
    # The dependencies are those of this environment. A path named in a .pth file is searched for packages but its own
    # .pth files are not read, so an editable install of the checkout is not seen from the new environment.
    site = Path(sysconfig.get_path("purelib", vars={"base": str(folder), "platbase": str(folder)}))
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    return folder / "bin"


def test_wheel_holds_models_and_maneuvers_and_no_tests(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    for wanted in (
        "activesteer/py.typed",
        "activesteer/pages/templates/document.html",
        "activesteer/pages/templates/page.css",
        "activesteer/pages/templates/uPlot.LICENSE",
        "activesteer/_data/maneuvers/step_steer.toml",
        "activesteer/_data/models/vehicles/compact.toml",
        "activesteer/_data/models/mjcf/compact/compact.xml",
    ):
        assert wanted in names
    for folder in ("maneuvers", "models", "studies"):
        files = [path for path in (ROOT / folder).rglob("*") if path.is_file() and "__pycache__" not in path.parts]
        assert {f"activesteer/_data/{path.relative_to(ROOT).as_posix()}" for path in files} <= set(names)
    assert not [name for name in names if name.startswith(("tests/", "tools/", "models/")) or name.endswith(".nbc")]


def test_installed_package_is_its_own(installed, tmp_path):
    told = call(
        installed / "python",
        "-P",
        "-c",
        "import activesteer as a, activesteer.resources as r; print(a.__file__, r.models_dir(), r.maneuvers_dir())",
        cwd=tmp_path,
    )
    for path in told.split():
        assert Path(path).is_relative_to(installed.parent)
    assert "step_steer" in call(installed / "activesteer", "list", cwd=tmp_path)


@pytest.mark.slow
def test_installed_package_drives_a_maneuver(installed, tmp_path):
    told = call(installed / "activesteer", "run", "step_steer", "-c", "none", "-o", "run.mcap", "--json", cwd=tmp_path)
    json.loads(told)
    assert (tmp_path / "run.mcap").stat().st_size > 10_000
    read = (
        "import activesteer; run = activesteer.Recording.open('run.mcap');"
        "assert run.metadata['maneuver']['kind'] == 'step_steer', run.metadata['maneuver'];"
        "print(abs(run['ay_mps2'][-1]))"
    )
    assert float(call(installed / "python", "-P", "-c", read, cwd=tmp_path)) > 1.0
