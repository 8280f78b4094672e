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


@pytest.mark.parametrize(("number", "system"), [("D2", "ars"), ("D3", "afs")])
@pytest.mark.parametrize(("less_deg", "kept"), [(0.07, False), (0.13, True)])
def test_a_system_keeps_the_car_only_with_a_sideslip_measurably_below_that_of_none(number, system, less_deg, kept):
    arguments = good("sine_with_dwell")
    # Without control the yaw rate alone is beyond the limits of the standard.
    arguments["none"] |= {"sideslip_rad": np.radians(12.0)}
    arguments[system] |= {"sideslip_rad": np.radians(12.0 - less_deg)}
    assert check("sine_with_dwell", arguments)[number].passed is kept


@pytest.mark.parametrize("system", ["ars", "afs"])
@pytest.mark.parametrize(("left_degps", "calmed"), [(2.9, True), (3.1, False)])
def test_a_car_is_calmed_only_if_it_runs_straight_however_much_none_sways(system, left_degps, calmed):
    arguments = good("double_lane_change")
    arguments["none"] |= {"yaw_rate": 2.0, "sideslip": 0.5}
    # RMS of a sine of this amplitude.
    arguments[system]["after"] = np.sqrt(2.0) * np.radians(left_degps) / arguments[system]["yaw_rate"]
    assert check("double_lane_change", arguments)["L2"].passed is calmed
