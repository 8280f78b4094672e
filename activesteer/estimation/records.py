"""Records of an estimator for compiled code: parameters and memory."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.estimation.setup import EstimatorParameters, EstimatorSetup

if TYPE_CHECKING:
    from activesteer.sensors.parameters import Sensor

LATERAL_SPEED, YAW_RATE, FRONT_SLIP, REAR_SLIP, FRONT_ERROR, REAR_ERROR, RATE_OFFSET, AY_OFFSET, BANK, \
    FRICTION, FRONT_STIFFNESS, REAR_STIFFNESS, REAR_RATIO = range(13)  # fmt: skip
"""Indices of the states v_y, r, a_f, a_r, e_f, e_r, b_r, b_y, g_y, u, k_f, k_r, w; see `kalman_filter`."""
N_STATES: Final = 13
"""Number of states; those from `FRICTION` on are properties of road and tyres, which are not learned while braking."""
N_MOVING: Final = 4
"""Number of states that depend on others after an interval; the others, behind them, depend only on themselves."""
AVERAGED_S: Final = 0.2
"""Time constant of the mean of the squared innovations [s]: some twenty samples."""
# Two measured values give 2 on average; the largest mean in 14 ordinary runs was 4.7. With a yaw rate of the wrong sign
# in two lane changes, it rose to 310 and 490. In ten slaloms on snow it had peaks of 8 to 184, and stayed below 10 for
# 95 % of the time in nine of them.
EXPLAINED: Final = 8.0
UNEXPLAINED: Final = 16.0
"""Mean squared innovation over its covariance up to which the model explains the car, and from which it does not."""
SAID: Final = (
    "yaw_rate_radps", "ay_mps2", "ax_mps2", "steering_wheel_rad", "rear_steer_rad", "superposition_rad",
    *(f"{corner}_spin_radps" for corner in ("fl", "fr", "rl", "rr")),
    *(f"{corner}_pressure_Pa" for corner in ("fl", "fr", "rl", "rr")),
)  # fmt: skip
"""Measured values in the order of a row."""
SAID_RATE, SAID_AY, SAID_AX, SAID_WHEEL, SAID_REAR, SAID_SUPERPOSITION, SAID_SPINS, SAID_PRESSURES = *range(7), 10
"""Indices in such a row; for wheel speeds and pressures the first index."""

MEMORY: Final = np.dtype(
    (
        np.record,
        [
            ("estimate", np.float64, (14,)),
            *((name, np.intp) for name in ("calls", "braked", "taken_as_known")),
            # of both measurements (innovations over covariances), sum of what is unexplained
            *(
                (name, np.float64)
                for name in ("waited_s", "innovation", "rate_innovation", "mean_innovation", "unexplained")
            ),
            *((name, np.float64) for name in ("left_out", "friction_used", "friction_borne")),
            ("last", np.float64, (3,)),
            ("last_spin_radps", np.float64, (4,)),
            *((name, np.float64) for name in ("speed_mps", "ax_offset_mps2")),
            *((name, np.float64) for name in ("speed_variance", "speed_offset_covariance", "offset_variance")),
            ("state", np.float64, (N_STATES,)),
            ("covariance", np.float64, (N_STATES, N_STATES)),
            ("now", np.float64, (N_STATES,)),
            *((name, np.float64) for name in ("front_angle_rad", "rear_angle_rad", "ax_mps2")),
            *((name, np.float64) for name in ("front_along_N", "moment_Nm", "loading_mps2")),
            *((name, np.float64) for name in ("roll_rad", "roll_rate_radps")),
            *((name, np.float64, (4,)) for name in ("along_N", "load_N", "by_wheel_mps", "not_slid_s")),
        ],
    )
)
"""Memory of an estimator: estimate, last filter step, states and covariances, inputs of the model, values per wheel."""

KNOWN: Final = np.dtype(
    (
        np.record,
        [
            *((name, np.float64) for name in (
                "mass_kg", "yaw_inertia_kgm2", "cg_to_front_m", "cg_to_rear_m", "front_compliance_radpN",
                "rear_compliance_radpN", "front_load_N", "rear_load_N", "front_load_kg", "rear_load_kg",
                "along_load_kg", "front_relaxation_m", "rear_relaxation_m", "angle_step_rad", "front_load_step_N",
                "rear_load_step_N", "roll_gradient_radpmps2", "roll_speed_radps", "roll_damping",
                "front_roll_arm_m", "rear_roll_arm_m", "pitch_gain", "drag_kgpm", "wheel_inertia_kgm2",
                "steering_ratio", "largest_ay_g",
                *(one.name for one in fields(EstimatorParameters)),
                "ay_offset_std_mps2", "ay_offset_s", "rate_offset_std_radps", "rate_walk_rad2ps3",
                "rate_variance_rad2ps2", "ay_variance_m2ps4", "ax_offset_std_mps2", "ax_offset_density_m2ps5",
                "wheel_variance_m2ps2", "call_s", "longest_s", "age_s",
            )),
            *((name, np.intp) for name in ("wheel_age", "steering_age", "actuator_age")),
            *((name, np.float64, (4,)) for name in (
                "half_track_m", "to_axle_m", "left_m", "rolling_radius_m", "drive_fraction",
                "torque_per_pressure_NmpPa", "slip_stiffness",
            )),
        ],
    )
)  # fmt: skip
"""Record of the properties and parameters that an estimator knows (see `known_of`)."""

_OFFSET_S: Final = 100.0
"""Time constant of the offset of the lateral accelerometer [s]: longer than any manoeuvre."""
_RATE_FLOOR_RADPS: Final = math.radians(0.02)
_AY_FLOOR_MPS2: Final = 0.03
"""Smallest standard deviations of a measurement, even if a data sheet gives less."""
_ENGINE_STEP_S: Final = 0.001
"""Interval of a controller that sees every new sample at once [s]."""
_SHORTEST_WAIT_S: Final = 0.005
"""Shortest time between two steps of the filters [s]: the tyres lag by about 20 ms."""


def known_of(setup: EstimatorSetup, parameters: EstimatorParameters, timestep_s: float) -> NDArray[Any]:
    """Return the car, uncertainties, times and wheels that an estimator knows, as a record of `KNOWN`."""
    values = _car(setup, parameters) | _uncertainties(setup, parameters) | _times(setup, timestep_s) | _wheels(setup)
    known = np.zeros(1, KNOWN)
    for name, value in values.items():
        known[name] = value
    return known


def _car(setup: EstimatorSetup, parameters: EstimatorParameters) -> dict[str, float]:
    body, more, (front, rear) = setup.single_track, setup.two_track, setup.tyres
    front_N, rear_N = body.wheel_loads_N
    # In a steady turn an axle carries its share of the mass, and its roll steer acts like a compliance.
    gradient = 0.5 * more.roll_gradient_radpmps2 * GRAVITY_MPS2
    rolled = parameters.front_roll_steer * gradient / front_N, parameters.rear_roll_steer * gradient / rear_N
    front_kg, rear_kg = setup.load_shifts_kg
    return {
        "mass_kg": body.mass_kg,
        "yaw_inertia_kgm2": body.yaw_inertia_kgm2,
        "cg_to_front_m": body.cg_to_front_m,
        "cg_to_rear_m": body.cg_to_rear_m,
        "front_compliance_radpN": 1.0 / body.front_stiffness_Nprad - 0.5 / front.stiffness_at(front_N) - rolled[0],
        "rear_compliance_radpN": 1.0 / body.rear_stiffness_Nprad - 0.5 / rear.stiffness_at(rear_N) - rolled[1],
        "front_load_N": front_N,
        "rear_load_N": rear_N,
        "front_load_kg": front_kg,
        "rear_load_kg": rear_kg,
        "along_load_kg": 0.5 * (body.mass_kg * more.load_height_m) / body.wheelbase_m,
        "front_relaxation_m": front.relaxation_length_m,
        "rear_relaxation_m": rear.relaxation_length_m,
        "angle_step_rad": front.slip_angle_step_rad,
        "front_load_step_N": front.load_step_N,
        "rear_load_step_N": rear.load_step_N,
        "roll_gradient_radpmps2": more.roll_gradient_radpmps2,
        "roll_speed_radps": 2.0 * math.pi * more.roll_frequency_Hz,
        "roll_damping": more.roll_damping,
        "front_roll_arm_m": more.front_roll_arm_m,
        "rear_roll_arm_m": more.rear_roll_arm_m,
        "pitch_gain": GRAVITY_MPS2 * more.pitch_gradient_radpmps2,
        "drag_kgpm": setup.drag_per_speed2_kgpm,
        "wheel_inertia_kgm2": more.wheel_inertia_kgm2,
        "steering_ratio": setup.steering_ratio,
        "largest_ay_g": 2.0 * (front.most_N(front_N) + rear.most_N(rear_N)) / (body.mass_kg * GRAVITY_MPS2),
    }


def _uncertainties(setup: EstimatorSetup, parameters: EstimatorParameters) -> dict[str, float]:
    """Return the parameters, with the values of the data sheets."""
    sensors, p = setup.sensors, parameters
    wheel_noise_mps = setup.tyres[0].rolling_radius_m * sensors.wheel_speed.amount("noise")
    return vars(p) | {
        "ay_offset_std_mps2": math.hypot(sensors.ay.amount("bias"), _AY_FLOOR_MPS2),
        "ay_offset_s": _OFFSET_S,
        "rate_offset_std_radps": sensors.yaw_rate.amount("bias"),
        "rate_walk_rad2ps3": sensors.yaw_rate.amount("drift") ** 2 / 60.0,
        "rate_variance_rad2ps2": sensors.yaw_rate.amount("noise") ** 2 + _RATE_FLOOR_RADPS**2,
        "ay_variance_m2ps4": sensors.ay.amount("noise") ** 2 + _AY_FLOOR_MPS2**2,
        "ax_offset_std_mps2": math.hypot(sensors.ax.amount("bias"), p.slope_std_mps2),
        "ax_offset_density_m2ps5": p.slope_density_m2ps5,
        "wheel_variance_m2ps2": wheel_noise_mps**2 + p.wheel_std_mps**2,
    }


def _times(setup: EstimatorSetup, timestep_s: float) -> dict[str, float]:
    sensors = setup.sensors
    age_s = max(_age_s(sensors.yaw_rate), _age_s(sensors.ay)) + 0.5 * max(timestep_s - _ENGINE_STEP_S, 0.0)

    def younger(sensor: Sensor, held_s: float = 0.0) -> int:
        return max(round((age_s - _age_s(sensor) - held_s) / timestep_s), 0)

    # A wheel speed is a mean over the time since the last sample.
    held_s = 0.5 * max((sensors.wheel_speed.sample_time_s or 0.0) - timestep_s, 0.0)
    return {
        "call_s": timestep_s,
        "longest_s": max(timestep_s, sensors.yaw_rate.sample_time_s or 0.0, _SHORTEST_WAIT_S),
        "age_s": age_s,
        "wheel_age": younger(sensors.wheel_speed, held_s),
        "steering_age": younger(sensors.steering_wheel),
        "actuator_age": younger(sensors.rear_steer),
    }


def _age_s(sensor: Sensor) -> float:
    """Return the age of a new sample of a sensor: delay and low-pass [s]."""
    return (sensor.delay_s or 0.0) + (0.5 / math.pi / sensor.bandwidth_Hz if sensor.bandwidth_Hz else 0.0)


def _wheels(setup: EstimatorSetup) -> dict[str, Any]:
    body, more, (front, rear) = setup.single_track, setup.two_track, setup.tyres

    def of(front_value: float, rear_value: float) -> NDArray[np.float64]:
        return np.repeat([front_value, rear_value], 2)

    half_m = 0.5 * of(*more.tracks_m)
    return {
        "half_track_m": half_m,
        "to_axle_m": of(body.cg_to_front_m, -body.cg_to_rear_m),
        "left_m": half_m * (1.0, -1.0, 1.0, -1.0),
        "rolling_radius_m": setup.rolling_radius_m,
        "drive_fraction": setup.drive_fractions,
        "torque_per_pressure_NmpPa": setup.brake_torque_per_pressure_NmpPa,
        "slip_stiffness": of(front.slip_stiffness, rear.slip_stiffness),
    }
