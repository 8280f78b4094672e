"""Check of a car before the first run, in stages. A stage that fails gives its reason.

A finding is one line of the report, with the value, the usual range from usual.toml, and advice.
"""

from __future__ import annotations

import functools
import math
import os
import textwrap
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import combinations, product
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

import mujoco
import numpy as np
from scipy.optimize import lsq_linear

from activesteer.config import build, read_toml
from activesteer.core.conventions import CORNERS, GRAVITY_MPS2, Array
from activesteer.core.signals import ActuatorCommand, DriverCommand
from activesteer.errors import ActiveSteerError, ModelError, SimulationDiverged, nearest_names
from activesteer.resources import find_vehicle
from activesteer.rigs.kc import KcResult, kinematics_compliance
from activesteer.scenario import CarSpec, load_car
from activesteer.vehicle import Vehicle, engine_warnings_held
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.statics import mass_properties
from activesteer.vehicle_builder.corner_motion import corner_motion, wheel_travel_m

Level = Literal["ok", "warning", "error"]
_ROUNDING: Final = 1e-7
"""Smallest value that is not printed as 0."""
_WRAPPED: Final = textwrap.TextWrapper(80, subsequent_indent=11 * " ", break_long_words=False)


@dataclass(frozen=True)
class Finding:
    """Result of one check: a line of the report.

    Attributes:
        topic: parts, geometry, standing, riding, kinematics, steering, tyres.
        what: Subject of the finding.
        level: Level: ok, warning or error.
        value: Value with unit, or words.
        usual: Usual range; may be empty.
        advice: Advice; empty without a problem.
    """

    topic: str
    what: str
    level: Level
    value: str
    usual: str = ""
    advice: str = ""


def checked(topic: str, what: str, good: bool, value: str, advice: str) -> Finding:
    """Return the finding about a required property, with advice if it is missing."""
    return Finding(topic, what, "ok" if good else "error", value, "", "" if good else advice)


@dataclass(frozen=True)
class CheckReport:
    """All findings of a car.

    Attributes:
        vehicle: Name of the car.
        findings: The lines.
    """

    vehicle: str
    findings: tuple[Finding, ...]

    def count(self, level: Level) -> int:
        """Return the number of findings of a level."""
        return sum(finding.level == level for finding in self.findings)

    def __getitem__(self, what: str) -> Finding:
        """Return the finding about a subject."""
        return next(finding for finding in self.findings if finding.what == what)

    def as_table(self) -> dict[str, Any]:
        """Return the report as JSON values."""
        return {
            "vehicle": self.vehicle,
            "errors": self.count("error"),
            "warnings": self.count("warning"),
            "findings": [asdict(finding) for finding in self.findings],
        }

    def table(self) -> str:
        """Return the report as lines, with advice below warnings and errors."""
        lines, topic = [], ""
        for finding in self.findings:
            if finding.topic != topic:
                topic = finding.topic
                lines += ["", topic] if lines else [topic]
            usual = f" (usual: {finding.usual})" if finding.usual else ""
            lines += _WRAPPED.wrap(f"  {finding.level:7}  {finding.what}: {finding.value}{usual}")
            if finding.advice:
                lines += _WRAPPED.wrap(f"           -> {finding.advice}")
        errors, warnings = self.count("error"), self.count("warning")
        told = f"{errors} error{'s' * (errors != 1)}, {warnings} warning{'s' * (warnings != 1)}"
        return "\n".join([*lines, "", f"{self.vehicle}: {told}, {self.count('ok')} ok"])


@dataclass(frozen=True)
class Usual:
    """Usual and possible ranges of a value, from a table in usual.toml."""

    topic: str
    words: str  # name in the report
    usual: tuple[float, ...]  # lowest and highest usual value. A value outside is a warning
    advice: str  # advice for a value outside
    unit: str = ""  # unit, or empty for a pure number or a metric of the rig, which has its own
    # Lowest and highest possible value. A value outside is an error
    possible: tuple[float, ...] = (-math.inf, math.inf)
    axle: str = ""
    name: str = ""  # axle and name of a metric of the rig

    def judged(self, value: float, unit: str = "", **words: str) -> Finding:
        """Return the finding about a value, a warning for nan."""
        unit = (self.unit or unit).removesuffix("-")
        level: Level = "warning"
        if not math.isnan(value):
            level = "ok" if self.usual[0] <= value <= self.usual[1] else "warning"
            level = level if self.possible[0] <= value <= self.possible[1] else "error"
        shown = 0.0 if abs(value) < _ROUNDING else value
        said = "none" if math.isnan(value) else f"{shown:.4g} {unit}".strip()
        usual = f"{self.usual[0]:g} to {self.usual[1]:g} {unit}".strip()
        advice = "" if level == "ok" else self.advice
        return Finding(self.topic, self.words.format(**words), level, said, usual, advice)


