"""Addresses of MuJoCo's arrays: measured, confirmed on the car, and an error if they cannot be found."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from activesteer.errors import ModelError
from activesteer.vehicle import force_block
from activesteer.vehicle.force_block import engine_layout
from tests.raising import raises
from tests.unit.vehicle.cars import standing


def word(address: int) -> int:
    return ctypes.c_uint64.from_address(address).value


def test_every_offset_leads_to_the_car_s_own_array() -> None:
    vehicle = standing()
    model, data = vehicle.model, vehicle.data
    layout = engine_layout.__wrapped__()
    for field in layout._fields:
        if field.startswith("d_") and field != "d_time":
            array = getattr(data, field.removeprefix("d_"))
            assert word(data._address + getattr(layout, field)) == array.ctypes.data, field
    assert word(model._address + layout.m_numeric_data) == model.numeric_data.ctypes.data
    data.time = 12.25
    assert ctypes.c_double.from_address(data._address + layout.d_time).value == data.time
    assert ctypes.c_double.from_address(model._address + layout.m_timestep).value == model.opt.timestep
    count = ctypes.c_int64.from_address(model._address + layout.m_nnumericdata).value
    assert count == model.numeric_data.size


def test_offsets_differ_and_are_aligned() -> None:
    layout = engine_layout.__wrapped__()
    model_part, data_part = layout[:3], layout[3:]
    assert len(set(model_part)) == len(model_part)
    assert len(set(data_part)) == len(data_part)
    assert all(offset % 8 == 0 for offset in layout)


def test_an_unknown_struct_is_an_error_that_names_the_member(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(force_block, "_DATA_BYTES", 64)
    with raises(ModelError, value="mjData.qvel"):
        engine_layout.__wrapped__()


def test_two_models_that_disagree_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    found = engine_layout.__wrapped__()
    answers = found, found._replace(d_qvel=found.d_qvel + 8)
    given = iter(answers)
    monkeypatch.setattr(force_block, "_measure", lambda *_: next(given))
    with raises(ModelError, value=answers):
        engine_layout.__wrapped__()


def test_arrays_that_are_found_are_views_of_the_engine_s_memory() -> None:
    vehicle = standing()
    data, layout = vehicle.data, engine_layout.__wrapped__()
    address = word(data._address + layout.d_qvel)
    view = np.ctypeslib.as_array((ctypes.c_double * vehicle.model.nv).from_address(address))
    data.qvel[3] = 0.125
    assert view[3] == 0.125
