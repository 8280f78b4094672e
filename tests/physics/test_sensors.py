"""A car with sensors: their recorded signals, and quantities that they leave unchanged."""

from __future__ import annotations

import math

import numpy as np
import pytest

import activesteer
from activesteer.core.conventions import CORNERS
from activesteer.errors import ParameterError
from activesteer.recording import Recording
from activesteer.scenario import resolve
from activesteer.simulation.closed_loop import ClosedLoop
from tests.physics.runs import STEP_DEG, assert_goes_on_from_its_state, step_steer
from tests.raising import raises

PRODUCTION = {"steer.steering_wheel_deg": STEP_DEG, "sensors.preset": "production", "duration_s": 2.5}
NOT_RANDOM = {
    f"sensors.{sensor}.{word}_{unit}": 0.0
    for sensor, unit in (
        ("yaw_rate", "radps"), ("ax", "mps2"), ("ay", "mps2"), ("steering_wheel", "rad"), ("rear_steer", "rad"),
        ("superposition", "rad"), ("wheel_speed", "radps"), ("brake_pressure", "Pa"),
    )
    for word in ("noise", "bias", "drift")
}  # fmt: skip


def _error(recording: Recording, channel: str) -> np.ndarray:
    return recording[f"measured_{channel}"] - recording[channel]


@pytest.fixture(scope="module")
def production() -> Recording:
    return activesteer.simulate("step_steer", "ars", overrides=PRODUCTION)


def test_ideal_sensors_are_no_sensors_at_all() -> None:
    explicit = activesteer.simulate(
        "step_steer", "ars", overrides={"steer.steering_wheel_deg": STEP_DEG, "sensors.preset": "ideal"}
    )
    assert [channel.name for channel in explicit.channels] == [channel.name for channel in step_steer("ars").channels]
    np.testing.assert_array_equal(explicit.values, step_steer("ars").values)


@pytest.mark.parametrize("vehicle", ["compact", pytest.param("sedan", marks=pytest.mark.slow)])
def test_recorded_noise_is_that_of_the_settings(vehicle: str) -> None:
    recording = activesteer.simulate("straight_line", "none", vehicle, overrides={"sensors.preset": "production"})
    sensors = recording.metadata["vehicle"]["sensors"]
    for channel, table, word in (
        ("yaw_rate_radps", "yaw_rate", "radps"), ("ay_mps2", "ay", "mps2"), ("ax_mps2", "ax", "mps2"),
        ("rear_steer_rad", "rear_steer", "rad"),
    ):  # fmt: skip
        asked = sensors[table]
        every = round(asked["sample_time_s"] / recording.metadata["timestep_s"])
        noise = recording[f"measured_{channel}"][::every]
        quantum = asked[f"quantum_{word}"]
        # Rounding to steps adds a uniform error of q / sqrt(12). The truth stands still; 1000 samples know rms to 2 %.
        expected = math.hypot(asked[f"noise_{word}"], quantum / math.sqrt(12.0))
        assert noise.std() == pytest.approx(expected, rel=0.09)
        assert np.abs(noise / quantum - np.rint(noise / quantum)).max() < 0.01
    speed = recording["measured_speed_mps"]
    assert speed.mean() == pytest.approx(recording["vx_mps"].mean(), rel=0.01)


def test_sensors_lag_by_bandwidth_samples_and_delay(production: Recording) -> None:
    """Delays: 8 ms of a 21 Hz low-pass, 5 ms of delay, 4.5 ms by the sampling of 10 ms."""
    truth, said = production["yaw_rate_radps"], production["measured_yaw_rate_radps"]
    turning = slice(500, 1500)
    misfit = [np.std(said[turning] - np.roll(truth, lag)[turning]) for lag in range(40)]
    assert int(np.argmin(misfit)) == pytest.approx(18, abs=3)


def test_speed_from_wheels_is_the_car_s(production: Recording) -> None:
    assert np.abs(_error(production, "speed_mps")).max() < 0.01 * 22.2
    assert np.abs(_error(production, "speed_mps")).max() > 0.001


