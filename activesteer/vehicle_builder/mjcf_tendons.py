"""The tendons of all axles and their classes: links, springs, dampers, and drawn parts."""

from __future__ import annotations

from activesteer.vehicle_builder.design import Axle, CarDesign
from activesteer.vehicle_builder.mjcf_axles import corner_name
from activesteer.vehicle_builder.steering_geometry import rack_per_steer_m
from activesteer.vehicle_builder.texts import num, sig
from activesteer.vehicle_builder.trim import Trimmed

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
    """Return the class of a link; front and rear may have links of the same name."""
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
