"""Steady-state handling (ISO 4138) from a slow ramp, at constant speed or on a constant radius.

The understeer gradient is the gradient of the steer angle (steering wheel over overall ratio) over lateral
acceleration, minus the gradient of the Ackermann angle l/R. With the measured curvature, yaw rate over speed, both
tests give the same line:

    steering wheel / ratio - l * yaw rate / speed = offset + EG * lateral acceleration

Gradients are fitted over `FIT_MPS2`, where tyres and suspension are linear. The offset is the small lag of the car
behind the ramp.

Source: ISO 4138, Passenger cars - Steady-state circular driving behaviour; v_ch = sqrt(l/EG) is the speed at which the
yaw rate per steer angle is largest.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.analysis.series import timestep
from activesteer.analysis.source import RecordingLike
from activesteer.core.conventions import Array
from activesteer.errors import RecordingError
from activesteer.theory.single_track import characteristic_speed

FIT_MPS2: Final = (0.5, 2.0)
"""Range of lateral acceleration over which gradients are fitted [m/s2]."""
DEPARTURE: Final = 0.05
"""Relative departure of the steer angle from the line at the end of the linear range."""
SMOOTHING_S: Final = 0.5
"""Window of the moving average for the limits [s]."""
MIN_SPEED_MPS: Final = 1.0
"""Least speed at which curvature is evaluated [m/s]."""
CONSTANT_SHARE: Final = 0.02
"""Relative change of a speed that counts as constant: 2 km/h at 100 km/h. Chosen."""


class CarGeometry(NamedTuple):
    """Geometry of the car that the evaluation needs."""

    cg_to_front_m: float  # distance of the centre of gravity to the front axle, l_V [m]
    cg_to_rear_m: float  # distance of the centre of gravity to the rear axle, l_H [m]
    steering_ratio: float  # steering wheel angle over road-wheel angle [-]

    @property
    def wheelbase_m(self) -> float:
        """Wheelbase l [m]."""
        return self.cg_to_front_m + self.cg_to_rear_m


def car_of(recording: RecordingLike) -> CarGeometry:
    """Read the geometry of the car from the metadata of a recording."""
    vehicle: Any = recording.metadata.get("vehicle")
    try:
        single_track, steering = vehicle["single_track"], vehicle["steering"]
        return CarGeometry(
            float(single_track["cg_to_front_m"]), float(single_track["cg_to_rear_m"]), float(steering["ratio"])
        )
    except (KeyError, TypeError, ValueError) as error:
        shown = sorted(vehicle) if isinstance(vehicle, Mapping) else vehicle
        raise RecordingError(
            "the metadata of the recording do not describe the car: vehicle.single_track.cg_to_front_m, "
            f"vehicle.single_track.cg_to_rear_m and vehicle.steering.ratio are needed; vehicle holds {shown!r}"
        ) from error


def evaluate(recording: RecordingLike, car: CarGeometry | None = None) -> dict[str, float]:
    """Return the steady-state handling from a slow ramp."""
    car = car or car_of(recording)
    ay = recording["ay_mps2"]
    side = math.copysign(1.0, float(ay[int(np.abs(ay).argmax())]))
    ay = side * ay
    speed = recording["vx_mps"]
    step_s = timestep(recording.time_s)
    smoothed = _moving_average(ay, step_s)
    # Only samples before the limit: beyond it the same acceleration occurs again.
    top = int(smoothed.argmax())
    first = int(np.argmax(smoothed > FIT_MPS2[0]))
    rising = np.zeros(len(ay), dtype=bool)
    rising[first : top + 1] = True
    fit = rising & (smoothed <= FIT_MPS2[1]) & (speed > MIN_SPEED_MPS)
    if smoothed[top] < FIT_MPS2[1] or fit.sum() < 10:
        raise RecordingError(
            f"the run reaches {smoothed[top]:.3g} m/s2 of lateral acceleration; gradients are fitted from "
            f"{FIT_MPS2[0]:g} to {FIT_MPS2[1]:g} m/s2",
            value=float(smoothed[top]),
            allowed=FIT_MPS2,
        )
    wheel = side * recording["steering_wheel_rad"]
    steer = wheel / car.steering_ratio
    yaw_rate = side * recording["yaw_rate_radps"]
    curvature = yaw_rate / np.maximum(speed, MIN_SPEED_MPS)
    sideslip = side * recording["sideslip_rad"]

    def gradient(values: Array) -> float:
        return _line(ay[fit], values[fit])[0]

    understeer, offset = _line(ay[fit], (steer - car.wheelbase_m * curvature)[fit])
    constant_speed = float(np.ptp(speed[fit])) < CONSTANT_SHARE * float(speed[fit].mean())
    expected = car.wheelbase_m * curvature + understeer * ay + offset
    departed = rising & (np.abs(_moving_average(steer - expected, step_s)) > DEPARTURE * np.abs(expected))
    departed &= smoothed > FIT_MPS2[1]
    return {
        "understeer_gradient_radpmps2": understeer,
        "steer_gradient_radpmps2": gradient(steer),
        "ackermann_gradient_radpmps2": gradient(car.wheelbase_m * curvature),
        "linear_range_mps2": float(smoothed[int(departed.argmax())]) if departed.any() else math.nan,
        "characteristic_speed_mps": characteristic_speed(car.wheelbase_m, understeer),
        "roll_gradient_radpmps2": gradient(side * recording["roll_rad"]),
        "sideslip_gradient_radpmps2": gradient(sideslip),
        "front_slip_gradient_radpmps2": gradient(steer - sideslip - car.cg_to_front_m * curvature),
        "rear_slip_gradient_radpmps2": gradient(car.cg_to_rear_m * curvature - sideslip),
        "yaw_rate_gain_1ps": _line(wheel[fit], yaw_rate[fit])[0] if constant_speed else math.nan,
        "steering_wheel_gain_mps2prad": _line(wheel[fit], ay[fit])[0] if constant_speed else math.nan,
        "limit_acceleration_mps2": float(smoothed[top]),
    }


def handling_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the steady-state handling from a test.

    Args:
        recording: A slow ramp to either side, from straight ahead: of the steering wheel at constant speed, or of the
            speed on a circle. Its metadata describe the car.

    Returns:
        Gradients are over lateral acceleration, in rad/(m/s2), or nan if not defined.

        - `understeer_gradient_radpmps2`: EG, at the road wheel; `steer_gradient_...` of steering wheel over ratio,
          `ackermann_gradient_...` of l/R.
        - `linear_range_mps2`: lateral acceleration at which the steer angle is 5 % off the line.
        - `characteristic_speed_mps`: sqrt(l/EG); nan for a car that does not understeer.
        - `roll_gradient_...`: roll angle, outwards positive. `sideslip_gradient_...`: sideslip angle at the centre of
          gravity, in a left turn.
        - `front_slip_gradient_...`, `rear_slip_gradient_...`: effective slip angles of the axles, at the front with
          steering and roll steer.
        - At constant speed `yaw_rate_gain_1ps` and `steering_wheel_gain_mps2prad`: yaw rate and lateral acceleration
          per steering wheel angle.
        - `limit_acceleration_mps2`: largest lateral acceleration; `speed_end_mps`.

    Raises:
        RecordingError: a channel is missing, or the run does not cover the range of the fit.
    """
    return {**evaluate(recording), "speed_end_mps": float(recording["speed_mps"][-1])}


def _line(x: Array, y: Array) -> tuple[float, float]:
    """Return slope and offset of the least-squares line through points."""
    spread = x - x.mean()
    slope = float(spread @ (y - y.mean()) / (spread @ spread))
    return slope, float(y.mean() - slope * x.mean())


def _moving_average(values: Array, step_s: float) -> Array:
    """Return the moving mean of a signal, with windows that are cut at its ends."""
    half = max(1, round(0.5 * SMOOTHING_S / step_s))
    total = np.concatenate(([0.0], np.cumsum(values)))
    index = np.arange(len(values))
    low, high = np.maximum(index - half, 0), np.minimum(index + half + 1, len(values))
    return (total[high] - total[low]) / (high - low)
