from __future__ import annotations

from pathlib import Path

import pytest

from activesteer.core.signals import Channel
from activesteer.errors import RecordingError
from activesteer.recording import ChannelTable, Recording
from tests.raising import raises


def test_a_name_gives_its_column_and_channel(channels: list[Channel]) -> None:
    table = ChannelTable(channels)
    assert list(table) == channels
    assert [table.index(channel.name) for channel in channels] == list(range(len(channels)))
    assert table["fl_travel_m"].unit == "m"
    assert "fl_travel_m" in table
    assert "fl_travel" not in table


def test_groups_keep_the_order_of_the_table(channels: list[Channel]) -> None:
    groups = ChannelTable(channels).groups()
    assert list(groups) == ["vehicle", "corners", "links"]
    assert groups["vehicle"] == [0, len(channels) - 1]
    assert sorted(column for columns in groups.values() for column in columns) == list(range(len(channels)))


def test_an_unknown_name_is_answered_with_the_nearest(channels: list[Channel]) -> None:
    with raises(RecordingError, value="yaw_rate_rads"):
        ChannelTable(channels).index("yaw_rate_rads")


def test_a_name_twice_is_refused() -> None:
    channel = Channel("v_mps", "m/s", "Speed", "vehicle")
    with raises(RecordingError, value="v_mps"):
        ChannelTable([channel, channel._replace(group="corners")])


@pytest.mark.parametrize("name", ["", "1st", "vx [m/s]", "vx.mps", "größe"])
def test_a_name_that_no_schema_can_hold_is_refused(name: str) -> None:
    with raises(RecordingError, value=name):
        ChannelTable([Channel(name, "m/s", "Speed", "vehicle")])


@pytest.mark.parametrize("group", ["", "Vehicle", "a/b"])
def test_a_group_that_no_topic_can_hold_is_refused(group: str) -> None:
    with raises(RecordingError, value=group):
        ChannelTable([Channel("v_mps", "m/s", "Speed", group)])


def test_names_that_differ_in_case_only_are_two_channels(tmp_path: Path) -> None:
    table = [Channel(name, "", "", "vehicle", single=False) for name in ("f_n", "f_N", "fN")]
    path = tmp_path / "case.mcap"
    Recording(table, [0.0], [[1.0, 2.0, 3.0]]).save(path)
    assert [Recording.open(path)[channel.name][0] for channel in table] == [1.0, 2.0, 3.0]
