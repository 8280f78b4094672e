"""The linear single-track model: equations, steady state, and prediction of the rear angle.

Also the parameters that a two-track model needs in addition.

Symbols of the source: V front axle, H rear axle; C cornering stiffness of an axle, l_V and l_H distance of the centre
of gravity to the axles, l their sum, m mass, J_z yaw inertia, v speed, beta sideslip angle, psi_dot yaw rate, delta
steer angle at the road wheel. Source: Dorsch, Implementation of active Steering Systems into a Multibody Vehicle Model
by Co-Simulation, Mecatronics-REM 2012, eqs. 1 to 5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Range
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.errors import ParameterError
from activesteer.native.records import NativeBlock
from activesteer.native.shared_laws import shared

if TYPE_CHECKING:
    import control

_Speed = TypeVar("_Speed", float, NDArray[np.float64])
_Positive = Annotated[float, Range(1e-9)]


IDENTIFY: Final = "identify"
IDENTIFIED: Final = "identified"
SOURCES: Final = ("file", IDENTIFY, IDENTIFIED)
"""Origins of the parameters of a single-track model."""


@dataclass(frozen=True)
class SingleTrackParameters:
    """Parameters of the single-track model, as the table [single_track] of a vehicle file."""

    mass_kg: _Positive
    """Mass m [kg]."""
    yaw_inertia_kgm2: _Positive
    """Yaw inertia J_z [kg m2]."""
    cg_to_front_m: _Positive
    """Distance of the centre of gravity to the front axle, l_V [m]."""
    cg_to_rear_m: _Positive
    """Distance of the centre of gravity to the rear axle, l_H [m]."""
    front_stiffness_Nprad: _Positive
    """Cornering stiffness of the front axle with its suspension and steering, C_V [N/rad]."""
    rear_stiffness_Nprad: _Positive
    """Cornering stiffness of the rear axle with its suspension, C_H [N/rad]."""
    characteristic_speed_mps: _Positive | None = None
    """Characteristic speed v_ch from a test of the car [m/s]; default by eq. 4."""
    source: str = "file"
    """`file`: the parameters are as given, for any load of the car. `identify`: the car is driven before the run, and
    the identified parameters replace them. `identified`: they are the result of such a drive."""

    def __post_init__(self) -> None:
        """Check the source of the parameters."""
        if self.source not in SOURCES:
            raise ParameterError(f"is {self.source!r}; allowed: {', '.join(SOURCES)}", key="source", value=self.source)

    @property
    def wheelbase_m(self) -> float:
        """Distance between the axles, l [m]."""
        return self.cg_to_front_m + self.cg_to_rear_m

    @property
    def wheel_loads_N(self) -> tuple[float, float]:
        """Static load of one wheel, front and rear [N]."""
        per_metre = 0.5 * self.mass_kg * GRAVITY_MPS2 / self.wheelbase_m
        return per_metre * self.cg_to_rear_m, per_metre * self.cg_to_front_m


def characteristic_speed(wheelbase_m: float, understeer_gradient_radpmps2: float) -> float:
    """Return the speed where an understeering car reaches half the yaw rate of a neutral car, sqrt(l/EG).

    Args:
        wheelbase_m: l [m].
        understeer_gradient_radpmps2: EG, at the road wheel [rad/(m/s2)].

    Returns:
        v_ch [m/s]; nan for a car that does not understeer.
    """
    return math.sqrt(wheelbase_m / understeer_gradient_radpmps2) if understeer_gradient_radpmps2 > 0.0 else math.nan


class SingleTrack(NativeBlock):
    """The linear single-track model of a car.

    Attributes:
        parameters: Its parameters.
        wheelbase_m: l [m].
        characteristic_speed_mps: v_ch [m/s]; infinite for a neutral car.
    """

    wheelbase_m: float
    characteristic_speed_mps: float
    _stiffness_ratio: float
    _front_moment_kgm: float
    _rear_moment_kgm: float
    _front_moment_Nm: float
    _rear_moment_Nm: float
    _yaw_inertia_kgm2: float

    def __init__(self, parameters: SingleTrackParameters) -> None:
        """Compute all values that do not depend on speed.

        Args:
            parameters: The parameters of the car.

        Raises:
            ParameterError: the car oversteers, so that it has no characteristic speed, and none is given.
        """
        p = self.parameters = parameters
        cv, ch, lv, lh = p.front_stiffness_Nprad, p.rear_stiffness_Nprad, p.cg_to_front_m, p.cg_to_rear_m
        wheelbase = self.wheelbase_m = lv + lh
        moment = ch * lh - cv * lv
        if p.characteristic_speed_mps is not None:
            self.characteristic_speed_mps = p.characteristic_speed_mps
        elif moment >= 0.0:
            square = cv * ch * wheelbase**2 / (p.mass_kg * moment) if moment else math.inf
            self.characteristic_speed_mps = math.sqrt(square)
        else:
            raise ParameterError(
                f"C_H l_H - C_V l_V is {moment:.4g} N m/rad; it must not be below 0 (an oversteering "
                "car) for eq. 4 to give a characteristic speed, or characteristic_speed_kmh must be given",
                key="single_track",
            )
        self._stiffness_ratio = cv / ch
        self._front_moment_kgm, self._rear_moment_kgm = p.mass_kg * lv, p.mass_kg * lh
        self._front_moment_Nm, self._rear_moment_Nm = cv * lv * wheelbase, ch * lh * wheelbase
        self._yaw_inertia_kgm2 = p.yaw_inertia_kgm2

    def yaw_rate_gain(self, speed_mps: float) -> float:
        """Return the steady-state yaw rate per front steer angle, eq. 3 [1/s].

        Args:
            speed_mps: Speed v [m/s].
        """
        return yaw_rate_gain(self, speed_mps)

    def longest_lag_s(self) -> float:
        """Return the longest lag of the yaw rate behind a slow movement of the front wheels, over all speeds [s].

        To first order in s, the transfer function of eqs. 1 and 2 is that of a lag

            T(v) = k v / (1 + (v / v_ch)^2) - k_z v,    k_z = m l_V / (C_H l),
            k = (J_z (C_V + C_H) + m (C_V l_V^2 + C_H l_H^2)) / (C_V C_H l^2),

        with its maximum at (v / v_ch)^2 = (sqrt(k^2 + 8 k k_z) - k) / (2 k_z) - 1. The lag of a neutral car grows with
        its speed without limit. Then, and if the lag is nowhere positive, the result is infinite: no limit.
        """
        p = self.parameters
        cv, ch, lv, lh = p.front_stiffness_Nprad, p.rear_stiffness_Nprad, p.cg_to_front_m, p.cg_to_rear_m
        zero = p.mass_kg * lv / (ch * self.wheelbase_m)
        poles = p.yaw_inertia_kgm2 * (cv + ch) + p.mass_kg * (cv * lv**2 + ch * lh**2)
        poles /= cv * ch * self.wheelbase_m**2
        square = (math.sqrt(poles * (poles + 8.0 * zero)) - poles) / (2.0 * zero) - 1.0
        if square <= 0.0 or math.isinf(self.characteristic_speed_mps):
            return math.inf
        return self.characteristic_speed_mps * math.sqrt(square) * (poles / (1.0 + square) - zero)

    def rear_prediction(self, speed_mps: _Speed) -> tuple[_Speed, _Speed, _Speed]:
        """Return the coefficients of the rear angle that keeps the sideslip angle at zero, eq. 5.

            G(s) = delta_H(s)/delta_V(s) = (K_H + K_H T_z s) / (1 + T_1 s)

        Re-derived from eqs. 1 and 2 with beta = beta_dot = 0. K_H is negative (against the front wheels) at low speed
        and positive at high speed. K_H T_z is returned in place of T_z, which is infinite where K_H is zero.

        Args:
            speed_mps: Speed v > 0 [m/s]; one number or an array.

        Returns:
            K_H [-], K_H T_z [s], T_1 [s].
        """
        return rear_prediction(self, speed_mps)

    def state_space(self, speed_mps: float) -> control.StateSpace:
        """Return the state-space model at a speed, eqs. 1 and 2.

        Args:
            speed_mps: Speed v > 0 [m/s].

        Returns:
            States and outputs yaw rate [rad/s], sideslip angle [rad]; inputs front and rear steer angle [rad].

        Raises:
            ParameterError: the speed is not above zero.
        """
        import control  # noqa: PLC0415 - takes longer to import than a run takes to start

        if speed_mps <= 0.0:
            raise ParameterError(
                f"is {speed_mps:g} m/s; the single-track model needs a speed above 0", key="speed_mps", value=speed_mps
            )
        a, b = self.matrices(speed_mps)
        return control.StateSpace(
            a,
            b,
            np.eye(2),
            np.zeros((2, 2)),
            inputs=["front_steer_rad", "rear_steer_rad"],
            outputs=["yaw_rate_radps", "sideslip_rad"],
            states=["yaw_rate_radps", "sideslip_rad"],
            name="single_track",
        )

    def matrices(self, speed_mps: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the system and input matrices of eqs. 1 and 2 for yaw rate and sideslip angle."""
        p, v = self.parameters, speed_mps
        cv, ch, lv, lh = p.front_stiffness_Nprad, p.rear_stiffness_Nprad, p.cg_to_front_m, p.cg_to_rear_m
        m, jz = p.mass_kg, p.yaw_inertia_kgm2
        difference = ch * lh - cv * lv
        a = np.array(
            [
                [-(cv * lv**2 + ch * lh**2) / (jz * v), difference / jz],
                [difference / (m * v**2) - 1.0, -(cv + ch) / (m * v)],
            ]
        )
        b = np.array([[cv * lv / jz, -ch * lh / jz], [cv / (m * v), ch / (m * v)]])
        return a, b


