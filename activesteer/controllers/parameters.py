"""Types and ranges of the gains and limits of all controllers."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any, ClassVar, NamedTuple, TypeVar

from activesteer.config import Range, build, read_toml
from activesteer.errors import ControllerError
from activesteer.estimation import EstimatorParameters, EstimatorSetup
from activesteer.estimation.estimator import Estimator
from activesteer.resources import find_controller_variant
from activesteer.theory.single_track import SingleTrackParameters

T = TypeVar("T")
_Fraction = Annotated[float, Range(0.0, 1.0)]
_Gain = Annotated[float, Range(0.0, 100.0)]
_Scale = Annotated[float, Range(1e-4, 10.0)]
_Limit = Annotated[float, Range(0.0, math.radians(10.0))]
_Lag = Annotated[float, Range(0.001, 1.0)]
_Size = Annotated[float, Range(1.0, 1e6)]
_Length = Annotated[float, Range(0.01, 5.0)]


@functools.cache
def file_gains(name: str, gains: type[T]) -> T:
    """Return the gains of a controller from its file in `models/controllers`."""
    table, source = read_toml(find_controller_variant(name), ControllerError)
    return build(gains, table.get(name, {}), source, (name,))


@dataclass(frozen=True)
class SideslipRearSteerParameters:
    """Gains of the rear steering with a sideslip term (`ars_sideslip`), in addition to [controllers.ars]."""

    sideslip_gain: _Gain
    """Rear angle that opposes the sideslip angle, per sideslip angle [rad/rad]: share by which the rear axle becomes
    stiffer against sideslip."""


@dataclass(frozen=True)
class LqrParameters:
    """Gains and limits of the linear-quadratic regulator for both axles (`lqr`).

    A yaw rate error, a sideslip angle and two angles, each as large as its scale, cost the same.
    """

    yaw_rate_scale_radps: _Scale
    """Scale of the yaw rate error [rad/s]."""
    sideslip_scale_rad: _Scale
    """Scale of the sideslip angle [rad]."""
    rear_scale_rad: _Scale
    """Scale of the rear angle [rad]."""
    superposition_scale_rad: _Scale
    """Scale of the superposition angle [rad]."""
    reference_length_m: _Length
    """Distance over which the desired yaw rate follows the driver [m]. The car's own lag limits its time."""
    friction_fraction: Annotated[float, Range(0.1, 1.5)]
    """Fraction of the estimated friction that the desired yaw rate may use [-]."""
    friction_deviations: Annotated[float, Range(0.0, 10.0)]
    """Standard deviations of the friction that are added to it for this limit [-]: the controller acts on the friction
    only as far as the estimate is certain."""
    against_driver_rad: _Limit
    """Superposition against the driver's angle that is allowed while the friction is unknown [rad]; it grows to the
    limit of the actuator with the certainty of the friction."""
    hold_s: _Lag
    """Time for which the superposition is held against a driver who does not steer back, and into a turn at the limit
    of the friction [s]."""
    decay_s: _Lag
    """Time in which it then decays to zero [s]."""
    lacking_radps: _Scale
    """Yaw rate error from which the superposition does not turn the car further from the desired yaw rate [rad/s]."""
    relaxation_length_m: _Length
    """Distance over which a tyre of the model builds up its force [m]."""
    moment_scale_Nm: _Size
    """Scale of a missing yaw moment [Nm]."""
    force_scale_N: _Size
    """Scale of a missing side force [N]."""
    ahead_s: _Lag
    """Time ahead for which the rates of the actuators limit the angles [s]."""
    removal_s: _Lag
    """Time in which an actuator must be able to remove its angle [s]."""


@dataclass(frozen=True)
class YawMomentParameters:
    """Parameters of the desired yaw rate, and of the yaw moment for its error and for the sideslip angle."""

    sideslip_limit_rad: _Limit
    """Sideslip angle that causes no action [rad]."""
    yaw_rate_time_s: _Lag
    """T_r: time in which the moment removes the yaw rate error [s]."""
    sideslip_time_s: _Lag
    """T_b: half the time in which the moment, without damping, turns the car back by the sideslip angle beyond its
    limit [s]."""
    reference_length_m: _Length
    """Distance over which the desired yaw rate follows the driver [m]. The car's own lag limits its time."""
    friction_fraction: Annotated[float, Range(0.1, 1.0)]
    """Fraction of the estimated friction that the desired yaw rate and, with `tv`, a wheel may use [-]."""
    acceleration_time_s: _Lag
    """T_a: time in which the lateral acceleration follows the desired yaw rate [s]."""
    acceleration_shortfall_mps2: Annotated[float, Range(0.0, 20.0)]
    """D: lateral acceleration that the turn may lack before the desired yaw rate falls [m/s2]."""


