"""The notebooks run from top to bottom, as a reader runs them."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import pytest

from activesteer import Recording

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))


@pytest.fixture
def kernel_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The kernel finds the package, and leaves nothing in the user's home."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")])))
    for name in ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR"):
        folder = tmp_path / "jupyter" / name.lower()
        folder.mkdir(parents=True)
        monkeypatch.setenv(name, str(folder))
    (tmp_path / "work").mkdir()
    return tmp_path / "work"


def outputs(notebook: Any) -> list[dict[str, Any]]:
    """What the cells show, in the order of the notebook: mime type -> content."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    return [output["data"] for cell in cells for output in cell.outputs if "data" in output]


def test_there_is_a_notebook() -> None:
    assert [path.name for path in NOTEBOOKS] == ["first_runs.ipynb"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_kept_without_outputs(path: Path) -> None:
    """They would be out of date with the next change of the car."""
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            assert cell.outputs == []
            assert cell.execution_count is None


def test_first_runs_run(kernel_home: Path) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(ROOT / "examples" / "first_runs.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(kernel_home)}}).execute()
    shown = outputs(notebook)
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
