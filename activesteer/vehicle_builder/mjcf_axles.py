"""Axles and tendons of a car as MJCF."""

from __future__ import annotations

import numpy as np

from activesteer.conventions import Array
from activesteer.vehicle_builder.axle_kinds import Mount
from activesteer.vehicle_builder.completion import rack_per_steer_m
from activesteer.vehicle_builder.design import Axle, CarDesign, Solid
from activesteer.vehicle_builder.texts import num, sig, vec
from activesteer.vehicle_builder.trim import Trimmed, TrimmedAxle

_ON_RACK = "tie_rod"
_LINKED = """  <!-- {words} {axle} axle, a fragment of the chassis body. Every position is a
       hardpoint in vehicle coordinates: origin on the road below the front axle, x forward, y left,
       z up, design position. Links are tendons; an arm is two links that share their outer point. -->"""
_GUIDED = """  <!-- {words} guide the {axle} axle, a fragment of the chassis body: the travel z is free,
       the other joints follow the curves of the vehicle file and deflect elastically from them. Vehicle coordinates:
       origin on the road below the front axle, x forward, y left, z up, design position. Sites of springs and dampers
       serve only for display. -->"""


def axle_file(car: CarDesign, axle: Axle, trimmed: Trimmed) -> str:
    """Return the text of front_axle.xml or rear_axle.xml."""
    words = axle.kind.name.replace("_", " ")
    lines = [
        "<mujocoinclude>",
        *(_GUIDED if axle.kind.guided else _LINKED).format(words=words.capitalize(), axle=axle.name).splitlines(),
        "",
        "  <!-- Chassis side of links, springs and dampers"
        + ("; the tie rods start at the rack (steering.xml). -->" if axle.name == "front" else ". -->"),
    ]
    for side in (1.0, -1.0):
        lines += _chassis_sites(axle, side)
    for side, title in ((1.0, "Left"), (-1.0, "Right")):
        lines += [
            "",
            f"  <!-- {title} {axle.name} corner" + (": the left one with y negated. -->" if side < 0 else ". -->"),
        ]
        lines += _corner(car, axle, trimmed.axle(axle.name), side)
    return "\n".join([*lines, "</mujocoinclude>", ""])


def corner_name(axle: Axle, side: float) -> str:
    """Return the name of the left (side 1) or right corner."""
    return axle.corner if side > 0.0 else f"{axle.corner[0]}r"


def _at(point: Array, side: float) -> str:
    return vec((point[0], side * point[1], point[2]))


def _site(name: str, point: Array, side: float, indent: str) -> str:
    return f'{indent}<site name="{name}" pos="{_at(point, side)}"/>'


def _mounts(axle: Axle) -> tuple[tuple[str, Mount], ...]:
    return (("spring", axle.spring), ("damper", axle.damper))


def _chassis_sites(axle: Axle, side: float) -> list[str]:
    corner, lines = corner_name(axle, side), []
    for link in axle.links:
        if link.name != _ON_RACK:
            lines.append(_site(f"{corner}_{link.name}_inner", axle.points[link.inner], side, "  "))
    for part, mount in _mounts(axle):
        if part == "damper" and axle.top_mount and axle.top_mount.rod:
            continue  # On its rod.
        upper = axle.points["strut_top"] if axle.kind.strut else axle.points[f"{part}_inner"]
        lines.append(_site(f"{corner}_{part}_inner", upper, side, "  "))
        if mount.lever != 1.0 and mount.start_m is not None:
            lines.append(_site(f"{corner}_{part}_lever", mount.start_m, side, "  "))
    return lines


def _inertial(solid: Solid, side: float, indent: str) -> str:
    return (
        f'{indent}<inertial pos="{_at(solid.cg_m, side)}" mass="{num(solid.mass_kg)}" '
        f'diaginertia="{vec(solid.inertia_kgm2)}"/>'
    )


def _corner(car: CarDesign, axle: Axle, trimmed: TrimmedAxle, side: float) -> list[str]:
    corner = corner_name(axle, side)
    if axle.kind.strut:
        inner = _knuckle(axle, trimmed, side, "    ", _jounce(axle, corner, side))
        strut = axle.strut
        return [
            f'  <body name="{corner}_strut">',
            *_mount_slides(axle, side),
            f'    <joint name="{corner}_topmount" class="top_mount" pos="{_at(axle.points["strut_top"], side)}"/>',
            *([_inertial(strut, side, "    ")] if strut else []),
            *inner,
            "  </body>",
        ]
    centre = _at(axle.wheel_centre_m, side)
    rod = _damper_rod(axle, axle.top_mount.rod, side) if axle.top_mount and axle.top_mount.rod else []
    joints = [
        f'<joint name="{corner}_x" class="knuckle_slide" axis="1 0 0"/>',
        f'<joint name="{corner}_y" class="knuckle_slide" axis="0 1 0"/>',
        f'<joint name="{corner}_z" class="knuckle_slide" axis="0 0 1"/>',
    ]
    if axle.kind.guided:
        about = {"toe": "0 0 1", "camber": "1 0 0", "caster": "0 1 0"}
        joints += [
            f'<joint name="{corner}_{name}" type="hinge" axis="{axis}" pos="{centre}"/>' for name, axis in about.items()
        ]
    else:
        joints.append(f'<joint name="{corner}_rot" class="knuckle_ball" pos="{centre}"/>')
    carrier = _carrier(car, axle, trimmed, side) if axle.carrier else None
    return [*rod, *_knuckle(axle, trimmed, side, "  ", joints, carrier)]


