"""The linear car against the nonlinear car that it was derived from."""

from __future__ import annotations

import functools
import math
import re

import control
import numpy as np
import pytest

from activesteer.analysis.frequency_response import frequency_response
from activesteer.config import Range
from activesteer.core.signals import ActuatorCommand
from activesteer.errors import ParameterError
from activesteer.scenario import load_car, resolve
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.studies.linear.linearisation import (
    INPUTS,
    OUTPUTS,
    LinearCar,
    eigenvalue_table,
    linear_car,
    linear_response,
)
from tests.physics.runs import assert_has_key_metrics, go_on, last, run
from tests.raising import raises

SPEED_MPS = 80.0 / 3.6
TENTH_G_MPS2 = 0.981


@functools.cache
def car(speed_mps: float = SPEED_MPS) -> LinearCar:
    return linear_car("compact", speed_mps)


@functools.cache
def system() -> control.StateSpace:
    return car().state_space()


@pytest.mark.parametrize("row", range(len(OUTPUTS)), ids=OUTPUTS)
def test_frequency_response_is_that_of_a_sine_sweep_of_the_full_car(row):
    """ISO 7401, 0.2 to 4 Hz, about 0.1 g: within 5 % and 5 deg, with all dry friction."""
    sweep = run("sine_sweep", sweep__length_s=30.0, duration_s=32.0)
    assert_has_key_metrics(sweep)
    assert np.abs(sweep["ay_mps2"]).max() == pytest.approx(TENTH_G_MPS2, rel=0.1)
    found = frequency_response(sweep, OUTPUTS[row], np.geomspace(0.2, 4.0, 40))
    expected = system()(2j * math.pi * found.frequency_Hz)[row, INPUTS.index("steering_wheel_rad")]
    assert np.abs(found.response / expected) == pytest.approx(1.0, abs=0.05)
    assert np.degrees(np.angle(found.response / expected)) == pytest.approx(0.0, abs=5.0)


@pytest.mark.parametrize(("name", "amplitude_rad"), [("rear_steer_rad", 5e-4), ("superposition_rad", 1e-3)])
def test_step_of_an_active_steering_gives_the_response_of_the_full_car(name, amplitude_rad):
    straight = {"kind": "open_loop", "speed_mps": SPEED_MPS, "duration_s": 1.0}
    # So small a superposition winds the column up by little more than the friction of the rack holds.
    vehicle_run = ClosedLoop(resolve(straight, overrides={"vehicle.friction.rack_N": 0.0}))
    command = ActuatorCommand(**{name.replace("_rad", "_demand_rad"): amplitude_rad})
    vehicle_run.controller = type("Constant", (), {"step": lambda *_: command})()  # type: ignore[assignment]
    values = go_on(vehicle_run, 1000)
    names = [channel.name for channel in vehicle_run.vehicle.channels.channels]
    inputs = np.zeros((len(INPUTS), 1000))
    inputs[INPUTS.index(name)] = amplitude_rad
    time_s = np.arange(1000) * 0.001
    response = control.forced_response(system(), time_s, inputs)  # type: ignore[reportArgumentType] - default 0.0
    expected = np.asarray(response.outputs)
    for row, output in enumerate(OUTPUTS):
        # The first 10 ms of the lateral acceleration belong to modes above the cut-off, which answer at once here.
        first = 10 if output == "ay_mps2" else 0
        driven, maximum = values[first:, names.index(output)], np.abs(expected[row]).max()
        assert driven == pytest.approx(expected[row, first:], abs=0.03 * maximum)


def test_step_steer_of_a_tenth_of_g_is_followed():
    # Without the friction of the rack, which the linear car is without: it lets the rack start a little late.
    recording = run("step_steer", steer__steering_wheel_deg=9.0, duration_s=3.0, friction__rack_N=0.0)
    found = linear_response(recording, system())
    for output in OUTPUTS:
        maximum = np.abs(recording[output]).max()
        # The first 10 ms of the lateral acceleration belong to modes above the cut-off, which answer at once here.
        allowed = 0.1 if output == "ay_mps2" else 0.05
        assert found[output] == pytest.approx(recording[output], abs=allowed * maximum)


