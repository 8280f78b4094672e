"""Allocation of a required yaw moment and side force to both steer angles, within their limits and rates.

The state feedback of `lqr` wants the angles u_l without limits: a yaw moment M(u_l) and a side force F(u_l), by the
slopes of the axle curves at the current slip angles. The angles minimise

    ((M(u) - M(u_l)) / M_0)^2 + ((F(u) - F(u_l)) / F_0)^2 + |(u - u_l) / s|^2

within limits and within the angles that the actuators reach in a time ahead. While no limit is active, u = u_l. If an
actuator is at its limit or too slow, the other one keeps the moment rather than the side force: a car that lacks side
force slides outwards, a car that lacks the moment spins. One axle takes over from the other one with the lag of the
actuators, so that the noise of the feedback beyond a limit does not reach it.

The state feedback assumes straight axle curves. With a large sideslip angle these give a large moment that turns the
car back, and the feedback demands that the front wheels cancel it. But an axle that slides does not create this moment.
Therefore the moment that the feedback expects, with straight curves about the slip angles of the desired turn,

    M_l = l_V C_V (alpha_V - alpha_V* + F_V*/C_V) - l_H C_H (alpha_H - alpha_H* + F_H*/C_H)

is compared with the moment M of the curved axles. If the front force turns the car more than wanted, the front wheels
give up the fraction s = (M - M_l) / (l_V F_V) of their force, at most all of it. Their slip angle moves by the same
fraction towards the slip angle of the remaining force. Within the straight part of the curves M = M_l, and the angles
stay as they are.

No angle is larger than its actuator can remove in the time in which the car responds: an angle that remains after the
driver has steered back turns the car further in.

Source: T. A. Johansen and T. I. Fossen, Control allocation - A survey, Automatica 49 (2013).
"""

from __future__ import annotations

import math
from typing import Final

from activesteer.controllers.axle_slopes import AxleSlopes, axle_forces, excess, front_slip, slopes
from activesteer.controllers.parameters import ControllerSetup
from activesteer.core.signals import Estimate
from activesteer.native.records import NativeBlock
from activesteer.native.shared_laws import shared

_FRICTION: Final = Estimate._fields.index("friction")


class Allocation(NativeBlock):
    """Limits and weights of the angles."""

    _curves: AxleSlopes
    _front_Nprad: float
    _rear_Nprad: float
    _axle_kgm: float
    _to_front_m: float
    _to_rear_m: float
    _per_moment2: float
    _per_force2: float
    _front_stay: float
    _rear_stay: float
    _front_limit_rad: float
    _rear_limit_rad: float
    _front_reach_rad: float
    _rear_reach_rad: float
    _fraction: float
    _front_shift_rad: float
    _rear_shift_rad: float

    def __init__(self, setup: ControllerSetup) -> None:
        """Compute the constants."""
        p, servos, car = setup.gains.lqr, setup.gains.servos, setup.single_track
        self._curves = AxleSlopes(setup)
        self._front_Nprad, self._rear_Nprad = car.front_stiffness_Nprad, car.rear_stiffness_Nprad
        self._to_front_m, self._to_rear_m = car.cg_to_front_m, car.cg_to_rear_m
        # Mass on an axle times its distance from the CG, the same for both.
        self._axle_kgm = car.mass_kg * car.cg_to_front_m * car.cg_to_rear_m / car.wheelbase_m
        self._per_moment2, self._per_force2 = p.moment_scale_Nm**-2, p.force_scale_N**-2
        self._front_stay, self._rear_stay = p.superposition_scale_rad**-2, p.rear_scale_rad**-2
        front_radps, rear_radps = servos.superposition_rate_radps, servos.rear_rate_radps
        self._front_limit_rad = min(servos.superposition_limit_rad, p.removal_s * front_radps)
        self._rear_limit_rad = min(servos.rear_limit_rad, p.removal_s * rear_radps)
        self._front_reach_rad, self._rear_reach_rad = p.ahead_s * front_radps, p.ahead_s * rear_radps
        self._fraction = -math.expm1(-setup.timestep_s / servos.lag_s)
        self._front_shift_rad = self._rear_shift_rad = 0.0


