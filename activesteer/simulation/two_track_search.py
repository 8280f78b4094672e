"""Search for the two-track properties of a car in driven tests: steering steps, and braking.

The steering wheel turns to one side and then to the other for about 2 m/s2 each. While the car turns steadily, the
difference between both sides gives load transfer and roll angle over lateral acceleration. Natural frequency and
damping of the roll are fitted to the whole run, with the roll angle as the response of a second-order system to the
lateral acceleration.

The same run gives the lateral speed h_i of the wheels per roll rate p'. Their slip angles follow with a lag, the
relaxation length s_i, which is fitted too:

    s_i / v_x a_i' = d_i - (v_y + h_i p' +- l_i r) / v_x + c p + a_0 - a_i

The term c p stands for the camber and for small errors of the axle's distance l_i.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from activesteer.analysis.source import RecordingLike
from activesteer.core.conventions import CORNERS, Array
from activesteer.errors import ModelError
from activesteer.scenario import FileOrTable, resolve
from activesteer.simulation.preparation import Run
from activesteer.theory.single_track import SingleTrack, TwoTrackParameters
from activesteer.vehicle import Vehicle
from activesteer.vehicle.statics import mass_properties

_SPEED_MPS: Final = 80.0 / 3.6
_AY_MPS2: Final = 2.0
"""Lateral acceleration of the steps, in the linear range [m/s2]."""
_LEAST_MPS2: Final = 0.5
"""Smallest acceleration from which gradients are taken [m/s2]."""
_STEADY_S: Final = ((2.0, 2.5), (4.5, 5.0))
"""Times in which the car turns steadily, to the left and to the right [s]."""
_STEPS_S: Final = (0.0, 0.5, 0.7, 2.5, 2.9, 5.0)
_PEDAL: Final = 0.3
_BRAKING_S: Final = (1.5, 2.5)
_BRAKING: Final = {
    "kind": "open_loop", "name": "braking", "speed_mps": 100.0 / 3.6, "duration_s": _BRAKING_S[1],
    "brake": {"time_s": [0.0, 0.3, _BRAKING_S[1]], "pedal": [0.0, _PEDAL, _PEDAL]},
}  # fmt: skip
_EVERY: Final = 10
"""Rows between two samples of the fit."""


def two_track_of(vehicle: FileOrTable, run: Run, overrides: Mapping[str, Any] | None = None) -> TwoTrackParameters:
    """Return the two-track properties of a car."""
    scenario = resolve(_steps(vehicle, overrides), vehicle, overrides)
    car = scenario.car.on()
    body = mass_properties(car.model, car.data)
    wheels = [car.model.body(f"{wheel}_wheel").id for wheel in CORNERS]
    tracks_m = [_contact_y(car, f"{axle}l") - _contact_y(car, f"{axle}r") for axle in "fr"]
    turned = run(scenario)
    ay, roll = _channel(turned, "ay_mps2"), _channel(turned, "roll_rad")
    change_mps2 = _between_sides(turned, ay)
    if not change_mps2 > 2.0 * _LEAST_MPS2:
        raise ModelError(
            f"the car turns with only {0.5 * change_mps2:.2g} m/s2 in a test for [two_track]; more than "
            f"{_LEAST_MPS2:g} m/s2 are needed"
        )
    arms_m = [
        _roll_arm(*_slip_and_motion(turned, axle, to_axle_m))
        for axle, to_axle_m in (
            ("f", scenario.car.config.single_track.cg_to_front_m),
            ("r", -scenario.car.config.single_track.cg_to_rear_m),
        )
    ]
    front_Nm, rear_Nm = (
        track * _between_sides(turned, _channel(turned, f"{axle}r_tyre_fz_N") - _channel(turned, f"{axle}l_tyre_fz_N"))
        for axle, track in zip("fr", (0.5 * each for each in tracks_m), strict=True)
    )
    height_m = (front_Nm + rear_Nm) / change_mps2 / body.mass_kg
    gradient = _between_sides(turned, roll) / change_mps2
    frequency_Hz, damping = _roll(ay, roll - roll[0], gradient, float(turned.time_s[1] - turned.time_s[0]))
    return TwoTrackParameters(
        load_height_m=height_m,
        front_track_m=tracks_m[0],
        rear_track_m=tracks_m[1],
        front_load_transfer_fraction=front_Nm / (front_Nm + rear_Nm),
        roll_gradient_radpmps2=gradient,
        roll_frequency_Hz=frequency_Hz,
        roll_damping=damping,
        front_roll_arm_m=arms_m[0],
        rear_roll_arm_m=arms_m[1],
        pitch_gradient_radpmps2=_pitch_gradient(run(resolve(_BRAKING, vehicle, overrides))),
        wheel_inertia_kgm2=float(car.model.body_inertia[wheels].max(axis=1).mean()),  # about the axis
    )


def _steps(vehicle: FileOrTable, overrides: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return a manoeuvre with a step of the steering wheel to either side."""
    car = resolve({"kind": "open_loop", "speed_mps": _SPEED_MPS, "duration_s": 1.0}, vehicle, overrides).car.config
    gain = SingleTrack(car.single_track).yaw_rate_gain(_SPEED_MPS)
    angle_rad = car.steering.ratio * _AY_MPS2 / _SPEED_MPS / gain
    angles_rad = [0.0, 0.0, angle_rad, angle_rad, -angle_rad, -angle_rad]
    return {
        "kind": "open_loop", "name": "steps", "speed_mps": _SPEED_MPS, "duration_s": _STEPS_S[-1],
        "steering": {"time_s": list(_STEPS_S), "steering_wheel_rad": angles_rad},
    }  # fmt: skip


