"""No claim accepts the fakes in its statement, made from runs for which all claims hold."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from activesteer.analysis.claims.judge import SCENARIOS, SYSTEMS, largest_action
from activesteer.core.metric_table import STEER_RAD
from tests.fakes import Fake, rejected
from tests.unit.analysis.good_runs import good, runs_of
from tests.unit.analysis.synthetic import SyntheticRun

Runs = dict[str, SyntheticRun]
ADDED = ("rear_steer", "superposition")
"""What the systems add; each has an angle and its demand."""
DEMAND = "superposition_demand_rad"
NOISE_RAD = np.radians(0.1) * 0.42
"""What the larger gain of the paper makes of the noise of a production yaw rate sensor, rms."""
HELD = 10
"""Rows for which a sample of that sensor is held."""


def copy_of(run: SyntheticRun, channels: Mapping[str, np.ndarray]) -> SyntheticRun:
    other = SyntheticRun(run.time_s, {**run.channels, **channels})
    other.metadata = run.metadata
    return other


def added(run: SyntheticRun, factor: float) -> dict[str, np.ndarray]:
    names = [f"{name}_{end}" for name in ADDED for end in ("rad", "demand_rad")]
    return {name: factor * run[name] for name in names}


def reversed_run(none: SyntheticRun, run: SyntheticRun) -> SyntheticRun:
    """Return the effect of a system on the car reversed, with its angles: as much worse as it was better."""
    moved = {
        name: values if len(values) != len(none.time_s) else 2.0 * none[name] - values
        for name, values in run.channels.items()
    }
    return copy_of(run, moved | added(run, -1.0))


def noise(run: SyntheticRun, *, beyond_the_band: bool) -> np.ndarray:
    """Return a demand of pure noise: permanent, or one-sided in the manoeuvre, which brings the error to the band."""
    rows = len(run.time_s)
    samples = np.random.default_rng(3).normal(0.0, NOISE_RAD, rows // HELD + 1)
    values = np.repeat(np.maximum(samples, 0.0) if beyond_the_band else samples, HELD)[:rows]
    return values * (np.abs(run["yaw_rate_radps"]) > 0.05) if beyond_the_band else values


def on_noise(run: SyntheticRun, name: str, *, beyond_the_band: bool) -> SyntheticRun:
    """Return the run with a noise demand."""
    return copy_of(run, {f"{name}_demand_rad": noise(run, beyond_the_band=beyond_the_band)})


def shortened(run: SyntheticRun, end_s: float) -> SyntheticRun:
    rows = run.time_s <= end_s
    other = SyntheticRun(run.time_s[rows], {name: values[rows] for name, values in run.channels.items()})
    other.metadata = run.metadata
    return other


def fakes_of(fake: Fake, runs: Runs) -> list[Runs]:
    none, ars, afs = (runs[system] for system in SYSTEMS)
    unmoved = {"none": none, "ars": copy_of(none, added(ars, 1.0)), "afs": copy_of(none, added(afs, 1.0))}
    turned_round = {"none": none, "ars": reversed_run(none, ars), "afs": reversed_run(none, afs)}
    noisy = [
        {"none": none, "ars": on_noise(moved[0], ADDED[0], **band), "afs": on_noise(moved[1], ADDED[1], **band)}
        for band in ({"beyond_the_band": False}, {"beyond_the_band": True})
        for moved in ((none, none), (ars, afs))
    ]
    ends_s = (0.0, 0.2, 1.0, 3.0, 4.0, none.time_s[-1] - 0.1)
    return {
        Fake.NONE_AS_BOTH: [dict.fromkeys(SYSTEMS, none)],
        Fake.NO_EFFECT: [unmoved],
        Fake.EXCHANGED: [{"none": none, "ars": afs, "afs": ars}],
        Fake.REVERSED: [turned_round],
        Fake.ONE_REVERSED: [
            runs | {"ars": copy_of(ars, added(ars, -1.0))}, runs | {"afs": copy_of(afs, added(afs, -1.0))},
        ],
        Fake.NO_GAIN: [{"none": none, "ars": copy_of(ars, added(ars, 0.0)), "afs": copy_of(afs, added(afs, 0.0))}],
        Fake.NOISE: noisy,
        Fake.CUT_SHORT: [
            *({system: shortened(run, end_s) for system, run in runs.items()} for end_s in ends_s),
            *(runs | {system: shortened(run, 3.0)} for system, run in runs.items()),
        ],
    }[fake]  # fmt: skip


@pytest.fixture(scope="module", params=SCENARIOS)
def scenario(request: pytest.FixtureRequest) -> tuple[str, Runs]:
    return request.param, runs_of(request.param, good(request.param))


@pytest.mark.parametrize("fake", Fake)
def test_a_claim_rejects_its_fakes(scenario, fake):
    name, runs = scenario
    for faked in fakes_of(fake, runs):
        for claim in SCENARIOS[name](faked):
            assert not (claim.passed and fake in rejected(claim.id)), (fake, claim)


def test_a_mean_of_a_fifth_of_a_second_tells_an_action_from_noise(scenario):
    name, runs = scenario
    for beyond_the_band in (False, True):
        demand = noise(runs["afs"], beyond_the_band=beyond_the_band)
        assert np.abs(demand).max() > 2.0 * STEER_RAD  # an instant of it is as large as an action
        assert largest_action(copy_of(runs["afs"], {DEMAND: demand}), DEMAND) < STEER_RAD
        both = copy_of(runs["afs"], {DEMAND: runs["afs"][DEMAND] + demand})
        assert all(claim.passed for claim in SCENARIOS[name](runs | {"afs": both}))


def test_what_stands_against_a_claim_is_said(scenario):
    name, runs = scenario
    for claim in SCENARIOS[name](runs):
        assert claim.obstacle == ""
    for claim in SCENARIOS[name](runs | {"ars": runs["afs"]}):
        assert claim.obstacle == (
            "the run ars never demands 0.05 deg of rear steer more than straight ahead, as a mean over 0.2 s"
        )
    for claim in SCENARIOS[name](runs | {"afs": shortened(runs["afs"], 3.0)}):
        assert claim.obstacle == "the run afs ends too early"
    failed = {**runs, "none": copy_of(runs["none"], {})}
    failed["none"].metadata = {**runs["none"].metadata, "complete": False}
    for claim in SCENARIOS[name](failed):
        assert claim.obstacle == "the run none ends too early"
        assert not claim.passed
