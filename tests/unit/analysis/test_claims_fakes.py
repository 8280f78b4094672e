"""No claim is taken in by the fakes that its statement names, made from runs of which every claim holds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from activesteer.analysis.claims import SCENARIOS, STATEMENTS, SYSTEMS, Fake
from tests.unit.analysis.good_runs import good, runs_of
from tests.unit.analysis.synthetic import SyntheticRun

Runs = dict[str, SyntheticRun]
ADDED = ("rear_steer", "superposition")
"""What the systems add; each has an angle and its demand."""


def copy_of(run: SyntheticRun, channels: Mapping[str, np.ndarray]) -> SyntheticRun:
    other = SyntheticRun(run.time_s, {**run.channels, **channels})
    other.metadata = run.metadata
    return other


def added(run: SyntheticRun, factor: float) -> dict[str, np.ndarray]:
    names = [f"{name}_{end}" for name in ADDED for end in ("rad", "demand_rad")]
    return {name: factor * run[name] for name in names}


def reversed_run(none: SyntheticRun, run: SyntheticRun) -> SyntheticRun:
    """What a system does to the car, and with which angles, turned round: as much worse as it was better."""
    moved = {
        name: values if len(values) != len(none.time_s) else 2.0 * none[name] - values
        for name, values in run.channels.items()
    }
    return copy_of(run, moved | added(run, -1.0))


def shortened(run: SyntheticRun, end_s: float) -> SyntheticRun:
    rows = run.time_s <= end_s
    other = SyntheticRun(run.time_s[rows], {name: values[rows] for name, values in run.channels.items()})
    other.metadata = run.metadata
    return other


def fakes_of(fake: Fake, runs: Runs) -> list[Runs]:
    none, ars, afs = (runs[system] for system in SYSTEMS)
    unmoved = {"none": none, "ars": copy_of(none, added(ars, 1.0)), "afs": copy_of(none, added(afs, 1.0))}
    turned_round = {"none": none, "ars": reversed_run(none, ars), "afs": reversed_run(none, afs)}
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
        Fake.CUT_SHORT: [
            *({system: shortened(run, end_s) for system, run in runs.items()} for end_s in ends_s),
            *(runs | {system: shortened(run, 3.0)} for system, run in runs.items()),
        ],
    }[fake]  # fmt: skip


@pytest.fixture(scope="module", params=SCENARIOS)
def scenario(request: pytest.FixtureRequest) -> tuple[str, Runs]:
    return request.param, runs_of(request.param, good(request.param))


@pytest.mark.parametrize("fake", Fake)
def test_a_claim_rejects_the_fakes_that_its_statement_names(scenario, fake):
    name, runs = scenario
    for faked in fakes_of(fake, runs):
        for claim in SCENARIOS[name](faked):
            assert not (claim.passed and fake in claim.statement.rejects), (fake, claim)


def test_every_statement_names_what_proves_nothing_and_a_turned_sign_unless_it_is_about_likeness():
    for number, statement in STATEMENTS.items():
        assert {Fake.NONE_AS_BOTH, Fake.EXCHANGED, Fake.NO_GAIN, Fake.CUT_SHORT} <= statement.rejects
        assert statement.rejects & {Fake.REVERSED, Fake.ONE_REVERSED} or number == "L1"


def test_what_stands_against_a_claim_is_said(scenario):
    name, runs = scenario
    for claim in SCENARIOS[name](runs):
        assert claim.obstacle == ""
    for claim in SCENARIOS[name](runs | {"ars": runs["afs"]}):
        assert claim.obstacle == "the run ars never asks for 0.05 deg of rear steer"
    for claim in SCENARIOS[name](runs | {"afs": shortened(runs["afs"], 3.0)}):
        assert claim.obstacle == "the run afs ends too early"
    failed = {**runs, "none": copy_of(runs["none"], {})}
    failed["none"].metadata = {**runs["none"].metadata, "complete": False}
    for claim in SCENARIOS[name](failed):
        assert claim.obstacle == "the run none ends too early"
        assert not claim.passed
