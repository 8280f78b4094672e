from __future__ import annotations

import math

from activesteer.analysis.report.groups import outcome, verdict
from activesteer.recording import Recording
from tests.unit.playback.synthetic import circle


def run(**metrics: float) -> Recording:
    made = circle(0.1)
    made.metrics.clear()
    made.metrics.update(metrics)
    return made


def test_lanes_cones_and_sideslip_are_said_with_their_sizes():
    good = run(stays_in_lanes=1.0, lane_overstep_m=-0.2, cones_hit=0.0, sideslip_peak_abs_rad=math.radians(1.5))
    assert outcome(good) == "stays in the lanes, hits no cone, sideslip peak 1.500 deg"
    bad = run(stays_in_lanes=0.0, lane_overstep_m=0.5, cones_hit=1.0, sideslip_peak_abs_rad=math.radians(50.0))
    assert outcome(bad) == (
        "lost at 50 deg of sideslip, leaves the lane by 0.50 m, hits 1 cone, sideslip peak 50.000 deg"
    )


def test_a_run_that_broke_off_says_why():
    broken = circle(0.1, {"complete": False, "error": "boom"})
    assert outcome(broken) == "the run did not end properly: boom"


def test_every_run_has_a_line_in_its_order():
    lines = verdict({"ars": run(cones_hit=2.0), "none": run(cones_hit=0.0)})
    assert lines == ["ars: hits 2 cones", "none: hits no cone"]
