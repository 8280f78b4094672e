"""Measured signals: names, units and axes, suspicious values, resampling, and path."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Final, TypeVar

import numpy as np

from activesteer.config import Source, field_in_unit, read_toml
from activesteer.core.conventions import Array
from activesteer.core.units import Unit, find_unit, known_unit, unit_of
from activesteer.errors import RecordingError, nearest_names
from activesteer.recording import Poses, Recording
from activesteer.vehicle import Vehicle

_NAMES: Final = read_toml(Path(__file__).with_name("names.toml"), RecordingError)[0]
TURNED_IN_SAE: Final = frozenset(_NAMES["turned_in_sae_j670"])
_BY_WORD: Final = {word: channel for channel, words in _NAMES["words"].items() for word in words.split()}


Entry = TypeVar("Entry")


def by_channel(
    table: Mapping[str, Entry], known: Collection[str], source: Source, where: tuple[str, ...]
) -> dict[str, tuple[str, float, Entry]]:
    """Return the entries of a table of a file by channel, each with its key and the factor of its unit to SI."""
    found: dict[str, tuple[str, float, Entry]] = {}
    for key, entry in table.items():
        name, factor = field_in_unit(key, known)
        if name is None:
            raise source.fail((*where, key), f"there is no such channel; {nearest_names(key, known)}", key, list(known))
        if name in found:
            raise source.fail((*where, key), "is given twice, in two units", key)
        found[name] = key, factor, entry
    return found


def written_unit(unit: str) -> Unit | None:
    """Return a unit from its spelling in a file, or None if unknown."""
    return find_unit(unit.strip().strip("[]()").strip().replace("**", "^"), any_case=True)


def bracketed(name: str) -> tuple[str, str]:
    """Return a name without the brackets at its end, and the string in the brackets or an empty string."""
    found = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]\s*", name)
    return (found[1], found[2]) if found else (name, "")


def split_unit(name: str) -> tuple[str, str]:
    """Return a name without the unit in brackets at its end, and the unit or an empty string."""
    words, unit = bracketed(name)
    return (words, unit) if unit and written_unit(unit) else (name, "")


def is_time(name: str) -> bool:
    """Return whether a column holds times, by its name."""
    return name == "time_s" or _word(split_unit(name)[0]) in _NAMES["time"].split()


def known_column(name: str, columns: Collection[str], channels: Collection[str]) -> tuple[str, str, float, bool] | None:
    """Return the channel that the name of a column stands for, or None."""
    # The other parts are its unit if the file states none, -1 if the exporter's sign is opposite to ISO 8855, and
    # whether the unit is the exporter's.
    for mark, names in _NAMES["exporters"].items():
        if mark in columns and name in names:
            key = names[name].lstrip("-")
            channel = field_in_unit(key, channels)[0] or key
            return channel, unit_of(key), -1.0 if names[name] != key else 1.0, True
    if name in channels:
        return name, "", 1.0, True
    channel, _ = field_in_unit(name, channels)
    if channel is not None:
        return channel, name.rsplit("_", 1)[1], 1.0, True
    words, unit = split_unit(name)
    channel = _BY_WORD.get(_word(words))
    return None if channel is None else (channel, unit, 1.0, bool(unit))


def _word(name: str) -> str:
    return re.sub(r"[\W_]", "", name.lower())


_ALIKE: Final = 0.7
"""Correlation above which two signals belong to the same motion."""
_MISTAKES: Final = {
    name: (known_unit(right).factor / known_unit(wrong).factor, wrong, right)
    for name, wrong, right in (
        ("yaw_rate_radps", "deg/s", "rad/s"),
        ("speed_mps", "km/h", "m/s"),
        ("ay_mps2", "g", "m/s2"),
    )
}
"""Factors of the error, by channel, if the first unit was mistaken for the second."""
_NEAR: Final = math.log(1.5)
"""Ratios within this range count as equal: ay/(v yaw rate) is 1 except for the change of the sideslip angle."""
_LONGEST_STEP_S: Final = 1.0
"""Time step from which the motion of a car cannot be seen [s]."""
_STEER_RANGE: Final = (0.001, 0.15)
"""Plausible yaw rate divided by speed and steering wheel angle [1/m]. The value 1/(wheelbase x ratio) is 0.02, divided
by 1 + (v/v_ch)^2, and less at the limit. Degrees taken as radians are off by a factor of 57."""
_SHORTEST_M: Final = 2.4
"""Wheelbase of a short car [m]. With the angle of the road wheels, yaw rate divided by speed and angle is 1/wheelbase
in a neutral car, and less in an understeering car."""
_FASTEST_RADPS: Final = 4.0
"""Yaw rate that no car on its wheels reaches [rad/s]."""


def suspicions(channels: Mapping[str, Array], step_s: float = 0.01) -> list[str]:
    """Return hints of wrong units or signs, one line each."""
    rate, ay, wheel = (channels.get(name) for name in ("yaw_rate_radps", "ay_mps2", "steering_wheel_rad"))
    speed = channels.get("speed_mps", channels.get("vx_mps"))
    found: list[str] = []
    if step_s >= _LONGEST_STEP_S:
        found.append(f"the time has steps of {step_s:g} s: it looks like ms or us that were taken as s (time_unit)")
    if speed is not None and rate is not None and ay is not None:
        found += _against_acceleration(speed * rate, ay, wheel)
    elif rate is not None and np.abs(rate).max() > _FASTEST_RADPS:
        found.append(f"yaw_rate_radps reaches {np.abs(rate).max():.0f} rad/s: it looks like deg/s")
    roll = channels.get("roll_rad")
    signed = any("sign" in line for line in found)
    if not signed and roll is not None and ay is not None and _alike(roll, ay) < -_ALIKE:
        signed = True
        found.append(
            "roll_rad and ay_mps2 have opposite signs: a car rolls to the outside of the turn, so roll_rad is "
            'positive to the left, or all are in axes of SAE J670 (axes = "sae_j670" in a map)'
        )
    if not signed and rate is not None and wheel is not None and _alike(wheel, rate) < -_ALIKE:
        found.append(
            "steering_wheel_rad and yaw_rate_radps have opposite signs: one of them is positive to the right, namely "
            "the steering wheel if ay_mps2 and the yaw rate have the same sign"
        )
    if speed is not None and rate is not None and wheel is not None and not found:
        found += _against_steering(speed, rate, wheel)
    return found


def _against_acceleration(product: Array, ay: Array, wheel: Array | None) -> list[str]:
    alike = _alike(product, ay)
    if abs(alike) < _ALIKE:
        return []
    found = []
    if alike < 0.0:
        guilty = "one of them is"
        if wheel is not None and abs(_alike(wheel, ay)) > _ALIKE:
            guilty = "ay_mps2 is" if _alike(wheel, ay) < 0.0 else "yaw_rate_radps is"
        found.append(f"ay_mps2 and yaw_rate_radps have opposite signs: {guilty} positive to the right")
    found += _unit_words(abs(float(product @ ay / (product @ product))))
    return found


def _unit_words(ratio: float) -> list[str]:
    """Explain a wrong ratio of lateral acceleration to speed x yaw rate by the fewest wrong units."""
    if abs(math.log(ratio)) < _NEAR:
        return []
    guesses = []
    for powers in itertools.product((0, 1, -1), repeat=len(_MISTAKES)):
        would = math.prod(
            size ** (power if name == "ay_mps2" else -power)
            for power, (name, (size, _, _)) in zip(powers, _MISTAKES.items(), strict=True)
        )
        if abs(math.log(ratio / would)) < _NEAR:
            guesses.append((sum(map(abs, powers)), abs(math.log(ratio / would)), powers))
    if not guesses:
        return [
            f"ay_mps2 is {ratio:.2g} times speed x yaw rate, but nearly 1 in a car: one of the three units is wrong"
        ]
    found = []
    for power, (name, (size, wrong, right)) in zip(min(guesses)[2], _MISTAKES.items(), strict=True):
        factor = size**power
        times = f"{factor:.2g} times too large" if factor > 1.0 else f"{1.0 / factor:.2g} times too small"
        taken = f"{wrong} that were taken as {right}" if power > 0 else f"{right} that were taken as {wrong}"
        found += [f"{name} is {times}: it looks like {taken}"] if power else []
    return found


def _against_steering(speed: Array, rate: Array, wheel: Array) -> list[str]:
    product = speed * wheel
    if abs(_alike(product, rate)) < _ALIKE:
        return []
    gain = abs(float(product @ rate / (product @ product)))
    looks = ""
    if gain < _STEER_RANGE[0]:
        looks = "looks like deg that were taken as rad"
    elif gain > 1.0 / _SHORTEST_M:
        looks = (
            "is too small even for the angle of the road wheels (0.1 to 0.4); it looks like rad that were taken as deg "
            "(0.2 to 1.7), or has another scale: give its `factor` in a map, or fit steering.factor"
        )
    elif gain > _STEER_RANGE[1]:
        looks = "looks like the angle of the road wheels, or rad that were taken as deg"
    return [
        f"the yaw rate is {gain:.2g} 1/m times speed x steering wheel angle; in a car it is 0.003 to 0.03: "
        f"steering_wheel_rad {looks}"
    ] if looks else []  # fmt: skip


def _alike(one: Array, other: Array) -> float:
    """Return the cosine between two signals, or 0 if one of them is zero."""
    size = math.sqrt(float(one @ one) * float(other @ other))
    return float(one @ other) / size if size > 0.0 else 0.0


Samples = tuple[Array, Array]
"""Times [s], increasing, and values, finite, of a signal as measured, shape (n,) each."""


def samples(name: str, time_s: Array, values: Array, file: str) -> Samples:
    """Return the finite samples in order of time, and drop all but the last one of equal times."""
    if time_s.shape != values.shape or time_s.ndim != 1:
        raise RecordingError(
            f"{name} has {values.shape} values at {time_s.shape} times; one value a time is needed", file=file
        )
    known = np.isfinite(time_s) & np.isfinite(values)
    time_s, values = time_s[known], values[known]
    steps = np.diff(time_s)
    if len(time_s) and (steps < 0.0).any():
        row = int(np.argmax(steps < 0.0))
        raise RecordingError(
            f"the time of {name} goes backwards, from {time_s[row]:g} to {time_s[row + 1]:g} s; if the file holds "
            "several runs, split it, or select one run with start_s and end_s of a map",
            file=file,
        )
    last = np.append(steps > 0.0, True) if len(time_s) else known[:0]
    if np.count_nonzero(last) < 2:
        raise RecordingError(f"{name} has fewer than two samples that are numbers", file=file)
    return time_s[last], values[last]


def resampled(signal: Samples, grid_s: Array) -> Array:
    """Resample a signal to a uniform grid by linear interpolation."""
    # If the samples are closer than the grid, their mean over a grid step is taken, which prevents aliasing.
    time_s, measured = signal
    step_s = float(grid_s[1] - grid_s[0])
    if float(np.median(np.diff(time_s))) > 0.75 * step_s:
        return np.interp(grid_s, time_s, measured)
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - slow to import

    integral = make_interp_spline(time_s, measured, k=1).antiderivative()
    # Towards the ends, the window shrinks on both sides, so that its centre does not move.
    half = np.minimum(0.5 * step_s, np.minimum(grid_s - time_s[0], time_s[-1] - grid_s))
    wide = half > 1e-3 * step_s
    values = np.interp(grid_s, time_s, measured)
    values[wide] = (integral((grid_s + half)[wide]) - integral((grid_s - half)[wide])) / (2.0 * half[wide])
    return values


_MOVING_MPS: Final = 1.0
"""Speed below which a sideslip angle is not defined [m/s]."""


def with_motion(time_s: Array, channels: Mapping[str, Array]) -> dict[str, Array]:
    """Add derived channels: speed, sideslip angle, yaw angle and path."""
    # Without a position, the path starts at the origin along x. Its direction is the yaw angle, plus the sideslip angle
    # if measured.
    from scipy.integrate import cumulative_trapezoid  # noqa: PLC0415 - slow to import

    found = dict(channels)
    if "speed_mps" not in found and "vx_mps" in found:
        found["speed_mps"] = np.hypot(found["vx_mps"], found.get("vy_mps", 0.0))
    if "sideslip_rad" not in found and {"vx_mps", "vy_mps"} <= set(found):
        found["sideslip_rad"] = _sideslip(found["vx_mps"], found["vy_mps"])
    if "yaw_rad" not in found and "yaw_rate_radps" in found:
        found["yaw_rad"] = cumulative_trapezoid(found["yaw_rate_radps"], time_s, initial=0.0)
    if not {"x_m", "y_m"} <= set(found) and {"speed_mps", "yaw_rad"} <= set(found):
        course = found["yaw_rad"] + found.get("sideslip_rad", 0.0)
        found["x_m"] = cumulative_trapezoid(found["speed_mps"] * np.cos(course), time_s, initial=0.0)
        found["y_m"] = cumulative_trapezoid(found["speed_mps"] * np.sin(course), time_s, initial=0.0)
    return found


def _sideslip(vx: Array, vy: Array) -> Array:
    return np.where(np.abs(vx) > _MOVING_MPS, np.arctan2(vy, np.abs(vx)), 0.0)


def at_sensor(run: Recording) -> Recording:
    """Return the motion at the sensors, at `sensor_ahead_m`, with the offsets in `sensor_offset`."""
    # The point is on the centre line of a rigid body, ahead of the centre of gravity by x: v_y + x r, a_y + x dr/dt,
    # a_x - x r^2 with the yaw rate r.
    maneuver = run.metadata.get("maneuver", {})
    ahead_m = maneuver.get("sensor_ahead_m", 0.0)
    offsets = {name: offset for name, offset in maneuver.get("sensor_offset", {}).items() if offset}
    if ahead_m == 0.0 and not offsets:
        return run
    rate = run["yaw_rate_radps"]
    vx, vy = run["vx_mps"], run["vy_mps"] + ahead_m * rate
    moved = {
        "vy_mps": vy,
        "speed_mps": np.hypot(vx, vy),
        "sideslip_rad": _sideslip(vx, vy),
        "ay_mps2": run["ay_mps2"] + ahead_m * np.gradient(rate, run.time_s),
        "ax_mps2": run["ax_mps2"] - ahead_m * rate**2,
    }
    values = [moved.get(channel.name, run[channel.name]) + offsets.get(channel.name, 0.0) for channel in run.channels]
    return Recording(run.channels, run.time_s, np.column_stack(values), metadata=run.metadata)


def moved_car(vehicle: Vehicle, time_s: Array, channels: Mapping[str, Array]) -> Poses | None:
    """Return the poses of a car along the measured path for replay, or None without a path."""
    if not {"x_m", "y_m", "yaw_rad"} <= set(channels):
        return None
    from scipy.spatial.transform import Rotation  # noqa: PLC0415 - slow to import

    rows = np.arange(0, len(time_s), max(1, round(0.01 / float(time_s[1] - time_s[0]))))
    turns = Rotation.from_euler("z", channels["yaw_rad"][rows, None])
    centre = vehicle.data.site("cg").xpos
    bodies = [vehicle.data.body(name) for name in vehicle.body_names]
    path = np.column_stack([channels["x_m"][rows], channels["y_m"][rows], np.zeros(len(rows))])
    positions = [path + turns.apply(body.xpos - [centre[0], centre[1], 0.0]) for body in bodies]
    turned = [(turns * Rotation.from_quat(body.xquat, scalar_first=True)).as_quat(scalar_first=True) for body in bodies]
    return Poses(time_s[rows], vehicle.body_names, np.stack(positions, axis=1), np.stack(turned, axis=1))
