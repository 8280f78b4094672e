"""Margins of loops that are known by hand, and of the parts of a loop."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from activesteer.commands.cli import main
from activesteer.controllers import load_controller
from activesteer.controllers.linear_form import SIGNALS, linear_controller, pulse_responses
from activesteer.core.signals import ActuatorCommand
from activesteer.errors import ControllerError, ParameterError, StudyError
from activesteer.pages import render_page
from activesteer.scenario import resolve
from activesteer.simulation.runner import simulate
from activesteer.studies.linear.linearisation import ACTUATORS, INPUTS, OUTPUTS, LinearCar
from activesteer.studies.linear.margins import (
    BOTH,
    FREQUENCIES_RADPS,
    LoopMargins,
    disk,
    is_stable,
    loop_margins,
    margins_of,
    margins_page,
    opened,
    opened_at_both,
    round_trip,
    weakest,
    worst_margins,
)
from tests.raising import raises
from tests.unit.controllers.cars import measured, setup

STEP_S, GAIN_1PS = 1e-3, 8.0
PRESETS = (pytest.param("ideal", marks=pytest.mark.slow), "production")


def integrator(delay_s: float = 0.0):
    return GAIN_1PS * np.exp(-1j * FREQUENCIES_RADPS * delay_s) / (1j * FREQUENCIES_RADPS)


def test_margins_of_an_integrator_with_a_delay_are_those_worked_out_by_hand():
    delay_s = 0.05
    margins = margins_of(integrator(delay_s), FREQUENCIES_RADPS)
    assert margins.phase_rad == pytest.approx(math.pi / 2.0 - GAIN_1PS * delay_s, abs=1e-3)
    assert margins.delay_s == pytest.approx(math.pi / 2.0 / GAIN_1PS - delay_s, abs=1e-3)
    assert margins.gain_dB == pytest.approx(20.0 * math.log10(math.pi / 2.0 / (GAIN_1PS * delay_s)), abs=0.01)
    # It cannot be better than what the margins of gain and phase, each by itself, leave.
    assert 0.5 < margins.disk < 2.0 * math.tan(margins.phase_rad / 2.0)


def test_integrator_alone_has_the_largest_disk_and_no_gain_margin():
    margins = margins_of(integrator(), FREQUENCIES_RADPS)
    assert margins.disk == pytest.approx(2.0, rel=1e-6)
    assert math.isnan(margins.gain_dB)


def test_unstable_loop_has_no_margins():
    margins = margins_of(integrator(), FREQUENCIES_RADPS, stable=False)
    assert margins.disk == 0.0
    assert math.isnan(margins.delay_s)


def turning_car() -> LinearCar:
    """Return a car whose yaw rate is the negative integral of the rear angle: x[k+1] = x[k] - h g u[k]."""
    b = np.zeros((1, len(INPUTS)))
    b[0, 1] = -STEP_S * GAIN_1PS
    c = np.zeros((len(OUTPUTS), 1))
    c[OUTPUTS.index("yaw_rate_radps"), 0] = 1.0
    still = np.zeros((len(ACTUATORS), 1))
    return LinearCar(20.0, STEP_S, 0.0, ("d_yaw",), np.eye(1), b, c, np.zeros((len(OUTPUTS), len(INPUTS))), still)


def loop_with_bus_delay(delay_s: float):
    def answer(frequencies_radps):
        found = np.zeros((len(frequencies_radps), 2, len(SIGNALS)), complex)
        found[:, 0, 0] = 1.0  # the rear wheels turn as the car does
        return found

    scenario = resolve("straight_line", overrides={"controllers.bus_delay_s": delay_s} if delay_s else None)
    return round_trip(turning_car(), answer, scenario, STEP_S, FREQUENCIES_RADPS)


def largest_root(steps: int) -> float:
    """Return the size of the largest root of z^(n+1) - z^n + h g = 0, the loop with a delay of n steps."""
    polynomial = np.zeros(steps + 2)
    polynomial[0], polynomial[1], polynomial[-1] = 1.0, -1.0, polynomial[-1] + STEP_S * GAIN_1PS
    return float(np.abs(np.roots(polynomial)).max())


def test_delay_as_long_as_the_delay_margin_makes_the_loop_marginal():
    margin_s = margins_of(opened(loop_with_bus_delay(0.0), "rear"), FREQUENCIES_RADPS).delay_s
    steps = margin_s / STEP_S
    assert steps == pytest.approx(math.pi / 2.0 / GAIN_1PS / STEP_S, rel=0.01)
    assert largest_root(math.floor(steps) - 1) < 1.0 < largest_root(math.ceil(steps) + 1)


def test_a_delay_of_both_demands_meets_two_loops_that_do_not_know_of_each_other_one_by_one():
    quick, slow = integrator(), 0.5 * integrator()
    returned = np.zeros((len(FREQUENCIES_RADPS), 2, 2), complex)
    returned[:, 0, 0], returned[:, 1, 1] = -quick, -slow
    delays_s = sorted(margins_of(loop, FREQUENCIES_RADPS).delay_s for loop in opened_at_both(returned))
    assert delays_s == pytest.approx([math.pi / 2.0 / GAIN_1PS, math.pi / GAIN_1PS], rel=0.01)


@pytest.mark.parametrize("preset", PRESETS)
def test_the_bus_may_delay_both_demands_by_less_than_their_margin_in_a_run_and_no_more(preset):
    """`lqr` at 100 km/h after 1 deg of steering wheel: the margin agrees with the behaviour of the full car."""
    sensors = {"sensors.preset": preset}
    both = next(m for m in loop_margins(["lqr"], speeds_kmh=[100.0], overrides=sensors) if m.loop == BOTH)
    steering = {"time_s": [0.0, 0.5, 0.6, 0.8, 0.9], "steering_wheel_deg": [0.0, 0.0, 1.0, 1.0, 0.0]}
    kick = {"kind": "open_loop", "speed_kmh": 100, "duration_s": 4.0, "hold_last": True, "steering": steering}
    swings_rad = []
    for delay_ms in (math.floor(1e3 * both.margins.delay_s) - 1, math.ceil(1e3 * both.margins.delay_s) + 4):
        run = simulate(kick, controller="lqr", overrides={**sensors, "controllers.bus_delay_s": 1e-3 * delay_ms})
        swings_rad.append(float(np.ptp(run["rear_steer_demand_rad"][run.time_s > 3.0])))
    assert swings_rad[0] < math.radians(0.7) < swings_rad[1]


@pytest.mark.parametrize("preset", PRESETS)
def test_every_loop_of_the_state_feedback_has_the_margin_that_it_was_designed_for(preset):
    found = loop_margins(["lqr"], speeds_kmh=[60.0, 160.0], overrides={"sensors.preset": preset})
    assert len(found) == 2 * 3
    assert min(loop.margins.disk for loop in found) >= 0.5


@pytest.mark.parametrize("delay_s", [0.02, 0.09])
def test_delay_of_the_bus_is_taken_off_the_delay_margin(delay_s):
    whole, rest = (margins_of(opened(loop_with_bus_delay(d), "rear"), FREQUENCIES_RADPS) for d in (0.0, delay_s))
    assert whole.delay_s - rest.delay_s == pytest.approx(delay_s, abs=1e-4)


def test_loop_that_turns_round_the_critical_point_is_known_as_unstable():
    returned = loop_with_bus_delay(0.05)
    assert is_stable(returned)
    # Twice the gain margin and more.
    factor = 10.0 ** (margins_of(opened(returned, "rear"), FREQUENCIES_RADPS).gain_dB / 20.0)
    assert is_stable(0.9 * factor * returned)
    assert not is_stable(1.1 * factor * returned)


@pytest.mark.parametrize("name", ["ars", "afs"])
def test_answer_to_pulses_is_that_of_the_linear_form(name):
    bands = {f"controllers.{name}.corrector.{end}_degps": 0.0 for end in ("deadband_start", "deadband_end")}
    known = resolve("straight_line", overrides=bands).controller_setup(STEP_S)
    pulses = pulse_responses(load_controller(name, known), measured(0.0, 25.0), STEP_S)
    form = linear_controller(name, known, 25.0)
    assert pulses[0, :, 0] == pytest.approx(form.d[:, 1], abs=1e-9)
    state = form.b[:, 1]
    for call in range(1, 50):
        assert pulses[call, :, 0] == pytest.approx(form.c @ state, abs=1e-9)
        state = form.a @ state
    assert not pulses[:, :, 1:].any()


class TakesEverySecond:
    """Like an estimator that uses each sample of a slow sensor once."""

    calls, angle_rad = 0, 0.0

    def step(self, _, measurement):
        if self.calls % 2 == 1:
            self.angle_rad += 0.1 * (measurement.yaw_rate_radps - self.angle_rad)
        self.calls += 1
        return ActuatorCommand(self.angle_rad)


def test_controller_that_takes_each_sample_once_answers_to_the_whole_sample():
    made = load_controller(TakesEverySecond, setup())
    pulses = pulse_responses(made, measured(0.0), 0.005, "mine", {"yaw_rate_radps": (2, 0)})
    # A yaw rate that lasts is one sample behind the other, each seen for two calls.
    assert pulses[:, 0, 0].sum() / 2.0 == pytest.approx(1.0, rel=1e-6)
    assert not pulses[:, :, 1:].any()


class Root:
    def step(self, _, measurement):
        return ActuatorCommand(0.01 * math.sqrt(abs(measurement.yaw_rate_radps)))


class Integrator:
    angle_rad = 0.0

    def step(self, _, measurement):
        self.angle_rad += 0.001 * measurement.yaw_rate_radps
        return ActuatorCommand(self.angle_rad)


@pytest.mark.parametrize(("controller", "signal"), [(Root, "yaw_rate_radps"), (Integrator, "yaw_rate_radps")])
def test_controller_without_a_linear_form_is_answered(controller, signal):
    with raises(ControllerError, key="mine", value=signal):
        pulse_responses(load_controller(controller, setup()), measured(0.0), 0.01, "mine")


def test_command_prints_the_margins_of_every_loop(capsys):
    found = {}
    for sensors in ("ideal", "production"):
        arguments = ["-c", "ars", "-c", "afs", "--speed-kmh", "100", "--set", f"sensors.preset={sensors}", "--json"]
        assert main(["linearise", "--loop", "controller", *arguments]) == 0
        found[sensors] = json.loads(capsys.readouterr().out)
    keys = {
        "controller", "loop", "speed_kmh", "gain_margin_dB", "phase_margin_deg", "delay_margin_s", "disk_margin",
    }  # fmt: skip
    for ideal, production in zip(found["ideal"], found["production"], strict=True):
        assert set(ideal) == keys
        # Bandwidth 8 ms, delay 5 ms, samples 4.5 ms; the bandwidth also takes gain, and with it some of the lag.
        assert 0.010 < ideal["delay_margin_s"] - production["delay_margin_s"] < 0.0175
        assert production["disk_margin"] < ideal["disk_margin"]
    assert [(row["controller"], row["loop"]) for row in found["ideal"]] == [("ars", "rear"), ("afs", "superposition")]


SPREAD = {
    "maneuvers": ["step_steer"],
    "factors": {
        "speed_kmh": {"grid": [80.0, 120.0], "maneuvers": ["step_steer"]},
        "factors.servo_lag": {"grid": [0.5, 2.0]},
    },
}


@pytest.mark.slow
def test_worst_margins_are_those_of_single_cars_that_the_controller_does_not_know():
    cars = [{"factors.servo_lag": 0.5}, {"factors.servo_lag": 2.0}]
    other = {"factors.mass": 1.1, "factors.rear_cornering_stiffness": 0.9, "load.cg_forward_change_m": 0.1}
    known = {resolve("step_steer", overrides=car).controller_setup(0.001) for car in ({}, other, *cars)}
    assert len(known) == 1
    seen = []
    found = worst_margins(SPREAD, ["ars"], speeds_kmh=[100.0], progress=seen.append, jobs=2)[0]
    assert [(now.done, now.total) for now in seen] == [(1, 2), (2, 2)]
    quick, nominal, slow = (
        loop_margins(["ars"], speeds_kmh=[100.0], overrides=car)[0].margins for car in (cars[0], {}, cars[1])
    )
    # Another process sums in another order.
    assert vars(found.margins) == pytest.approx(vars(weakest([quick, slow])), rel=1e-9)
    # A servo that is slower than the controller knows takes phase, one that is quicker gives some.
    assert slow.phase_rad < nominal.phase_rad < quick.phase_rad
    assert found.factors == cars[1]


def test_command_and_page_tell_an_unlimited_margin_from_an_unstable_loop(tmp_path, capsys):
    code = "class Damper:\n    def __init__(self, gain_s=0.02):\n        self.gain_s = gain_s\n\n"
    code += "    def step(self, command, measurement):\n"
    code += "        return ActuatorCommand(rear_steer_demand_rad=self.gain_s * measurement.yaw_rate_radps)\n"
    file = tmp_path / "damper.py"
    file.write_text(f"from activesteer import ActuatorCommand\n\n\n{code}")
    for gain_s, word, other in ((0.02, "no limit", "unstable"), (3.0, "unstable", "no limit")):
        arguments = ["-c", f"{file}:Damper?gain_s={gain_s}", "--speed-kmh", "80", "-o", str(tmp_path)]
        assert main(["linearise", "--loop", "controller", *arguments]) == 0
        table = capsys.readouterr().out.partition("page: ")[0]
        assert word in table
        assert other not in table
        assert "nan" not in table
        assert word in (tmp_path / "margins.html").read_text()


def test_a_loop_that_is_unstable_in_one_car_has_no_margins():
    unstable = margins_of(integrator(), FREQUENCIES_RADPS, stable=False)
    assert weakest([margins_of(integrator(0.05), FREQUENCIES_RADPS), unstable]) is unstable


def test_processes_are_for_the_cars_of_a_study(capsys):
    assert main(["linearise", "--loop", "controller", "--jobs", "2"]) == 1
    assert "--jobs: has an effect with --study only" in capsys.readouterr().err


def test_what_a_study_varies_and_the_speed_are_given_in_one_place():
    with raises(StudyError, key="factors.factors.servo_lag"):
        worst_margins(SPREAD, ["ars"], speeds_kmh=[100.0], overrides={"factors.servo_lag": 1.1})
    with raises(ParameterError, key="speed_kmh"):
        loop_margins(["ars"], speeds_kmh=[100.0], overrides={"speed_kmh": 80.0})


def test_a_loop_that_some_cars_of_a_study_lack_has_the_margins_of_the_others():
    key = "controllers.ars.corrector.proportional_gain_s"
    study = {"maneuvers": ["step_steer"], "controllers": ["ars"], "factors": {key: {"grid": [0.0, 0.25, 0.5]}}}
    (worst,) = worst_margins(study, ["ars"], speeds_kmh=[100.0], jobs=1)
    (alone,) = loop_margins(["ars"], speeds_kmh=[100.0], overrides={key: 0.5})
    assert (worst.controller, worst.loop, worst.factors) == ("ars", "rear", {key: 0.5})
    assert worst.margins.disk == alone.margins.disk


def test_command_names_the_text_of_the_car_with_the_smallest_margin(tmp_path, capsys):
    study = tmp_path / "sensors.toml"
    factors = '[factors]\n"sensors.preset" = { grid = ["ideal", "production"] }\n'
    study.write_text(f'maneuvers = ["step_steer"]\n{factors}', encoding="utf-8")
    arguments = ["--study", str(study), "-c", "ars", "--speed-kmh", "100", "--jobs", "1"]
    assert main(["linearise", "--loop", "controller", *arguments]) == 0
    assert "sensors.preset = production" in capsys.readouterr().out


def test_the_disk_of_a_loop_touches_its_curve():
    loop = integrator(0.05)
    centre, radius = disk(margins_of(loop, FREQUENCIES_RADPS).disk)
    assert np.abs(loop - centre).min() == pytest.approx(radius, rel=1e-9)
    # The gains at which a factor of this size makes the loop marginal are the ends of the disk.
    assert centre - radius < -1.0 < centre + radius < 0.0
    assert (centre - radius) * (centre + radius) == pytest.approx(1.0)


def test_page_of_margins_shows_each_loop_with_its_disk():
    pytest.importorskip("matplotlib")
    loop = integrator(0.05)
    margins = margins_of(loop, FREQUENCIES_RADPS)
    found = [LoopMargins("<b>", "rear", speed, margins, curves=(loop,)) for speed in (60.0, 80.0)]
    many = [LoopMargins("lqr", "rear", 60.0, margins, {"car.mass_kg": 1500.0})]
    text = render_page(margins_page([*found, *many], "compact"))
    assert text.count('<div class="plots"') == 1
    assert "&lt;b&gt;, opened at rear" in text
    assert f"disk margin {margins.disk:.2f}" in text
    assert f'The smallest disk margin is <b class="passed">\N{CHECK MARK} {margins.disk:.2f}</b>' in text
    assert "car.mass_kg = 1500.0" in text