@dataclass(frozen=True)
class _File:
    metric: tuple[Usual, ...]
    quantity: dict[str, Usual]


@functools.cache
def usual_values() -> _File:
    """Return the usual values of metrics and quantities."""
    return build(_File, *read_toml(Path(__file__).with_name("usual.toml")))


def judged(quantity: str, value: float, **words: str) -> Finding:
    """Return the finding about a quantity of usual.toml (see `Usual.judged`)."""
    return usual_values().quantity[quantity].judged(value, **words)


def check_vehicle(vehicle: str | os.PathLike[str]) -> CheckReport:
    """Check a car before it is driven."""
    file = find_vehicle(vehicle)
    findings: list[Finding] = []
    try:
        car = load_car(file)
    except ActiveSteerError as reason:
        return CheckReport(file.stem, (Finding("parts", "vehicle file", "error", "wrong", "", str(reason)),))
    findings.append(Finding("parts", "vehicle file, MJCF and tyre files", "ok", "read"))
    name = car.name
    try:
        model = mujoco.MjModel.from_xml_path(str(car.mjcf))
    except ValueError as reason:
        findings.append(Finding("parts", "MJCF compiles", "error", "no", "", str(reason)))
        return CheckReport(name, tuple(findings))
    findings += missing_parts(model)
    if any(finding.level == "error" for finding in findings):
        return CheckReport(name, tuple(findings))
    findings += geometry(model)
    try:
        standing_car = car.on()
    except ActiveSteerError as reason:
        findings.append(Finding("standing", "static equilibrium", "error", "none", "", str(reason)))
        return CheckReport(name, tuple(findings))
    findings += _standing(standing_car, car)
    try:
        findings += _riding(kinematics_compliance(file))
    except ActiveSteerError as reason:
        findings.append(Finding("riding", "kinematics and compliance", "error", "cannot be measured", "", str(reason)))
    return CheckReport(name, tuple(findings))


def _riding(result: KcResult) -> Iterator[Finding]:
    """Compare the metrics of the rig with the usual values of passenger cars."""
    yield from _metrics(result, "riding")
    front, rear = result["front", "ride_frequency"], result["rear", "ride_frequency"]
    yield judged("ride_ratio", rear / front)
    yield from _metrics(result, "kinematics")
    yield _sign(result)
    yield from _metrics(result, "steering")
    known = result.measured.vehicle.parameters.steering.ratio
    yield judged("ratio_error", 100.0 * (known / result["front", "steering_ratio"] - 1.0))


def _metrics(result: KcResult, topic: str) -> Iterator[Finding]:
    units = {(entry.axle, entry.name): entry.unit for entry in result.metrics}
    for row in (row for row in usual_values().metric if row.topic == topic):
        yield row.judged(result[row.axle, row.name], units[row.axle, row.name])


def _sign(result: KcResult) -> Finding:
    """Check that both wheels turn left when the steering wheel does."""
    sweep = result.curves["steering_rolling"]
    turned = sweep.steer_rad[-1, :2] - sweep.steer_rad[sweep.zero, :2]
    good = bool((turned > 0.0).all()) and float(sweep.x[-1]) > 0.0
    degrees = ", ".join(f"{math.degrees(angle):.1f}" for angle in np.asarray(turned))
    advice = "reverse the axis of the joint `rack`: its positive travel has to steer left"
    return checked("steering", "left turn of the steering wheel steers left", good, f"{degrees} deg", advice)


_MIRROR_M: Final = 1e-6
_TOUCH_M: Final = 0.005
"""Smallest distance of the lines of two rods [m]."""
_OPPOSITE: Final = {"fl": "fr", "rl": "rr"}
_MIRRORED: Final = np.array([1.0, -1.0, 1.0])


class _Rod(NamedTuple):
    name: str
    start_m: Array
    end_m: Array
    length_m: float


