"""All runs of the paper, made once for the tests of this folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from activesteer.recording import Recording
from activesteer.studies.reproduction import Reproduction, reproduce


@pytest.fixture(scope="session")
def reproduced(tmp_path_factory: pytest.TempPathFactory) -> Reproduction:
    return reproduce(tmp_path_factory.mktemp("reproduced"))


@pytest.fixture(scope="session")
def runs(reproduced: Reproduction) -> dict[str, dict[str, Recording]]:
    return reproduced.recordings()


@pytest.fixture(scope="session")
def folder(reproduced: Reproduction) -> Path:
    return reproduced.paths["step_steer"]["none"].parent
