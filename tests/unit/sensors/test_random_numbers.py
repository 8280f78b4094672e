"""Random numbers of the sensors, and a pulse wheel that starts to turn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.sensors import Sensors
from activesteer.sensors.block import _uniform
from tests.unit.sensors.runs import said_of

TEETH = 48


def test_random_numbers_are_those_of_splitmix64():
    # First outputs for the seed 1234567 of the reference implementation, S. Vigna, splitmix64.c.
    reference = 6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431
    with np.errstate(over="ignore"):
        found = [float(_uniform.py_func(np.uint64(1234567), np.uint64(number))) for number in range(4)]
    assert found == [((output >> 11) + 1) * 2.0**-53 for output in reference]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_pulse_wheel_at_rest_passes_no_edge_until_it_has_turned_by_half_a_tooth(side):
    pitch_rad = 2.0 * math.pi / TEETH

    def said_after(teeth):
        # Within a sample of 10 ms, and then at rest.
        speed_radps = np.concatenate([np.full(10, side * teeth * pitch_rad / 0.010), np.zeros(50)])
        return said_of("wheel_speed", speed_radps, teeth=TEETH, sample_time_s=0.01)

    assert not said_after(0.45).any()
    assert (side * said_after(0.55)).max() > 0.0


def test_inertial_sensors_of_production_are_those_of_their_data_sheet():
    # SMI700: noise 6 mg and 0.1 deg/s, +-5 g and +-300 deg/s, 5000 LSB/g and 100 LSB/(deg/s), 21 Hz.
    sensors = Sensors(preset="production")
    for felt in (sensors.ax, sensors.ay):
        in_g = [value / 9.80665 for value in (felt.amount("noise"), felt.amount("limit"), felt.amount("quantum"))]
        assert in_g == pytest.approx([6e-3, 5.0, 1.0 / 5000.0], rel=1e-3)
        assert felt.bandwidth_Hz == sensors.yaw_rate.bandwidth_Hz == 21.0
    rate = sensors.yaw_rate
    in_degps = [math.degrees(rate.amount(word)) for word in ("noise", "limit", "quantum")]
    assert in_degps == pytest.approx([0.1, 300.0, 1.0 / 100.0])


def test_pulse_wheel_that_turns_back_right_at_an_edge_says_a_finite_speed():
    # Half a tooth forwards ends on an edge; a quarter back passes it again in the same instant.
    per_tooth = 2.0 * math.pi / (0.001 * TEETH)
    forwards = next(
        speed
        for speed in (np.nextafter(0.5 * per_tooth, side) for side in (0.0, 0.5 * per_tooth, math.inf))
        if speed * 0.001 * TEETH / (2.0 * math.pi) == 0.5
    )
    said = said_of("wheel_speed", [forwards, -0.5 * forwards, 0.0, 0.0], teeth=TEETH, sample_time_s=0.001)
    assert np.isfinite(said).all()
    assert np.abs(said).max() <= per_tooth
