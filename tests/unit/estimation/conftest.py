"""Fixtures of the tests of this folder."""

from __future__ import annotations

import pytest

from activesteer.scenario import resolve
from tests.unit.estimation.drives import drive

PRODUCTION = {"sensors.preset": "production"}


@pytest.fixture(scope="session")
def slalom():
    return drive("slalom")


@pytest.fixture(scope="session")
def make():
    """Function that makes estimators of the compact with production sensors."""

    def made(interval_s=0.001, **overrides):
        return resolve("straight_line", overrides=PRODUCTION | overrides).controller_setup(interval_s).estimator()

    return made
