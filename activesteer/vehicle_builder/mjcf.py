"""All MJCF files of a car, as texts by file name."""

from __future__ import annotations

import math
from pathlib import Path
from string import Template

import numpy as np

from activesteer.vehicle_builder import mjcf_axles as tendons
from activesteer.vehicle_builder.design import CarDesign
from activesteer.vehicle_builder.mjcf_axles import axle_file
from activesteer.vehicle_builder.texts import num, sig, vec
from activesteer.vehicle_builder.trim import Trimmed

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
                           viewer_springs=tendons.viewer_springs(car)),
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
        link_classes=tendons.link_classes(car),
        spring_classes=tendons.spring_classes(car, trimmed),
        mount_classes=tendons.mount_classes(car, trimmed),
        damper_classes=tendons.damper_classes(car, trimmed),
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
        link_tendons=tendons.link_tendons(car),
        mount_tendons=tendons.mount_tendons(car),
        spring_tendons=tendons.part_tendons(car, "spring"),
        damper_tendons=tendons.part_tendons(car, "damper"),
        front_bar=sig(front.anti_roll_bar_Npm),
        rear_bar=sig(car.rear.anti_roll_bar_Npm),
        front_travel="jounce" if front.kind.strut else "z",
        # On the strut tube: its force does not go through the top mount.
        front_bar_on_mounts=(
            '<joint joint="fl_mount_z" coef="1"/><joint joint="fr_mount_z" coef="-1"/>' if front.kind.strut else ""
        ),
        front_bar_on_rack=tendons.rack_joint(front, -2.0),
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
