"""Torque vectoring: a yaw moment from the difference of the drive torques of an axle's wheels.

Desired yaw rate and estimator are those of `esc`. The moment removes the errors in given times:

    M_z = J_z (r* - r) / T_r + J_z / T_b^2 (sideslip beyond its limit)

A difference q, the right torque less the left one, makes the moment q t / (2 R), with track t and rolling radius R.
More torque on the right turns the car to the left. Each axle whose torques can differ gets the same fraction of its
largest difference. The driver's torque stays: half of q is added on the right and taken from the left. If one wheel is
at its limit, the other one takes the rest. The limits of a wheel are

    motor       |T| <= min(T_max, P / n); for T n < 0 times the regeneration
    friction    |T| <= R F_z mu max(sqrt(u^2 - (a_y / (g mu))^2), s)

with the estimated friction mu, the fraction u of it that may be used, a fraction s that stays for the moment in a turn
at the limit, and the wheel load F_z of the measured lateral acceleration. Both limits fade to zero for a wheel whose
slip grows from 3 to 6 %, since the estimate of a sudden change of friction comes late. Last, q is reduced so far that
the electric power stays within the limits of the battery. While the driver brakes, the controller rests.

Unlike the brakes of `esc`, the moment costs no speed, so the controller acts at every error. Electric motors answer
within some 15 ms, faster than hydraulics.

Source: L. De Novellis, A. Sorniotti, P. Gruber, Wheel torque distribution criteria for electric vehicles with
torque-vectoring differentials, IEEE Trans. Vehicular Technology 63 (2014); the law is that of `esc` without its band.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from activesteer.controllers.desired_yaw_rate import MIN_SPEED_MPS
from activesteer.controllers.esc import beyond
from activesteer.controllers.file_gains import TorqueVectoringParameters
from activesteer.controllers.parameters import ControllerSetup
from activesteer.controllers.split_axles import SplitTorques
from activesteer.controllers.turn_reference import BorneTurnReference
from activesteer.errors import ControllerError
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement

if TYPE_CHECKING:
    from activesteer.estimation.estimator import Estimator


class TorqueVectoring:
    """Yaw moments by left and right torques of electric axles."""

    interval_s = 0.005
    reads = ("tv", "estimator")
    gains = TorqueVectoringParameters

    def __init__(
        self,
        reference: BorneTurnReference,
        estimator: Estimator,
        parameters: TorqueVectoringParameters,
        yaw_inertia_kgm2: float,
        torques: SplitTorques,
    ) -> None:
        """Make the controller of one run.

        Args:
            reference: Desired yaw rate.
            estimator: Estimator of speed, yaw rate, sideslip and friction.
            parameters: Times and limits.
            yaw_inertia_kgm2: J_z [kg m2].
            torques: The electric axles.
        """
        self._reference, self._estimator, self._parameters = reference, estimator, parameters
        self._yaw_inertia_kgm2, self._torques = yaw_inertia_kgm2, torques

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> TorqueVectoring:
        """Make the controller for a car.

        Raises:
            ControllerError: the car has no axle whose torques can differ, or no table [two_track].
        """
        if not setup.split_axles:
            raise ControllerError(
                "needs an electric axle whose left and right torques can differ: motors.rl and motors.rr (or fl and "
                'fr), or differential = "splitting" of motors.rear or motors.front, as compact_electric has it',
                key="motors",
            )
        p, estimator = setup.gains.tv, setup.estimator()
        torques = SplitTorques(setup, p.friction_fraction, p.least_fraction)
        reference = BorneTurnReference(setup.single_track, p, setup.timestep_s)
        return cls(reference, estimator, p, setup.single_track.yaw_inertia_kgm2, torques)

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return the wheel torques."""
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