@dataclass(frozen=True)
class EscParameters(YawMomentParameters):
    """Parameters of the stability control by the brakes (`esc`)."""

    yaw_rate_band_radps: _Gain
    """Yaw rate error that causes no action [rad/s]."""
    friction_deviations: Annotated[float, Range(0.0, 10.0)]
    """Standard deviations of the friction that are added to it for the desired yaw rate [-]: the controller acts on the
    friction only as far as the estimate is certain."""
    sideslip_deviations: Annotated[float, Range(0.0, 10.0)]
    """Least limit of the sideslip angle, in standard deviations of its estimate [-]: the controller acts only on a
    sideslip angle that is certain."""
    torque_limit_Nm: Annotated[float, Range(0.0, 1e4)]
    """Largest brake torque at a wheel [Nm]."""
    least_speed_mps: Annotated[float, Range(1.0, 20.0)]
    """Speed below which the controller is inactive [m/s]."""


@dataclass(frozen=True)
class TorqueVectoringParameters(YawMomentParameters):
    """Parameters of the torque vectoring by electric axles (`tv`)."""

    least_fraction: _Fraction
    """Fraction of the friction that remains available for the torque in a turn at the limit [-]."""
    full_speed_mps: Annotated[float, Range(2.0, 50.0)]
    """Speed from which the controller acts fully [m/s]; below it, its action fades out until walking speed."""


@dataclass(frozen=True)
class IntegratedParameters:
    """Parameters of the brakes that assist the steering of `lqr` (`integrated`).

    A missing moment as large as its scale in [controllers.lqr] and a brake force as large as its scale cost the same.
    """

    KEY_HINTS: ClassVar = {
        **{key: f"now controllers.lqr.{key}" for key in ("moment_scale_Nm", "force_scale_N", "ahead_s")},
        **{key: f"now controllers.esc.{key}" for key in ("yaw_rate_time_s", "sideslip_time_s")},
        "brake_fraction": "the brakes have the limit controllers.esc.torque_limit_Nm",
        "angle_scale_deg": "the angles are those of lqr; see controllers.lqr.superposition_scale_deg",
    }

    brake_scale_N: _Size
    """F_0: scale of the brake force at a wheel [N]."""
    brake_threshold_Nm: _Size
    """Missing yaw moment below which the brakes are inactive [Nm]."""
    brake_side_loss: _Fraction
    """Side force that a fully utilised tyre loses per brake force [-]."""
    side_difference_Pa: Annotated[float, Range(0.0, 1e8)]
    """Brake pressure difference between the sides for a car without errors, in addition to the difference that the
    anti-lock system leaves to the driver [Pa]."""
    side_yaw_rate_radps: _Scale
    """Yaw rate error at which this pressure difference is zero [rad/s]."""
    side_sideslip_rad: _Scale
    """Sideslip error at which this pressure difference is zero [rad]."""
    side_acceleration_mps2: _Scale
    """Lateral acceleration of a turn at which this pressure difference is zero; it falls from half of that on
    [m/s2]."""
    tolerance_rad: _Limit
    """Distance of an actuator from its demand that is tolerated [rad]."""
    window_s: _Lag
    """Time in which an actuator must approach its demand; after the same time again it counts as failed [s]."""


_NotNegative = Annotated[float, Range(0.0)]
_Rate = Annotated[float, Range(0.01, 100.0)]


@dataclass(frozen=True)
class DesiredYawRateParameters:
    """Parameters of the desired yaw rate for the driver's demand (eqs. 3 and 6)."""

    max_lateral_acceleration_mps2: Annotated[float, Range(0.1, 20.0)] = 8.0
    """a_y_max: the desired yaw rate stays below a_y_max / v. The controllers assume this value on every road, because
    they do not know its friction [m/s2]."""
    delay_s: _Lag = 0.06
    """Time constant of the delay element: a car cannot follow a sudden change [s]."""