def _mount_slides(axle: Axle, side: float) -> list[str]:
    directions = {} if axle.top_mount is None else axle.top_mount.directions
    return [
        f'    <joint name="{corner_name(axle, side)}_mount_{name}" class="top_mount_slide" axis="{_at(axis, side)}"/>'
        for name, axis in directions.items()
    ]


def _damper_rod(axle: Axle, rod: Solid, side: float) -> list[str]:
    corner = corner_name(axle, side)
    return [
        f'  <body name="{corner}_damper_rod">',
        *_mount_slides(axle, side),
        _inertial(rod, side, "    "),
        _site(f"{corner}_damper_inner", axle.points["damper_inner"], side, "    "),
        "  </body>",
    ]


def _jounce(axle: Axle, corner: str, side: float) -> list[str]:
    axis = axle.points["strut_top"] - axle.points["strut_bottom"]
    axis = axis / np.linalg.norm(axis)
    return [f'<joint name="{corner}_jounce" class="jounce" axis="{_at(axis, side)}"/>']


def _knuckle(
    axle: Axle, trimmed: TrimmedAxle, side: float, indent: str, joints: list[str], carrier: list[str] | None = None
) -> list[str]:
    corner, inside = corner_name(axle, side), indent + "  "
    lines = [f'{indent}<body name="{corner}_knuckle">']
    lines += [inside + joint for joint in joints]
    lines.append(_inertial(axle.knuckle, side, inside))
    lines += [_site(f"{corner}_{link.name}_outer", axle.points[link.outer], side, inside) for link in axle.links]
    for part, _ in _mounts(axle):
        lower = axle.points["strut_bottom"] if axle.kind.strut else axle.points[f"{part}_outer"]
        lines.append(_site(f"{corner}_{part}_outer", lower, side, inside))
    centre = axle.wheel_centre_m - np.array([0.0, 0.06, 0.0])
    for point in dict.fromkeys(link.outer for link in axle.links):
        if np.linalg.norm(axle.points[point] - centre) > 0.01:
            ends = f"{_at(axle.points[point], side)} {_at(centre, side)}"
            lines.append(f'{inside}<geom class="knuckle" fromto="{ends}"/>')
    if axle.kind.strut:
        ends = f"{_at(axle.points['strut_bottom'], side)} {_at(centre, side)}"
        lines.append(f'{inside}<geom class="knuckle" fromto="{ends}"/>')
    lines += carrier if carrier is not None else _wheel(axle, trimmed, side, inside)
    return [*lines, f"{indent}</body>"]


def _carrier(car: CarDesign, axle: Axle, trimmed: TrimmedAxle, side: float) -> list[str]:
    corner, indent, inside = corner_name(axle, side), "    ", "      "
    lower, upper = (_in_design(axle, point) for point in car.kingpin_m)
    axis = (upper - lower) / np.linalg.norm(upper - lower)
    middle = lower + axis * (axle.wheel_centre_m[2] - lower[2]) / axis[2]
    solid = axle.carrier
    return [
        f'{indent}<body name="{corner}_carrier">',
        f'{inside}<joint name="{corner}_steer" class="rear_steer" pos="{_at(middle, side)}" axis="{_at(axis, side)}"/>',
        *([_inertial(solid, side, inside)] if solid else []),
        f'{inside}<geom class="carrier" fromto="{_at(lower, side)} {_at(upper, side)}"/>',
        *_wheel(axle, trimmed, side, inside),
        f"{indent}</body>",
    ]


def _in_design(axle: Axle, point: Array) -> Array:
    """Return a point of the knuckle at zero joints. In the standing car curves turn it by the static angles."""
    if axle.measured is None:
        return point
    curves = axle.measured.curves
    camber, toe = (-float(np.interp(0.0, curves.travel_m, over)) for over in (curves.camber_rad, curves.toe_rad))
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(camber), -np.sin(camber)], [0.0, np.sin(camber), np.cos(camber)]])
    about_z = np.array([[np.cos(toe), -np.sin(toe), 0.0], [np.sin(toe), np.cos(toe), 0.0], [0.0, 0.0, 1.0]])
    return axle.wheel_centre_m + (about_z @ about_x).T @ (point - axle.wheel_centre_m)


