"""Gains and limits of the controllers; keys of the table [controllers] in a vehicle file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from activesteer.config import Range
from activesteer.controllers.family_parameters import (
    EscParameters,
    IntegratedParameters,
    LqrParameters,
    MpcParameters,
    ServoParameters,
    SideslipRearSteerParameters,
)
from activesteer.errors import ControllerError
from activesteer.estimation import EstimatorParameters, EstimatorSetup
from activesteer.theory.single_track import SingleTrackParameters

if TYPE_CHECKING:
    from activesteer.estimation.estimator import Estimator

_NotNegative = Annotated[float, Range(0.0)]


@dataclass(frozen=True)
class DesiredYawRateParameters:
    """How the driver's demand becomes a desired yaw rate (eqs. 3 and 6)."""

    max_lateral_acceleration_mps2: Annotated[float, Range(0.1, 20.0)] = 8.0
    """a_y_max: the desired yaw rate stays below a_y_max / v. It is what the controllers assume that the road gives,
    whatever road it is: nobody tells them its friction [m/s2]."""
    delay_s: Annotated[float, Range(0.001, 1.0)] = 0.06
    """Time constant of the delay element: a car cannot follow a sudden change [s]."""


@dataclass(frozen=True)
class CorrectorParameters:
    """Tolerance band and PID corrector on the yaw rate error; the paper uses the P part alone."""

    deadband_start_radps: _NotNegative = math.radians(0.5)
    """c_off: below this error there is no action [rad/s]."""
    deadband_end_radps: _NotNegative = math.radians(2.0)
    """c_in: above this error the action is full [rad/s]."""
    proportional_gain_s: _NotNegative = 0.25
    """Steer angle per yaw rate error [rad/(rad/s)]."""
    integral_gain: _NotNegative = 0.0
    """Steer angle per integrated yaw rate error [rad/rad]."""
    derivative_gain_s2: _NotNegative = 0.0
    """Steer angle per change of the yaw rate error [rad/(rad/s2)]."""
    derivative_filter_s: Annotated[float, Range(0.001, 1.0)] = 0.02
    """Time constant of the filter of the D part [s]."""


@dataclass(frozen=True)
class RearSteerParameters:
    """Active rear steering (ARS)."""

    corrector: CorrectorParameters = CorrectorParameters()
    """Feedback of the yaw rate."""
    prediction_gain: Annotated[float, Range(0.0, 2.0)] = 1.0
    """Fraction of the predicted rear angle that is used; 1 is the zero-sideslip feed-forward of eq. 5 [-]."""
    limit_rad: Annotated[float, Range(0.0, math.radians(10.0))] = math.radians(3.0)
    """Most rear angle demanded [rad]."""


@dataclass(frozen=True)
class FrontSuperpositionParameters:
    """Active front steering by superposition (AFS)."""

    corrector: CorrectorParameters = CorrectorParameters()
    """Feedback of the yaw rate."""
    limit_rad: Annotated[float, Range(0.0, math.radians(10.0))] = math.radians(3.0)
    """Most angle added at the road wheels [rad]."""


@dataclass(frozen=True)
class ControllerParameters:
    """Parameters of all controllers of a vehicle file."""

    desired_yaw_rate: DesiredYawRateParameters = DesiredYawRateParameters()
    """What both systems steer for."""
    ars: RearSteerParameters = RearSteerParameters()
    """Active rear steering."""
    afs: FrontSuperpositionParameters = FrontSuperpositionParameters()
    """Active front steering."""
    servos: ServoParameters = ServoParameters()
    """What controllers beyond the paper's know of the actuators of both axles."""
    ars_sideslip: SideslipRearSteerParameters = SideslipRearSteerParameters()
    """Rear steering with a sideslip term."""
    lqr: LqrParameters = LqrParameters()
    """Both axles together."""
    esc: EscParameters = EscParameters()
    """Single brakes."""
    integrated: IntegratedParameters = IntegratedParameters()
    """Steering and brakes together."""
    mpc: MpcParameters = MpcParameters()
    """Both axles within an envelope."""
    estimator: EstimatorParameters = EstimatorParameters()
    """Speed, sideslip and friction, for controllers that ask for them."""
    interval_s: Annotated[float, Range(1e-4, 0.1)] | None = None
    """Time between two calls of a controller, whole steps; its own `interval_s`, else every step, if not given [s]."""
    bus_delay_s: Annotated[float, Range(0.0, 0.1)] = 0.0
    """How long a command takes to the actuators, whole steps [s]."""


@dataclass(frozen=True)
class ControllerSetup:
    """What a controller gets when it is made.

    Attributes:
        single_track: The car as a single-track model sees it.
        gains: Gains and limits from the vehicle file.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
        timestep_s: Time between two calls [s].
        overridden: Dotted keys of the gains that were replaced for this run.
        estimation: What an estimator knows of the car; None where its file has no table [two_track].
    """

    single_track: SingleTrackParameters
    gains: ControllerParameters
    steering_ratio: float
    timestep_s: float
    overridden: frozenset[str] = frozenset()
    estimation: EstimatorSetup | None = None

    def estimator(self) -> Estimator:
        """Makes an estimator of speed, sideslip, yaw rate and friction, to be called in each step of the controller.

        Raises:
            ControllerError: the vehicle file does not say what it needs.
        """
        if self.estimation is None:
            raise ControllerError(
                "an estimator needs the table [two_track] in the vehicle file, as models/vehicles/compact.toml has it",
                key="two_track",
            )
        from activesteer.estimation.estimator import Estimator  # noqa: PLC0415 - compiled code, which lists of controllers do without

        return Estimator(self.estimation, self.gains.estimator, self.timestep_s)
