"""Nearest points of many cars, each along its own path."""

import numpy as np

from activesteer.core.path import Path
from activesteer.road.native_path import PathSearch, PathSearches


def test_many_cars_find_what_each_finds_alone(rng: np.random.Generator) -> None:
    short, long = (Path.through([0.0, length, 2.0 * length], [0.0, 3.0, -4.0]) for length in (20.0, 55.0))
    paths = [short, long, short, long]
    cars, ahead_m = np.array([3, 0, 1]), rng.uniform(-5.0, 120.0, (3, 4))
    x_m, y_m, around_m = rng.uniform(0.0, 40.0, 3), rng.uniform(-2.0, 2.0, 3), rng.uniform(0.0, 40.0, 3)
    along_m, *points_m = PathSearches(paths).ahead(cars, x_m, y_m, around_m, 5.0, ahead_m)
    for place, car in enumerate(cars.tolist()):
        alone = PathSearch(paths[car])
        here_m = alone.nearest(x_m[place], y_m[place], around_m[place], 5.0)
        assert along_m[place] == here_m
        assert np.array_equal([points[place] for points in points_m], alone.at(here_m + ahead_m[place]))
