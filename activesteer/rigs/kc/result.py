"""The K&C rig and its result.

A column is a channel and its unit: `left_toe [deg]`. Signs follow ISO 8855 and `Sweep`: toe positive toe-in,
camber negative with the top inwards, caster positive with the top to the rear, motion of a wheel outwards or
forwards positive; for forces and moments see `TESTS`.
"""

from __future__ import annotations

import dataclasses
import math
import os
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.core.conventions import Array
from activesteer.core.files import make_folder, write_text
from activesteer.core.units import known_unit
from activesteer.errors import ModelError, ParameterError, nearest_names
from activesteer.rigs.kc.metrics import DEFINITIONS, Axle, load_targets
from activesteer.rigs.kc.programme import INWARDS, Measured, Sweep, measure
from activesteer.scenario import FileOrTable, check_gains, load_car
from activesteer.vehicle.parameters import Friction


@dataclass(frozen=True)
class KcMetric:
    """One K&C metric of the car, with its target band."""

    name: str
    axle: str  # `front`, `rear` or `car`
    value: float  # value; nan if the car has none
    unit: str
    band: tuple[float, float] | None  # target band; None without a target
    inside: bool | None  # whether the value is inside the band; None without a target
    source: str  # source of the band; empty without a target
    definition: str  # definition, sign, source
    remark: str = ""  # remark of the target file about a value outside the band


@dataclass(frozen=True)
class KcResult:
    """Kinematics and compliance of a car.

    Attributes:
        vehicle: Name of the car.
        metrics: Metrics, in the order of the table.
        curves: Sweeps of every wheel by name, in SI units.
        measured: All results, with steering axes and modes.
    """

    vehicle: str
    metrics: tuple[KcMetric, ...]
    curves: dict[str, Sweep]
    measured: Measured

    def __getitem__(self, key: tuple[str, str]) -> float:
        """Return the value of a metric by axle and name.

        Raises:
            ParameterError: there is no such metric.
        """
        for entry in self.metrics:
            if (entry.axle, entry.name) == key:
                return entry.value
        known = [f"{entry.axle}.{entry.name}" for entry in self.metrics]
        raise ParameterError(
            f"no metric is named {'.'.join(key)!r}; {nearest_names('.'.join(key), known)}", value=".".join(key)
        )

    @property
    def targeted(self) -> tuple[KcMetric, ...]:
        """The metrics with a target band."""
        return tuple(entry for entry in self.metrics if entry.inside is not None)

    @property
    def outside(self) -> tuple[KcMetric, ...]:
        """The metrics outside their bands."""
        return tuple(entry for entry in self.metrics if entry.inside is False)

    def to_json(self) -> dict[str, Any]:
        """Return the metrics as JSON values."""
        names = ("name", "axle", "value", "unit", "band", "inside", "source")
        return {"metrics": [{name: getattr(entry, name) for name in names} for entry in self.metrics]}

    def table(self) -> str:
        """Return the metrics as lines of 80 columns, with their target bands."""
        band = f"{'target band':>14}" if self.targeted else ""
        lines = [f"{'metric':31} {'axle':5} {'value':>7} {'unit':9} {band}".rstrip()]
        for entry in self.metrics:
            band = f"{entry.band[0]:g} to {entry.band[1]:g}" if entry.band else ""
            verdict = "" if entry.inside is None else "inside" if entry.inside else "OUTSIDE"
            lines.append(
                f"{entry.name:31} {entry.axle:5} {_number(entry.value):>7} {entry.unit:9} {band:>14} {verdict}".rstrip()
            )
        if self.targeted:
            met = len(self.targeted) - len(self.outside)
            lines += ["", f"{met} of {len(self.targeted)} target bands met"]
        for entry in self.outside:
            remark = f": {entry.remark}" if entry.remark else ""
            lines += textwrap.wrap(f"outside: {entry.axle} {entry.name}{remark}", 80, subsequent_indent="  ")
        return "\n".join(lines)


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "-"
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.4g}" if abs(value) >= 1.0 else f"{value:z.3f}"


@dataclass(frozen=True)
class Test:
    """One test of an axle."""

    sweep: str  # name of our own sweep
    variable: str  # channel of the variable
    # Sign from the variable to the load of the left wheel: its travel; forwards, to the left; a turn to the left
    sign: float = 1.0
    # Whether the load of the right wheel is the mirror image of the left wheel's load, or its opposite
    mirrored: bool = True
    front_only: bool = False  # whether only the front axle has the test


TESTS: Final = {
    "parallel_travel": Test("parallel_travel", "travel"),
    "opposite_travel": Test("opposite_travel", "travel"),
    "steering": Test("steering_rolling", "rack", mirrored=False, front_only=True),
    "side_force": Test("lateral_in_phase", "force", mirrored=False),
    "side_force_opposed": Test("lateral_opposed", "force", -1.0),
    "braking_force": Test("longitudinal_patch", "force"),
    "drive_force": Test("longitudinal_centre", "force"),
    "aligning_moment": Test("aligning_in_phase", "moment", mirrored=False),
    "aligning_moment_opposed": Test("aligning_opposed", "moment", -1.0),
}
"""Tests by name. AXLE_NAME.csv is the file of a test."""

