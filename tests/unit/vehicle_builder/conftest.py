"""Cars of these tests only stand, because drives take longer than all else; `tests/physics/test_own_cars.py` drives."""

from __future__ import annotations

import pytest

from activesteer.vehicle_builder import build


@pytest.fixture(autouse=True)
def parked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the drives of a new car out."""
    monkeypatch.setattr(build, "_drive", lambda *_: [])
