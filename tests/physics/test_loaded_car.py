"""Assumptions of controllers and driver about a loaded car: from the file, or from driving."""

from __future__ import annotations

import pytest

from activesteer.errors import ParameterError
from activesteer.scenario import describe, resolve
from activesteer.simulation.preparation import with_amplitude_found
from tests.raising import raises

LOAD = {"load.payload_kg": 300.0}


def test_belief_is_kept_unless_asked_otherwise() -> None:
    known = with_amplitude_found(resolve("straight_line", overrides=LOAD)).car.config.single_track
    assert known == resolve("straight_line").car.config.single_track
    assert known.source == "file"


def test_belief_is_identified_where_asked_for_and_said_so() -> None:
    asked, in_full = (
        resolve("straight_line", overrides={**LOAD, key: "identify"}) for key in ("single_track", "single_track.source")
    )
    assert asked.car.config.single_track == in_full.car.config.single_track
    scenario = with_amplitude_found(asked)
    known, before = scenario.car.config.single_track, resolve("straight_line").car.config.single_track
    assert known.mass_kg == pytest.approx(1730.0, abs=1.0)
    # 300 kg above the rear axle take the centre of gravity back by 300 (l - l_V) / 1730.
    assert known.cg_to_front_m - before.cg_to_front_m == pytest.approx(300.0 * 1.5554 / 1730.0, abs=0.02)
    assert describe(scenario)["vehicle"]["single_track"]["source"] == "identified"


def test_unknown_source_is_refused() -> None:
    with raises(ParameterError, file="compact.toml", key="single_track.source", value="guess"):
        resolve("straight_line", overrides={"single_track.source": "guess"})
