"""The notebooks run from top to bottom, as a reader runs them."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from activesteer import Recording
from tests.docs.blocks import same_output

ROOT = Path(__file__).resolve().parents[2]
FIRST_RUNS, LQR_DESIGN = (ROOT / "examples" / f"{name}.ipynb" for name in ("first_runs", "lqr_design"))


@pytest.fixture
def kernel_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an environment in which the kernel finds the package and writes nothing to the user's home."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")])))
    for name in ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR"):
        folder = tmp_path / "jupyter" / name.lower()
        folder.mkdir(parents=True)
        monkeypatch.setenv(name, str(folder))
    (tmp_path / "work").mkdir()
    return tmp_path / "work"


def outputs(notebook: Any) -> list[dict[str, Any]]:
    """Return the outputs of the cells in order: mime type -> content."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    return [output["data"] for cell in cells for output in cell.outputs if "data" in output]


def run(path: Path, folder: Path) -> Any:
    """Return the notebook after a run."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    return notebook


def printed(notebook: Any) -> list[str]:
    """Return the printed output of the cells."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    return ["".join(output.text for output in cell.outputs if output.output_type == "stream") for cell in cells]


@pytest.mark.slow
def test_every_notebook_is_tested() -> None:
    assert sorted((ROOT / "examples").glob("*.ipynb")) == [FIRST_RUNS, LQR_DESIGN]


@pytest.mark.slow
def test_first_runs_are_kept_without_outputs() -> None:
    """Stored outputs would be outdated by the next change of the car."""
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(FIRST_RUNS, as_version=4)
    nbformat.validate(notebook)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            assert cell.outputs == []
            assert cell.execution_count is None


@pytest.mark.slow
def test_first_runs_run(kernel_home: Path) -> None:
    shown = outputs(run(FIRST_RUNS, kernel_home))
    assert sum("image/png" in data for data in shown) == 1
    assert sum("text/html" in data for data in shown) == 3  # tables
    share = float(shown[-2]["text/plain"].removeprefix("np.float64(").removesuffix(")"))
    # Rear wheels against the front ones turn the car more.
    assert 1.02 < share < 1.2
    assert {path.suffix for path in kernel_home.iterdir() if path.is_file()} == {
        ".csv", ".html", ".mat", ".mcap", ".parquet", ".py",
    }  # fmt: skip
    assert Recording.open(kernel_home / "step_steer-ars.mcap").metadata["controller"] == "ars"
    shutil.rmtree(kernel_home)


@pytest.mark.slow
def test_lqr_design_shows_what_it_gives_and_keeps_the_car(kernel_home: Path) -> None:
    nbformat = pytest.importorskip("nbformat")
    stored = nbformat.read(LQR_DESIGN, as_version=4)
    nbformat.validate(stored)
    again = run(LQR_DESIGN, kernel_home)
    for shown, now in zip(printed(stored), printed(again), strict=True):
        assert same_output(tuple(shown.splitlines()), now)
    for notebook in (stored, again):
        assert sum("image/png" in data for data in outputs(notebook)) == 2
    text = "".join(printed(again))
    assert "none: spins" in text
    assert "gentle: sideslip up to" in text
    grows = [float(value) for value in re.findall(r"sharp: .* real part ([-\d.]+)", text)]
    holds = [float(value) for value in re.findall(r"gentle: .* real part ([-\d.]+)", text)]
    assert min(grows) > 0.0 > max(holds)