def test_reduction_leaves_the_frequency_response_as_the_steps_have_it():
    full = car()
    frequencies = np.geomspace(0.1, 5.0, 15)
    for frequency in frequencies:
        z = np.exp(2j * math.pi * frequency * full.timestep_s)
        exact = full.c @ np.linalg.solve(z * np.eye(len(full.states)) - full.a, full.b) + full.d
        # A sine in steps lags half a step behind a smooth one.
        exact = exact * np.exp(1j * math.pi * frequency * full.timestep_s)
        reduced = np.asarray(system()(2j * math.pi * frequency))
        # 2.1 % at 5 Hz from the rear wheels on their steering actuators, at 62 Hz above the cut-off.
        assert (np.abs(reduced - exact) < 0.025 * np.abs(exact)).all()


def test_gain_at_rest_is_kept_exactly():
    full = car()
    exact = full.c @ np.linalg.solve(np.eye(len(full.states)) - full.a, full.b) + full.d
    assert np.asarray(system().dcgain()) == pytest.approx(exact, rel=1e-6)


def test_drive_torque_of_the_trim_is_what_holds_the_speed():
    recording = run("straight_line")
    settled = recording["drive_torque_demand_Nm"][last(recording, 1.0)].mean()
    assert car().drive_torque_Nm == pytest.approx(settled, rel=0.01)


def test_modes_of_the_car_are_named_and_plausible():
    modes = {mode.name: mode for mode in car().modes() if mode.natural_frequency_Hz < 30.0}
    for name, low_Hz, high_Hz in (
        ("bounce", 1.0, 1.8), ("pitch", 1.0, 1.9), ("roll", 1.3, 2.2),
        ("front wheel hop, parallel", 10.0, 16.0), ("front wheel hop, opposite", 10.0, 16.0),
        ("rear wheel hop, parallel", 10.0, 16.0), ("rear wheel hop, opposite", 10.0, 16.0),
    ):  # fmt: skip
        assert low_Hz < modes[name].natural_frequency_Hz < high_Hz, name
        assert 0.1 < modes[name].damping_ratio < 0.6, name
    assert "yaw/sideslip" in modes
    assert sum(mode.name in {"bounce", "pitch", "roll"} for mode in car().modes()) == 3


def test_car_is_stable():
    assert np.real(system().poles()).max() < -0.5
    assert max(mode.eigenvalue_1ps.real for mode in car().modes()) < 0.0


def test_eigenvalue_table_has_a_line_for_every_mode_up_to_its_limit():
    # Long names and words go on in lines without an eigenvalue; every mode of this car decays.
    lines = [line for line in eigenvalue_table(car().modes(), 5.0).splitlines() if re.search(r"  -\d+\.\d\d", line)]
    assert len(lines) == sum(mode.natural_frequency_Hz <= 5.0 for mode in car().modes())
    assert any(line.startswith("roll ") and "+-" in line for line in lines)


def test_state_space_has_names_and_no_heave():
    assert system().input_labels == list(INPUTS)
    assert system().output_labels == list(OUTPUTS)
    assert len(set(system().state_labels)) == system().nstates
    assert not any(label.startswith(("bounce", "pitch", "speed")) for label in system().state_labels)


def test_yaw_gain_is_largest_at_the_characteristic_speed():
    speeds = np.arange(60.0, 116.0, 10.0) / 3.6
    gains = [np.asarray(linear_car("compact", speed).state_space().dcgain())[0, 0] for speed in speeds]
    a, b, _ = np.polyfit(speeds, gains, 2)
    stored = load_car().config.single_track.characteristic_speed_mps
    assert -b / (2 * a) == pytest.approx(stored, rel=0.05)


@pytest.mark.parametrize("speed_mps", [0.0, 2.9, -20.0, 100.1, math.nan, math.inf])
def test_speed_without_a_linear_car_is_an_error(speed_mps):
    with raises(ParameterError, key="speed_mps", allowed=Range(3.0, 100.0)):
        linear_car("compact", speed_mps)
