"""No claim accepts fakes driven by the car itself: other runs, and controllers with reversed or no action."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from activesteer import ActuatorCommand, simulate
from activesteer.analysis.claims.judge import SCENARIOS, SYSTEMS, Claim
from activesteer.controllers import load_controller
from activesteer.core.metric_table import STEER_RAD
from activesteer.recording import Recording
from tests.fakes import Fake, rejected

Runs = Mapping[str, Mapping[str, Recording]]
IDLE = {
    "controllers.ars.prediction_gain": 0.0,
    "controllers.ars.corrector.proportional_gain_s": 0.0,
    "controllers.afs.corrector.proportional_gain_s": 0.0,
}


NOISE_RADPS, SAMPLE_STEPS = np.radians(0.1), 10
"""Noise of a production yaw rate sensor, rms, and how many steps lie between its samples."""


class TurnedRound:
    """A controller with angles of the opposite sign."""

    def __init__(self, system: str, setup: Any) -> None:
        self._inner = load_controller(system, setup)

    def step(self, command: Any, measurement: Any) -> ActuatorCommand:
        asked = self._inner.step(command, measurement)
        return asked._replace(
            rear_steer_demand_rad=-asked.rear_steer_demand_rad,
            superposition_demand_rad=-asked.superposition_demand_rad,
        )


def turned_round(system: str) -> Any:
    """Return a factory of such a controller."""

    def make(setup: Any) -> TurnedRound:
        return TurnedRound(system, setup)

    return make


class OnNoise:
    """A controller with the paper's gain that acts only on the noise of a production yaw rate sensor."""

    def __init__(self, system: str, setup: Any) -> None:
        self._gain_s = getattr(setup.gains, system).corrector.proportional_gain_s
        self._word = {"ars": "rear_steer_demand_rad", "afs": "superposition_demand_rad"}[system]
        self._rng, self._steps = np.random.default_rng(5), 0
        self._command = ActuatorCommand()

    def step(self, command: Any, measurement: Any) -> ActuatorCommand:
        if self._steps % SAMPLE_STEPS == 0:
            self._command = ActuatorCommand(**{self._word: self._gain_s * self._rng.normal(0.0, NOISE_RADPS)})
        self._steps += 1
        return self._command


def cut(recording: Recording, end_s: float) -> Recording:
    """Return the recorded part of a run that ends too early."""
    return recording.at(np.flatnonzero(recording.time_s < end_s))


def passed(claims: list[Claim], fake: Fake) -> list[Claim]:
    """Return the claims that should have rejected the fake."""
    return [claim for claim in claims if claim.passed and fake in rejected(claim.id)]


REPRODUCED = ("sine_with_dwell", "slalom", "double_lane_change_low_mu")
"""Scenarios of which some claims pass on the real runs: there, a fake that is not rejected passes."""


@pytest.mark.parametrize(
    "scenario", [pytest.param(name, marks=[] if name in REPRODUCED else pytest.mark.slow) for name in SCENARIOS]
)
def test_other_runs_in_place_of_the_systems_prove_nothing(runs: Runs, scenario: str) -> None:
    none, ars, afs = (runs[scenario][system] for system in SYSTEMS)
    check = SCENARIOS[scenario]
    assert passed(check(dict.fromkeys(SYSTEMS, none)), Fake.NONE_AS_BOTH) == []
    assert passed(check({"none": none, "ars": afs, "afs": ars}), Fake.EXCHANGED) == []
    for part in (0.05, 0.5, 0.98):
        ended = {system: cut(run, part * run.time_s[-1]) for system, run in runs[scenario].items()}
        assert passed(check(ended), Fake.CUT_SHORT) == []


@pytest.mark.parametrize(
    "scenario",
    [pytest.param(name, marks=[] if name == "sine_with_dwell" else pytest.mark.slow) for name in SCENARIOS],
)
def test_a_system_turned_round_has_none_of_the_effects(runs: Runs, scenario: str) -> None:
    fakes = {system: simulate(scenario, turned_round(system)) for system in ("ars", "afs")}
    assert passed(SCENARIOS[scenario]({"none": runs[scenario]["none"], **fakes}), Fake.REVERSED) == []


@pytest.mark.parametrize("scenario", ["sine_with_dwell", pytest.param("slalom", marks=pytest.mark.slow)])
def test_who_acts_on_noise_alone_does_not_act(runs: Runs, scenario: str) -> None:
    fakes = {
        system: simulate(scenario, lambda setup, system=system: OnNoise(system, setup)) for system in ("ars", "afs")
    }
    for system, demand in (("ars", "rear_steer_demand_rad"), ("afs", "superposition_demand_rad")):
        assert np.abs(fakes[system][demand]).max() > STEER_RAD  # in an instant
    assert passed(SCENARIOS[scenario]({"none": runs[scenario]["none"], **fakes}), Fake.NOISE) == []


def test_gains_at_zero_are_no_system(runs: Runs) -> None:
    scenario = "sine_with_dwell"
    none = runs[scenario]["none"]
    idle = {system: simulate(scenario, system, overrides=IDLE) for system in SYSTEMS[1:]}
    assert passed(SCENARIOS[scenario]({"none": none, **idle}), Fake.NO_GAIN) == []
    for recording in idle.values():  # which is why what is tried with `none` as both systems need not be tried again
        assert np.abs(recording["yaw_rate_radps"] - none["yaw_rate_radps"]).max() < 1e-6
