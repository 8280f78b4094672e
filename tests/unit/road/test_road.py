"""Valid and invalid roads."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from activesteer.config import Source, build, read_toml, to_table
from activesteer.errors import ManeuverError
from activesteer.road.road import Road, RoadPatch
from tests.raising import raises

TEXT = """\
mu = 0.9
mu_right = 0.5

[[patches]]
start_m = 30
end_m = 42
mu = 0.3
side = "left"

[[patches]]
start_m = 40
end_m = 50
mu = 0.6
"""


def read(text: str, folder: Path) -> Road:
    path = folder / "road.toml"
    path.write_text(text)
    return build(Road, *read_toml(path, ManeuverError))


def test_road_is_read_and_comes_back_as_a_table(tmp_path: Path) -> None:
    road = read(TEXT, tmp_path)
    assert road == Road(0.9, mu_right=0.5, patches=(RoadPatch(30.0, 42.0, 0.3, "left"), RoadPatch(40.0, 50.0, 0.6)))
    assert build(Road, to_table(road), Source("road")) == road


def test_areas_come_in_the_order_in_which_they_count(tmp_path: Path) -> None:
    everywhere, half = math.inf, (-math.inf, 0.0)
    assert tuple(area[:5] for area in read(TEXT, tmp_path).areas()) == (
        (-everywhere, everywhere, *half, 0.5),
        (30.0, 42.0, 0.0, everywhere, 0.3),
        (40.0, 50.0, -everywhere, everywhere, 0.6),
    )
    assert Road(0.9).areas() == ()


@pytest.mark.parametrize(
    ("old", "new", "line", "key"),
    [
        ("end_m = 42", "end_m = 30", 4, "patches.0"),
        ("end_m = 42", "end_m = nan", 6, "patches.0.end_m"),
        ('"left"', '"lft"', 8, "patches.0.side"),
        ("mu = 0.6", "mu = 0.0", 13, "patches.1.mu"),
        ("mu = 0.6", "frction = 1", 13, "patches.1.frction"),
        ("start_m = 40\n", "", 10, "patches.1.start_m"),
        ("mu_right = 0.5", "mu_right = 7", 2, "mu_right"),
    ],
)
def test_a_wrong_road_is_answered_with_its_line(tmp_path: Path, old: str, new: str, line: int, key: str) -> None:
    assert old in TEXT
    with raises(ManeuverError, file="road.toml", line=line, key=key):
        read(TEXT.replace(old, new), tmp_path)


def test_the_friction_of_every_road_is_within_the_same_range() -> None:
    values: list[dict[str, Any]] = [
        {"mu": 3.0}, {"mu_left": 3.0}, {"patches": [{"start_m": 0, "end_m": 1, "mu": 3.0}]},
    ]  # fmt: skip
    for table in values:
        with raises(ManeuverError, file="road", value=3.0):
            build(Road, table, Source("road", error=ManeuverError))
