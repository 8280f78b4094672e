"""Reference runs on uneven roads: a folder whose `roads.json` describes the road of each run.

Heights are those of the other code's file: `cosine_bump`, `bank` and `wave`. Places count from the point whose motion
the other code gives, at t = 0. Wheel loads, heave, pitch, roll, yaw rate and speed are compared over the whole run.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.core.conventions import Array
from activesteer.core.files import read_text, shown_path
from activesteer.errors import ParameterError, shown
from tests.reference.chrono.comparison import Comparison
from tests.reference.chrono.our_runs import compare_rms
from tests.reference.chrono.reference import Table

ROADS: Final = "roads.json"
_RACK_M: Final = 0.08
"""Rack travel for a `steer` of 1 [m], left positive."""
_STEER_AT_S: Final = (0.5, 0.6)
"""Ramp of a steer without times [s], as in the other reference runs."""


_ASIDE_M: Final = 0.0115
"""Place of the other car at t = 0, to the left of the middle of its road [m]."""


class _Limit(NamedTuple):
    """A compared column: name in words, unit, least range that counts, and limit of the RMS difference below it.

    Where symmetry leaves a channel near zero, a fraction of its range says nothing, and the other code's own asymmetry
    (0.0002 rad/s, 0.00005 rad of roll) decides. It lets the other car drift 9 cm further in 6 s. On a bank of 7 % this
    is 6 mm of height, 0.004 m/s of a coasting car's speed.
    """

    word: str
    unit: str
    least_range: float
    limit: float


_LIMITS: Final = {
    "vx": _Limit("speed", "m/s", 0.05, 0.005),
    "z": _Limit("heave", "m", 2e-3, 2e-4),
    "pitch": _Limit("pitch", "rad", 5e-3, 2e-4),
    "roll": _Limit("roll", "rad", 2e-3, 2e-4),
    "r": _Limit("yaw_rate", "rad/s", 0.01, 5e-4),
    **{f"Fz_{wheel}": _Limit(f"{wheel.lower()}_load", "N", 100.0, 10.0) for wheel in ("FL", "FR", "RL", "RR")},
}
"""Compared column -> its limit."""


class UnevenRun(NamedTuple):
    """A reference run on an uneven road.

    Attributes:
        name: Its name.
        table: Columns of the reference.
        road: Entry of `roads.json`.
        ahead_m: Distance of the other code's point from our origin, forwards [m].
    """

    name: str
    table: Table
    road: Mapping[str, Any]
    ahead_m: float

    def maneuver(self, speed_mps: float) -> dict[str, Any]:
        """Return the manoeuvre: coasting from a speed [m/s] over the road, steered if the file says so."""
        road: dict[str, Any] = {"mu": 0.9, "obstacle": self._obstacles()}
        if road["obstacle"]:
            road["contact"] = "single_point"
        steering = {"steering": steer} if (steer := _steering(self.road.get("steer"), self.name)) else {}
        return {
            "kind": "open_loop", "name": self.name, "title": f"Uneven road {self.name}", "speed_mps": speed_mps,
            "duration_s": float(self.table["t"][-1]), "settle_s": 3.0, "drive": "coast", "hold_last": True,
            "road": road, **steering,
        }  # fmt: skip

    def compare(self, ours: Table) -> list[Comparison]:
        """Compare our columns (`reference_columns`) with the reference."""
        time = self.table["t"][self.table["t"] <= ours["t"][-1]]
        if missing := [column for column in ("t", "x", "y", *_LIMITS) if column not in self.table]:
            raise ParameterError(f"{self.name}.csv lacks the columns {', '.join(missing)}")
        theirs = {column: self.table[column][: len(time)] for column in ("x", "y", *_LIMITS)}
        own = {column: np.interp(time, ours["t"], ours[column]) for column in theirs}
        # The cars drift apart by centimetres, so on a bank their heights differ: ours is taken where the other car is.
        there = self._bank_m(theirs["x"], theirs["y"] + _ASIDE_M)
        own["z"] = own["z"] - own["z"][0] + theirs["z"][0] + there - self._bank_m(own["x"], own["y"])
        return [
            compare_rms(self.name, limit.word, limit.unit, time, own[column], theirs[column],
                        limit.limit if float(np.ptp(theirs[column])) < limit.least_range else None)
            for column, limit in _LIMITS.items()
        ]  # fmt: skip

    def _bank_m(self, x: Array, y: Array) -> Array:
        bank = _table(self.road.get("bank", {}), self.name, "bank")
        if not bank:
            return np.zeros(1)
        start, end, slope = (_number(bank, key, f"{self.name}: bank") for key in ("from_m", "to_m", "slope_y"))
        part = np.clip((x - start) / (end - start), 0.0, 1.0)
        return slope * part * part * (3.0 - 2.0 * part) * y

    def _obstacles(self) -> list[dict[str, Any]]:
        unknown = sorted(set(self.road) - {"speed_kmh", "obstacles", "bank", "wave", "steer"})
        if unknown:
            raise ParameterError(f"{ROADS}: {self.name}: there is no meaning for {', '.join(map(shown, unknown))}")
        entries = self.road.get("obstacles", [])
        if not isinstance(entries, list):
            raise ParameterError(f"{ROADS}: {self.name}: obstacles is {shown(entries)}, a list is needed")
        listed = [_table(entry, self.name, "obstacles") for entry in entries]
        listed += [
            {"kind": kind, **_table(self.road[kind], self.name, kind)} for kind in ("wave", "bank") if kind in self.road
        ]
        return [self._obstacle(entry) for entry in listed]

    def _obstacle(self, entry: Mapping[str, Any]) -> dict[str, Any]:
        kind, place = entry.get("kind"), f"{self.name}: {shown(entry.get('kind'))}"
        if kind == "bank":
            start, end = _number(entry, "from_m", place), _number(entry, "to_m", place)
            slope = _number(entry, "slope_y", place)
            return {
                "kind": "cross_slope_ramp", "start_m": start + self.ahead_m, "length_m": end - start, "slope": slope,
            }  # fmt: skip
        if kind not in ("cosine_bump", "wave"):
            raise ParameterError(f"{ROADS}: {place} is no known kind; cosine_bump, wave and bank are")
        height = next((key for key in ("height_m", "amplitude_m", "a_m", "a") if key in entry), "height_m")
        return {
            "kind": "sine_wave" if kind == "wave" else kind, "start_m": _number(entry, "start_m", place) + self.ahead_m,
            "length_m": _number(entry, "length_m", place), "height_m": _number(entry, height, place),
            "side": entry.get("side", "both"),
        }  # fmt: skip


def uneven_runs(folder: Path, known: Sequence[str], tables: Mapping[str, Table], ahead_m: float) -> list[UnevenRun]:
    """Return the runs on uneven roads of a folder.

    Args:
        folder: The folder.
        known: Names of the runs on plane roads, which need no description.
        tables: Columns of each CSV of the folder, by its name.
        ahead_m: Distance of the other code's point from our origin, forwards [m].

    Raises:
        ParameterError: a CSV is neither a known run nor described, or a description is not understood.
    """
    roads: Mapping[str, Any] = {}
    if (path := folder / ROADS).exists():
        try:
            roads = json.loads(read_text(path, ParameterError))
        except (ValueError, RecursionError) as reason:
            raise ParameterError(f"cannot read {shown_path(path)}: {reason}") from reason
        if not isinstance(roads, dict):
            raise ParameterError(f"{shown_path(path)} holds no table of runs")
    if strange := sorted(name for name in tables if name not in known and name not in roads):
        raise ParameterError(
            f"{shown_path(folder / strange[0])}.csv is neither a run of the reference nor described in {ROADS}; known "
            f"are {', '.join([*known, *roads])}",
            value=strange[0],
        )
    runs = [UnevenRun(name, tables[name], _table(roads[name], name, name), ahead_m) for name in roads if name in tables]
    for run in runs:
        run.maneuver(20.0)
    return runs


def _steering(given: Any, name: str) -> dict[str, Any] | None:
    """Return the table of the rack for a steer: a value, a value with its times, or points (time, value)."""
    if given is None:
        return None
    times: list[float]
    if isinstance(given, int | float) and not isinstance(given, bool):
        times, values = list(_STEER_AT_S), [0.0, float(given)]
    elif isinstance(given, Mapping):
        found = {key: value for key, value in given.items() if isinstance(value, int | float)}
        value = next((found[key] for key in ("value", "to_value", "steer", "s") if key in found), None)
        start = next(
            (found[key] for key in ("from_s", "start_s", "at_s", "t0_s", "begin_s", "t0") if key in found), None
        )
        end = next((found[key] for key in ("to_s", "end_s", "until_s", "t1_s", "t1") if key in found), None)
        ramp = next((found[key] for key in ("ramp_s", "duration_s", "over_s", "length_s") if key in found), None)
        start = _STEER_AT_S[0] if start is None else start
        end = start + (_STEER_AT_S[1] - _STEER_AT_S[0] if ramp is None else ramp) if end is None else end
        listed = [given.get(key) for key in ("time_s", "value")]
        if isinstance(listed[0], list) and isinstance(listed[1], list):
            times, values = listed[0], listed[1]
        elif value is None or not end > start:
            raise ParameterError(
                f"{ROADS}: {name}: steer is {shown(given)}; a value and the times of its ramp are needed"
            )
        else:
            times, values = [start, end], [0.0, value]
    elif isinstance(given, list) and all(isinstance(point, list) and len(point) == 2 for point in given) and given:
        times, values = [point[0] for point in given], [point[1] for point in given]
    else:
        raise ParameterError(f"{ROADS}: {name}: steer is {shown(given)}, which is not understood")
    return {"time_s": times, "rack_m": [_RACK_M * value for value in values]}


def _table(value: Any, name: str, key: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise ParameterError(f"{ROADS}: {name}: {key} is {shown(value)}, a table is needed")
    return value


def _number(table: Mapping[str, Any], key: str, place: str) -> float:
    value = table.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ParameterError(f"{ROADS}: {place}: {key} is {shown(value)}, a number is needed")
    return float(value)
