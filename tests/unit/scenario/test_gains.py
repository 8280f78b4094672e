"""The part of the table [controllers] that each controller reads, and settings that no driven controller reads."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from activesteer import simulate
from activesteer.controllers import (
    CONTROLLERS,
    ControllerParameters,
    controller_spec,
    declared_parameters,
    keys_read,
)
from activesteer.controllers.variant import Variant
from activesteer.errors import ParameterError
from activesteer.resources import list_controller_variants
from activesteer.scenario import check_gains, resolve, unread_gains
from tests.raising import raises

LIMIT = {"controllers.ars.limit_deg": 2.0}


class Asked:
    """Gains that record which of them are read."""

    def __init__(self, gains: ControllerParameters) -> None:
        self.gains, self.names = gains, set()

    def __getattr__(self, name: str) -> Any:
        self.names.add(name)
        return getattr(self.gains, name)


@pytest.mark.parametrize("name", sorted({*CONTROLLERS, *list_controller_variants()}))
def test_controller_says_what_it_reads(name, monkeypatch):
    setup = resolve("straight_line", "compact_electric").controller_setup(0.01)
    asked = Asked(setup.gains)
    monkeypatch.setattr(Variant, "gains_in", lambda _, setup: setup.gains)
    controller_spec(name).make(replace(setup, gains=asked))  # pyright: ignore[reportArgumentType]
    assert asked.names == {key.partition(".")[0] for key in keys_read(name)} - {"interval_s", "bus_delay_s"}


def test_code_of_a_users_own_may_read_everything(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text("class Mine:\n    def step(self, command, measurement): ...\n")
    assert keys_read(f"{path}:Mine") == {field.name for field in fields(ControllerParameters)}


def test_one_of_the_controllers_must_read_a_setting():
    for controllers in (["ars"], ["none", "ars"], ["ars_sideslip"], ["none", "ars_tuned"]):
        check_gains(LIMIT, controllers)
    for controllers in ([], ["none"], ["afs", "lqr"], ["integrated"]):
        with raises(ParameterError, key="controllers.ars.limit_deg", value=2.0):
            check_gains(LIMIT, controllers)


def test_a_key_of_a_table_that_is_read_in_part_needs_a_controller_that_reads_it():
    for key in ("controllers.esc.friction_deviations", "vehicle.controllers.tv.sideslip_limit_deg"):
        with raises(ParameterError, key=key, value=2.0) as caught:
            check_gains({key: 2.0}, ["none", "integrated"])
        assert str(caught.value).endswith(f"is read by {key.split('.')[-2]}")
        check_gains({key: 2.0}, ["integrated", "esc", "tv"])
    check_gains({"controllers.esc.torque_limit_Nm": 900.0, "controllers.tv.least_fraction": 0.1}, ["integrated"])
    check_gains({"controllers.esc": {}}, ["integrated"])


def test_keys_that_a_controller_leaves_out_of_a_table_have_no_effect_on_it():
    setup = {"settle_s": 0.2, "duration_s": 4.0, "steer.steering_wheel_deg": 120.0, "road.mu": 0.35}
    all_keys, read = (declared_parameters("esc") | declared_parameters("tv")), declared_parameters("integrated")
    left_out = {key: 1.1 * each.default for key, each in all_keys.items() if key not in read}
    assert {key.split(".")[1] for key in left_out} == {"esc", "tv"}
    changed = {"controllers.esc.yaw_rate_time_s": 0.05}
    base, other, seen = (
        simulate("sine_with_dwell", "integrated", "compact_electric", setup | more) for more in ({}, left_out, changed)
    )
    assert np.array_equal(base.values, other.values)
    assert not np.array_equal(base.values, seen.values)


def test_shared_settings_are_those_of_each_that_shares_them():
    shared = {"controllers.servos.lag_s": 0.03, "vehicle.controllers.bus_delay_s": 0.01, "controllers.lqr": {}}
    assert not unread_gains(shared, ["integrated"])
    assert list(unread_gains(shared | {"controllers.ars": {}}, ["lqr"])) == ["controllers.ars"]
    assert list(unread_gains(shared, ["none"])) == list(shared)


def test_whole_table_counts_by_what_it_holds():
    assert not unread_gains({"controllers": {"afs": {}}}, ["afs"])
    assert unread_gains({"controllers": {"afs": {}}}, ["ars"])


def test_settings_of_other_parts_are_no_matter_of_controllers():
    check_gains({"road.mu": 0.5, "driver.preview_s": 1.0, "factors.mass": 1.1}, ["none"])
