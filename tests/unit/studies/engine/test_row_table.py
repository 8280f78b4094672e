"""Columns of results: their types, and parts with different types."""

from __future__ import annotations

from dataclasses import replace

import pyarrow as pa
import pytest

from activesteer.scenario import resolve
from activesteer.studies.engine.runs import run_id
from activesteer.studies.engine.store import joined, table_of


def column(*values):
    return table_of([{"run": run, "load": value} for run, value in enumerate(values)], ["load"]).column("load")


@pytest.mark.parametrize(
    ("values", "kind"),
    [((1, 2), pa.int64()), ((1, 2.5), pa.float64()), (("a", None), pa.string()), ((True, False), pa.bool_())],
)
def test_a_factor_keeps_its_type(values, kind):
    found = column(*values)
    assert found.type == kind
    assert found.to_pylist() == list(values)


def test_a_factor_of_lists_or_tables_is_written_as_json():
    assert column([1, 2], {"a": 1.5}, None).to_pylist() == ["[1, 2]", '{"a": 1.5}', None]


@pytest.mark.parametrize(
    ("one", "other", "both"),
    [
        (pa.int64(), pa.int64(), pa.int64()), (pa.int64(), pa.float64(), pa.float64()),
        (pa.int64(), pa.null(), pa.int64()), (pa.null(), pa.string(), pa.string()),
        (pa.int64(), pa.string(), pa.string()), (pa.bool_(), pa.float64(), pa.string()),
    ],
)  # fmt: skip
def test_parts_of_different_types_are_joined(one, other, both):
    parts = [pa.schema([("load", kind)]).empty_table() for kind in (one, other)]
    assert joined(parts).schema.field("load").type == both
    assert joined(parts[::-1]).schema.field("load").type == both


def test_a_run_id_has_16_digits_and_differs_with_whatever_decides_the_run():
    scenario = resolve("step_steer")
    ids = [
        run_id(scenario, "ars", 0, 0.001), run_id(scenario, "afs", 0, 0.001), run_id(scenario, "ars", 1, 0.001),
        run_id(scenario, "ars", 0, 0.0005), run_id(resolve("step_steer", overrides={"road.mu": 0.5}), "ars", 0, 0.001),
    ]  # fmt: skip
    assert len(set(ids)) == len(ids)
    assert all(len(bytes.fromhex(each)) == 8 for each in ids)
    assert run_id(resolve("step_steer"), "ars", 0, 0.001) == ids[0]


def test_a_run_id_differs_with_the_content_of_a_file_that_the_run_was_made_from():
    given = resolve("step_steer")
    assert given.files
    for name, content in given.files.items():
        changed = replace(given, files={**given.files, name: content + b"\n"})
        assert run_id(changed, "ars", 0, 0.001) != run_id(given, "ars", 0, 0.001), name