def geometry(model: mujoco.MjModel) -> Iterator[Finding]:
    """Return all findings about the hardpoints."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    origin = data.xpos[model.body("chassis").id]
    points = {model.site(index).name: data.site_xpos[index] - origin for index in range(model.nsite)}
    wrong = [
        name
        for name, point in points.items()
        if name[:3] in {f"{corner}_" for corner in CORNERS} and point[1] * (1.0 if name[1] == "l" else -1.0) <= 0.0
    ]
    advice = "y is positive on the left; change its sign, and x, y, z of the table"
    yield _any("points on the side of their wheel", wrong, advice)
    yield from _mirror(model, points)
    rods = _rods(model, data)
    for word, choose in (("shortest", min), ("longest", max)) if rods else ():
        rod = choose(rods, key=lambda rod: rod.length_m)
        yield judged("link_length", rod.length_m, which=word, rod=rod.name)
    yield from _order(rods, points)
    yield from _crossings(rods)
    yield from _reach(points)
    for axle, corner in (("front", "fl"), ("rear", "rl")):
        try:
            yield judged("firmness", corner_motion(model, corner)[1], axle=axle)
        except ModelError as reason:
            yield Finding("geometry", f"{axle} links hold the wheel", "error", "no", "", str(reason))


def _mirror(model: mujoco.MjModel, points: dict[str, Array]) -> Iterator[Finding]:
    wrong = []
    for name, point in points.items():
        if name[:2] in _OPPOSITE and name[2:3] == "_":
            other = points.get(_OPPOSITE[name[:2]] + name[2:])
            if other is None or np.abs(other - _MIRRORED * point).max() > _MIRROR_M:
                wrong.append(name)
    yield _any("right side mirrors the left side", wrong, "edit both sides; see docs/suspension.md")
    unlike = []
    for part, count, values in (
        (model.body, model.nbody, ((model.body_mass, 1e-9), (model.body_inertia, 1e-6))),
        (model.tendon, model.ntendon, ((model.tendon_stiffness, 0.0), (model.tendon_lengthspring, 1e-9))),
    ):
        for index in range(count):
            name = part(index).name
            if name[:2] in _OPPOSITE and name[2:3] == "_":
                other = part(_OPPOSITE[name[:2]] + name[2:]).id
                if not all(np.allclose(array[index], array[other], rtol=rtol) for array, rtol in values):
                    unlike.append(name)
    yield _any("equal masses, springs and bushings on both sides", unlike, "edit both sides, or the class of both")


def _any(what: str, wrong: list[str], advice: str) -> Finding:
    named = ", ".join(wrong[:6]) + (f" and {len(wrong) - 6} more" if len(wrong) > 6 else "")
    return checked("geometry", what, not wrong, f"no: {named}" if wrong else "yes", advice)


def _rods(model: mujoco.MjModel, data: mujoco.MjData) -> list[_Rod]:
    """Return the links of the left side that run straight between two sites."""
    rods = []
    for index in range(model.ntendon):
        name = model.tendon(index).name
        first, count = int(model.tendon_adr[index]), int(model.tendon_num[index])
        straight = count == 2 and (model.wrap_type[first : first + 2] == int(mujoco.mjtWrap.mjWRAP_SITE)).all()
        if name[:3] in ("fl_", "rl_") and straight and not name.endswith(("_spring", "_damper", "_guide")):
            start, end = (data.site_xpos[int(site)].copy() for site in model.wrap_objid[first : first + 2])
            rods.append(_Rod(name, start, end, float(np.linalg.norm(end - start))))
    return rods


def _order(rods: list[_Rod], points: dict[str, Array]) -> Iterator[Finding]:
    """Check that knuckle ends are further out than inner ends, and upper joints above lower ones."""
    crossed = [
        rod.name
        for rod in rods
        if abs(rod.end_m[1] - rod.start_m[1]) > abs(rod.end_m[0] - rod.start_m[0]) and rod.end_m[1] < rod.start_m[1]
    ]
    yield _any("inner ends further in than outer ends", crossed, "its inner and outer point seem to be swapped")
    upside = []
    for corner in ("fl", "rl"):
        for pair in (("uca", "lca"), ("trailing_upper", "trailing_lower"), ("camber_link", "spring_link")):
            above, below = (
                [at[2] for name, at in points.items() if name.startswith(f"{corner}_{link}") and "outer" in name]
                for link in pair
            )
            if above and below and max(above) <= min(below):
                upside.append(f"{corner}_{pair[0]} below {corner}_{pair[1]}")
    yield _any("upper links above lower links", upside, "swap them, or check z of their outer points")


def _crossings(rods: list[_Rod]) -> Iterator[Finding]:
    crossing = []
    for one, two in combinations(rods, 2):
        ends = product((one.start_m, one.end_m), (two.start_m, two.end_m))
        if one.name[:2] != two.name[:2] or any(np.linalg.norm(a - b) < 1e-4 for a, b in ends):
            continue
        gap = _distance(one, two)
        if gap < _TOUCH_M:
            crossing.append(f"{one.name} and {two.name} ({1e3 * gap:.1f} mm)")
    level: Level = "warning" if crossing else "ok"
    words = "yes: " + ", ".join(crossing) if crossing else "no"
    advice = "two rods cannot pass through each other; are two points swapped?" if crossing else ""
    yield Finding("geometry", "links that cross", level, words, "", advice)


def _distance(one: _Rod, two: _Rod) -> float:
    """Return the smallest distance between two segments [m]."""
    along = np.stack([one.end_m - one.start_m, two.start_m - two.end_m], axis=1)
    return float(np.linalg.norm(lsq_linear(along, two.start_m - one.start_m, (0.0, 1.0), method="bvls").fun))


def _reach(points: dict[str, Array]) -> Iterator[Finding]:
    """Check that the points of a suspension are near its wheel and not outside it."""
    far, outside = [], []
    for corner in ("fl", "rl"):
        centre = points[f"{corner}_wheel_centre"]
        for name, point in points.items():
            if not name.startswith(f"{corner}_") or name.endswith(("wheel_centre", "_lever")):
                continue
            if np.abs(point - centre).max() > 1.2:
                far.append(f"{name} ({np.abs(point - centre).max():.2f} m)")
            elif point[1] > centre[1] + 0.05:
                outside.append(f"{name} ({1e3 * (point[1] - centre[1]):.0f} mm)")
    yield _any("points within 1.2 m of their wheel", far, "front and rear swapped, or a point in another unit?")
    advice = "check y: the point is further out than the middle of the tyre"
    yield _any("points not outside the middle of the wheel", outside, advice)


_COUNTS: Final = {
    "body": "nbody", "joint": "njnt", "site": "nsite", "tendon": "ntendon", "actuator": "nu", "sensor": "nsensor",
}  # fmt: skip
"""Name of the model's count of each kind of part."""


