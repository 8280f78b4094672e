"""Tables as spreadsheets and loggers write them: units, separators, decimal commas, byte order marks."""

from __future__ import annotations

import math

import pytest

from activesteer.errors import ManeuverError
from activesteer.maneuver.base import read_columns
from tests.raising import raises


def columns(tmp_path, text, *names):
    path = tmp_path / "table.csv"
    path.write_bytes(text.encode())
    return read_columns(path, ("time_s",), names)[0]


@pytest.mark.parametrize(
    "text",
    [
        "time_s,speed_mps\n0,10\n0.5,12.5\n",
        "time_s,speed_kmh\n0,36\n0.5,45\n",
        "time_s;speed_kmh\n0;36\n0,5;45,0\n",
        "time_s;speed_kmh\n0;36\n0.5;45.0\n",
        "time_s\tspeed_kmh\n0\t36\n0,5\t4,5e1\n",
        "\ufefftime_s ; note ; speed_kmh\r\n0 ; x ; 36\r\n0,5 ; y ; 45\r\n;;\r\n",
        '# from a logger\ntime_s, "speed_kmh"\n0, 36\n\n0.5, "45"  # last\n',
    ],
)
def test_a_table_is_read_however_it_is_written(tmp_path, text):
    found = columns(tmp_path, text, "speed_mps")
    assert found == {"time_s": [0.0, 0.5], "speed_mps": pytest.approx([10.0, 12.5])}


def test_degrees_and_degrees_a_second_become_radians(tmp_path):
    text = "time_s,steering_wheel_deg,rate_degps\n0,180,-90\n"
    found = columns(tmp_path, text, "steering_wheel_rad", "rate_radps")
    assert found["steering_wheel_rad"] == pytest.approx([math.pi])
    assert found["rate_radps"] == pytest.approx([-math.pi / 2])


@pytest.mark.parametrize(
    ("text", "line", "key", "value"),
    [
        ("time_s,speed_kmh,speed_mps\n0,36,10\n", 1, "speed_mps", None),
        ("time_s,speed_kmh\n0,36\n0,5,45,0\n", 3, None, None),
        ("time_s;speed_kmh\n0;1.000,5\n", 2, "speed_kmh", "1.000,5"),
        ("time_s;speed_kmh\n0\n", 2, "speed_kmh", ""),
        ("time_s,speed_kmh\n0,nan\n", 2, "speed_kmh", "nan"),
        ("time_s,speed_kmh\n0," + "1" * 131_073 + "\n", 2, None, None),
    ],
)
def test_what_cannot_be_a_number_is_answered_with_its_line(tmp_path, text, line, key, value):
    with raises(ManeuverError, file="table.csv", line=line, key=key, value=value):
        columns(tmp_path, text, "speed_mps")
