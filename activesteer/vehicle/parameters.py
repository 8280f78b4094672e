"""Parameters of the car in a vehicle file, and the torque limits of its engine.

The driver always uses the gear with the highest torque. Over all gears that is a constant torque, the first gear's, up
to the speed at which the engine reaches its highest power, and constant power above:

    T(u) = min(T_max, P / u)          u: mean speed of the driven wheels in the direction of the gear

The mean counts because a differential passes on equal torques and turns with the mean of the speeds behind it; so power
in is power out, whatever a single wheel does. At the speed limit (top gear, rev limiter) the torque fades to zero. With
the throttle released, the engine drags. The gear scales its drag as it does its torque, T_drag(u) = T_drag min(1, P /
(T_max u)), and near standstill the clutch opens. Against the gear, as when rolling back on a hill, the clutch slips:
the drive pulls with up to T_max and does not drag.

Engine and gears turn with the driven wheels and increase their inertia, except while the clutch is open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Final

from numba import types

from activesteer.config import Range, check_points
from activesteer.errors import ParameterError
from activesteer.native.compilation import compiled, compiled_call
from activesteer.native.shared_laws import shared
from activesteer.sensors.parameters import Sensors
from activesteer.tyre.tyre_parameters import TyreConventions, TyreParameters
from activesteer.vehicle.brakes.records import Brakes
from activesteer.vehicle.curve_axles import Curves
from activesteer.vehicle.electric_actuators import Battery, Motors, RearActuator, SuperpositionActuator
from activesteer.vehicle.force_block import MAX_CURVE_POINTS

Positive = Annotated[float, Range(1e-12)]
NotNegative = Annotated[float, Range(0.0)]
Fraction = Annotated[float, Range(0.0, 1.0)]
_MASS_HINT: Final = (
    "load.payload_kg loads the car, factors.mass scales it; single_track.mass_kg is only the mass that "
    "controllers and driver assume"
)
_GRAVITY_HINT: Final = (
    "load.cg_height_change_m and cg_forward_change_m move the empty car's centre of gravity, load.payload_position_m "
    "places the payload, payload_forward_change_m shifts it"
)
_MASS_HINTS: Final = {
    **dict.fromkeys(("mass", "mass_kg", "mass_factor", "curb_mass_kg", "weight", "weight_kg", "weight_N"), _MASS_HINT),
    **dict.fromkeys(("load_kg", "payload", "passengers", "luggage_kg"), _MASS_HINT),
    **dict.fromkeys(("cg_m", "cg_height", "cg_height_m"), _GRAVITY_HINT),
}
"""Keys to use instead of keys that users may expect but that do not exist."""
Position = Annotated[tuple[float, ...], Range(-20.0, 20.0)]


@dataclass(frozen=True)
class TyreFitment:
    """Tyre files of the car, and tyre behaviour near standstill."""

    front: str
    """Tyre file of the front wheels, a name in models/tyres or a path."""
    rear: str
    """Tyre file of the rear wheels."""
    front_pressure_Pa: Positive | None = None
    """Inflation pressure; default from the tyre file [Pa]."""
    rear_pressure_Pa: Positive | None = None
    """Inflation pressure; default from the tyre file [Pa]."""
    low_speed_mps: Annotated[float, Range(0.1, 5.0)] = 2.0
    """Speed below which the standstill terms fade in [m/s]: there relaxation takes longer than a body oscillation."""
    low_speed_damping_Nspm: NotNegative = 1500.0
    """Viscous coefficient of the contact patch at rest [N s/m]: a third of the critical damping of a wheel of 1 kg m2
    that oscillates on a carcass of 450 kN/m, 2 sqrt(k J) / R = 4400 N s/m."""
    conventions: TyreConventions = TyreConventions()
    """Conventions that a tyre file leaves open. Default: the conventions of this package."""


@dataclass(frozen=True)
class DamperCurve:
    """Force of a damper versus velocity, piecewise linear, compression positive."""

    velocity_mps: tuple[float, ...]
    """Compression velocities, increasing [m/s]."""
    force_N: tuple[float, ...]
    """Forces that resist these velocities [N]."""

    def __post_init__(self) -> None:
        """Check that the curve has increasing velocities."""
        check_points("velocity_mps", self.velocity_mps, {"force_N": self.force_N}, Range(2, MAX_CURVE_POINTS))


@dataclass(frozen=True)
class Dampers:
    """Damper curves, one per axle."""

    front: DamperCurve
    rear: DamperCurve


VIBRATION_AT_MPS: Final = 80.0 / 3.6
"""Speed of the car at which `Friction.vibration_mps` holds [m/s]."""


@dataclass(frozen=True)
class Friction:
    """Dry friction, independent of speed and elastic until it slips (see `native_actuators`)."""

    front_damper_N: NotNegative = 0.0
    """Friction of seal, piston and rod guide of a front damper or strut, along it [N]."""
    rear_damper_N: NotNegative = 0.0
    """The same friction of a rear damper or strut [N]."""
    rack_N: NotNegative = 0.0
    """Friction of the rack in its guide and seals, of pinion and assist motor, along the rack [N]."""
    damper_stiffness_Npm: Annotated[float, Range(1.0, 1e6)] = 1e5
    """Force over travel before a damper slips [N/m]: a seal's lip deflects by some tenths of a millimetre."""
    vibration_mps: Annotated[float, Range(0.0, 1.0)] = 0.0
    """RMS of the damper speed that a road's roughness causes at 80 km/h [m/s]. It grows with the root of the speed."""
    rack_stiffness_Npm: Annotated[float, Range(1.0, 1e7)] = 2e6
    """Force over travel before the rack slips [N/m]."""


