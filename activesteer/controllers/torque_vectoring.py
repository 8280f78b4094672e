"""Torque vectoring: a yaw moment from the difference of the drive torques of an axle's wheels.

Desired yaw rate and estimator are the same as in `esc`. The moment removes the errors in given times:

    M_z = J_z (r* - r) / T_r + J_z / T_b^2 (sideslip beyond its limit)

A difference q, right torque minus left torque, creates the moment q t / (2 R), with track t and rolling radius R. More
torque on the right turns the car to the left. Each axle whose torques can differ gets the same fraction of its largest
difference. The driver's torque stays: half of q is added on the right and taken from the left. If one wheel is at its
limit, the other one takes the rest. The limits of a wheel are

    motor       |T| <= min(T_max, P / n); for T n < 0 times the regeneration
    friction    |T| <= R F_z mu max(sqrt(u^2 - (a_y / (g mu))^2), s)

with the estimated friction mu, the fraction u of it that may be used, a fraction s that stays for the moment in a turn
at the limit, and the wheel load F_z of the measured lateral acceleration. Both limits fade to zero for a wheel whose
slip grows from 3 to 6 %, since the estimate of a sudden change of friction comes late. Last, q is reduced until the
electric power is within the limits of the battery. While the driver brakes, the controller is inactive.

Unlike the brakes of `esc`, the moment costs no speed, so the controller acts at every error. Electric motors respond
within about 15 ms, faster than hydraulics.

Source: L. De Novellis, A. Sorniotti, P. Gruber, Wheel torque distribution criteria for electric vehicles with
torque-vectoring differentials, IEEE Trans. Vehicular Technology 63 (2014). The law is the law of `esc` without
its band.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from activesteer.controllers.corrector import MIN_SPEED_MPS
from activesteer.controllers.esc import beyond
from activesteer.controllers.parameters import ControllerSetup, TorqueVectoringParameters
from activesteer.controllers.turn_reference import BorneTurnReference
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.core.signals import NO_TORQUES, ActuatorCommand, DriverCommand, Estimate, Measurement, PerWheel
from activesteer.errors import ControllerError

_SIDES: Final = (-1.0, 1.0, -1.0, 1.0)
"""Sign of a torque that turns the car to the left, in the order of `CORNERS`."""
_FREE_SLIP: Final = 0.03
"""Slip up to which a wheel gets all of its torque [-]: the slip of a rear wheel of the compact at 1.7 kN."""
_MOST_SLIP: Final = 0.06
"""Slip from which a wheel gets no torque [-]: further slip costs more side force than it gives drive force."""
_LEAST_RADPS: Final = 1.0
"""Wheel speed below which the power of a motor sets no limit [rad/s]."""


class Range(NamedTuple):
    """Range of the torque difference of an axle, right minus left."""

    place: int  # its left wheel, 0 or 2
    lever: float  # yaw moment per difference [-]
    low: tuple[float, float]  # lowest torques that can be added left and right [Nm]
    high: tuple[float, float]
    most_Nm: float  # limit of the differential

    def largest_Nm(self, side: float) -> float:
        """Return the largest torque difference towards a side, 1 left or -1 right [Nm]."""
        (low_left, low_right), (high_left, high_right) = self.low, self.high
        wide = high_right - low_left if side > 0.0 else high_left - low_right
        return min(max(wide, 0.0), self.most_Nm)

    def torques(self, difference_Nm: float) -> tuple[float, float]:
        """Return the torques to add at left and right wheel. Their sum is 0 unless one of them is at its limit."""
        half = 0.5 * difference_Nm
        left = min(max(-half, self.low[0]), self.high[0])
        right = min(max(difference_Nm + left, self.low[1]), self.high[1])
        return min(max(right - difference_Nm, self.low[0]), self.high[0]), right


def _left_by(slip: float) -> float:
    """Return the fraction of a torque that is allowed for a wheel that slips in the direction of the torque."""
    return min(max((_MOST_SLIP - slip) / (_MOST_SLIP - _FREE_SLIP), 0.0), 1.0)


class SplitTorques:
    """Electric axles of a car, as known to a controller."""

    def __init__(self, setup: ControllerSetup) -> None:
        """Compute the constants."""
        self._axles, self._battery = setup.split_axles, setup.battery_power_W
        self._fractions = setup.gains.tv.friction_fraction, setup.gains.tv.least_fraction
        if not self._axles:
            return
        known = setup.estimation
        assert known is not None  # an estimator exists
        self._radius_m, self._drive = known.rolling_radius_m, known.drive_fractions
        tracks_m = known.two_track.tracks_m
        self._load_N, self._shift_kg = known.single_track.wheel_loads_N, known.load_shifts_kg
        self._arms_m = [
            0.5 * side * track_m for side, track_m in zip(_SIDES, np.repeat(tracks_m, 2).tolist(), strict=True)
        ]
        self._levers = [0.5 * track_m / self._radius_m[2 * axle] for axle, track_m in enumerate(tracks_m)]

    def ranges(self, command: DriverCommand, measurement: Measurement, now: Estimate) -> list[Range]:
        """Return the torque differences that each electric axle can still create on top of the driver's torque."""
        if not self._axles:
            return []
        if command.brake_pedal > 0.0:
            # The brakes use the friction, and the anti-lock system needs wheels that nothing else drives.
            nothing = 0.0, 0.0
            return [Range(axle.place, self._levers[axle.place // 2], nothing, nothing, 0.0) for axle in self._axles]
        use, least = self._fractions
        # On a sudden change the estimate may exceed the friction in the tyre files, which no road does.
        friction = min(max(now.friction, 0.05), 1.0)
        used = measurement.ay_mps2 / (GRAVITY_MPS2 * friction)
        grip = friction * max(math.sqrt(max(use**2 - used**2, 0.0)), least)
        drive_Nm = command.drive_torque_demand_Nm if command.gear else 0.0
        found = []
        for axle in self._axles:
            low, high = [0.0, 0.0], [0.0, 0.0]
            for side in (0, 1):
                wheel = axle.place + side
                shift_N = self._shift_kg[axle.place // 2] * measurement.ay_mps2 * _SIDES[wheel]
                road_Nm = self._radius_m[wheel] * grip * max(self._load_N[axle.place // 2] + shift_N, 0.0)
                speed = measurement.wheel_speed_radps[wheel]
                most = min(axle.torque_Nm, axle.power_W / max(abs(speed), _LEAST_RADPS))
                driver = self._drive[wheel] * drive_Nm
                drives, absorbs = (most, axle.regeneration * most) if speed >= 0.0 else (axle.regeneration * most, most)
                travel_mps = now.speed_mps + self._arms_m[wheel] * now.yaw_rate_radps
                slip = self._radius_m[wheel] * speed / max(travel_mps, 1.0) - 1.0
                high[side] = _left_by(slip) * max(min(drives, road_Nm) - driver, 0.0)
                low[side] = _left_by(-slip) * min(-min(absorbs, road_Nm) - driver, 0.0)
            lever = self._levers[axle.place // 2]
            found.append(Range(axle.place, lever, (low[0], low[1]), (high[0], high[1]), axle.difference_Nm))
        return found

    def for_moment(
        self, moment_Nm: float, command: DriverCommand, measurement: Measurement, now: Estimate
    ) -> tuple[PerWheel, float]:
        """Return the wheel torques to add for a yaw moment, left positive, and the moment that they create."""
        ranges, side = self.ranges(command, measurement, now), math.copysign(1.0, moment_Nm)
        possible = sum(each.lever * each.largest_Nm(side) for each in ranges)
        if possible <= 0.0 or moment_Nm == 0.0:
            return NO_TORQUES, 0.0
        share = side * min(abs(moment_Nm) / possible, 1.0)
        torques = self.of_differences([share * each.largest_Nm(side) for each in ranges], ranges, command, measurement)
        reached = sum(each.lever * (torques[each.place + 1] - torques[each.place]) for each in ranges)
        return torques, reached

    def of_differences(
        self, differences_Nm: Sequence[float], ranges: Sequence[Range], command: DriverCommand, measurement: Measurement
    ) -> PerWheel:
        """Return the wheel torques to add for the axles' torque differences, within the limits of the battery."""
        if not any(differences_Nm):
            return NO_TORQUES
        torques = [0.0, 0.0, 0.0, 0.0]
        for each, difference in zip(ranges, differences_Nm, strict=True):
            torques[each.place : each.place + 2] = each.torques(difference)
        # Power is convex in the torques: along the chord it is at most what the chord says.
        drive_Nm = command.drive_torque_demand_Nm if command.gear else 0.0
        driver = [fraction * drive_Nm for fraction in self._drive]
        speeds = measurement.wheel_speed_radps
        before = self._power_W(driver, speeds)
        after = self._power_W([own + added for own, added in zip(driver, torques, strict=True)], speeds)
        charge, discharge = self._battery
        if after > max(discharge, before):
            torques = [torque * max(discharge - before, 0.0) / (after - before) for torque in torques]
        elif after < min(-charge, before):
            torques = [torque * max(before + charge, 0.0) / (before - after) for torque in torques]
        fl, fr, rl, rr = torques
        return fl, fr, rl, rr

    def _power_W(self, torques_Nm: Sequence[float], speeds_radps: Sequence[float]) -> float:
        """Return the electric power of wheel torques [W]."""
        efficiency = self._axles[0].efficiency
        powers = [torque * speed for torque, speed in zip(torques_Nm, speeds_radps, strict=True)]
        return sum(power / efficiency if power > 0.0 else power * efficiency for power in powers)


class TorqueVectoring:
    """Torque vectoring between the left and right wheels of electric axles."""

    interval_s = 0.005
    reads = ("tv", "estimator")
    gains = TorqueVectoringParameters

    def __init__(self, setup: ControllerSetup) -> None:
        """Create the controller of one run for a car with an axle whose torques can differ."""
        if not setup.split_axles:
            raise ControllerError(
                "needs an electric axle whose left and right torques can differ: motors.rl and motors.rr (or fl and "
                'fr), or differential = "splitting" of motors.rear or motors.front, as compact_electric has it',
                key="motors",
            )
        self._parameters, self._estimator = setup.gains.tv, setup.estimator()
        self._reference = BorneTurnReference(setup.single_track, self._parameters, setup.timestep_s)
        self._yaw_inertia_kgm2, self._torques = setup.single_track.yaw_inertia_kgm2, SplitTorques(setup)

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return the torques to add at the wheels of the electric axles."""
        p, now = self._parameters, self._estimator.step(measurement)
        if now.speed_mps < MIN_SPEED_MPS:
            return ActuatorCommand(estimate=now)
        desired = self._reference.borne(
            command.front_steer_demand_rad, now.speed_mps, now.friction, measurement.ay_mps2
        )
        slide = beyond(now.sideslip_rad, p.sideslip_limit_rad)
        error = desired - now.yaw_rate_radps
        moment = self._yaw_inertia_kgm2 * (error / p.yaw_rate_time_s + slide / p.sideslip_time_s**2)
        moment *= min((now.speed_mps - MIN_SPEED_MPS) / (p.full_speed_mps - MIN_SPEED_MPS), 1.0)
        torques, reached = self._torques.for_moment(moment, command, measurement, now)
        return ActuatorCommand(
            yaw_rate_desired_radps=desired,
            saturated=math.fabs(reached) < 0.99 * math.fabs(moment),
            estimate=now,
            wheel_torque_demand_Nm=torques,
        )
