"""The yaw angle of a car that turns several times is continuous over the blocks of its recording."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.recording import McapWriter, Recording
from activesteer.scenario import resolve
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.recorder import Recorder

TURNING = {"settle_s": 0.5, "duration_s": 14.0, "circle.radius_m": 20.0, "speed_kmh": 36.0}
"""A circle of 20 m at 10 m/s: more than one turn, so that the angle of the engine jumps by a turn at least once."""


@pytest.mark.parametrize("in_file", [False, True])
def test_yaw_angle_is_the_integral_of_the_yaw_rate_over_more_than_a_turn(tmp_path, in_file):
    loop = ClosedLoop(resolve("constant_radius", overrides=TURNING), "none")
    if in_file:
        channels = loop.vehicle.channels.channels
        with McapWriter(tmp_path / "run.mcap", channels, loop.vehicle.body_names) as writer:
            recorder = Recorder(loop.vehicle, loop.steps, writer, keep=False)
            loop.run(recorder)
            recorder.flush()
        recording = Recording.open(tmp_path / "run.mcap")
        yaw_rad, yaw_rate_radps = recording["yaw_rad"], recording["yaw_rate_radps"]
    else:
        recorder = Recorder(loop.vehicle, loop.steps)
        loop.run(recorder)
        values, names = recorder.result()[1], [channel.name for channel in recorder.channels]
        yaw_rad, yaw_rate_radps = values[:, names.index("yaw_rad")], values[:, names.index("yaw_rate_radps")]
    turned_rad = 0.001 * np.cumsum(yaw_rate_radps)
    assert abs(turned_rad[-1]) > math.tau
    # The yaw rate is about the axis of the car, which leans by a few degrees: 1 % of two turns.
    assert yaw_rad - yaw_rad[0] == pytest.approx(turned_rad, abs=0.1)