@dataclass(frozen=True)
class Powertrain:
    """Engine, gearbox and differentials: torque of the driven wheels and its distribution (see `drive_limits`).

    On axles with motors the torques and the power are the limits of the driver's demand, which motors carry out.
    """

    front_fraction: Fraction
    """Fraction of the drive torque at the front axle. Each axle's part is split evenly [-]."""
    max_torque_Nm: Positive
    """Highest drive torque at all wheels together, in first gear [N m]."""
    max_power_W: Positive
    """Highest total power at the wheels: the power of the engine minus the losses of the gears [W]."""
    engine_brake_torque_Nm: NotNegative
    """Drag of the engine at all wheels together, in first gear [N m]; less in the longer gears of higher speeds."""
    max_wheel_speed_radps: Positive = 250.0
    """Mean speed of the driven wheels at which the engine is at its rev limit in top gear [rad/s]."""
    inertia_kgm2: NotNegative = 0.0
    """Inertia of engine and gears at all driven wheels together, in one gear that represents all [kg m2]."""
    lag_s: Annotated[float, Range(0.001, 2.0)] = 0.1
    """Time constant of the torque relative to its demand: filling of the engine, twist of the driveline [s]."""

    @property
    def wheel_fractions(self) -> tuple[float, float, float, float]:
        """Fraction of the drive torque at each wheel [-], in the order of `CORNERS`."""
        front, rear = 0.5 * self.front_fraction, 0.5 * (1.0 - self.front_fraction)
        return front, front, rear, rear


@dataclass(frozen=True)
class Steering:
    """Steering ratio, lock angle and power assist."""

    ratio: Positive
    """Steering wheel angle over mean road-wheel angle around straight ahead [-]."""
    steering_wheel_limit_rad: Positive
    """Lock angle of the steering wheel to either side [rad]."""
    assist_fraction: Annotated[float, Range(0.0, 0.99)] = 0.35
    """Fraction of the column's torque that the power assist carries and the hands do not feel [-]; 0.35 belongs to the
    compact's column (its README). Only `hand_torque_Nm` and the torque limit of the hands depend on it."""


@dataclass(frozen=True)
class Aerodynamics:
    """Aerodynamic drag, without lift."""

    drag_area_m2: NotNegative
    """Drag coefficient times frontal area [m2]."""
    air_density_kgpm3: NotNegative = 1.2
    """Density of the air [kg/m3]. The default is for 20 deg C and sea level."""
    pressure_point_m: tuple[float, ...] = (0.0, 0.0, 0.0)
    """Point where drag acts, vehicle axes [m]."""


