"""Channels of the four wheels: tyre forces and slips, contact with the road, position against the chassis, brakes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import mujoco
import numpy as np

from activesteer.brakes.records import PER_WHEEL, PLACES
from activesteer.conventions import CORNERS, Array
from activesteer.signals import CORNERS_IN_WORDS
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.channels.native_channels import Column, Computed, Signal, Values, sensor, signal

_TYRE: Final = (
    ("fx_N", "tyre_fx_N", "N", "longitudinal tyre force at the contact point, ISO-W"),
    ("fy_N", "tyre_fy_N", "N", "lateral tyre force at the contact point, ISO-W, left positive"),
    ("fz_N", "tyre_fz_N", "N", "vertical tyre force"),
    ("mx_Nm", "tyre_mx_Nm", "Nm", "overturning moment"),
    ("my_Nm", "tyre_my_Nm", "Nm", "rolling resistance moment, negative rolling forward"),
    ("mz_Nm", "tyre_mz_Nm", "Nm", "aligning moment"),
    ("slip_ratio", "slip_ratio", "", "transient longitudinal slip, positive drives"),
    ("slip_angle_rad", "slip_angle_rad", "rad", "transient slip angle, positive gives negative force"),
    ("inclination_rad", "inclination_rad", "rad", "inclination of the wheel against the road about +x"),
    ("loaded_radius_m", "loaded_radius_m", "m", "distance between wheel centre and contact point"),
    ("limited", "tyre_limited", "", "1 if the tyre is outside its file's range of validity"),
    ("contact_x_m", "contact_x_m", "m", "contact point with the road, world x"),
    ("contact_y_m", "contact_y_m", "m", "contact point with the road, world y"),
    ("mu", "mu", "", "friction of the road at the contact point"),
    (
        "friction_utilisation", "friction_utilisation", "",
        "used fraction of the tyre's peak friction at its load",
    ),
)  # fmt: skip
"""Output of the native forces -> its channel: name, unit, meaning."""
_ROAD: Final = (
    ("road_z_m", "road_z_m", "m", "height of the plane that the tyre feels, below the wheel"),
    ("road_slope_x", "road_slope_x", "", "forward slope of that plane, positive uphill"),
    ("road_slope_y", "road_slope_y", "", "sideways slope of that plane, positive where the left side is higher"),
)
"""The same on an uneven road only."""
_BRAKES: Final = (
    ("demand_Pa", "brake_pressure_demand_Pa", "Pa", "brake pressure demand of driver and controller", "corners"),
    ("pressure_Pa", "brake_pressure_Pa", "Pa", "pressure in the wheel brake", "corners"),
    (
        "phase",
        "abs_phase",
        "",
        "anti-lock control: 0 off, 1 releases, 2 recovers, 3 builds up, 4 holds pressure",
        "corners",
    ),
    (
        "reference_mps",
        "abs_speed_mps",
        "m/s",
        "speed of the car, estimated by the control unit of the brakes",
        "vehicle",
    ),
    ("tcs_active", "tcs_active", "", "1 while traction control limits the drive", "vehicle"),
)
"""Field of `BRAKE_STATE` -> its channels: name, unit, meaning, group."""


def corner_signals(model: mujoco.MjModel) -> Iterator[Signal]:
    """Yield the signals of each wheel: its tyre, and its position relative to the chassis."""
    heights_m = design_heights_m(model)
    outputs = _TYRE if fb.header_of(model)["n_surfaces"][0] == 0.0 else (*_TYRE, *_ROAD)
    for index, (corner, words) in enumerate(CORNERS_IN_WORDS.items()):

        def of(
            name: str, unit: str, meaning: str, values: Values, *, corner: str = corner, words: str = words
        ) -> Signal:
            return signal("corners", f"{corner}_{name}", unit, f"{meaning}, {words}", values)

        for field, name, unit, meaning in outputs:
            yield of(name, unit, meaning, Column("userdata", fb.output_slot(index, field)))
        *_, height = sensor(model, f"{corner}_wheel_position")
        axis = sensor(model, f"{corner}_wheel_axis")
        (speed,) = sensor(model, f"{corner}_wheel_speed")
        damper = Column("userdata", len(CORNERS) * fb.USERDATA_PER_WHEEL + index)
        travel, steer, camber = _against_chassis(height, heights_m[index], axis)
        yield of("wheel_speed_radps", "rad/s", "rotational speed", speed)
        yield of("travel_m", "m", "wheel travel from the design position, bump positive", travel)
        yield of("steer_rad", "rad", "steer angle of the wheel against the chassis, left positive", steer)
        yield of("camber_rad", "rad", "inclination of the wheel against the chassis about +x", camber)
        yield of("damper_force_N", "N", "damper force, positive resists compression", damper)


def brake_signals() -> Iterator[Signal]:
    """Yield the pressures, and the signals of the control unit of the brakes."""
    for field, name, unit, meaning, group in _BRAKES:
        first = PLACES[field]
        if field in PER_WHEEL:
            for index, (corner, words) in enumerate(CORNERS_IN_WORDS.items()):
                yield signal(group, f"{corner}_{name}", unit, f"{meaning}, {words}", Column("brakes", first + index))
        else:
            yield signal(group, name, unit, meaning, Column("brakes", first))


def toe(forward: Array, left: Array) -> Array:
    """Return the steer angle of a wheel from two components of its spin axis in chassis axes [rad]."""
    return np.arctan2(-forward, left)


def _against_chassis(height: Column, design_m: float, axis: tuple[Column, ...]) -> tuple[Values, Values, Values]:
    """Return travel, steer angle and camber from the sensors of a wheel's height and spin axis."""
    return (
        Computed(lambda height_m: height_m - design_m, (height,)),
        Computed(toe, axis[:2]),
        Computed(np.arcsin, axis[2:]),
    )


def design_heights_m(model: mujoco.MjModel) -> list[float]:
    """Return the heights of the wheel centres in vehicle axes in the design position, order of `CORNERS` [m]."""
    at_rest = mujoco.MjData(model)
    mujoco.mj_kinematics(model, at_rest)
    chassis = model.body("chassis").id
    axes, place = at_rest.xmat[chassis].reshape(3, 3), at_rest.xpos[chassis]
    wheels = (at_rest.xpos[model.body(f"{corner}_wheel").id] for corner in CORNERS)
    return [float((axes.T @ (wheel - place))[2]) for wheel in wheels]