@shared
def allocated(
    block: Allocation,
    now: Estimate,
    driver_rad: float,
    at_rad: tuple[float, float],
    demand_rad: tuple[float, float],
    range_rad: tuple[float, float],
    works: tuple[bool, bool],
    ay_mps2: float,
    authority: float,
) -> tuple[float, float]:
    """Allocate the demands of the feedback, faster than walking speed: superposition angle and rear angle [rad]."""
    front_slope, rear_slope = slopes(block._curves, now, driver_rad + at_rad[0], at_rad[1])
    front_N, rear_N = abs(front_slope) * block._front_Nprad, abs(rear_slope) * block._rear_Nprad
    front_Nm, rear_Nm = front_N * block._to_front_m, -rear_N * block._to_rear_m
    moment = front_Nm * demand_rad[0] + rear_Nm * demand_rad[1]
    force = front_N * demand_rad[0] + rear_N * demand_rad[1]
    limit = block._front_limit_rad
    allowed = max(range_rad[0], -limit), min(range_rad[1], limit)
    least_front, most_front = angle_range(at_rad[0], allowed, block._front_reach_rad, works[0])
    limit = block._rear_limit_rad
    least_rear, most_rear = angle_range(at_rad[1], (-limit, limit), block._rear_reach_rad, works[1])
    of_moment, of_force = block._per_moment2, block._per_force2
    h_front = of_moment * front_Nm * front_Nm + of_force * front_N * front_N + block._front_stay
    h_rear = of_moment * rear_Nm * rear_Nm + of_force * rear_N * rear_N + block._rear_stay
    h_both = of_moment * front_Nm * rear_Nm + of_force * front_N * rear_N
    g_front = of_moment * front_Nm * moment + of_force * front_N * force + block._front_stay * demand_rad[0]
    g_rear = of_moment * rear_Nm * moment + of_force * rear_N * force + block._rear_stay * demand_rad[1]
    det = h_front * h_rear - h_both * h_both
    front, rear = (h_rear * g_front - h_both * g_rear) / det, (h_front * g_rear - h_both * g_front) / det
    if not (least_front <= front <= most_front and least_rear <= rear <= most_rear):
        # The least is on an edge: one angle at a bound, the best other one.
        least = math.inf
        for edge in range(4):
            if edge < 2:
                a = least_front if edge == 0 else most_front
                b = min(max((g_rear - h_both * a) / h_rear, least_rear), most_rear)
            else:
                b = least_rear if edge == 2 else most_rear
                a = min(max((g_front - h_both * b) / h_front, least_front), most_front)
            cost = h_front * a * a + 2.0 * h_both * a * b + h_rear * b * b - 2.0 * (g_front * a + g_rear * b)
            if cost < least:
                least, front, rear = cost, a, b
    kept_front = min(max(demand_rad[0], least_front), most_front)
    kept_rear = min(max(demand_rad[1], least_rear), most_rear)
    block._front_shift_rad += block._fraction * (front - kept_front - block._front_shift_rad)
    block._rear_shift_rad += block._fraction * (rear - kept_rear - block._rear_shift_rad)
    front = min(max(kept_front + block._front_shift_rad, least_front), most_front)
    rear = min(max(kept_rear + block._rear_shift_rad, least_rear), most_rear)
    relieved = _relieved(block, now, driver_rad, demand_rad, (front, rear), ay_mps2)
    front = authority * relieved + (1.0 - authority) * front
    return min(max(front, least_front), most_front), rear


@shared
def moment_change(
    block: Allocation, now: Estimate, driver_rad: float, at_rad: tuple[float, float], angle_rad: tuple[float, float]
) -> float:
    """Return the change of the yaw moment from measured to allocated angles, from the axle curves [Nm]."""
    _, _, front_now, rear_now = axle_forces(block._curves, now, driver_rad + at_rad[0], at_rad[1])
    _, _, front_then, rear_then = axle_forces(block._curves, now, driver_rad + angle_rad[0], angle_rad[1])
    return block._axle_kgm * ((front_then - front_now) - (rear_then - rear_now))


@shared
def _relieved(
    block: Allocation,
    now: Estimate,
    driver_rad: float,
    demand_rad: tuple[float, float],
    angle_rad: tuple[float, float],
    ay_mps2: float,
) -> float:
    """Return the superposition angle, reduced where the front wheels turn the car further than wanted [rad]."""
    front_slip_rad, rear_slip_rad, front, rear = axle_forces(
        block._curves, now, driver_rad + angle_rad[0], angle_rad[1]
    )
    front_more, rear_more = excess(block._curves, ay_mps2, now[_FRICTION])
    wanted_front_N = block._front_Nprad * (front_slip_rad + demand_rad[0] - angle_rad[0] - front_more)
    wanted_rear_N = block._rear_Nprad * (rear_slip_rad + demand_rad[1] - angle_rad[1] - rear_more)
    wanted_Nm = block._to_front_m * wanted_front_N - block._to_rear_m * wanted_rear_N
    front_Nm = block._axle_kgm * front
    missing_Nm = wanted_Nm - block._axle_kgm * (front - rear)
    if missing_Nm * front_Nm >= 0.0:
        return angle_rad[0]
    share = min(-missing_Nm / front_Nm, 1.0)
    less_rad = front_slip(block._curves, (1.0 - share) * front, now[_FRICTION]) - front_slip_rad
    return angle_rad[0] + share * less_rad


@shared
def angle_range(place_rad: float, range_rad: tuple[float, float], reach_rad: float, works: bool) -> tuple[float, float]:
    """Return the smallest and the largest angle that limits, rate and faults allow [rad]."""
    if not works:
        return place_rad, place_rad
    least, most = range_rad
    low = max(least, place_rad - reach_rad)
    high = max(min(most, place_rad + reach_rad), low)
    return min(low, most), high
