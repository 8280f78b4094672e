"""The table of panels: its channels exist, and every view reads it."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from activesteer import simulate
from activesteer.core.conventions import CORNERS
from activesteer.drawing import panels
from activesteer.drawing.panels import (
    AXLE_SLIP,
    PANELS,
    PATH_DISTANCE,
    VIEWS,
    Line,
    drawn_values,
    panels_in,
)
from activesteer.scenario import resolve
from activesteer.simulation.simulation import Simulation


def test_every_channel_of_every_panel_is_recorded() -> None:
    simulation = Simulation(resolve("step_steer"), "ars")
    simulation.advance(10)
    recorded = {channel.name for channel in simulation.recording().channels}
    for name, panel in PANELS.items():
        for line in panel.lines:
            if line.channel == PATH_DISTANCE:
                continue
            channels = [f"{wheel}_slip_angle_rad" for wheel in AXLE_SLIP.get(line.channel, ())] or [line.channel]
            wanted = {*channels, line.demand, line.beside} - {""}
            # A car with sensors or an estimator records a true value under a second name.
            assert {each.removeprefix("measured_").removeprefix("estimated_") for each in wanted} <= recorded, name


def test_every_panel_stands_in_a_view_and_every_view_names_panels() -> None:
    assert {name for names in VIEWS.values() for name in names} == PANELS.keys()
    for view, names in VIEWS.items():
        assert len(set(names)) == len(names), view
        for panel in panels_in(view):
            assert panel.extreme is not None or panel.lines_in(view), panel.title


def test_a_line_without_a_demand_or_without_its_companion_has_no_meaning() -> None:
    run: dict[str, Any] = {"a_rad": np.ones(3), "a_demand_rad": np.zeros(3)}

    class Run:
        def __getitem__(self, name: str) -> Any:
            if name not in run:
                raise panels.RecordingError(f"there is no {name}")
            return run[name]

    assert Line("a_rad", demand="a_demand_rad").of(Run()) is None
    assert Line("a_rad", demand="missing").of(Run()) is not None
    assert Line("a_rad", beside="missing").of(Run()) is None
    run["a_demand_rad"][1] = 1.0
    assert Line("a_rad", demand="a_demand_rad").of(Run()) is not None


def test_parts_of_all_corners_have_one_colour() -> None:
    names = [f"{corner}_{part}_force_N" for corner in CORNERS for part in ("spring", f"link_{corner[0]}")]
    by_corner = panels.link_panels(names)
    assert len(by_corner) == len(CORNERS)
    assert {panel.lines[0].colour for panel in by_corner} == {by_corner[0].lines[0].colour}
    assert json.dumps([panel.title_with_unit for panel in by_corner]).count("[N]") == len(CORNERS)


@pytest.mark.parametrize(("maneuver", "spins"), [("sine_with_dwell", True), ("ramp_steer", False)])
def test_the_axle_that_has_lost_its_grip_slips_more(maneuver: str, spins: bool) -> None:
    """At 4 s, the sine with dwell has ended with a car that spins, and the ramp has asked for too much of the front."""
    run = simulate(maneuver, "none")
    rear, front = (np.degrees(drawn_values(run, f"{axle}_axle_slip_angle_rad")[4000]) for axle in ("rear", "front"))
    # Without steering, the slip angles of the axles differ by wheelbase times yaw rate over speed, here 6 deg.
    assert abs(rear) > abs(front) + 4.0 if spins else abs(front) > 2.0 * abs(rear)


def test_the_sideslip_angle_of_a_car_that_turns_round_has_no_jump() -> None:
    beyond_deg = np.array([170.0, 179.0, -178.0, -170.0, 178.0])
    shown = drawn_values({"sideslip_rad": np.radians(beyond_deg), "yaw_rad": np.radians(beyond_deg)}, "sideslip_rad")
    assert np.degrees(shown) == pytest.approx([170.0, 179.0, 182.0, 190.0, 178.0])


def test_an_axle_at_rest_has_no_slip_angle() -> None:
    wheels = {f"{wheel}_{name}": np.full(2, value) for wheel in ("fl", "fr")
              for name, value in (("slip_angle_rad", 0.05), ("tyre_fz_N", 4000.0))}  # fmt: skip
    shown = drawn_values({**wheels, "speed_mps": np.array([0.01, 20.0])}, "front_axle_slip_angle_rad")
    assert np.isnan(shown[0])
    assert shown[1] == pytest.approx(0.05)