def _each(*parts: str) -> tuple[str, ...]:
    return tuple(f"{corner}_{part}" for part in parts for corner in CORNERS)


_NEEDED: Final = {
    "body": ("chassis", "rack", *_each("knuckle", "wheel")),
    "joint": ("root", "rack", "steering_wheel", "superposition", "rl_steer", "rr_steer", *_each("spin")),
    "site": ("origin", "cg", "front_axle", *_each("wheel_centre")),
    "tendon": ("steering_column", *_each("damper", "spring")),
    "actuator": (
        "steering_wheel", "superposition", "rl_steer", "rr_steer",
        *_each("drive", "brake", "slip_x", "slip_y", "slip_z"),
    ),
    "sensor": (
        "cg_accelerometer", "cg_gyro", "cg_velocimeter", "cg_position", "chassis_orientation", "cg_velocity",
        "front_axle_position", "steering_wheel_angle", "superposition_angle", "rack_travel", "rl_steer_angle",
        "rr_steer_angle", *_each("wheel_speed", "wheel_position", "wheel_axis"),
    ),
}  # fmt: skip
"""Parts that loader, callback, recorder and rig look up."""


def missing_parts(model: mujoco.MjModel) -> Iterator[Finding]:
    """Return an error for each missing part, or one line if nothing is missing."""
    complete = True
    for word, count in _COUNTS.items():
        there = [getattr(model, word)(index).name for index in range(getattr(model, count))]
        for name in _NEEDED[word]:
            if name not in there:
                complete = False
                words = nearest_names(name, [other for other in there if other and other not in _NEEDED[word]])
                yield Finding("parts", f"{word} {name}", "error", "missing", "", f"add it to the MJCF; {words}")
    if complete:
        total = sum(len(names) for names in _NEEDED.values())
        yield Finding("parts", "bodies, joints, sites, tendons, actuators, sensors", "ok", f"all {total} there")


_STEPS: Final = 500
_STILL_MPS: Final = 0.01