def _wheel(axle: Axle, trimmed: TrimmedAxle, side: float, indent: str) -> list[str]:
    corner, inside = corner_name(axle, side), indent + "  "
    euler = vec((side * trimmed.wheel_x_rad, 0.0, side * trimmed.wheel_z_rad), 8)
    across, spin = num(axle.wheel_inertia_kgm2, 4), num(axle.wheel_spin_inertia_kgm2, 4)
    width = 0.5 * float(axle.tyre_parameters["WIDTH"])
    return [
        f'{indent}<body name="{corner}_wheel" pos="{_at(axle.wheel_centre_m, side)}" euler="{euler}">',
        f'{inside}<joint name="{corner}_spin" class="spin"/>',
        f'{inside}<inertial pos="0 0 0" mass="{num(axle.wheel_mass_kg)}" diaginertia="{across} {spin} {across}"/>',
        f'{inside}<site name="{corner}_wheel_centre"/>',
        f'{inside}<geom name="{corner}_tyre" class="tyre" size="{num(axle.radius_m)} {num(width)}"/>',
        f'{inside}<geom class="rim"/>',
        f'{inside}<geom class="spoke"/>',
        f'{inside}<geom class="valve"/>',
        f"{indent}</body>",
    ]


_VIEWER_GUIDES = (
    ("x", "5e5", "3e3"),
    ("y", "5e6", "1e4"),
    ("toe", "5e4", "200"),
    ("camber", "1e5", "500"),
    ("caster", "2e4", "200"),
)
"""Joint, stiffness and damping of a guide in the scene."""


def link_classes(car: CarDesign) -> str:
    """Return the default classes of the links, one per link and axle."""
    lines = []
    for axle in car.axles:
        for link in axle.links:
            stiffness = sig(link.stiffness_Npm)
            if link.hardening_Npm3:
                stiffness += f" 0 {sig(link.hardening_Npm3)}"
            colour = ' width="0.009" rgba="0.85 0.3 0.2 1"' if link.name in ("tie_rod", "toe_link") else ""
            lines += [
                f"      <!-- {axle.name}: {link.remark}. -->",
                f'      <default class="{_class_of(axle, link.name)}"><tendon stiffness="{stiffness}" '
                f'damping="{sig(link.damping_Nspm)}"{colour}/></default>',
            ]
    return "\n".join(lines) + "\n"


def _class_of(axle: Axle, link: str) -> str:
    """Return the class of a link. Front and rear may have links of the same name."""
    return f"{axle.name}_{link}"


def link_tendons(car: CarDesign) -> str:
    """Return the links of all corners."""
    lines = []
    for axle in car.axles:
        for side in (1.0, -1.0):
            corner = corner_name(axle, side)
            for link in axle.links:
                name = f"{corner}_{link.name}"
                lines.append(
                    f'    <spatial name="{name}" class="{_class_of(axle, link.name)}">'
                    f'<site site="{name}_inner"/><site site="{name}_outer"/></spatial>'
                )
    return "\n".join(lines)


def part_tendons(car: CarDesign, part: str) -> str:
    """Return the springs or dampers of all corners."""
    lines = []
    reported = set()
    for axle in car.axles:
        mount = axle.spring if part == "spring" else axle.damper
        if mount.lever == 1.0 or mount.start_m is None:
            continue
        divisor = 1.0 / mount.lever
        reported.add(axle.name)
        lines += [
            f"    <!-- {axle.name}: the {part} stands on {mount.carrier}, which has no body: the",
            f"         pulley ({num(divisor)}) is its lever, from *_{part}_lever on it has the {part}'s length.",
            f"         Both follow from *_{part}_inner and *_{part}_outer, which only draw it: docs/own_car.md. -->",
        ]
    for axle in car.axles:
        mount = axle.spring if part == "spring" else axle.damper
        for side in (1.0, -1.0):
            corner = corner_name(axle, side)
            start = f'    <{{}} name="{corner}_{part}" class="{axle.name}_{part}">'
            if mount.start_m is None:
                travel = "jounce" if axle.kind.strut else "z"
                coef = num(-mount.lever)
                lifted = rack_joint(axle, side * mount.lever)
                lines.append(
                    start.format("fixed") + f'<joint joint="{corner}_{travel}" coef="{coef}"/>{lifted}</fixed>'
                )
            elif mount.lever == 1.0:
                sites = f'<site site="{corner}_{part}_inner"/><site site="{corner}_{part}_outer"/>'
                lines.append(start.format("spatial") + f"{sites}</spatial>")
            else:
                link = next(link.name for link in axle.links if link.outer == mount.outer)
                sites = f'<site site="{corner}_{part}_lever"/><site site="{corner}_{link}_outer"/>'
                pulley = f'<pulley divisor="{num(1.0 / mount.lever)}"/>'
                lines.append(start.format("spatial") + f"{pulley}{sites}</spatial>")
    return "\n".join(lines)