def _contact_y(car: Vehicle, wheel: str) -> float:
    """Return the lateral position of the road below the middle of a standing wheel [m]."""
    centre, axis = (
        car.data.xpos[car.model.body(f"{wheel}_wheel").id],
        car.data.xaxis[car.model.joint(f"{wheel}_spin").id],
    )
    down = axis[2] * axis - np.array([0.0, 0.0, 1.0])  # in the plane of the wheel
    return float(centre[1] - centre[2] * down[1] / down[2])


def _channel(recording: RecordingLike, name: str) -> Array:
    return np.asarray(recording[name], dtype=np.float64)


def _between_sides(recording: RecordingLike, values: Array) -> float:
    """Return the difference of a value between steady turns to the left and to the right."""
    left, right = (
        float(values[(recording.time_s >= begin) & (recording.time_s <= end)].mean()) for begin, end in _STEADY_S
    )
    return left - right


def _roll(ay: Array, roll: Array, gradient: float, step_s: float) -> tuple[float, float]:
    """Return natural frequency [Hz] and damping ratio of the roll."""
    from scipy.optimize import least_squares  # noqa: PLC0415 - slow to import
    from scipy.signal import cont2discrete, lfilter  # noqa: PLC0415

    def residual(place: Array) -> Array:
        speed, damping = 2.0 * math.pi * place[0], place[1]
        system = [gradient * speed**2], [1.0, 2.0 * damping * speed, speed**2]
        discrete: Any = cont2discrete(system, step_s, "zoh")
        (numerator,), denominator, _ = discrete
        return (lfilter(numerator, denominator, ay - ay[0]) - roll)[::_EVERY] / gradient

    found = least_squares(residual, [2.0, 0.3], bounds=([0.2, 0.02], [9.0, 5.0]))
    return float(found.x[0]), float(found.x[1])


def _slip_and_motion(turned: RecordingLike, axle: str, to_axle_m: float) -> tuple[Array, Array, Array, Array, float]:
    """Return the arguments of `_roll_arm` for an axle at a distance ahead of the centre of gravity."""
    slip, steer = (
        0.5 * (_channel(turned, f"{axle}l_{name}_rad") + _channel(turned, f"{axle}r_{name}_rad"))
        for name in ("slip_angle", "steer")
    )
    across_mps = _channel(turned, "vy_mps") + to_axle_m * _channel(turned, "yaw_rate_radps")
    speed_mps = _channel(turned, "vx_mps")
    per_step_m = float(speed_mps.mean()) * float(turned.time_s[1] - turned.time_s[0])
    roll, rate = _channel(turned, "roll_rad"), _channel(turned, "roll_rate_radps")
    # A positive slip angle of the recording gives a negative force.
    return -slip, steer - across_mps / speed_mps, roll, rate / speed_mps, per_step_m


def _roll_arm(slip: Array, unrolled: Array, roll: Array, rate_radpm: Array, per_step_m: float) -> float:
    """Return the lateral speed of an axle's wheels per roll rate [m]; slip angles positive for a positive force."""
    # `unrolled` has no relaxation: steer angle and motion of a body that does not roll. `rate_radpm` is roll rate over
    # speed, `per_step_m` the road between two samples.
    from scipy.optimize import least_squares  # noqa: PLC0415 - slow to import
    from scipy.signal import lfilter  # noqa: PLC0415

    def fitted(relaxation_m: float) -> tuple[Array, Array]:
        kept = math.exp(-per_step_m / relaxation_m)
        columns = np.array([unrolled, -rate_radpm, roll]).T
        start = columns[0]
        moved = start + lfilter([1.0 - kept], [1.0, -kept], columns - start, axis=0)
        known, unknown = moved[:, 0], np.column_stack((moved[:, 1:], np.ones(len(roll))))
        found = np.linalg.lstsq(unknown, slip - known, rcond=None)[0]
        return found, known + unknown @ found

    def residual(place: Array) -> Array:
        return (fitted(math.exp(place[0]))[1] - slip)[::_EVERY] / np.ptp(slip)

    found = least_squares(residual, [math.log(0.2)], bounds=([math.log(1e-3)], [math.log(5.0)]))
    return float(fitted(math.exp(found.x[0]))[0][0])


def _pitch_gradient(recording: RecordingLike) -> float:
    """Return the pitch angle per deceleration [rad/(m/s2)]."""
    pitch, braking = _channel(recording, "pitch_rad"), recording.time_s >= _BRAKING_S[0]
    return max(0.0, float((pitch[braking].mean() - pitch[0]) / -_channel(recording, "ax_mps2")[braking].mean()))


def two_track_lines(parameters: TwoTrackParameters) -> dict[str, str]:
    """Return the entries of the table [two_track], rounded to the resolution of the tests."""
    return {key: f"{value:.{5 if 'gradient' in key else 3}f}" for key, value in vars(parameters).items()}
