"""The plane that a tyre feels, against the two-cam model computed independently, and a wheel on a wave."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from activesteer.road.obstacles import Obstacle
from activesteer.road.road import Road
from activesteer.road.surface import Surface, surface_of
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.kernels.contact import WheelForces, tyre_on_road
from activesteer.tyre.kernels.vertical import effective_rolling_radius
from activesteer.vehicle.native_contact import cam_record, contact_plane, plane_axes, spin_on_bend
from tests.unit.tyre.tyres import tyre

PRESSURE_PA = 230e3
PARAMETERS = tyre()
CAM = cam_record(PARAMETERS, PRESSURE_PA)[0]
RADIUS_M = PARAMETERS["UNLOADED_RADIUS"]


def surface(contact: Any, *obstacles: Obstacle) -> Surface:
    return surface_of(Road(obstacle=obstacles, contact=contact))


def plane(road: Surface, s: float, d: float = 0.0, heading: float = 0.0) -> tuple[float, float, float, float]:
    cos, sin = math.cos(heading), math.sin(heading)
    return contact_plane(road.head[0], road.numbers, road.obstacles, CAM, s, d, 1.0, 0.0, 1.0, cos, sin, RADIUS_M)


def test_over_a_cleat_height_and_slope_are_those_of_two_ellipses_rolled_over_it() -> None:
    start, length, height, edge = 10.0, 0.05, 0.02, 0.001
    road = surface("enveloping", Obstacle("cleat", start, length, height, edge_m=edge))
    a, b, c = (PARAMETERS[f"ELLIPS_{name}"] for name in ("LENGTH", "HEIGHT", "ORDER"))
    a, b = a * RADIUS_M, b * RADIUS_M
    profile = start + np.linspace(-0.5, 0.6, 55_001)
    z = height * np.clip(np.minimum(profile - start, start + length - profile) / edge, 0.0, 1.0)

    def lowest(middle: float) -> float:
        """Height of the lowest point of an ellipse that rests on the profile."""
        x = profile - middle
        near = np.abs(x) < a
        return float((z[near] - b * (1.0 - (1.0 - (np.abs(x[near]) / a) ** c) ** (1.0 / c))).max())

    half = 0.5 * CAM.distance_m
    for middle in np.linspace(start - 0.25, start + length + 0.25, 31):
        front, rear = lowest(middle + half), lowest(middle - half)
        found, slope, sideways, _ = plane(road, float(middle))
        assert found == pytest.approx(0.5 * (front + rear), abs=2e-4)
        assert slope == pytest.approx((front - rear) / CAM.distance_m, abs=4e-3)
        assert sideways == 0.0
    # Longer than the cleat and lower: the contact begins some 0.1 m before it and its two bumps stay below its height.
    assert plane(road, start - 0.12)[0] > 1e-4
    assert max(plane(road, float(s))[0] for s in np.linspace(9.7, 10.3, 60)) < 0.9 * height


def test_the_bend_adds_up_to_the_change_of_the_slope() -> None:
    road = surface("enveloping", Obstacle("cosine_bump", 10.0, 0.8, 0.03))
    s = np.linspace(9.6, 10.4, 401)
    found = np.array([plane(road, float(at))[1:4:2] for at in s])
    # At the top the slope is 0; on the way it reaches 0.1.
    for first, last in ((0, 200), (200, 400), (0, 400)):
        added = np.trapezoid(found[first : last + 1, 1], s[first : last + 1])
        assert added == pytest.approx(found[last, 0] - found[first, 0], abs=0.01)
    assert np.abs(found[:, 0]).max() > 0.05


@pytest.mark.parametrize("contact", ["single_point", "four_point", "enveloping"])
def test_slopes_follow_the_heading_of_the_wheel(contact: str) -> None:
    road = surface(contact, Obstacle("cross_slope_ramp", 5.0, 1.0, slope=0.1))
    assert plane(road, 20.0, 2.0)[:3] == pytest.approx((0.2, 0.0, 0.1), abs=2e-4)
    assert plane(road, 20.0, 2.0, math.pi / 2)[1:3] == pytest.approx((0.1, 0.0), abs=2e-3)
    assert plane(road, 20.0, 2.0, -math.pi / 2)[1:3] == pytest.approx((-0.1, 0.0), abs=2e-3)


def test_the_axes_of_a_plane_are_orthonormal_and_right_handed() -> None:
    n, a, b = np.array(plane_axes(0.2, -0.1, math.cos(0.7), math.sin(0.7))).reshape(3, 3)
    assert np.stack([a, b, n]) @ np.stack([a, b, n]).T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.cross(a, b) == pytest.approx(n)
    # Uphill along the heading, the normal leans back; with the right side higher it leans to the left.
    ahead, left = np.array((math.cos(0.7), math.sin(0.7), 0.0)), np.array((-math.sin(0.7), math.cos(0.7), 0.0))
    assert -n @ ahead / n[2] == pytest.approx(0.2)
    assert -n @ left / n[2] == pytest.approx(-0.1)


def test_over_a_round_crest_a_wheel_rolls_freely_where_its_tread_does_not_slip() -> None:
    # Crest of radius R: the centre moves at (R + l) w, the tread at R w = r (spin - w) on the road.
    radius_m, loaded_m, turn = 5.0, 0.29, 3.0
    p = PARAMETERS.record
    rolling = effective_rolling_radius(p, p.FNOMIN, 40.0, PRESSURE_PA)
    spin = turn * (radius_m + rolling) / rolling
    rolling = effective_rolling_radius(p, p.FNOMIN, spin, PRESSURE_PA)
    spin = turn * (radius_m + rolling) / rolling
    speed = turn * (radius_m + loaded_m)
    felt = spin_on_bend(p, spin, speed, -1.0 / (radius_m + loaded_m), loaded_m, PRESSURE_PA)
    assert felt * rolling == pytest.approx(speed, rel=1e-5)


def test_a_quarter_car_on_a_sine_follows_its_transfer_function() -> None:
    """Body 350 kg, 30 kN/m, 2000 N s/m; wheel 40 kg on the tyre's own stiffness, at 20 m/s over waves of 3 mm."""
    body, wheel, spring, damper, speed = 350.0, 40.0, 30e3, 2000.0, 20.0
    load = 9.81 * (body + wheel)
    formula = MagicFormula(PARAMETERS)
    standing = float(formula.evaluate(load, 0.0, 0.0, vx_mps=speed, pressure_Pa=PRESSURE_PA).loaded_radius_m)
    step, p = 5e-4, PARAMETERS.record

    def tyre_N(centre: float, down: float, height: float, slope: float) -> float:
        n, a, _ = np.array(plane_axes(slope, 0.0, 1.0, 0.0)).reshape(3, 3)
        velocity = np.array((speed, 0.0, -down))
        inputs = (p, 1.0, PRESSURE_PA, 2.0, 1500.0, step, (centre - height) * n[2], 0.0, 1.0, 0.0)
        found = WheelForces(
            *tyre_on_road(*inputs, velocity @ a, 0.0, velocity @ n, 0.0, speed / standing, 0.0, 0.0, 0.0, 0.0)
        )
        return found.fz_N * n[2]

    stiffness = (tyre_N(standing - 1e-4, 0.0, 0.0, 0.0) - tyre_N(standing + 1e-4, 0.0, 0.0, 0.0)) / 2e-4
    balance = tyre_N(standing, 0.0, 0.0, 0.0) - load
    for frequency in (1.5, 8.0):
        wave = Obstacle("sine_wave", 5.0, speed / frequency, 0.003)
        road = surface("single_point", wave)
        zb = vb = zw = vw = 0.0
        travelled, times = [], np.arange(0.0, 1.0 + 4.0 / frequency, step)
        for time in times:
            z, slope, _, _ = plane(road, speed * time)
            push = tyre_N(standing + zw, -vw, z, slope) - load - balance
            strut = spring * (zw - zb) + damper * (vw - vb)
            vb += step * strut / body
            vw += step * (push - strut) / wheel
            zb += step * vb
            zw += step * vw
            travelled.append(zb)
        w = 2j * math.pi * frequency
        strut = spring + w * damper
        matrix = np.array([[body * w**2 + strut, -strut], [-strut, wheel * w**2 + strut + stiffness]])
        expected = np.linalg.solve(matrix, [0.0, stiffness])[0]
        end = times > times[-1] - 2.0 / frequency
        carrier = np.exp(-w * (times[end] - 5.0 / speed))
        measured = 2.0 * np.mean(np.array(travelled)[end] * carrier) / (0.003 * -1j)
        assert abs(measured) == pytest.approx(abs(expected), rel=0.04)