def rack_joint(axle: Axle, lever: float) -> str:
    """Return the joint that lengthens a spring of a guided axle as the rack raises its wheel."""
    lift = 0.0 if axle.measured is None else axle.measured.rack_lift
    return f'<joint joint="rack" coef="{num(lever * lift)}"/>' if lift else ""


def viewer_springs(car: CarDesign) -> str:
    """Return springs for the scene, for springs without a shape of their own or on an arm."""
    lines = []
    for axle in car.axles:
        if axle.spring.start_m is None or axle.spring.lever != 1.0:
            if not lines:
                lines.append("    <!-- Springs without force, only drawn: the real tendons have no shape here. -->")
            for side in (1.0, -1.0):
                corner = corner_name(axle, side)
                lines.append(
                    f'    <spatial name="{corner}_viewer_spring" class="coil"><site site="{corner}_spring_inner"/>'
                    f'<site site="{corner}_spring_outer"/></spatial>'
                )
    return "\n".join([*lines, *_viewer_guides(car)]) + ("\n" if lines else "")


def _viewer_guides(car: CarDesign) -> list[str]:
    """Return straight, steered guides that hold the wheels of axles of curves without their native forces."""
    lines = []
    for axle in car.axles:
        if axle.measured is None:
            continue
        lines.append("    <!-- Replace the curves that guide the wheels. -->")
        for side in (1.0, -1.0):
            corner = corner_name(axle, side)
            for joint, stiffness, damping in _VIEWER_GUIDES:
                rack = ""
                if joint == "toe" and axle.name == "front":
                    rack = f'<joint joint="rack" coef="{num(-1.0 / rack_per_steer_m(axle))}"/>'
                lines.append(
                    f'    <fixed name="{corner}_viewer_{joint}" stiffness="{stiffness}" damping="{damping}" '
                    f'springlength="0"><joint joint="{corner}_{joint}" coef="1"/>{rack}</fixed>'
                )
    return lines


def spring_classes(car: CarDesign, trimmed: Trimmed) -> str:
    """Return the default classes of the springs."""
    lines = []
    for axle in car.axles:
        trim = trimmed.axle(axle.name)
        squeezed = trim.spring_force_N / trim.spring_rate_Npm
        length = axle.spring.length_m + squeezed
        hidden = ' group="3"' if axle.spring.start_m is not None and axle.spring.lever != 1.0 else ""
        lines.append(
            f'      <default class="{axle.name}_spring"><tendon stiffness="{sig(trim.spring_rate_Npm)}" '
            f'springlength="{num(length)}"{hidden}/></default>'
        )
    return "\n".join(lines) + "\n"


def mount_classes(car: CarDesign, trimmed: Trimmed) -> str:
    """Return the default classes of the top mounts."""
    lines = []
    for axle in car.axles:
        if (mount := axle.top_mount) is None:
            continue
        for name, stiffness in mount.stiffness_Npm.items():
            lines.append(
                f'      <default class="{axle.name}_mount_{name}"><tendon stiffness="{sig(stiffness)}" '
                f'damping="{sig(mount.damping_Nspm[name])}" '
                f'springlength="{num(trimmed.axle(axle.name).mount_m.get(name, 0.0))}"/></default>'
            )
    return "".join(f"{line}\n" for line in lines)


def mount_tendons(car: CarDesign) -> str:
    """Return the top mounts of all corners."""
    lines = []
    for axle in car.axles:
        for side in (1.0, -1.0):
            for name in () if axle.top_mount is None else axle.top_mount.directions:
                joint = f"{corner_name(axle, side)}_mount_{name}"
                start = f'    <fixed name="{joint}" class="{axle.name}_mount_{name}">'
                lines.append(f'{start}<joint joint="{joint}" coef="1"/></fixed>')
    return "".join(f"{line}\n" for line in lines)


def damper_classes(car: CarDesign, trimmed: Trimmed) -> str:
    """Return the default classes of the dampers."""
    lines = []
    for axle in car.axles:
        trim, length = trimmed.axle(axle.name), axle.damper.length_m
        ends = f"{num(length - trim.bump_stop_m)} {num(length + trim.rebound_stop_m)}"
        stiffness = " ".join(sig(value) for value in trim.stop_stiffness)
        hidden = ' group="3"' if axle.damper.start_m is not None and axle.damper.lever != 1.0 else ""
        lines.append(
            f'      <default class="{axle.name}_damper"><tendon springlength="{ends}" stiffness="{stiffness}"{hidden}/>'
            "</default>"
        )
    return "\n".join(lines) + "\n"