@dataclass(frozen=True)
class Load:
    """Load of the car in addition to its model (see `loading`)."""

    KEY_HINTS: ClassVar = _MASS_HINTS

    payload_kg: Annotated[float, Range(0.0, 2000.0)] = 0.0
    """Persons and luggage in addition to the driver [kg]."""
    payload_position_m: Position | None = None
    """Centre of gravity of the payload, vehicle axes [m]; default above the middle of the rear axle, 0.6 m high."""
    payload_forward_change_m: Annotated[float, Range(-2.0, 4.0)] = 0.0
    """Forward shift of that position [m]. Unlike the position, it places the payload alike in cars of any wheelbase."""
    roof_kg: Annotated[float, Range(0.0, 500.0)] = 0.0
    """Load on the roof [kg], over the middle of the wheelbase."""
    roof_height_m: Annotated[float, Range(0.5, 4.0)] = 1.6
    """Height of the roof load's centre of gravity above the road [m]."""
    fuel_kg: Annotated[float, Range(-100.0, 200.0)] = 0.0
    """Fuel in addition to the fuel in the model [kg]. Negative is less."""
    fuel_position_m: Position | None = None
    """Position of the tank, vehicle axes [m]; default 0.4 m ahead of the rear axle, 0.35 m high."""
    cg_height_change_m: Annotated[float, Range(-0.3, 0.3)] = 0.0
    """Upward shift of the empty car's centre of gravity [m], by moving the chassis's centre of gravity."""
    cg_forward_change_m: Annotated[float, Range(-0.5, 0.5)] = 0.0
    """Forward shift of the empty car's centre of gravity [m]."""

    def __post_init__(self) -> None:
        """Check that each position has three numbers."""
        for name in ("payload_position_m", "fuel_position_m"):
            position = getattr(self, name)
            if position is not None and len(position) != 3:
                raise ParameterError(f"{len(position)} numbers given; 3 are needed", key=name, value=position)


@dataclass(frozen=True)
class Factors:
    """Factors on the modelled car, 1 by default (see `loading`)."""

    KEY_HINTS: ClassVar = dict.fromkeys(("mass_kg", "payload_kg"), _MASS_HINT)

    mass: Annotated[float, Range(0.5, 2.0)] = 1.0
    """Factor on the mass of the empty car: the chassis takes all of the difference, its inertia in proportion to its
    mass."""
    yaw_inertia: Annotated[float, Range(0.5, 2.0)] = 1.0
    """Factor on the yaw inertia of the empty car, as if masses were moved along the chassis, so that its pitch inertia
    changes by the same amount."""
    spring_rate: Annotated[float, Range(0.2, 5.0)] = 1.0
    """Factor on the rates of the springs. Their forces in the design position stay, and so does the ride height."""
    anti_roll_bar: Annotated[float, Range(0.0, 10.0)] = 1.0
    """Factor on the stiffnesses of the anti-roll bars."""
    damper: Annotated[float, Range(0.0, 10.0)] = 1.0
    """Factor on the forces of the dampers' curves."""
    tyre_friction: Annotated[float, Range(0.1, 2.0)] = 1.0
    """Factor on the tyres' LMUX and LMUY."""
    front_tyre_friction: Annotated[float, Range(0.1, 2.0)] = 1.0
    """Additional factor on LMUX and LMUY of the front tyres."""
    rear_tyre_friction: Annotated[float, Range(0.1, 2.0)] = 1.0
    """Additional factor on LMUX and LMUY of the rear tyres, as with other tyres on one axle."""
    tyre_cornering_stiffness: Annotated[float, Range(0.2, 3.0)] = 1.0
    """Factor on the tyres' LKY."""
    front_cornering_stiffness: Annotated[float, Range(0.2, 3.0)] = 1.0
    """Additional factor on LKY of the front tyres."""
    rear_cornering_stiffness: Annotated[float, Range(0.2, 3.0)] = 1.0
    """Additional factor on LKY of the rear tyres."""
    tyre_slip_stiffness: Annotated[float, Range(0.2, 3.0)] = 1.0
    """Factor on the tyres' LKX."""
    tyre_vertical_stiffness: Annotated[float, Range(0.2, 3.0)] = 1.0
    """Factor on the tyres' LCZ."""
    servo_lag: Annotated[float, Range(0.1, 5.0)] = 1.0
    """Factor on the lag of the model's servos of rear wheels and superposition. A screw and a motor have none."""

    def on_tyres(self, front: TyreParameters, rear: TyreParameters) -> tuple[TyreParameters, TyreParameters]:
        """Return the tyres of both axles with scaled coefficients."""
        axles = (
            (self.front_cornering_stiffness, self.front_tyre_friction),
            (self.rear_cornering_stiffness, self.rear_tyre_friction),
        )
        fitted = self._on_tyre(front, *axles[0])
        return fitted, fitted if rear is front and axles[0] == axles[1] else self._on_tyre(rear, *axles[1])

    def _on_tyre(self, tyre: TyreParameters, cornering_stiffness: float, friction: float) -> TyreParameters:
        scales = {
            "LMUX": self.tyre_friction * friction,
            "LMUY": self.tyre_friction * friction,
            "LKX": self.tyre_slip_stiffness,
            "LKY": self.tyre_cornering_stiffness * cornering_stiffness,
            "LCZ": self.tyre_vertical_stiffness,
        }
        changes = {key: factor * tyre[key] for key, factor in scales.items() if factor != 1.0}
        return tyre.with_values(**changes) if changes else tyre