@shared
def yaw_rate_gain(model: SingleTrack, speed_mps: float) -> float:
    """Compiled form of `SingleTrack.yaw_rate_gain`."""
    ratio = speed_mps / model.characteristic_speed_mps
    return speed_mps / model.wheelbase_m / (1.0 + ratio * ratio)


@shared
def rear_prediction(model: SingleTrack, speed_mps: _Speed) -> tuple[_Speed, _Speed, _Speed]:
    """Compiled form of `SingleTrack.rear_prediction`."""
    # Called in every step of a run; everything that does not depend on speed is computed beforehand.
    square = speed_mps * speed_mps
    denominator = model._rear_moment_kgm * square + model._front_moment_Nm
    ratio = model._stiffness_ratio
    gain = ratio * (model._front_moment_kgm * square - model._rear_moment_Nm) / denominator
    lag = model._yaw_inertia_kgm2 * speed_mps / denominator
    return gain, -ratio * lag, lag


@dataclass(frozen=True)
class TwoTrackParameters:
    """Keys of the table [two_track] in a vehicle file."""

    load_height_m: _Positive
    """Moment that changes the wheel loads, per mass and acceleration: height of the centre of gravity above the road,
    plus the effect of the body's inclination [m]."""
    front_track_m: _Positive
    """Distance between the front wheels' contact points [m]."""
    rear_track_m: _Positive
    """Distance between the rear wheels' contact points [m]."""
    front_load_transfer_fraction: Annotated[float, Range(0.0, 1.0)]
    """Front axle's share of the lateral load transfer in a turn."""
    roll_gradient_radpmps2: Annotated[float, Range(0.0, 0.1)]
    """Roll angle per lateral acceleration, out of the turn [rad/(m/s2)]."""
    roll_frequency_Hz: Annotated[float, Range(0.1, 10.0)]
    """Natural frequency of the body's roll [Hz]."""
    roll_damping: Annotated[float, Range(0.01, 10.0)]
    """Damping ratio of the body's roll."""
    front_roll_arm_m: Annotated[float, Range(-2.0, 2.0)]
    """Lateral speed of the front wheels per roll rate, relative to the centre of gravity, at the points whose slip the
    tyres feel [m]. Such a point is the contact point, or the wheel centre by `tyres.conventions.slip_velocity`."""
    rear_roll_arm_m: Annotated[float, Range(-2.0, 2.0)]
    """The same for the rear wheels [m]."""
    pitch_gradient_radpmps2: Annotated[float, Range(0.0, 0.1)]
    """Pitch angle per deceleration, nose down [rad/(m/s2)]."""
    wheel_inertia_kgm2: _Positive = 1.0
    """Inertia of a wheel about its axis [kg m2]; 1.0 belongs to a wheel of 18 kg and 16 inches."""

    @property
    def tracks_m(self) -> tuple[float, float]:
        """Distances between the contact points of the wheels, front and rear [m]."""
        return self.front_track_m, self.rear_track_m
