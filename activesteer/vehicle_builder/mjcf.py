"""All MJCF files of a car, as texts by file name."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from string import Template

import numpy as np

from activesteer.core.conventions import Array
from activesteer.vehicle_builder.axle_kinds import Mount
from activesteer.vehicle_builder.completion import rack_per_steer_m
from activesteer.vehicle_builder.design import Axle, CarDesign, Solid
from activesteer.vehicle_builder.texts import num, sig, vec
from activesteer.vehicle_builder.trim import Trimmed, TrimmedAxle

_TEMPLATES = Path(__file__).resolve().parent / "templates"
_NO_KEYFRAMES = "<mujocoinclude>\n  <keyframe/>\n</mujocoinclude>\n"
_SHELL = (
    # class, centre and half sizes of the compact's outline, for a wheelbase of 2.637 m and a width of 1.80 m
    ("body_shell", (0.22, 0.0, 0.45), (0.6, 0.6, 0.19)),
    ("body_shell", (-1.32, 0.0, 0.43), (0.94, 0.86, 0.21)),
    ("body_shell", (-2.82, 0.0, 0.45), (0.56, 0.58, 0.19)),
    ("body_shell", (0.2, 0.0, 0.72), (0.58, 0.82, 0.08)),
    ("body_shell", (-1.32, 0.0, 0.76), (0.94, 0.86, 0.12)),
    ("body_shell", (-2.8, 0.0, 0.78), (0.54, 0.83, 0.14)),
    ("glass", (-1.75, 0.0, 0.9), (1.4, 0.7, 0.55)),
)


def mjcf_files(car: CarDesign, trimmed: Trimmed) -> dict[str, str]:
    """Return the files of the model as name to text. The keyframe is empty."""
    return {
        f"{car.name}.xml": _main(car, trimmed),
        "front_axle.xml": axle_file(car, car.front, trimmed),
        "rear_axle.xml": axle_file(car, car.rear, trimmed),
        "steering.xml": _steering(car),
        "scene.xml": _fill("scene.xml", name=car.name, middle=num(-0.42 * car.wheelbase_m, 2),
                           viewer_springs=viewer_springs(car)),
        "keyframes.xml": _NO_KEYFRAMES,
    }  # fmt: skip


def _fill(file: str, **values: str) -> str:
    return Template((_TEMPLATES / file).read_text(encoding="utf-8")).substitute(values)


def _main(car: CarDesign, trimmed: Trimmed) -> str:
    front = car.front
    half_width = 0.5 * float(front.tyre_parameters["WIDTH"])
    rim = 0.65 * front.radius_m
    mass = car.rack_mass_kg + 40.0
    return _fill(
        "car.xml",
        name=car.name,
        table=car.table.source or "a table",
        front_words=front.kind.name.replace("_", " "),
        rear_words=car.rear.kind.name.replace("_", " "),
        middle=num(-0.5 * car.wheelbase_m, 2),
        radius=num(front.radius_m),
        half_width=num(half_width),
        rim_radius=num(rim, 3),
        rim_half_width=num(half_width + 0.0015, 4),
        spoke_radius=num(rim - 0.01, 3),
        spoke_half_width=num(half_width + 0.003, 4),
        valve_radius=num(0.775 * front.radius_m, 3),
        valve_half_width=num(half_width + 0.002, 4),
        rear_limit=num(car.rear_limit_rad, 10),
        rear_stiffness=sig(car.rear_stiffness_Nmprad),
        rear_damping=sig(350.0 * math.sqrt(car.rear_stiffness_Nmprad / 1e5), 4),
        rack_words=f"tie rods {'behind' if car.rack_sign < 0.0 else 'ahead of'} the steering axis",
        rack_sign=num(car.rack_sign),
        rack_limit=num(car.rack_limit_m),
        link_classes=link_classes(car),
        spring_classes=spring_classes(car, trimmed),
        mount_classes=mount_classes(car, trimmed),
        damper_classes=damper_classes(car, trimmed),
        chassis_words=(
            "What is left of the whole car's mass and inertia when all other bodies are taken away."
            if car.table.mass.total_kg is not None
            else "The chassis as the table gives it."
        ),
        chassis_cg=vec(trimmed.chassis.cg_m),
        chassis_mass=num(trimmed.chassis.mass_kg, 3),
        chassis_inertia=vec(trimmed.chassis.inertia_kgm2, 2),
        front_height=num(front.wheel_centre_m[2]),
        cg=vec((trimmed.cg_m[0], 0.0, trimmed.cg_m[1]), 4),
        shell=_shell(car),
        link_tendons=link_tendons(car),
        mount_tendons=mount_tendons(car),
        spring_tendons=part_tendons(car, "spring"),
        damper_tendons=part_tendons(car, "damper"),
        front_bar=sig(front.anti_roll_bar_Npm),
        rear_bar=sig(car.rear.anti_roll_bar_Npm),
        front_travel="jounce" if front.kind.strut else "z",
        # On the strut tube: its force does not go through the top mount.
        front_bar_on_mounts=(
            '<joint joint="fl_mount_z" coef="1"/><joint joint="fr_mount_z" coef="-1"/>' if front.kind.strut else ""
        ),
        front_bar_on_rack=rack_joint(front, -2.0),
        pinion=num(trimmed.pinion_radius_m, 7),
        column_stiffness=sig(car.column_stiffness_Npm),
        column_damping=sig(round(1.2 * math.sqrt(car.column_stiffness_Npm * mass), -2)),
        wheel_limit=num(0.993 * car.rack_limit_m / trimmed.pinion_radius_m, 3),
        superposition_limit=num(math.radians(3.0) * trimmed.ratio, 3),
    )


def _shell(car: CarDesign) -> str:
    scale = np.array([car.wheelbase_m / 2.637, car.width_m / 1.8, 1.0])
    lines = [
        f'      <geom class="{kind}" pos="{vec(scale * np.array(at), 3)}" size="{vec(scale * np.array(size), 3)}"/>'
        for kind, at, size in _SHELL
    ]
    return "\n".join(lines) + "\n"


def _steering(car: CarDesign) -> str:
    left = car.front.points["tie_rod_inner"]
    right = left * np.array([1.0, -1.0, 1.0])
    bar = car.rack_mass_kg * left[1] ** 2 / 5.0
    return _fill(
        "steering.xml",
        rack_pos=vec((left[0], 0.0, left[2])),
        rack_mass=num(car.rack_mass_kg),
        rack_inertia=vec((bar, 0.002, bar), 4),
        left=vec(left),
        right=vec(right),
    )


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
        axis = axle.points["strut_top"] - axle.points["strut_bottom"]
        axis = _at(axis / np.linalg.norm(axis), side)
        jounce = f'<joint name="{corner}_jounce" class="jounce" axis="{axis}"/>'
        strut = axle.strut
        return [
            f'  <body name="{corner}_strut">',
            *_mount_slides(axle, side),
            f'    <joint name="{corner}_topmount" class="top_mount" pos="{_at(axle.points["strut_top"], side)}"/>',
            *([_inertial(strut, side, "    ")] if strut else []),
            *_knuckle(axle, trimmed, side, "    ", [jounce]),
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


def _corners(car: CarDesign) -> Iterator[tuple[Axle, float, str]]:
    """Yield axle, side and name of each corner."""
    for axle in car.axles:
        for side in (1.0, -1.0):
            yield axle, side, corner_name(axle, side)


def _class(axle: Axle, part: str, tendon: str) -> str:
    """Return the default class of a tendon. Front and rear may have links of the same name."""
    return f'      <default class="{axle.name}_{part}"><tendon {tendon}/></default>\n'


def _sites(tendon: str, name: str, ends: str = "") -> str:
    """Return a tendon between the sites of a part of a corner."""
    ends = ends or name
    return (
        f'    <spatial name="{name}" class="{tendon}"><site site="{ends}_inner"/><site site="{ends}_outer"/></spatial>'
    )


def link_classes(car: CarDesign) -> str:
    """Return the default classes of the links, one per link and axle."""
    text = ""
    for axle in car.axles:
        for link in axle.links:
            stiffness = sig(link.stiffness_Npm)
            if link.hardening_Npm3:
                stiffness += f" 0 {sig(link.hardening_Npm3)}"
            colour = ' width="0.009" rgba="0.85 0.3 0.2 1"' if link.name in ("tie_rod", "toe_link") else ""
            tendon = f'stiffness="{stiffness}" damping="{sig(link.damping_Nspm)}"{colour}'
            text += f"      <!-- {axle.name}: {link.reason}. -->\n" + _class(axle, link.name, tendon)
    return text or "\n"


def link_tendons(car: CarDesign) -> str:
    """Return the links of all corners."""
    return "\n".join(
        _sites(f"{axle.name}_{link.name}", f"{corner}_{link.name}")
        for axle, _, corner in _corners(car)
        for link in axle.links
    )


def part_tendons(car: CarDesign, part: str) -> str:
    """Return the springs or dampers of all corners."""
    mounts = {axle.name: dict(_mounts(axle))[part] for axle in car.axles}
    lines = []
    for name, mount in mounts.items():
        if mount.on_arm:
            divisor = num(1.0 / mount.lever)
            lines += [
                f"    <!-- {name}: the {part} stands on {mount.carrier}, which has no body: the",
                f"         pulley ({divisor}) is its lever, from *_{part}_lever on it has the {part}'s length.",
                f"         Both follow from *_{part}_inner and *_{part}_outer, which only draw it: docs/own_car.md. "
                "-->",
            ]
    for axle, side, corner in _corners(car):
        mount, name, tendon = mounts[axle.name], f"{corner}_{part}", f"{axle.name}_{part}"
        if mount.start_m is None:
            travel = "jounce" if axle.kind.strut else "z"
            lifted = rack_joint(axle, side * mount.lever)
            joint = f'<joint joint="{corner}_{travel}" coef="{num(-mount.lever)}"/>'
            lines.append(f'    <fixed name="{name}" class="{tendon}">{joint}{lifted}</fixed>')
        elif mount.lever == 1.0:
            lines.append(_sites(tendon, name))
        else:
            link = next(link.name for link in axle.links if link.outer == mount.outer)
            sites = f'<site site="{name}_lever"/><site site="{corner}_{link}_outer"/>'
            pulley = f'<pulley divisor="{num(1.0 / mount.lever)}"/>'
            lines.append(f'    <spatial name="{name}" class="{tendon}">{pulley}{sites}</spatial>')
    return "\n".join(lines)


def rack_joint(axle: Axle, lever: float) -> str:
    """Return the joint that lengthens a spring of a guided axle as the rack raises its wheel."""
    lift = 0.0 if axle.measured is None else axle.measured.rack_lift
    return f'<joint joint="rack" coef="{num(lever * lift)}"/>' if lift else ""


def viewer_springs(car: CarDesign) -> str:
    """Return springs for the scene, for springs without a shape of their own or on an arm."""
    springs = [
        _sites("coil", f"{corner}_viewer_spring", f"{corner}_spring")
        for axle, _, corner in _corners(car)
        if axle.spring.start_m is None or axle.spring.on_arm
    ]
    if springs:
        springs.insert(0, "    <!-- Springs without force, only drawn: the real tendons have no shape here. -->")
    return "\n".join([*springs, *_viewer_guides(car)]) + ("\n" if springs else "")


def _viewer_guides(car: CarDesign) -> Iterator[str]:
    """Yield straight, steered guides that hold the wheels of axles of curves without their native forces."""
    for axle, side, corner in _corners(car):
        if axle.measured is None:
            continue
        if side > 0.0:
            yield "    <!-- Replace the curves that guide the wheels. -->"
        for joint, stiffness, damping in _VIEWER_GUIDES:
            rack = ""
            if joint == "toe" and axle.name == "front":
                rack = f'<joint joint="rack" coef="{num(-1.0 / rack_per_steer_m(axle))}"/>'
            yield (
                f'    <fixed name="{corner}_viewer_{joint}" stiffness="{stiffness}" damping="{damping}" '
                f'springlength="0"><joint joint="{corner}_{joint}" coef="1"/>{rack}</fixed>'
            )


def spring_classes(car: CarDesign, trimmed: Trimmed) -> str:
    """Return the default classes of the springs."""
    text = ""
    for axle in car.axles:
        trim = trimmed.axle(axle.name)
        length = num(axle.spring.length_m + trim.spring_force_N / trim.spring_rate_Npm)
        hidden = ' group="3"' if axle.spring.on_arm else ""
        text += _class(axle, "spring", f'stiffness="{sig(trim.spring_rate_Npm)}" springlength="{length}"{hidden}')
    return text


def mount_classes(car: CarDesign, trimmed: Trimmed) -> str:
    """Return the default classes of the top mounts."""
    text = ""
    for axle in car.axles:
        if (mount := axle.top_mount) is None:
            continue
        for name, stiffness in mount.stiffness_Npm.items():
            damping = sig(mount.damping_Nspm[name])
            length = num(trimmed.axle(axle.name).mount_m.get(name, 0.0))
            tendon = f'stiffness="{sig(stiffness)}" damping="{damping}" springlength="{length}"'
            text += _class(axle, f"mount_{name}", tendon)
    return text


def mount_tendons(car: CarDesign) -> str:
    """Return the top mounts of all corners."""
    return "".join(
        f'    <fixed name="{corner}_mount_{name}" class="{axle.name}_mount_{name}">'
        f'<joint joint="{corner}_mount_{name}" coef="1"/></fixed>\n'
        for axle, _, corner in _corners(car)
        for name in (() if axle.top_mount is None else axle.top_mount.directions)
    )


def damper_classes(car: CarDesign, trimmed: Trimmed) -> str:
    """Return the default classes of the dampers."""
    text = ""
    for axle in car.axles:
        trim, length = trimmed.axle(axle.name), axle.damper.length_m
        ends = f"{num(length - trim.bump_stop_m)} {num(length + trim.rebound_stop_m)}"
        stiffness = " ".join(sig(value) for value in trim.stop_stiffness)
        hidden = ' group="3"' if axle.damper.on_arm else ""
        text += _class(axle, "damper", f'springlength="{ends}" stiffness="{stiffness}"{hidden}')
    return text
