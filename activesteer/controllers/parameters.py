"""Gains and limits of the controllers: keys of the table [controllers] in a vehicle file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any, NamedTuple

from activesteer.config import Range
from activesteer.controllers.file_gains import (
    EscParameters,
    IntegratedParameters,
    LqrParameters,
    SideslipRearSteerParameters,
    TorqueVectoringParameters,
    file_gains,
)
from activesteer.errors import ControllerError
from activesteer.estimation import EstimatorParameters, EstimatorSetup
from activesteer.estimation.estimator import Estimator
from activesteer.theory.single_track import SingleTrackParameters

_NotNegative = Annotated[float, Range(0.0)]
_Limit = Annotated[float, Range(0.0, math.radians(10.0))]
_Rate = Annotated[float, Range(0.01, 100.0)]
_Lag = Annotated[float, Range(0.001, 1.0)]


@dataclass(frozen=True)
class DesiredYawRateParameters:
    """Desired yaw rate for the driver's demand (eqs. 3 and 6)."""

    max_lateral_acceleration_mps2: Annotated[float, Range(0.1, 20.0)] = 8.0
    """a_y_max: the desired yaw rate stays below a_y_max / v. The controllers assume this value on every road, because
    they do not know its friction [m/s2]."""
    delay_s: _Lag = 0.06
    """Time constant of the delay element: a car cannot follow a sudden change [s]."""


@dataclass(frozen=True)
class CorrectorParameters:
    """Tolerance band and PID corrector on the yaw rate error; the paper uses the P part alone."""

    deadband_start_radps: _NotNegative = math.radians(0.5)
    """c_off: below this error there is no action [rad/s]."""
    deadband_end_radps: _NotNegative = math.radians(2.0)
    """c_in: above this error there is full action [rad/s]."""
    proportional_gain_s: _NotNegative = 0.25
    """Steer angle per yaw rate error [rad/(rad/s)]."""
    integral_gain: _NotNegative = 0.0
    """Steer angle per integrated yaw rate error [rad/rad]."""
    derivative_gain_s2: _NotNegative = 0.0
    """Steer angle per rate of change of the yaw rate error [rad/(rad/s2)]."""
    derivative_filter_s: _Lag = 0.02
    """Time constant of the filter of the D part [s]."""


@dataclass(frozen=True)
class RearSteerParameters:
    """Active rear steering (ARS)."""

    corrector: CorrectorParameters = CorrectorParameters()
    """Feedback of the yaw rate."""
    prediction_gain: Annotated[float, Range(0.0, 2.0)] = 1.0
    """Fraction of the predicted rear angle that is used; 1 is the zero-sideslip feedforward of eq. 5 [-]."""
    limit_rad: _Limit = math.radians(3.0)
    """Largest rear angle demanded [rad]."""


@dataclass(frozen=True)
class FrontSuperpositionParameters:
    """Active front steering by superposition (AFS)."""

    corrector: CorrectorParameters = CorrectorParameters()
    """Feedback of the yaw rate."""
    limit_rad: _Limit = math.radians(3.0)
    """Largest angle added at the road wheels [rad]."""


@dataclass(frozen=True)
class ServoParameters:
    """The actuators of both axles as `lqr` and `integrated` know them; angles at the road wheels."""

    lag_s: _Lag = 0.025
    """Lag of both actuators [s]."""
    rear_limit_rad: _Limit = math.radians(3.0)
    """Largest rear angle [rad]."""
    rear_rate_radps: _Rate = math.radians(28.0)
    """Rate of the rear steering [rad/s]."""
    superposition_limit_rad: _Limit = math.radians(3.0)
    """Largest superposition angle [rad]."""
    superposition_rate_radps: _Rate = math.radians(29.0)
    """Rate of the superposition [rad/s]."""


