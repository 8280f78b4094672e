"""Cars of these tests only stand, because drives take longer than all else; `tests/physics/test_own_cars.py` drives."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from activesteer.vehicle_builder import build


@pytest.fixture(autouse=True, scope="module")
def parked() -> Iterator[None]:
    """Leave the drives of a new car out."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "_drive", lambda *_: [])
        yield
