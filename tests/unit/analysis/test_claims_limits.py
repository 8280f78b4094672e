"""Limits of the claims, from just below to just above."""

from __future__ import annotations

import numpy as np
import pytest

from tests.unit.analysis.good_runs import check, good


@pytest.mark.parametrize(("sideslip_deg", "lost"), [(19.7, False), (20.3, True)])
def test_a_car_is_lost_beyond_20_deg_of_sideslip(sideslip_deg, lost):
    arguments = good("sine_with_dwell")
    arguments["none"] |= {"sideslip_rad": np.radians(sideslip_deg)}
    assert check("sine_with_dwell", arguments)["D1"].passed is lost
