"""The population: complete with two samples, and the counts of more samples."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, cast

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from activesteer.analysis.claims.judge import Claim
from activesteer.core.metric_table import CONES_MISSED
from activesteer.errors import StudyError
from activesteer.studies.engine.study import study
from activesteer.studies.engine.study_file import StudyFile, read_study
from tests.raising import raises
from tools import population_store
from tools.population_results import NO_FACTOR, ClaimProportion, Population, population_study, summarise
from tools.proportions import Proportion, ProportionVerdict

RESULTS = "results.parquet"


class Nominal:
    """A claim with the parts that `summarise` reads."""

    def __init__(self, number: str, passed: bool) -> None:
        self.id, self.passed = number, passed


def nominal(**passed: bool) -> list[Claim]:
    return cast(list[Claim], [Nominal(*item) for item in passed.items()])


def shortened(samples: int) -> StudyFile:
    """Return the population with its fastest scenario, a given angle, and two factors, whose effects are soon found."""
    table = population_study(samples).to_table()
    table["maneuvers"] = ["step_steer"]
    table["overrides"] = {"steer.steering_wheel_deg": 36.5}
    table["factors"] = {key: table["factors"][key] for key in ("factors.mass", "sensors.preset")}
    return read_study(table)


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("population") / "serial"
    study(shortened(2), output=folder, jobs=1)
    return folder


@pytest.mark.slow
def test_processes_and_interruptions_change_no_bit(serial: Path, tmp_path: Path) -> None:
    study(shortened(2), output=tmp_path, jobs=1, limit=3)
    study(shortened(2), output=tmp_path, jobs=2)
    assert (tmp_path / RESULTS).read_bytes() == (serial / RESULTS).read_bytes()


@pytest.mark.slow
def test_all_three_systems_meet_the_same_samples(serial: Path) -> None:
    rows = pq.read_table(serial / RESULTS).to_pylist()
    keys = shortened(2).keys
    assert {row["status"] for row in rows} == {"ok"}
    by_sample: dict[int, list[dict[str, Any]]] = {}
    for row in rows:
        by_sample.setdefault(row["sample"], []).append({key: row[key] for key in keys})
    assert len(by_sample) == 2
    assert all(len(cars) == 3 and cars[1:] == cars[:2] for cars in by_sample.values())
    assert by_sample[0][0] != by_sample[1][0]


def test_fewer_samples_are_the_first_of_more() -> None:
    few, many = (population_study(samples).samples()[0] for samples in (8, 16))
    assert [few[number] for number in range(8)] == [many[number] for number in range(8)]
    assert few[0] != population_study(8, seed=2).samples()[0][0]


def made_up(planned: StudyFile, outcomes: dict[str, list[tuple[float | None, float]]]) -> pa.Table:
    """Return slalom runs from the peak sideslip [rad] and the number of missed cones of each sample, by system."""
    rows = []
    samples = planned.samples()[0]
    for sample in range(len(outcomes["none"])):
        for system, values in outcomes.items():
            peak_rad, missed = values[sample]
            rows.append({
                "run": len(rows), "sample": sample, "maneuver": "slalom", "vehicle": "compact", "controller": system,
                **samples[sample], "status": "failed" if peak_rad is None else "ok",
                "sideslip_peak_abs_rad": peak_rad, CONES_MISSED: missed,
                "claim_Z1": 1.0 if samples[sample]["speed_kmh"] > 1.0 else 0.0, "claim_Z2": 1.0,
                "claim_Z3": 1.0 if samples[sample]["sensors.preset"] == "ideal" else 0.0,
            })  # fmt: skip
    return pa.Table.from_pylist(rows)


def test_saved_and_spoiled_are_counted_in_pairs() -> None:
    planned = population_study(4)
    spin_rad = math.radians(60.0)
    table = made_up(
        planned,
        {
            "none": [(spin_rad, 0.0), (0.1, 2.0), (0.1, 0.0), (0.05, 0.0)],
            "ars": [(0.1, 0.0), (0.1, 1.0), (0.05, 0.0), (0.05, 0.0)],
            "afs": [(spin_rad, 0.0), (0.1, 0.0), (None, 0.0), (0.05, 1.0)],
        },
    )
    found = summarise(table, planned, nominal(Z1=True, Z2=False))
    ars, afs = found.systems
    assert (ars.saved, ars.spoiled) == (Proportion(1, 2), Proportion(0, 2))
    assert (afs.saved, afs.spoiled) == (Proportion(1, 2), Proportion(2, 2))
    assert ars.lower == Proportion(0, 0)
    assert found.failed == 1
    assert (ars.spun_without, ars.spun, afs.spun) == (1, 0, 2)
    [change] = ars.changes
    assert (change.metric, change.number) == ("sideslip_peak_abs_rad", 4)
    assert change.median == pytest.approx(-0.025)
    assert afs.changes[0].number == 3
    assert [(claim.id, claim.passed, claim.share) for claim in found.claims][1] == ("Z2", False, 1.0)


def test_the_factor_that_decides_is_named() -> None:
    planned = population_study(128)
    table = made_up(planned, dict.fromkeys(("none", "ars", "afs"), [(0.1, 0.0)] * 128))
    speed, always = summarise(table, planned, nominal(Z1=True, Z2=True)).claims
    assert (speed.depends_on, speed.direction, speed.verdict) == ("speed_kmh", 1, ProportionVerdict.DEPENDS)
    assert (always.depends_on, always.verdict) == (NO_FACTOR, ProportionVerdict.HOLDS)
    assert speed.words == "higher speed"


def test_a_choice_that_decides_is_named_with_its_value_and_shares() -> None:
    planned = population_study(128)
    table = made_up(planned, dict.fromkeys(("none", "ars", "afs"), [(0.1, 0.0)] * 128))
    [ideal] = summarise(table, planned, nominal(Z3=True)).claims
    assert ideal.share == 0.5
    assert ideal.at == {"sensors.preset = ideal": 1.0, "sensors.preset = production": 0.0}
    assert ideal.words == "ideal sensors"


def test_what_is_stored_is_what_was_found(serial: Path) -> None:
    found = summarise(pq.read_table(serial / RESULTS), shortened(2), nominal(S1=True))
    assert Population.from_json(found.to_json()) == found
    assert found.to_json()["claims"][0]["verdict"] == "depends"
    assert "S1   passed" in found.to_text()
    with raises(StudyError, cause=KeyError):
        Population.from_json({"claims": []})


def test_the_package_stores_results_and_runs(serial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(population_store, "studies_dir", lambda: tmp_path)
    found = summarise(pq.read_table(serial / RESULTS), shortened(2), nominal(S1=True))
    summary, runs = population_store.store_population(found, serial)
    assert Population.from_json(json.loads(summary.read_text())) == found
    assert (
        pq.read_table(runs).select(["sample", "maneuver", "controller"]).to_pylist()
        == pq.read_table(serial / RESULTS).select(["sample", "maneuver", "controller"]).to_pylist()
    )
    assert {"claim_S1", "sideslip_peak_rad", "status"} <= set(pq.read_table(runs).column_names)
    assert not set(shortened(2).keys) & set(pq.read_table(runs).column_names)
    with raises(StudyError):
        population_store.store_population(found, tmp_path)


def test_a_share_is_whole_only_where_it_is() -> None:
    for share, shown in ((1.0, " 100 %"), (0.999, " 99.9 %"), (0.001, " 0.1 %"), (0.0, " 0 %")):
        claim = ClaimProportion("S1", True, 1000, share, 0.0, 1.0)
        assert shown in Population(1000, 1, "compact", {}, (claim,), ()).to_text()
