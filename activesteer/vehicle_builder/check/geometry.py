"""Checks of geometry and parts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from activesteer.conventions import CORNERS, Array
from activesteer.errors import ModelError, nearest_names
from activesteer.vehicle_builder.check.findings import Finding, Level, judged
from activesteer.vehicle_builder.corner_motion import corner_motion

_MIRROR_M: Final = 1e-6
_TOUCH_M: Final = 0.005
"""Smallest distance of the lines of two rods [m]."""
_OPPOSITE: Final = {"fl": "fr", "rl": "rr"}
_MIRRORED: Final = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class _Rod:
    name: str
    start_m: Array
    end_m: Array

    @property
    def length_m(self) -> float:
        return float(np.linalg.norm(self.end_m - self.start_m))


def geometry(model: mujoco.MjModel) -> Iterator[Finding]:
    """Return all findings about the hardpoints."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    origin = data.xpos[model.body("chassis").id]
    points = {model.site(index).name: data.site_xpos[index] - origin for index in range(model.nsite)}
    yield from _sides(points)
    yield from _mirror(model, points)
    rods = _rods(model, data)
    yield from _lengths(rods)
    yield from _order(rods, points)
    yield from _crossings(rods)
    yield from _reach(points)
    for corner in ("fl", "rl"):
        yield from _firmness(model, corner)


def _sides(points: dict[str, Array]) -> Iterator[Finding]:
    wrong = [
        name
        for name, point in points.items()
        if name[:3] in {f"{corner}_" for corner in CORNERS} and point[1] * (1.0 if name[1] == "l" else -1.0) <= 0.0
    ]
    yield _any(
        "points on the side of their wheel",
        wrong,
        "y is positive on the left; change its sign, and x, y, z of the table",
    )


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
    if not wrong:
        return Finding("geometry", what, "ok", "yes")
    named = ", ".join(wrong[:6]) + (f" and {len(wrong) - 6} more" if len(wrong) > 6 else "")
    return Finding("geometry", what, "error", f"no: {named}", "", advice)


def _rods(model: mujoco.MjModel, data: mujoco.MjData) -> list[_Rod]:
    """Return the links of the left side that run straight between two sites."""
    rods = []
    for index in range(model.ntendon):
        name = model.tendon(index).name
        first, count = int(model.tendon_adr[index]), int(model.tendon_num[index])
        straight = count == 2 and (model.wrap_type[first : first + 2] == int(mujoco.mjtWrap.mjWRAP_SITE)).all()
        if name[:3] in ("fl_", "rl_") and straight and not name.endswith(("_spring", "_damper", "_guide")):
            start, end = (data.site_xpos[int(site)].copy() for site in model.wrap_objid[first : first + 2])
            rods.append(_Rod(name, start, end))
    return rods


def _lengths(rods: list[_Rod]) -> Iterator[Finding]:
    for choose in (min, max) if rods else ():
        rod = choose(rods, key=lambda rod: rod.length_m)
        word = "shortest" if rod.length_m == min(rod.length_m for rod in rods) else "longest"
        yield judged("link_length", rod.length_m, which=word, rod=rod.name)


def _order(rods: list[_Rod], points: dict[str, Array]) -> Iterator[Finding]:
    """Check that knuckle ends are further out than inner ends, and upper joints above lower ones."""
    crossed = [
        rod.name
        for rod in rods
        if abs(rod.end_m[1] - rod.start_m[1]) > abs(rod.end_m[0] - rod.start_m[0]) and rod.end_m[1] < rod.start_m[1]
    ]
    yield _any("inner ends further in than outer ends", crossed, "its inner and outer point seem to be exchanged")
    upside = []
    for corner in ("fl", "rl"):
        for upper, lower in (("uca", "lca"), ("trailing_upper", "trailing_lower"), ("camber_link", "spring_link")):
            above = [
                point[2] for name, point in points.items() if name.startswith(f"{corner}_{upper}") and "outer" in name
            ]
            below = [
                point[2] for name, point in points.items() if name.startswith(f"{corner}_{lower}") and "outer" in name
            ]
            if above and below and max(above) <= min(below):
                upside.append(f"{corner}_{upper} below {corner}_{lower}")
    yield _any("upper links above lower links", upside, "exchange them, or check z of their outer points")


