"""The README of a new car: what it was made from, what was trimmed, and the open points."""

from __future__ import annotations

import math

from activesteer.vehicle_builder.design import Car
from activesteer.vehicle_builder.numbers import num, sig
from activesteer.vehicle_builder.trimmed import Trimmed


def readme_text(car: Car, trimmed: Trimmed, table_name: str) -> str:
    """Text of README.md.

    Args:
        car: The car, with its assumptions.
        trimmed: What was trimmed.
        table_name: Name of the table's copy in the folder.
    """
    kinds = " and ".join(f"{axle.kind.name.replace('_', ' ')} {axle.name}" for axle in car.axles)
    rows = [f"| `{item.key}` | {item.value} | {item.rule} |" for item in car.assumptions]
    trim_rows = [_trim_row(car, trimmed, axle.name) for axle in car.axles]
    source = car.table.source or "not said in the table"
    return f"""# {car.name}: {kinds}

Made by `activesteer vehicle new` from `{table_name}`. Source of its numbers, as the table says: {source}

`{car.name}.toml` is the vehicle file, `{car.name}.xml` the car that simulations load (it includes the axles, the steering and the
keyframe), `scene.xml` the car on a road for any MuJoCo viewer. All of these are meant to be edited; made again from the table
they are written anew.

    activesteer vehicle check {car.name}.toml
    activesteer kc --vehicle {car.name}.toml -o kc
    activesteer identify --vehicle {car.name}.toml
    activesteer run step_steer --vehicle {car.name}.toml

## Found by letting the car stand

The springs' forces, so that each wheel stands where its hardpoints are; the wheels' angles, so that static toe and camber are those asked
for; the rates where a wheel rate or a frequency was asked for; the pinion for the steering ratio.

| Axle | Spring rate, N/mm | Spring force, N | Dampers around rest, N s/m | Stops at the damper, mm |
|---|---|---|---|---|
{chr(10).join(trim_rows)}

Steering: {num(2e3 * math.pi * trimmed.pinion_radius_m, 2)} mm of rack a turn, ratio {num(trimmed.ratio, 2)}.
Chassis: {num(trimmed.chassis.mass_kg, 1)} kg, centre of gravity of the whole car at x {num(trimmed.cg_m[0], 3)} m, {num(trimmed.cg_m[1], 3)} m high in the design position.

## Open points

{_open(rows)}
Always open, since no table gives them: torsional stiffness of bushings (none), bushing hysteresis (none), compliance of top mounts and
subframes (none), friction of ball joints (none), lift (none). Driver and controllers have the package's own values, and
`[single_track]` is estimated until `activesteer identify` has driven the car.
"""


def _open(rows: list[str]) -> str:
    if not rows:
        return "The table gave every value that a rule would have given.\n"
    head = "Not given by the table, taken by a rule. Replace what you know: the key is that of the table.\n\n"
    return head + "| Key | Value | Rule |\n|---|---|---|\n" + "\n".join(rows) + "\n"


def _trim_row(car: Car, trimmed: Trimmed, name: str) -> str:
    found = trimmed.axle(name)
    speeds, forces = found.damper_velocity_mps, found.damper_force_N
    at = next(index for index, speed in enumerate(speeds) if speed >= 0.0)
    first, last = max(at - 1, 0), min(at + 1, len(speeds) - 1)
    damping = (forces[last] - forces[first]) / (speeds[last] - speeds[first])
    stops = f"{num(1e3 * found.bump_stop_m, 1)} bump, {num(1e3 * found.rebound_stop_m, 1)} rebound"
    return f"| {name} | {num(1e-3 * found.spring_rate_Npm, 2)} | {num(found.spring_force_N, 0)} | {sig(damping, 3)} | {stops} |"