def _standing(vehicle: Vehicle, car: CarSpec) -> Iterator[Finding]:
    """Yield all findings about the car at rest."""
    model, data = vehicle.model, vehicle.data
    load_N = fb.wheel_outputs(data, 4)["fz_N"].copy()
    body, design = mass_properties(model), mujoco.MjData(model)
    mujoco.mj_kinematics(model, design)
    yield Finding("standing", "static equilibrium", "ok", "found")
    yield judged("mass", body.mass_kg)
    yield judged("front_share", 100.0 * load_N[:2].sum() / load_N.sum())
    for axle, left, right in (("front", 0, 1), ("rear", 2, 3)):
        difference = 100.0 * abs(load_N[left] - load_N[right]) / load_N[left : right + 1].mean()
        yield judged("wheel_load_difference", difference, axle=axle)
    yield from _height(vehicle)
    wheels = [model.body(f"{corner}_wheel").id for corner in CORNERS]
    y_m, height_m = data.xpos[wheels, 1], float(data.subtree_com[0, 2])
    track = 0.5 * (y_m[0] - y_m[1] + y_m[2] - y_m[3])
    yield judged("cg_height", height_m)
    yield judged("stability_factor", track / (2.0 * height_m))
    to_front, to_rear = design.xpos[wheels[0], 0] - body.cg_m[0], body.cg_m[0] - design.xpos[wheels[2], 0]
    yield judged("yaw_inertia", float(body.inertia_kgm2[2, 2] / (body.mass_kg * to_front * to_rear)))
    for axle, curve in (("front", car.config.dampers.front), ("rear", car.config.dampers.rear)):
        pushes = [force * speed < 0.0 for speed, force in zip(curve.velocity_mps, curve.force_N, strict=True)]
        good = not any(pushes) and float(np.interp(0.0, curve.velocity_mps, curve.force_N)) == 0.0
        yield checked(
            "standing", f"{axle} damper resists its motion", good, "yes" if good else "no",
            "force_N has the sign of velocity_mps, both positive in compression, and is 0 at rest",
        )  # fmt: skip
        slope = np.abs(np.diff(curve.force_N) / np.diff(curve.velocity_mps)).max()
        yield judged("damper_slope", float(slope), axle=axle)
    brakes, radius = car.config.brakes, data.xpos[wheels[0], 2]
    maximum = 2.0 * (brakes.front_torque_Nm + brakes.rear_torque_Nm) / radius / (body.mass_kg * GRAVITY_MPS2)
    yield judged("deceleration", float(maximum))
    track, yaw = car.config.single_track, float(body.inertia_kgm2[2, 2])
    for what, known, real in (("mass", track.mass_kg, body.mass_kg), ("yaw inertia", track.yaw_inertia_kgm2, yaw)):
        yield judged("known", 100.0 * (known / real - 1.0), what=what)
    yield _stays(vehicle)
    for axle, tyre, load in zip(
        ("front", "rear"), car.tyres, (load_N[:2].mean(), load_N[2:].mean()), strict=True
    ):  # fmt: skip
        yield judged("tyre_load", float(load) / float(tyre["FNOMIN"]), axle=axle)
        yield judged("tyre_reserve", float(tyre["FZMAX"]) / float(load), axle=axle)


def _height(vehicle: Vehicle) -> Iterator[Finding]:
    """Check the distance of the wheels from their design position, and the attitude of the chassis."""
    travel_mm = 1e3 * wheel_travel_m(vehicle)
    yield judged("wheel_travel", float(travel_mm[:2].mean()), axle="front")
    yield judged("wheel_travel", float(travel_mm[2:].mean()), axle="rear")
    w, x, y, z = vehicle.data.qpos[3:7]
    yield judged("pitch", math.degrees(math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))))
    yield judged("roll", math.degrees(2.0 * math.atan2(x, w)))


def _stays(vehicle: Vehicle) -> Finding:
    """Check that the car stands still for half a second."""
    try:
        with engine_warnings_held():
            for _ in range(_STEPS):
                vehicle.step(DriverCommand(), ActuatorCommand())
        speed = float(np.abs(vehicle.data.qvel[:6]).max())
        warned = int(sum(warning.number for warning in vehicle.data.warning))
    except SimulationDiverged:
        speed, warned = math.inf, 0
    good = math.isfinite(speed) and speed < _STILL_MPS and not warned
    words = "yes" if good else f"no: {speed:.3g} m/s, rad/s"
    advice = "look for a part without stiffness or damping, or with a stiffness too large for the time step"
    return checked("standing", "stands still for 0.5 s", good, words, advice)