@dataclass(frozen=True)
class ControllerParameters:
    """Parameters of all controllers of a vehicle file.

    The files in `models/controllers` give what the vehicle file leaves out of `ars_sideslip`, `lqr`, `esc`
    and `integrated`.
    """

    desired_yaw_rate: DesiredYawRateParameters = DesiredYawRateParameters()
    """Desired yaw rate of the paper's controllers."""
    ars: RearSteerParameters = RearSteerParameters()
    """Active rear steering."""
    afs: FrontSuperpositionParameters = FrontSuperpositionParameters()
    """Active front steering."""
    servos: ServoParameters = ServoParameters()
    """The actuators as controllers beyond the paper's know them."""
    ars_sideslip: SideslipRearSteerParameters = field(
        default_factory=partial(file_gains, "ars_sideslip", SideslipRearSteerParameters)
    )
    """Rear steering with a sideslip term."""
    lqr: LqrParameters = field(default_factory=partial(file_gains, "lqr", LqrParameters))
    """Both axles together."""
    esc: EscParameters = field(default_factory=partial(file_gains, "esc", EscParameters))
    """Single brakes."""
    integrated: IntegratedParameters = field(default_factory=partial(file_gains, "integrated", IntegratedParameters))
    """Steering and brakes together."""
    tv: TorqueVectoringParameters = field(default_factory=partial(file_gains, "tv", TorqueVectoringParameters))
    """Torque vectoring."""
    estimator: EstimatorParameters = EstimatorParameters()
    """Speed, sideslip and friction, for controllers that use an estimator."""
    interval_s: Annotated[float, Range(1e-4, 0.1)] | None = None
    """Time between two calls of a controller, in whole steps of the simulation [s]. Default: the controller's own
    `interval_s`, or every step."""
    bus_delay_s: Annotated[float, Range(0.0, 0.1)] = 0.0
    """Delay of a command on its way to the actuators, in whole steps of the simulation [s]."""


class SplitAxle(NamedTuple):
    """An electric axle whose left and right torques can differ, as controllers know it.

    Attributes:
        place: Its left wheel in the order of `CORNERS`: 0 in front, 2 at the rear.
        torque_Nm: Largest torque of one wheel [Nm].
        power_W: Largest power of one wheel [W].
        regeneration: Fraction of both that the motors can absorb [-].
        difference_Nm: Largest difference of the torques, right less left [Nm].
        efficiency: Efficiency in both directions [-].
    """

    place: int
    torque_Nm: float
    power_W: float
    regeneration: float
    difference_Nm: float
    efficiency: float


@dataclass(frozen=True)
class ControllerSetup:
    """Input from which a controller is made.

    Attributes:
        single_track: The car as a single-track model.
        gains: Gains and limits from the vehicle file.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
        timestep_s: Time between two calls [s].
        overridden: Dotted keys of the gains that were overridden for this run.
        estimation: The car as an estimator knows it; None if its file has no table [two_track].
        own: Overrides of the parameters of users' controllers: class -> name -> value.
        split_axles: Electric axles whose left and right torques can differ.
        battery_power_W: Largest power that the battery takes and gives [W].
    """

    single_track: SingleTrackParameters
    gains: ControllerParameters
    steering_ratio: float
    timestep_s: float
    overridden: frozenset[str] = frozenset()
    estimation: EstimatorSetup | None = None
    own: Mapping[str, Mapping[str, Any]] = field(default_factory=dict, hash=False)
    split_axles: tuple[SplitAxle, ...] = ()
    battery_power_W: tuple[float, float] = (math.inf, math.inf)

    def estimator(self) -> Estimator:
        """Make an estimator of speed, sideslip, yaw rate and friction, to be called in each step of the controller.

        Raises:
            ControllerError: the vehicle file lacks the table [two_track].
        """
        if self.estimation is None:
            raise ControllerError(
                "an estimator needs the table [two_track] in the vehicle file, as models/vehicles/compact.toml has it",
                key="two_track",
            )
        return Estimator(self.estimation, self.gains.estimator, self.timestep_s)