@dataclass(frozen=True)
class CorrectorParameters:
    """Parameters of tolerance band and PID corrector on the yaw rate error. The paper has only the P term."""

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
    """Time constant of the filter of the derivative term [s]."""


@dataclass(frozen=True)
class RearSteerParameters:
    """Gains and limits of active rear steering (ARS)."""

    corrector: CorrectorParameters = CorrectorParameters()
    """Feedback of the yaw rate."""
    prediction_gain: Annotated[float, Range(0.0, 2.0)] = 1.0
    """Fraction of the predicted rear angle that is used; 1 is the zero-sideslip feedforward of eq. 5 [-]."""
    limit_rad: _Limit = math.radians(3.0)
    """Largest rear angle demanded [rad]."""


@dataclass(frozen=True)
class FrontSuperpositionParameters:
    """Gains and limits of active front steering by superposition (AFS)."""

    corrector: CorrectorParameters = CorrectorParameters()
    """Feedback of the yaw rate."""
    limit_rad: _Limit = math.radians(3.0)
    """Largest angle added at the road wheels [rad]."""


@dataclass(frozen=True)
class ServoParameters:
    """Properties of the actuators of both axles for `lqr` and `integrated`, with angles at the road wheels."""

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
    """Data of the actuators, for controllers beyond the paper's."""
    ars_sideslip: SideslipRearSteerParameters = field(
        default_factory=partial(file_gains, "ars_sideslip", SideslipRearSteerParameters)
    )
    """Rear steering with a sideslip term."""
    lqr: LqrParameters = field(default_factory=partial(file_gains, "lqr", LqrParameters))
    """State feedback to both axles."""
    esc: EscParameters = field(default_factory=partial(file_gains, "esc", EscParameters))
    """Stability control by individual brakes."""
    integrated: IntegratedParameters = field(default_factory=partial(file_gains, "integrated", IntegratedParameters))
    """Integrated control of steering and brakes."""
    tv: TorqueVectoringParameters = field(default_factory=partial(file_gains, "tv", TorqueVectoringParameters))
    """Torque vectoring."""
    estimator: EstimatorParameters = EstimatorParameters()
    """Estimator of speed, sideslip and friction, for controllers that use an estimator."""
    interval_s: Annotated[float, Range(1e-4, 0.1)] | None = None
    """Time between two calls of a controller, in whole steps of the simulation [s]. Default: the controller's own
    `interval_s`, or every step."""
    bus_delay_s: Annotated[float, Range(0.0, 0.1)] = 0.0
    """Delay of a command on its way to the actuators, in whole steps of the simulation [s]."""


class SplitAxle(NamedTuple):
    """Properties of an electric axle whose left and right torques can differ, for controllers.

    Attributes:
        place: Its left wheel in the order of `CORNERS`: 0 in front, 2 at the rear.
        torque_Nm: Largest torque of one wheel [Nm].
        power_W: Largest power of one wheel [W].
        regeneration: Fraction of both that the motors can absorb [-].
        difference_Nm: Largest difference of the torques, right minus left [Nm].
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
    """Input for the creation of a controller.

    Attributes:
        single_track: The car as a single-track model.
        gains: Gains and limits from the vehicle file.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
        timestep_s: Time between two calls [s].
        overridden: Dotted keys of the gains that were overridden for this run.
        estimation: The car as an estimator knows it; None if its file has no table [two_track].
        user_parameters: Overrides of the parameters of users' controllers: class -> name -> value.
        split_axles: Electric axles whose left and right torques can differ.
        battery_power_W: Largest power that the battery takes and gives [W].
    """

    single_track: SingleTrackParameters
    gains: ControllerParameters
    steering_ratio: float
    timestep_s: float
    overridden: frozenset[str] = frozenset()
    estimation: EstimatorSetup | None = None
    user_parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict, hash=False)
    split_axles: tuple[SplitAxle, ...] = ()
    battery_power_W: tuple[float, float] = (math.inf, math.inf)

    def estimator(self) -> Estimator:
        """Create an estimator, to be called in each step of the controller.

        Raises:
            ControllerError: the vehicle file lacks the table [two_track].
        """
        if self.estimation is None:
            raise ControllerError(
                "an estimator needs the table [two_track] in the vehicle file, as models/vehicles/compact.toml has it",
                key="two_track",
            )
        return Estimator(self.estimation, self.gains.estimator, self.timestep_s)
