"""Comfort on an uneven road."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.general import weighted, weighting


def test_the_weighting_has_the_factors_of_iso_2631() -> None:
    # ISO 2631-1:1997, table 3, W_k in thousandths.
    table = {0.5: 418, 1.0: 482, 2.0: 531, 4.0: 967, 6.3: 1054, 8.0: 1036, 16.0: 768, 31.5: 405, 63.0: 186}
    found = np.abs(weighting(np.array(list(table))))
    assert 1000.0 * found == pytest.approx(list(table.values()), abs=1.0)


def test_a_sine_keeps_its_shape_and_its_mean_does_not_count() -> None:
    time = np.arange(0.0, 10.0, 1e-3)
    wave = 3.0 + 2.0 * np.sin(2.0 * math.pi * 4.0 * time)
    assert np.sqrt(np.mean(weighted(wave, 1e-3) ** 2)) == pytest.approx(0.967 * math.sqrt(2.0), rel=1e-3)
