"""The table [brakes] of a vehicle file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range

NotNegative = Annotated[float, Range(0.0)]
Positive = Annotated[float, Range(1e-9)]
Fraction = Annotated[float, Range(0.0, 1.0)]


@dataclass(frozen=True)
class Hydraulics:
    """Pressures of the wheel brakes behind the master cylinder and the valves; all four are assumptions, see docs."""

    full_pedal_pressure_Pa: Annotated[float, Range(1e6, 3e7)] = 10e6
    """Pressure at a pedal pressed to the end, and the most that the pump makes [Pa]."""
    rise_Paps: Annotated[float, Range(1e6, 1e9)] = 100e6
    """Fastest rise while the pedal feeds the wheel [Pa/s]: booster and inlet valve, 0 to 100 bar in 0.1 s."""
    fall_Paps: Annotated[float, Range(1e6, 1e9)] = 100e6
    """Fastest fall through the outlet valve [Pa/s]."""
    pump_rise_Paps: Annotated[float, Range(1e6, 1e9)] = 30e6
    """Fastest rise beyond the pedal's pressure, by the pump of a stability control [Pa/s]."""
    lag_s: Annotated[float, Range(0.001, 0.5)] = 0.008
    """Time constant of the pressure behind its demand: valves, lines, clearance of the pads [s]."""


@dataclass(frozen=True)
class Antilock:
    """Anti-lock control by wheel deceleration and slip; see `antilock`."""

    select_low: bool = True
    """Whether both rear wheels get the pressure of the one with less grip."""
    lowest_speed_mps: Annotated[float, Range(0.5, 10.0)] = 1.5
    """Speed below which it leaves the brakes to the driver [m/s] ..."""
    hand_over_Paps: NotNegative = 4e6
    """... by letting the pressures rise this fast to what he asks for [Pa/s]."""
    first_deceleration_mps2: Positive = 20.0
    """Deceleration of a wheel beyond the car's that releases it while the pedal is being pressed [m/s2]: a pressure
    that rises at its fastest makes 14 m/s2 at 100 km/h without any danger, by the slip that it needs."""
    first_slip: Fraction = 0.08
    """Least slip for that: below it a deceleration comes from the pedal or the road."""
    deceleration_mps2: Positive = 6.0
    """Deceleration beyond the car's once pressure is built up slowly [m/s2]."""
    min_slip: Fraction = 0.02
    """Least slip for that on a road without grip ..."""
    min_slip_gain_s2pm: NotNegative = 0.005
    """... its rise with the deceleration of the car, as the slip at the peak of friction rises [s2/m] ..."""
    min_slip_speed_mps: NotNegative = 0.1
    """... and what it is more at low speed, where the estimated speed is wrong, and wheels swing, by as much [m/s]."""
    largest_slip: Annotated[float, Range(0.05, 0.9)] = 0.3
    """Slip by the estimated speed that releases a wheel however slowly it came."""
    release_fraction: Fraction = 0.9
    """Pressure of a released wheel, as a fraction of what its friction bore ..."""
    regain_mps2: NotNegative = 10.0
    """... or less, where that friction would not speed the wheel up by this, as on ice [m/s2]."""
    rolls_fraction: Fraction = 0.5
    """A released wheel rolls with the car again once it regains speed by less than this fraction of what it did [-]."""
    resume_fraction: Fraction = 0.97
    """Pressure of a wheel that rolls again, likewise."""
    build_per_s: Positive = 0.5
    """Slow rise of pressure from there on, in fractions of the same a second [1/s]."""
    side_difference_Pa: NotNegative = 0.5e6
    """Pressure by which a front wheel may exceed one that is being released on the other side, at first [Pa] ..."""
    side_difference_rise_Paps: NotNegative = 4e6
    """... and how fast the difference may grow, so that the driver can follow the yaw moment [Pa/s]."""
    rear_side_fraction: Fraction = 0.5
    """Part of the difference that a controller steers against which the rear wheels get, too: a rear axle that is
    braked to its limit holds no side force."""


@dataclass(frozen=True)
class TractionControl:
    """Slip of the driven wheels, by the engine and by the brakes; see `traction`."""

    slip: Annotated[float, Range(0.005, 0.5)] = 0.05
    """Slip that is allowed, by the speed of the wheels that are not driven."""
    spin_mps: Annotated[float, Range(0.05, 5.0)] = 0.6
    """Speed that is allowed beside [m/s]."""
    engine_gain_Nmspm: NotNegative = 400.0
    """Drive torque taken back at once, per speed beyond [Nm/(m/s)]."""
    engine_integral_gain_Nmpm: NotNegative = 1500.0
    """Drive torque taken back in time, per speed beyond and second [Nm/m]."""
    brake_gain_Paspm: NotNegative = 1.5e6
    """Pressure at a driven wheel per speed beyond that of its axle's other wheel [Pa/(m/s)]."""
    brake_limit_Pa: NotNegative = 6e6
    """Most of that pressure [Pa]."""


@dataclass(frozen=True)
class Brakes:
    """Friction brakes: torque per wheel at full pedal, and the stiffness of pads and caliper in their holder."""

    front_torque_Nm: NotNegative
    """Torque of a front wheel at full pedal; over the pressure there, it is the torque per pressure [N m]."""
    rear_torque_Nm: NotNegative
    """The same of a rear wheel; both together are the balance [N m]."""
    drag_torque_Nm: NotNegative = 0.0
    """Dry friction of released pads, bearings and seals, per wheel [N m]."""
    stiffness_Nmprad: Positive = 1e5
    """Torque per angle of wind-up while the brake holds [N m/rad]."""
    parking_torque_Nm: NotNegative = 700.0
    """Torque of a rear wheel with the parking brake fully applied, by a cable or a spindle, without pressure [N m]."""
    hydraulics: Hydraulics = Hydraulics()
    """Pressures."""
    control_interval_s: Annotated[float, Range(0.001, 0.02)] = 0.005
    """Time between two decisions of anti-lock and traction control [s]."""
    abs: bool = True
    """Whether the anti-lock system is on; it does nothing while no wheel nears locking."""
    tcs: bool = False
    """Whether traction control is on."""
    antilock: Antilock = Antilock()
    """How the anti-lock system decides."""
    traction: TractionControl = TractionControl()
    """How traction control decides."""

    @property
    def torques_Nm(self) -> tuple[float, float, float, float]:
        """Torques of the wheels at full pedal [N m], order of `CORNERS`."""
        return self.front_torque_Nm, self.front_torque_Nm, self.rear_torque_Nm, self.rear_torque_Nm