def _crossings(rods: list[_Rod]) -> Iterator[Finding]:
    crossing = []
    for number, one in enumerate(rods):
        for two in rods[number + 1 :]:
            if one.name[:2] != two.name[:2] or _share_a_point(one, two):
                continue
            gap = _distance(one, two)
            if gap < _TOUCH_M:
                crossing.append(f"{one.name} and {two.name} ({1e3 * gap:.1f} mm)")
    level: Level = "warning" if crossing else "ok"
    words = "yes: " + ", ".join(crossing) if crossing else "no"
    advice = "two rods cannot pass through each other; is a point exchanged?" if crossing else ""
    yield Finding("geometry", "links that cross", level, words, "", advice)


def _share_a_point(one: _Rod, two: _Rod) -> bool:
    ends = [(a, b) for a in (one.start_m, one.end_m) for b in (two.start_m, two.end_m)]
    return any(np.linalg.norm(a - b) < 1e-4 for a, b in ends)


def _distance(one: _Rod, two: _Rod) -> float:
    """Return the smallest distance of two segments by alternating projection, exact for convex segments [m]."""
    s, t = 0.5, 0.5
    u, v = one.end_m - one.start_m, two.end_m - two.start_m
    for _ in range(200):
        s = float(np.clip((two.start_m + t * v - one.start_m) @ u / max(u @ u, 1e-12), 0.0, 1.0))
        t = float(np.clip((one.start_m + s * u - two.start_m) @ v / max(v @ v, 1e-12), 0.0, 1.0))
    return float(np.linalg.norm(one.start_m + s * u - two.start_m - t * v))


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
    yield _any("points within 1.2 m of their wheel", far, "front and rear exchanged, or a point in another unit?")
    advice = "check y: the point is further out than the middle of the tyre"
    yield _any("points not outside the middle of the wheel", outside, advice)


def _firmness(model: mujoco.MjModel, corner: str) -> Iterator[Finding]:
    axle = "front" if corner[0] == "f" else "rear"
    try:
        yield judged("firmness", corner_motion(model, corner).firmness, axle=axle)
    except ModelError as reason:
        yield Finding("geometry", f"{axle} links hold the wheel", "error", "no", "", str(reason))


_KINDS: Final = {
    "body": (mujoco.mjtObj.mjOBJ_BODY, "nbody"),
    "joint": (mujoco.mjtObj.mjOBJ_JOINT, "njnt"),
    "site": (mujoco.mjtObj.mjOBJ_SITE, "nsite"),
    "tendon": (mujoco.mjtObj.mjOBJ_TENDON, "ntendon"),
    "actuator": (mujoco.mjtObj.mjOBJ_ACTUATOR, "nu"),
    "sensor": (mujoco.mjtObj.mjOBJ_SENSOR, "nsensor"),
}


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
    """Return one error for each missing part, or one line if none is missing."""
    complete = True
    for word, (kind, count) in _KINDS.items():
        there = [mujoco.mj_id2name(model, kind, index) or "" for index in range(getattr(model, count))]
        for name in _NEEDED[word]:
            if name not in there:
                complete = False
                words = nearest_names(name, [other for other in there if other and other not in _NEEDED[word]])
                yield Finding("parts", f"{word} {name}", "error", "missing", "", f"add it to the MJCF; {words}")
    if complete:
        total = sum(len(names) for names in _NEEDED.values())
        yield Finding("parts", "bodies, joints, sites, tendons, actuators, sensors", "ok", f"all {total} there")
