from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def figures(monkeypatch):
    """Return every Figure that is saved, to check its curves; the file stays empty."""
    figure_module = pytest.importorskip("matplotlib.figure")
    kept = []

    def keep(self, path, **_):
        kept.append(self)
        Path(path).touch()

    monkeypatch.setattr(figure_module.Figure, "savefig", keep)
    return kept
