"""The README of a new car: its sources, the trim, and open points."""

from __future__ import annotations

import math
from pathlib import Path
from string import Template
from typing import Final

from activesteer.vehicle_builder.design import Car
from activesteer.vehicle_builder.numbers import num, sig
from activesteer.vehicle_builder.trimmed import Trimmed

_TEMPLATE: Final = Path(__file__).resolve().parent / "templates" / "README.md"


def readme_text(car: Car, trimmed: Trimmed, table_name: str) -> str:
    """Return the text of README.md."""
    kinds = " and ".join(f"{axle.kind.name.replace('_', ' ')} {axle.name}" for axle in car.axles)
    rows = [f"| `{item.key}` | {item.value} | {item.rule} |" for item in car.assumptions]
    trim_rows = [_trim_row(trimmed, axle.name) for axle in car.axles]
    return Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        name=car.name,
        kinds=kinds,
        table=table_name,
        source=car.table.source or "not said in the table",
        trimmed="\n".join(trim_rows),
        rack=num(2e3 * math.pi * trimmed.pinion_radius_m, 2),
        ratio=num(trimmed.ratio, 2),
        chassis=num(trimmed.chassis.mass_kg, 1),
        cg_x=num(trimmed.cg_m[0], 3),
        cg_height=num(trimmed.cg_m[1], 3),
        measured=_measured(car),
        open=_open(rows),
    )


def _measured(car: Car) -> str:
    """Return the section on the measurements of the K&C rig, their roughness, and unusual ones."""
    lines = []
    for axle in car.axles:
        if axle.measured is None:
            continue
        rough = max(axle.measured.roughness.items(), key=lambda item: item[1], default=("", 0.0))
        lines += [
            f"- {axle.name}: cubic splines by least squares, one interval for each two points and at most 16; greatest "
            f"distance of a sample {rough[1]:.2g} m or rad ({rough[0]}). Compliance: {axle.measured.stiffness_remark}.",
            *(f"- **{line}**" for line in axle.measured.questions),
        ]
    return "\n".join(["## Measured", "", *lines, "", ""]) if lines else ""


def _open(rows: list[str]) -> str:
    if not rows:
        return "The table gives all values, so that no rule was used.\n"
    head = "Values by rules, because the table lacks them. Replace what you know, by these keys of the table.\n\n"
    return head + "| Key | Value | Rule |\n|---|---|---|\n" + "\n".join(rows) + "\n"


def _trim_row(trimmed: Trimmed, name: str) -> str:
    trim = trimmed.axle(name)
    speeds, forces = trim.damper_velocity_mps, trim.damper_force_N
    at = next(index for index, speed in enumerate(speeds) if speed >= 0.0)
    first, last = max(at - 1, 0), min(at + 1, len(speeds) - 1)
    damping = (forces[last] - forces[first]) / (speeds[last] - speeds[first])
    stops = f"{num(1e3 * trim.bump_stop_m, 1)} bump, {num(1e3 * trim.rebound_stop_m, 1)} rebound"
    spring = f"{num(1e-3 * trim.spring_rate_Npm, 2)} | {num(trim.spring_force_N, 0)}"
    return f"| {name} | {spring} | {sig(damping, 3)} | {stops} |"