@dataclass(frozen=True)
class VehicleParameters:
    """A vehicle file without the tables for controllers and driver."""

    KEY_HINTS: ClassVar = {
        **_MASS_HINTS,
        "payload_kg": _MASS_HINT,
        "cg_height_change_m": _GRAVITY_HINT,
        **dict.fromkeys(("roof_kg", "roof_load_kg"), "load.roof_kg loads the roof, at load.roof_height_m"),
        **dict.fromkeys(("fuel", "fuel_kg"), "load.fuel_kg is fuel in addition to the fuel in the model"),
        **dict.fromkeys(("springs", "spring_rate", "spring_stiffness"), "factors.spring_rate scales the springs"),
        **dict.fromkeys(("mu", "grip"), "road.mu is the road's, factors.tyre_friction scales the tyres"),
    }

    name: str
    mjcf: str
    """The model, a name in models/mjcf or a path."""
    width_m: Annotated[float, Range(0.5, 4.0)]
    """Width of the body without mirrors [m]: lanes are made for it, and cones touched by it."""
    tyres: TyreFitment
    dampers: Dampers
    brakes: Brakes
    powertrain: Powertrain
    steering: Steering
    aerodynamics: Aerodynamics
    rear_actuator: RearActuator = RearActuator()
    """Rear steering actuator; default the model's hinges."""
    superposition_actuator: SuperpositionActuator = SuperpositionActuator()
    """Superposition actuator; default the model's servo."""
    friction: Friction = Friction()
    """Dry friction; default none."""
    curves: Curves = Curves()
    """Curve axles in place of links; default none."""
    sensors: Sensors = Sensors()
    """Sensors; default ideal."""
    load: Load = Load()
    """Load; default none."""
    motors: Motors = Motors()
    """Electric motors; default none."""
    battery: Battery = Battery()
    """Battery of the motors. Default without limits."""
    factors: Factors = Factors()
    """Factors; default 1."""

    def __post_init__(self) -> None:
        """Reject keys without effect."""
        if self.battery != Battery() and not list(self.motors):
            raise ParameterError("has no effect on a car without [motors]", key="battery")
        engine = self.powertrain
        if not any(self.engine_fractions):
            for key, place in (("inertia_kgm2", "rotor_inertia_kgm2"), ("lag_s", "lag_s")):
                if getattr(engine, key) != getattr(Powertrain, key):
                    problem = f"has no effect: motors drive all driven wheels; motors.*.{place} is theirs"
                    raise ParameterError(problem, key=f"powertrain.{key}", value=getattr(engine, key))
        lag = self.factors.servo_lag
        if lag != 1.0 and self.rear_actuator.has_motor and self.superposition_actuator.has_motor:
            raise ParameterError(
                "has no effect on screws and a geared motor, whose lag follows from their own keys",
                key="factors.servo_lag",
                value=lag,
            )

    @property
    def engine_fractions(self) -> tuple[float, float, float, float]:
        """Fraction of the engine's torque at each wheel [-], in the order of `CORNERS`."""
        share = self.engine_share or 1.0
        front, _, rear, _ = self.powertrain.wheel_fractions
        front, rear = (0.0 if self.motors.on(ax) else part / share for ax, part in (("front", front), ("rear", rear)))
        return front, front, rear, rear

    @property
    def engine_share(self) -> float:
        """Fraction of the driver's demand that the engine, not the motors, provides [-]."""
        front = self.powertrain.front_fraction
        return 1.0 - sum(part for axle, part in (("front", front), ("rear", 1.0 - front)) if self.motors.on(axle))

    @property
    def drive(self) -> Powertrain:
        """Powertrain for the driver, with the torque limits of engine and motors."""
        engine, (front, _, rear, _) = self.powertrain, self.powertrain.wheel_fractions
        torques_Nm, powers_W = [engine.max_torque_Nm], [engine.max_power_W]
        for axle, fraction in (("front", 2.0 * front), ("rear", 2.0 * rear)):
            if fraction > 0.0 and (motors := self.motors.on(axle)):
                torques_Nm.append(sum(motor.wheel_torque_Nm for motor in motors) / fraction)
                powers_W.append(sum(motor.power_W for motor in motors) / fraction)
        return replace(engine, max_torque_Nm=min(torques_Nm), max_power_W=min(powers_W))


