"""Result of the kinematics and compliance rig: metrics in customary units, curves in SI, tables."""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass
from typing import Any, Final

from activesteer.errors import ParameterError, nearest_names
from activesteer.rigs.kc.definitions import Axle
from activesteer.rigs.kc.metrics_steering import DEFINITIONS
from activesteer.rigs.kc.programme import Measured
from activesteer.rigs.kc.sweep import Sweep
from activesteer.rigs.kc.targets import Target, Targets


@dataclass(frozen=True)
class KcMetric:
    """One metric of the car.

    Attributes:
        name: Name.
        axle: `front`, `rear` or `car`.
        value: Value; nan if the car has none.
        unit: Unit.
        band: Target band; None without a target.
        inside: Whether the value is inside the band; None without a target.
        source: Source of the band; empty without a target.
        definition: Definition, sign, source.
        remark: Remark of the target file about a value outside the band.
    """

    name: str
    axle: str
    value: float
    unit: str
    band: tuple[float, float] | None
    inside: bool | None
    source: str
    definition: str
    remark: str = ""


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
        """Return the metrics as JSON values: name, axle, value, unit, band, inside, source; a missing value is null."""
        names = ("name", "axle", "value", "unit", "band", "inside", "source")
        return {"metrics": [{name: getattr(entry, name) for name in names} for entry in self.metrics]}

    def table(self) -> str:
        """Return the metrics as text of 80 columns, a line each, with their target bands if there are any."""
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
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.4g}" if abs(value) >= 1.0 else f"{value:.3f}"


_NO_TARGET: Final = Target((), "")


def evaluated(vehicle: str, measured: Measured, targets: Targets) -> KcResult:
    """Compute all metrics and compare them with their bands."""
    metrics = []
    for definition in DEFINITIONS:
        for name in definition.axles:
            value = definition.evaluate(Axle(name, measured))
            band, inside, target = None, None, targets.get((name, definition.name), _NO_TARGET)
            if target is not _NO_TARGET:
                band = target.band[0], target.band[1]
                inside = bool(band[0] <= value <= band[1])
            metrics.append(
                KcMetric(
                    definition.name, name, value, definition.unit, band, inside, target.source, definition.text,
                    target.remark,
                )
            )  # fmt: skip
    return KcResult(vehicle, tuple(metrics), measured.sweeps, measured)