def test_a_seed_decides_everything(production: Recording) -> None:
    again = activesteer.simulate("step_steer", "ars", overrides=PRODUCTION)
    np.testing.assert_array_equal(again.values, production.values)
    other = activesteer.simulate("step_steer", "ars", overrides=PRODUCTION | {"sensors.seed": 1})
    assert not np.array_equal(other["measured_yaw_rate_radps"], production["measured_yaw_rate_radps"])
    assert not np.array_equal(other["rear_steer_rad"], production["rear_steer_rad"])
    assert production.metadata["vehicle"]["sensors"]["seed"] == 0


def test_a_restored_state_continues_bit_identically() -> None:
    simulation = ClosedLoop(resolve("step_steer", overrides=PRODUCTION), "afs")
    simulation.advance(903)
    assert_goes_on_from_its_state(simulation, 300)


def test_sensors_without_chance_treat_left_and_right_alike() -> None:
    left, right = (
        activesteer.simulate(
            "step_steer", "afs", overrides=PRODUCTION | NOT_RANDOM | {"steer.steering_wheel_deg": side * STEP_DEG}
        )
        for side in (1.0, -1.0)
    )
    for channel in ("yaw_rate_radps", "superposition_rad", "measured_yaw_rate_radps", "measured_ay_mps2"):
        assert np.abs(left[channel]).max() > 0.0
        np.testing.assert_allclose(left[channel], -right[channel], atol=1e-9 * np.abs(left[channel]).max())
    for left_wheel, right_wheel in (("fl", "fr"), ("rl", "rr")):
        there, here = (
            left[f"measured_{left_wheel}_wheel_speed_radps"],
            right[f"measured_{right_wheel}_wheel_speed_radps"],
        )
        np.testing.assert_allclose(there, here, rtol=1e-9)


def test_what_a_faulty_sensor_says_is_recorded_and_the_truth_stays() -> None:
    fault = {"part": "yaw_rate_sensor", "kind": "stuck", "start_s": 0.8}
    recording = activesteer.simulate("step_steer", "none", overrides=PRODUCTION | {"fault": [fault]})
    assert np.ptp(recording["measured_yaw_rate_radps"][802:]) == 0.0
    assert np.ptp(recording["yaw_rate_radps"][802:]) > 0.01
    assert np.ptp(recording["measured_ay_mps2"][802:]) > 0.01


def test_there_is_no_seed_without_chance() -> None:
    with raises(ParameterError, key="sensors.seed", value=7):
        resolve("step_steer", overrides=PRODUCTION | NOT_RANDOM | {"sensors.seed": 7})


def test_a_car_that_brakes_to_a_stop_and_stands_has_wheels_that_stand() -> None:
    recording = activesteer.simulate(
        "drive_off_and_stop", overrides={"sensors.preset": "production", "sensors.wheel_speed.noise_radps": 0.0}
    )
    for corner in CORNERS:
        assert recording[f"measured_{corner}_wheel_speed_radps"][-1] == pytest.approx(0.0, abs=0.2)
        error = _error(recording, f"{corner}_wheel_speed_radps")
        assert np.abs(error).max() < 0.15 * np.abs(recording[f"{corner}_wheel_speed_radps"]).max()


def test_brake_pressures_are_measured() -> None:
    overrides = {"sensors.preset": "production", "sensors.seed": 2}
    recording = activesteer.simulate("brake_in_turn", overrides=overrides)
    for corner in CORNERS:
        error = _error(recording, f"{corner}_brake_pressure_Pa")
        assert recording[f"{corner}_brake_pressure_Pa"].max() > 1e6
        # Before braking begins, noise about the bias of the run, 0.5 % of the range.
        assert 0.0 < error[:300].std() < 4e4
        assert np.abs(error[:300]).max() < 5e5
        rising = np.abs(error).max()
        assert rising < 0.5 * recording[f"{corner}_brake_pressure_Pa"].max()