CLUTCH_OPEN: Final = 0
"""The gear in which the engine is disconnected from the wheels, whose torques then do not depend on the engine."""

_FADE: Final = 0.02
"""Fraction of the speed limit over which the torque fades to zero."""
_CLUTCH_SLIPS_radps: Final = 6.0
"""Speed of the wheels below which the clutch slips, and the drag of the engine falls with the speed [rad/s]: the speed
of idling at 800 1/min in first gear."""


@compiled
def drive_limits(
    speed_radps: float, gear: int, torque_Nm: float, power_W: float, limit_radps: float, drag_Nm: float
) -> tuple[float, float]:
    """Return the limits of the drive torque."""
    speed = gear * speed_radps
    high, low = torque_Nm, 0.0
    if speed > 0.0:
        longer = power_W / (torque_Nm * speed)
        longer = longer if longer < 1.0 else 1.0
        left = (limit_radps - speed) / (_FADE * limit_radps)
        high *= longer * min(max(left, 0.0), 1.0)
        low = -drag_Nm * longer * min(speed / _CLUTCH_SLIPS_radps, 1.0)
    if gear > 0:
        return low, high
    return -high, -low


@compiled_call(
    types.UniTuple(types.float64, 2), types.float64, types.intp, types.UniTuple(types.float64, 4), others_run=False
)
def _limits_Nm(speed_radps, gear, numbers):
    """Computation of `drive_limits`, called from Python."""
    return drive_limits(speed_radps, gear, *numbers)


@shared
def engine_speed(fractions: Sequence[float], wheel_speeds_radps: Sequence[float]) -> float:
    """Return the mean speed of the driven wheels, weighted by their fractions of the torque [rad/s]."""
    f, w = fractions, wheel_speeds_radps
    return f[0] * w[0] + f[1] * w[1] + f[2] * w[2] + f[3] * w[3]


class PowertrainLimits:
    """Powertrain as the driver knows it: torque limits at the current wheel speed.

    Attributes:
        fractions: Fraction of the torque that each wheel gets.
        numbers: Last four arguments of `drive_limits`.
    """

    def __init__(self, parameters: Powertrain) -> None:
        """Copy limits and fractions from the parameters."""
        self.fractions = parameters.wheel_fractions
        self.numbers = (
            parameters.max_torque_Nm,
            parameters.max_power_W,
            parameters.max_wheel_speed_radps,
            parameters.engine_brake_torque_Nm,
        )

    def speed_radps(self, wheel_speeds_radps: tuple[float, float, float, float]) -> float:
        """Return the mean speed of the driven wheels [rad/s], weighted by their fractions of the torque."""
        return engine_speed(self.fractions, wheel_speeds_radps)

    def limits_Nm(self, speed_radps: float, gear: int) -> tuple[float, float]:
        """Return the torque limits at all wheels together, forward positive [N m]."""
        return _limits_Nm(speed_radps, gear, self.numbers)
