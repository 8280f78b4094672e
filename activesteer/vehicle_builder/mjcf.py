"""All MJCF files of a car, as texts by file name, from jinja2 templates."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from activesteer.core.conventions import Array
from activesteer.vehicle_builder.completion import rack_per_steer_m
from activesteer.vehicle_builder.design import Axle, CarDesign
from activesteer.vehicle_builder.texts import filled, num, vec
from activesteer.vehicle_builder.trim import Trimmed

_NO_KEYFRAMES = "<mujocoinclude>\n  <keyframe/>\n</mujocoinclude>\n"
_SHELL: Final = (
    # class, centre and half sizes of the compact's outline, for a wheelbase of 2.637 m and a width of 1.80 m
    ("body_shell", (0.22, 0.0, 0.45), (0.6, 0.6, 0.19)),
    ("body_shell", (-1.32, 0.0, 0.43), (0.94, 0.86, 0.21)),
    ("body_shell", (-2.82, 0.0, 0.45), (0.56, 0.58, 0.19)),
    ("body_shell", (0.2, 0.0, 0.72), (0.58, 0.82, 0.08)),
    ("body_shell", (-1.32, 0.0, 0.76), (0.94, 0.86, 0.12)),
    ("body_shell", (-2.8, 0.0, 0.78), (0.54, 0.83, 0.14)),
    ("glass", (-1.75, 0.0, 0.9), (1.4, 0.7, 0.55)),
)


_GUIDES: Final = (
    ("x", "5e5", "3e3"),
    ("y", "5e6", "1e4"),
    ("toe", "5e4", "200"),
    ("camber", "1e5", "500"),
    ("caster", "2e4", "200"),
)
"""Joint, stiffness and damping of a straight, steered guide in the scene, which has no native forces of curves."""


class _Corner(NamedTuple):
    name: str
    axle: Axle
    side: float  # 1 on the left, -1 on the right

    def at(self, point: Array) -> str:
        """Return a point of the left side on this side."""
        return vec((point[0], self.side * point[1], point[2]))


def mjcf_files(car: CarDesign, trimmed: Trimmed) -> dict[str, str]:
    """Return the files of the model as name to text. The keyframe is empty."""
    front, corners = car.front, _corners(*car.axles)
    half_width_m = 0.5 * float(front.tyre_parameters["WIDTH"])
    scale = np.array([car.wheelbase_m / 2.637, car.width_m / 1.8, 1.0])
    shell = [(kind, scale * np.array(at), scale * np.array(size)) for kind, at, size in _SHELL]
    main = {"car": car, "front": front, "corners": corners, "trimmed": trimmed, "half_width_m": half_width_m}
    left_m = front.points["tie_rod_inner"]
    steering = {"left_m": left_m, "right_m": left_m * np.array([1.0, -1.0, 1.0])}
    # Springs without a shape of their own, or on an arm.
    viewed = [one for one in corners if one.axle.spring.start_m is None or one.axle.spring.on_arm]
    scene = {"corners": corners, "viewed": viewed, "guides": _GUIDES, "rack_per_steer": rack_per_steer_m(front)}
    return {
        f"{car.name}.xml": filled("car.xml", **main, shell=shell, rack_joint=_rack_joint),
        "front_axle.xml": _axle_file(car, front, trimmed),
        "rear_axle.xml": _axle_file(car, car.rear, trimmed),
        "steering.xml": filled("steering.xml", car=car, **steering, bar_kgm2=car.rack_mass_kg * left_m[1] ** 2 / 5.0),
        "scene.xml": filled("scene.xml", car=car, **scene),
        "keyframes.xml": _NO_KEYFRAMES,
    }


def _corners(*axles: Axle) -> list[_Corner]:
    return [_Corner(f"{axle.name[0]}{end}", axle, side) for axle in axles for end, side in (("l", 1.0), ("r", -1.0))]


def _rack_joint(axle: Axle, lever: float) -> str:
    """Return the joint that lengthens a spring of a guided axle as the rack raises its wheel."""
    lift = 0.0 if axle.measured is None else axle.measured.rack_lift
    return f'<joint joint="rack" coef="{num(lever * lift)}"/>' if lift else ""


def _axle_file(car: CarDesign, axle: Axle, trimmed: Trimmed) -> str:
    """Return the text of front_axle.xml or rear_axle.xml."""
    middle = axle.wheel_centre_m - np.array([0.0, 0.06, 0.0])
    drawn = [axle.points[point] for point in dict.fromkeys(link.outer for link in axle.links)]
    drawn = [point for point in drawn if np.linalg.norm(point - middle) > 0.01]
    lower, upper = (_in_design(axle, point) for point in car.kingpin_m)
    axis = (upper - lower) / np.linalg.norm(upper - lower)
    return filled(
        "axle.xml",
        axle=axle,
        words=axle.kind.name.replace("_", " ").capitalize(),
        trim=trimmed.axle(axle.name),
        corners=_corners(axle),
        directions={} if axle.top_mount is None else axle.top_mount.directions,
        rod=None if axle.top_mount is None else axle.top_mount.rod,
        half_width_m=0.5 * float(axle.tyre_parameters["WIDTH"]),
        middle_m=middle,
        drawn=[*drawn, *([axle.points["strut_bottom"]] if axle.kind.strut else [])],
        kingpin={
            "lower": lower, "upper": upper, "axis": axis,
            "middle": lower + axis * (axle.wheel_centre_m[2] - lower[2]) / axis[2],
        },
    )  # fmt: skip


def _in_design(axle: Axle, point: Array) -> Array:
    """Return a point of the knuckle at zero joints. In the standing car curves turn it by the static angles."""
    if axle.measured is None:
        return point
    curves = axle.measured.curves
    camber, toe = (-float(np.interp(0.0, curves.travel_m, over)) for over in (curves.camber_rad, curves.toe_rad))
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(camber), -np.sin(camber)], [0.0, np.sin(camber), np.cos(camber)]])
    about_z = np.array([[np.cos(toe), -np.sin(toe), 0.0], [np.sin(toe), np.cos(toe), 0.0], [0.0, 0.0, 1.0]])
    return axle.wheel_centre_m + (about_z @ about_x).T @ (point - axle.wheel_centre_m)