CHANNELS: Final = {
    "travel": ("m", "mm"), "rack": ("m", "mm"), "force": ("N", "N"), "moment": ("Nm", "Nm"),
    "steering_wheel": ("rad", "deg"), "toe": ("rad", "deg"), "camber": ("rad", "deg"), "caster": ("rad", "deg"),
    "centre_forward": ("m", "mm"), "centre_outwards": ("m", "mm"), "contact_forward": ("m", "mm"),
    "contact_outwards": ("m", "mm"), "load": ("N", "N"), "damper": ("m", "mm"),
}  # fmt: skip
"""SI unit and unit in a file of each channel. Channels of a wheel begin with left_ or right_."""
OF_THE_AXLE: Final = ("rack", "force", "moment", "steering_wheel")
"""Channels of the axle, not of a wheel."""


def write_tables(result: KcResult, folder: str | os.PathLike[str]) -> list[Path]:
    """Write all tests of both axles, and return the paths."""
    target = make_folder(folder, ParameterError)
    written = []
    for first, axle in ((0, "front"), (2, "rear")):
        for name, test in TESTS.items():
            if test.front_only and axle == "rear":
                continue
            sweep = result.curves[test.sweep]
            text = _csv(
                f"{axle} axle of {result.vehicle}: {sweep.title}; {sweep.variable}", _columns(sweep, test, first)
            )
            written.append(write_text(target / f"{axle}_{name}.csv", text, ParameterError))
    return written


def _columns(sweep: Sweep, test: Test, first: int) -> dict[str, Array]:
    columns: dict[str, Array] = {}
    if test.variable == "rack":
        columns |= {"rack": sweep.rack_m, "steering_wheel": sweep.steering_wheel_rad}
    elif test.variable != "travel":
        columns[test.variable] = sweep.x
    for side, wheel in (("left", first), ("right", first + 1)):
        outwards = -INWARDS[wheel]
        moved = {"centre": sweep.centre_m[:, wheel], "contact": sweep.contact_m[:, wheel]}
        values = {
            "travel": sweep.travel_m[:, wheel],
            "toe": sweep.toe_rad[:, wheel],
            "camber": sweep.camber_rad[:, wheel],
            "caster": -(sweep.wind_up_rad[:, wheel] - sweep.wind_up_rad[sweep.zero, wheel]),
            **{f"{point}_forward": path[:, 0] - path[sweep.zero, 0] for point, path in moved.items()},
            **{f"{point}_outwards": outwards * (path[:, 1] - path[sweep.zero, 1]) for point, path in moved.items()},
            "load": sweep.load_N[:, wheel],
            "damper": sweep.damper_m[:, wheel],
        }
        columns |= {f"{side}_{name}": value for name, value in values.items()}
    return columns


def _csv(remark: str, columns: dict[str, Array]) -> str:
    heads, values = [], []
    for name, column in columns.items():
        _, unit = CHANNELS[name.removeprefix("left_").removeprefix("right_")]
        heads.append(f"{name} [{unit}]")
        values.append(column / known_unit(unit).factor)
    rows = [",".join(f"{value:.8g}" for value in row) for row in np.array(values).T]
    return "\n".join([f"# {remark}", ",".join(heads), *rows, ""])


def kinematics_compliance(
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    targets: str | os.PathLike[str] | None = None,
) -> KcResult:
    """Measure kinematics and compliance of a car with a held chassis and its wheels on pads.

    Args:
        vehicle: Name, path, or table of a vehicle.
        overrides: Dotted key of the vehicle, such as `factors.mass`, to value.
        targets: File with target bands. Default: the file with the vehicle's name in `models/targets`.

    Returns:
        Metrics with their bands, and all curves, of the car without the dry friction of its dampers and rack.

    Raises:
        ParameterError: the vehicle or the targets are not found or wrong.
        ModelError: the model is not found, lacks a part, or has no equilibrium.
        TyreFileError: a tyre file is not found or wrong.

    Examples:
        >>> from activesteer.rigs.kc.result import kinematics_compliance
        >>> result = kinematics_compliance("compact")
        >>> result["front", "bump_steer"] < 0.0
        True
    """
    car = load_car(vehicle, overrides)
    check_gains(overrides or {}, ())
    bands = load_targets(car.name, targets)
    # Dry friction acts equally in both directions: without it the rig finds the mean of both directions of a sweep.
    # The play of screws is removed for the same reason: the rig would find one of its ends by chance.
    rear = car.config.rear_actuator.smooth()
    smooth = dataclasses.replace(car, config=dataclasses.replace(car.config, friction=Friction(), rear_actuator=rear))
    try:
        measured = measure(smooth.on(), car.tyres)
    except np.linalg.LinAlgError as reason:
        raise ModelError(f"{car.mjcf}: the car has no equilibrium on the rig: {reason}") from reason
    except KeyError as reason:
        # The message of the engine's look-up by name lists the known names.
        raise ModelError(
            f"{car.mjcf}: the kinematics and compliance rig needs a part that the model lacks: {reason}"
        ) from reason
    metrics = []
    for definition in DEFINITIONS:
        for name in definition.axles:
            value, target = definition.evaluate(Axle(name, measured)), bands.get((name, definition.name))
            band = None if target is None else (target.band[0], target.band[1])
            inside = None if band is None else bool(band[0] <= value <= band[1])
            source, remark = ("", "") if target is None else (target.source, target.remark)
            metrics.append(
                KcMetric(definition.name, name, value, definition.unit, band, inside, source, definition.text, remark)
            )
    return KcResult(car.name, tuple(metrics), measured.sweeps, measured)
