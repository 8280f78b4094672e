"""The paper's statements about the three systems: a table with a row for each, and the limits of their criteria.

Every criterion comes from the paper's words and from what a driver or a sensor can notice, and was written down before
anything was tuned.

The ratios of the sine with dwell are those of FMVSS 126, from the completion of steer. For a system that must keep the
car, their magnitude counts: a car that swings back fails too, which is stricter than the standard. For the car without
control, which must be lost, they count with their sign, as in the standard.

"Between the cones" of the slalom is from the first gate to the end of the last gate, by the front axle centre.

Sources: V. Dorsch, Implementation of active Steering Systems into a Multibody Vehicle Model by Co-Simulation,
Mecatronics-REM 2012, a section for each manoeuvre; 49 CFR 571.126; A. van Zanten et al., VDC, the vehicle dynamics
control system of Bosch, SAE 950759 (1995), for the sideslip angles that drivers know, up to 2 deg, and at which
steering has no effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Final

import numpy as np

from activesteer.analysis import lanes, path_following, sine_with_dwell, step_response
from activesteer.analysis.claims.judge import (
    ALL,
    SYSTEMS,
    SYSTEMS_WITH_CONTROL,
    TOGETHER,
    Kind,
    RunMetrics,
    Scenario,
    Statement,
    mean_straight_ahead,
)
from activesteer.analysis.harm import LOST_SIDESLIP_RAD
from activesteer.analysis.path_following import AFTER_S
from activesteer.analysis.series import crossing_time, rms, smooth, timestep
from activesteer.analysis.sine_with_dwell import INSTANTS_S, RATIO_LIMITS
from activesteer.analysis.source import RecordingLike, read_course
from activesteer.metric_table import (
    CONES_HIT,
    CONES_MISSED,
    LANE_OVERSTEP,
    SETTLED_SIDESLIP_RAD,
    SIDESLIP_RAD,
    STAYS_IN_LANES,
    STEER_RAD,
    STEERING_WHEEL_RAD,
    TIME_S,
    TRACK_M,
    YAW_RATE_RADPS,
)

LEVEL: Final = 0.9
"""Fraction of the steady-state value of none at which the delays of the step steer are compared."""
KEPT: Final = 0.8
"""Least fraction of the steady-state yaw rate that a system must keep. With less, the car only turns less."""
KEPT_SIDESLIP_RAD: Final = math.radians(12.0)
"""Largest sideslip angle at which the steering still turns the car on a dry road [rad]."""
SLIPPERY_SIDESLIP_RAD: Final = math.radians(5.0)
"""Largest sideslip angle at which the steering still turns the car on the slippery road [rad]: the 12 deg of a dry road
in proportion to the friction, 0.4 to 0.9, because the slip angle of the largest side force is proportional to it."""
MIN_ANGLE_RAD: Final = math.radians(0.1)
"""Least size of two added angles that are compared [rad]."""
OPPOSITE_FRACTION: Final = 0.9
"""Least fraction of the time of comparison in which they are opposite."""
MIN_COMMON_S: Final = 0.1
"""Least time of comparison [s]."""
ALIKE_M: Final = 0.5
"""Largest distance between tracks that look alike [m]: a seventh of the distance to the side lane."""
PEAK_FRACTION: Final = 0.9
"""Largest fraction of a peak that is left when a system lowers it."""
CALMED: Final = 0.5
"""Largest fraction of the root mean square that is left when a system calms an oscillation."""
SETTLED_YAW_RATE_RADPS: Final = math.radians(3.0)
"""Largest root mean square of the yaw rate of a car that runs straight [rad/s]: at 80 km/h it strays 0.3 m a second."""
LOW_SIDESLIP_RAD: Final = math.radians(2.0)
"""Largest sideslip angle that a driver knows from normal driving [rad]."""
LARGE_STEERING_WHEEL_RAD: Final = math.radians(90.0)
"""Largest steering wheel angle without crossing arms or changing the grip [rad]."""
NOT_REDUCED: Final = 0.95
"""Least fraction of the amplitude without control that is left when a system does not reduce it."""
LARGER: Final = 1.5
"""Least ratio of the driver's angle without control to the angles with control."""
LARGE_YAW_RATE_RADPS: Final = math.radians(5.0)
"""Yaw rate at the end that no car has which continues straight [rad/s]."""
LARGE_SIDESLIP_RAD: Final = math.radians(5.0)
"""Sideslip angle at the end that no car has which continues straight [rad]."""
OVERSTEP_M: Final = 0.5
"""Overstep that counts as a whole distance from keeping to the lanes [m]."""
END_S: Final = 3.0
"""Length of the end of the slippery run, which the paper's figures show [s]."""

PEAK: Final = "yaw_rate_peak_abs_radps"
"""Peak over the whole run, to either side: the peak of a car that swings back counts too."""
STEADY: Final = "yaw_rate_steady_state_radps"
COMMON_DELAYS: Final = {"yaw_rate_delay_s": ("yaw_rate", "radps"), "ay_delay_s": ("ay", "mps2")}
"""Times at which signals reach a common level, 90 % of the steady-state value of none. Name and unit of the signals."""
TURNED: Final = (("rear_steer", "rad"), ("superposition", "rad"), ("sideslip", "rad"))
"""Settled angles that count from straight ahead, where the offset of a sensor also turns wheels."""
ADDED: Final = ("rear_steer_steady_state_rad", "superposition_steady_state_rad")
"""Angles that count without the give of the hinges, which the car without control has too."""
RATIOS: Final = ("yaw_rate_after_1000ms_share", "yaw_rate_after_1750ms_share")
SIDESLIP_PEAK: Final = "sideslip_peak_abs_rad"
AFTER_YAW_RATE: Final = "yaw_rate_after_gates_rms_radps"
AFTER_SIDESLIP: Final = "sideslip_after_gates_rms_rad"
AFTER_DRIVER: Final = ("ay_after_gates_rms_mps2", "steering_wheel_after_gates_rms_rad")
GATES_YAW_RATE: Final = "yaw_rate_gates_rms_radps"
GATES_SIDESLIP: Final = "sideslip_gates_rms_rad"
GATES_STEERING: Final = "steering_wheel_gates_rms_rad"
WHEEL: Final = "steering_wheel_peak_abs_rad"
END_YAW_RATE: Final = "yaw_rate_end_rms_radps"
END_SIDESLIP: Final = "sideslip_end_rms_rad"
TRACKS: Final = {f"track_difference_{one}_{other}_m": (one, other) for one, other in combinations(SYSTEMS, 2)}


def _deg(angle_rad: float) -> str:
    return f"{math.degrees(angle_rad):g} deg"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _lowers(name: str, fraction: float, minimum: float = 0.0, *systems: str) -> list[str]:
    """Return the conditions that systems lower the magnitude of a metric to a fraction, and noticeably."""
    found: list[str] = []
    for system in systems or SYSTEMS_WITH_CONTROL:
        found.append(f"abs({name}({system})) <= {fraction} * abs({name}(none))")
        if minimum:
            found.append(f"abs({name}(none)) - abs({name}({system})) >= {minimum}")
    return found


def _extreme(system: str, name: str, minimum: float, *, sign: float) -> list[str]:
    """Return the conditions that the magnitude of a metric is noticeably above (1) or below (-1) the other two runs."""
    others = [other for other in SYSTEMS if other != system]
    return [f"{sign} * (abs({name}({system})) - abs({name}({other}))) >= {minimum}" for other in others]


def _helps(system: str) -> list[str]:
    """Return the benefit in the step steer without which the angles and the sideslip of a system prove nothing."""
    kept = f"{STEADY}({system}) * {STEADY}(none) >= {KEPT} * {STEADY}(none) * {STEADY}(none)"
    return [*_lowers(PEAK, 1.0, YAW_RATE_RADPS, system), kept]


def _along(name: str, other: str, system: str) -> str:
    """Return a metric of a system, positive if it has the sign of another one."""
    return f"{name}({system}) * {other}({system}) / abs({other}({system}))"


def _keeps(system: str) -> list[str]:
    """Return the conditions that a car keeps the limits of the sine with dwell."""
    ratios = [f"abs({ratio}({system})) <= {limit}" for ratio, limit in zip(RATIOS, RATIO_LIMITS, strict=True)]
    return [*ratios, f"{SIDESLIP_PEAK}({system}) <= {KEPT_SIDESLIP_RAD}"]


def _in_lanes(system: str, sign: float) -> str:
    """Return the condition that a body keeps to the lanes (1), or does not (-1)."""
    room = f"max(abs({LANE_OVERSTEP}({system})) / {OVERSTEP_M}, 1e-6)"
    return f"{sign} * {room} * (2 * {STAYS_IN_LANES}({system}) - 1) > 0"


_HELPED: Final = [*_helps("ars"), *_helps("afs")]
_LOWER: Final = (
    f"at least {_deg(YAW_RATE_RADPS)}/s below the peak of none, with at least {_percent(KEPT)} of its steady-state "
    "value"
)
_HELPS: Final = f"the peak yaw rate of {{}} is {_LOWER}"
_LIMITS: Final = " and ".join(
    f"{_percent(limit)} {instant_s:.2f} s" for limit, instant_s in zip(RATIO_LIMITS, INSTANTS_S, strict=True)
)
_CALMED_WORDS: Final = (
    f"in the {AFTER_S:g} s after the last gate (front axle centre) are, for ars and for afs, at most "
    f"{_percent(CALMED)} of the values of none and smaller by at least {_deg(YAW_RATE_RADPS)}/s and "
    f"{_deg(SIDESLIP_RAD)}; the remaining yaw rate is at most {_deg(SETTLED_YAW_RATE_RADPS)}/s"
)
_CALMED: Final = [
    *(f"{AFTER_YAW_RATE}({system}) <= {SETTLED_YAW_RATE_RADPS}" for system in SYSTEMS_WITH_CONTROL),
    *_lowers(AFTER_YAW_RATE, CALMED, YAW_RATE_RADPS),
    *_lowers(AFTER_SIDESLIP, CALMED, SIDESLIP_RAD),
]

STEP_STEER: Final = (
    Statement(
        "S1",
        "Both systems lower the peak of the yaw rate.",
        f"The peak yaw rates of ars and of afs are {_LOWER}.",
        {ALL: (PEAK, STEADY)},
        _HELPED,
    ),
    Statement(
        "S2",
        "Neither system makes the car answer later while it lowers the peak.",
        "Yaw rate and lateral acceleration of ars and of afs reach 90 % of the steady-state values of none, counted "
        f"from half the steering angle, at most {1000.0 * TIME_S:.0f} ms after none; and their peak yaw rates are "
        f"{_LOWER}. The paper's figure has the three curves in one diagram, where a delay is a distance at one level. "
        "The times to 90 % of each run's own steady-state value are given, and do not decide: a system that raises its "
        "steady state reaches 90 % of it later without answering later.",
        {ALL: (*COMMON_DELAYS, "yaw_rate_response_time_s", "ay_response_time_s")},
        [
            *_HELPED,
            *(f"{name}({one}) - {name}(none) <= {TIME_S}" for one in SYSTEMS_WITH_CONTROL for name in COMMON_DELAYS),
        ],
    ),
    Statement(
        "S3",
        "The rear wheels settle turned against the front wheels.",
        "The steady-state rear angle of ars, counted from straight ahead, less the angle of none (the give of the "
        f"hinges), has the opposite sign to the front wheels, and at least {_deg(STEER_RAD)}; {_HELPS.format('ars')}.",
        {"ars": (f"added_{ADDED[0]}", "front_steer_steady_state_rad")},
        [*_helps("ars"), f"-{_along(f'added_{ADDED[0]}', 'front_steer_steady_state_rad', 'ars')} >= {STEER_RAD}"],
    ),
    Statement(
        "S4",
        "The superposed angle adds to the driver's.",
        "The steady-state superposition angle of afs, counted from straight ahead, less the angle of none (the give of "
        f"the gear), has the sign of the steering wheel angle, and at least {_deg(STEER_RAD)}; {_HELPS.format('afs')}.",
        {"afs": (f"added_{ADDED[1]}", "steering_wheel_steady_state_rad")},
        [*_helps("afs"), f"{_along(f'added_{ADDED[1]}', 'steering_wheel_steady_state_rad', 'afs')} >= {STEER_RAD}"],
    ),
    Statement(
        "S5",
        "Rear steering makes the sideslip angle larger.",
        "The magnitude of the steady-state sideslip angle of ars, counted from straight ahead, is above the values of "
        f"none and of afs by at least {_deg(SETTLED_SIDESLIP_RAD)}; {_HELPS.format('ars')}.",
        {ALL: ("sideslip_steady_state_rad",)},
        [*_helps("ars"), *_extreme("ars", "sideslip_steady_state_rad", SETTLED_SIDESLIP_RAD, sign=1.0)],
    ),
)


def _kept(number: str, system: str, text: str) -> Statement:
    """Return D2 or D3: a system keeps the car that is lost without control."""
    return Statement(
        number,
        text,
        f"The yaw rate of {system} is in magnitude at most {_LIMITS} after the completion of steer, of its first peak "
        f"after the steering reversal (FMVSS 126), and its sideslip stays within {_deg(KEPT_SIDESLIP_RAD)}; none "
        f"breaks these limits, and the peak of its sideslip is at least {_deg(SIDESLIP_RAD)} larger.",
        {f"none {system}": (*RATIOS, SIDESLIP_PEAK)},
        [
            *_keeps(system),
            " or ".join(limit.replace("<=", ">") for limit in _keeps("none")),
            *_lowers(SIDESLIP_PEAK, 1.0, SIDESLIP_RAD, system),
        ],
    )


SINE_WITH_DWELL: Final = (
    Statement(
        "D1",
        "Without control the car is lost.",
        f"The yaw rate of none is above at least one of the limits of FMVSS 126 ({_LIMITS} after the completion of "
        f"steer), and its sideslip exceeds {_deg(LOST_SIDESLIP_RAD)} and twice the sideslip of ars and of afs.",
        {"none": RATIOS, ALL: (SIDESLIP_PEAK,)},
        [
            " or ".join(f"{ratio}(none) > {limit}" for ratio, limit in zip(RATIOS, RATIO_LIMITS, strict=True)),
            f"{SIDESLIP_PEAK}(none) > {LOST_SIDESLIP_RAD}",
            *(f"{SIDESLIP_PEAK}(none) > 2 * {SIDESLIP_PEAK}({system})" for system in SYSTEMS_WITH_CONTROL),
        ],
    ),
    _kept("D2", "ars", "Rear steering keeps the car."),
    _kept("D3", "afs", "Front superposition keeps the car."),
    Statement(
        "D4",
        "The angles that the two systems add have opposite signs.",
        f"From the steering reversal to {INSTANTS_S[-1]:.2f} s after the completion of steer, the rear angle demanded "
        "by ars times the angle demanded by afs integrates to less than 0, and while both are larger than "
        f"{_deg(MIN_ANGLE_RAD)}, at least {MIN_COMMON_S:.1f} s in all, they are opposite for "
        f"{_percent(OPPOSITE_FRACTION)} of the time.",
        {TOGETHER: ("added_angles_correlation", "added_angles_opposite_share", "added_angles_common_s")},
        [
            "added_angles_correlation(together) < 0",
            f"added_angles_common_s(together) >= {MIN_COMMON_S}",
            f"added_angles_opposite_share(together) >= {OPPOSITE_FRACTION}",
        ],
    ),
    Statement(
        "D5",
        "Rear steering is somewhat more effective than front superposition.",
        f"The peak of the sideslip of ars is at least {_deg(SIDESLIP_RAD)} below the peak of afs, and the magnitude of "
        "its yaw rate ratio 1.00 s after the completion of steer is not larger; ars keeps the limits of D2.",
        {"ars afs": (SIDESLIP_PEAK, RATIOS[0])},
        [
            *_keeps("ars"),
            f"{SIDESLIP_PEAK}(afs) - {SIDESLIP_PEAK}(ars) >= {SIDESLIP_RAD}",
            f"(abs({RATIOS[0]}(ars)) - abs({RATIOS[0]}(afs))) / {RATIO_LIMITS[0]} <= 0",
        ],
    ),
)


def _held(number: str) -> Statement:
    """Return L4, Z5 or W4: the paper's conclusion about the rear system, for a manoeuvre with a driver."""
    return Statement(
        number,
        "Rear steering holds the sideslip low.",
        f"The peak of the sideslip of ars is at most {_deg(LOW_SIDESLIP_RAD)}, and at least {_deg(SIDESLIP_RAD)} below "
        "the peaks of none and of afs.",
        {ALL: (SIDESLIP_PEAK,)},
        [f"{SIDESLIP_PEAK}(ars) <= {LOW_SIDESLIP_RAD}", *_extreme("ars", SIDESLIP_PEAK, SIDESLIP_RAD, sign=-1.0)],
    )


DOUBLE_LANE_CHANGE: Final = (
    Statement(
        "L1",
        "The three tracks look alike.",
        "From the first gate to the last, the tracks of the front axle centre of any two runs are at most "
        f"{ALIKE_M:g} m apart at the same x. The number of cones that each body hits is given, and does not decide.",
        {TOGETHER: TRACKS, ALL: (CONES_HIT,)},
        [f"{name}(together) <= {ALIKE_M}" for name in TRACKS],
    ),
    Statement(
        "L2",
        "Without control the car goes on oscillating after the last gate; each system stops that.",
        f"The root mean square of the yaw rate of none after the last gate is above {_deg(SETTLED_YAW_RATE_RADPS)}/s. "
        f"The root mean squares of yaw rate and sideslip {_CALMED_WORDS}. The root mean squares of lateral "
        f"acceleration and steering wheel angle are also at most {_percent(CALMED)} of the values of none.",
        {ALL: (AFTER_YAW_RATE, AFTER_SIDESLIP, *AFTER_DRIVER)},
        [
            f"{AFTER_YAW_RATE}(none) > {SETTLED_YAW_RATE_RADPS}",
            *_CALMED,
            *(condition for name in AFTER_DRIVER for condition in _lowers(name, CALMED)),
        ],
    ),
    Statement(
        "L3",
        "Each system lowers the peaks of yaw rate and sideslip.",
        "The largest magnitudes of yaw rate and of sideslip of ars and of afs are at most "
        f"{_percent(PEAK_FRACTION)} of the values of none, and smaller by at least {_deg(YAW_RATE_RADPS)}/s and "
        f"{_deg(SIDESLIP_RAD)}.",
        {ALL: (PEAK, SIDESLIP_PEAK)},
        [*_lowers(PEAK, PEAK_FRACTION, YAW_RATE_RADPS), *_lowers(SIDESLIP_PEAK, PEAK_FRACTION, SIDESLIP_RAD)],
    ),
    _held("L4"),
)
SLALOM: Final = (
    Statement(
        "Z1",
        "Without control the track swings wider.",
        "The amplitude of the front axle centre's track between first and last cone (half the distance of its leftmost "
        f"and rightmost place) is at least {TRACK_M:g} m larger for none than for ars and for afs. The number of "
        "cones that each body hits is given, and does not decide.",
        {ALL: ("track_amplitude_m", CONES_HIT)},
        [f"track_amplitude_m(none) - track_amplitude_m({system}) >= {TRACK_M}" for system in SYSTEMS_WITH_CONTROL],
    ),
    Statement(
        "Z2",
        "Each system reduces the oscillation of yaw rate and sideslip after the last gate.",
        f"The root mean squares of yaw rate and sideslip {_CALMED_WORDS}.",
        {ALL: (AFTER_YAW_RATE, AFTER_SIDESLIP)},
        _CALMED,
    ),
    Statement(
        "Z3",
        "Front superposition does not reduce the amplitudes, and needs large angles of the driver.",
        "Between the cones, the root mean squares of yaw rate and of sideslip of afs are not more than "
        f"{_percent(1.0 - NOT_REDUCED)} below the values of none. The root mean square of its steering wheel angle is "
        f"the largest of the three by at least {_deg(STEERING_WHEEL_RAD)}, and the angle exceeds "
        f"{_deg(LARGE_STEERING_WHEEL_RAD)}. afs passes every cone on the right side.",
        {ALL: (GATES_YAW_RATE, GATES_SIDESLIP, GATES_STEERING, WHEEL)},
        [
            *(f"{name}(afs) >= {NOT_REDUCED} * {name}(none)" for name in (GATES_YAW_RATE, GATES_SIDESLIP)),
            f"{WHEEL}(afs) > {LARGE_STEERING_WHEEL_RAD}",
            f"{CONES_MISSED}(afs) < 0.5",
            *_extreme("afs", GATES_STEERING, STEERING_WHEEL_RAD, sign=1.0),
        ],
    ),
    Statement(
        "Z4",
        "Rear steering has the smallest amplitudes of yaw rate and sideslip.",
        "Between the cones, the root mean squares of yaw rate and of sideslip of ars are below the values of none and "
        f"afs by at least {_deg(YAW_RATE_RADPS)}/s and {_deg(SIDESLIP_RAD)}.",
        {ALL: (GATES_YAW_RATE, GATES_SIDESLIP)},
        [
            *_extreme("ars", GATES_YAW_RATE, YAW_RATE_RADPS, sign=-1.0),
            *_extreme("ars", GATES_SIDESLIP, SIDESLIP_RAD, sign=-1.0),
        ],
    ),
    _held("Z5"),
)


def _stays(number: str, system: str, text: str) -> Statement:
    """Return W2 or W3: a system keeps the car on the slippery track."""
    return Statement(
        number,
        text,
        f"The whole body of {system} goes through every lane and never crosses a side; the body of none does not, and "
        f"gets at least {TRACK_M:g} m further out. {system} is under control: its sideslip stays within "
        f"{_deg(SLIPPERY_SIDESLIP_RAD)}, and in the last {END_S:g} s of the run the root mean square of its yaw rate "
        f"is at most {_deg(SETTLED_YAW_RATE_RADPS)}/s.",
        {f"none {system}": (LANE_OVERSTEP, STAYS_IN_LANES, CONES_HIT, SIDESLIP_PEAK, END_YAW_RATE)},
        [
            _in_lanes(system, 1.0),
            _in_lanes("none", -1.0),
            f"{LANE_OVERSTEP}(none) - {LANE_OVERSTEP}({system}) >= {TRACK_M}",
            f"{SIDESLIP_PEAK}({system}) <= {SLIPPERY_SIDESLIP_RAD}",
            f"{END_YAW_RATE}({system}) <= {SETTLED_YAW_RATE_RADPS}",
        ],
    )


SLIPPERY: Final = (
    Statement(
        "W1",
        "Without control the driver leaves the track, with large steering angles, and the car ends with large yaw rate "
        "and sideslip.",
        f"The body of none does not keep to the lanes; its steering wheel angle exceeds "
        f"{_deg(LARGE_STEERING_WHEEL_RAD)} and {LARGER:g} times the angles of ars and of afs; in the last {END_S:g} s "
        f"of the run the root mean squares of its yaw rate and sideslip are above {_deg(LARGE_YAW_RATE_RADPS)}/s and "
        f"{_deg(LARGE_SIDESLIP_RAD)}.",
        {"none": (LANE_OVERSTEP, STAYS_IN_LANES, CONES_HIT, END_YAW_RATE, END_SIDESLIP), ALL: (WHEEL,)},
        [
            _in_lanes("none", -1.0),
            f"{WHEEL}(none) > {LARGE_STEERING_WHEEL_RAD}",
            *(f"{WHEEL}(none) > {LARGER} * {WHEEL}({system})" for system in SYSTEMS_WITH_CONTROL),
            f"{END_YAW_RATE}(none) > {LARGE_YAW_RATE_RADPS}",
            f"{END_SIDESLIP}(none) > {LARGE_SIDESLIP_RAD}",
        ],
    ),
    _stays("W2", "ars", "Rear steering keeps the car on the track."),
    _stays("W3", "afs", "Front superposition keeps the car on the track."),
    _held("W4"),
)


def _step_metrics(recording: RecordingLike) -> dict[str, float]:
    values = step_response.step_response_metrics(recording)
    for name, unit in TURNED:
        values[f"{name}_steady_state_{unit}"] -= mean_straight_ahead(recording, f"{name}_{unit}")
    return values | {PEAK: float(np.abs(recording["yaw_rate_radps"]).max())}


def _step_compared(recordings: Mapping[str, RecordingLike], metrics: RunMetrics, whole: bool) -> RunMetrics:
    """Return the added angles, and the times at which the signals reach the common level, from half the steering angle.

    A time is nan if its run is incomplete or stays below the level.
    """
    found: RunMetrics = {}
    for system in SYSTEMS:
        own = metrics[system]
        values = {f"added_{name}": own[name] - metrics["none"][name] for name in ADDED}
        for delay, (name, unit) in COMMON_DELAYS.items():
            values[delay] = math.nan
            if whole:
                steady, begin_s = metrics["none"][f"{name}_steady_state_{unit}"], own["step_time_s"]
                time_s = np.asarray(recordings[system].time_s, dtype=np.float64)
                moving = math.copysign(1.0, steady) * smooth(recordings[system][f"{name}_{unit}"], timestep(time_s))
                after = time_s >= begin_s
                values[delay] = crossing_time(time_s[after], moving[after], LEVEL * abs(steady)) - begin_s
        found[system] = values
    return found


def _added_angles(recordings: Mapping[str, RecordingLike], _: RunMetrics, whole: bool) -> RunMetrics:
    """Compare the demanded rear and superposed angle, without the give of the hinges, since the beginning of steer."""
    if not whole:
        return {TOGETHER: {"added_angles_common_s": 0.0}}
    ars, afs = recordings["ars"], recordings["afs"]
    times = sine_with_dwell.steering(ars)
    later_s = sine_with_dwell.steering(afs).begin_s - times.begin_s
    time_s = np.asarray(ars.time_s, dtype=np.float64)
    wanted = (time_s >= times.reversal_s) & (time_s <= times.completion_s + INSTANTS_S[-1])
    rear = np.asarray(ars["rear_steer_demand_rad"], dtype=np.float64)[wanted]
    front = np.interp(time_s[wanted] + later_s, afs.time_s, afs["superposition_demand_rad"])
    both = (np.abs(rear) > MIN_ANGLE_RAD) & (np.abs(front) > MIN_ANGLE_RAD)
    scale = float(np.sqrt(np.sum(rear**2) * np.sum(front**2)))
    return {
        TOGETHER: {
            "added_angles_correlation": float(np.sum(rear * front)) / scale if scale > 0.0 else math.nan,
            "added_angles_opposite_share": float(np.mean(rear[both] * front[both] < 0.0)) if both.any() else math.nan,
            "added_angles_common_s": float(np.count_nonzero(both)) * float(time_s[1] - time_s[0]),
        }
    }


def _lane_metrics(recording: RecordingLike) -> dict[str, float]:
    return {CONES_HIT: math.nan} | path_following.path_following_metrics(recording)


def _tracks(recordings: Mapping[str, RecordingLike], _: RunMetrics, whole: bool) -> RunMetrics:
    course = read_course(recordings["none"])
    first_m, last_m = course.first_gate_x_m, course.last_gate_x_m
    if last_m is None or not whole:
        return {}
    return {
        TOGETHER: {
            name: lanes.largest_difference(recordings[one], recordings[other], first_m, last_m)
            for name, (one, other) in TRACKS.items()
        }
    }


def _slippery_metrics(recording: RecordingLike) -> dict[str, float]:
    # A course without lanes has no track to stay on.
    without = dict.fromkeys((LANE_OVERSTEP, STAYS_IN_LANES, CONES_HIT), math.nan)
    last = recording.time_s >= recording.time_s[-1] - END_S
    end = {END_YAW_RATE: rms(recording["yaw_rate_radps"][last]), END_SIDESLIP: rms(recording["sideslip_rad"][last])}
    return without | path_following.path_following_metrics(recording) | end


SCENARIOS: Final[dict[str, Scenario]] = {
    "step_steer": Scenario("step steer", Kind.SYSTEMS, STEP_STEER, _step_metrics, _step_compared),
    "sine_with_dwell": Scenario(
        "sine with dwell", Kind.SYSTEMS, SINE_WITH_DWELL, sine_with_dwell.sine_with_dwell_metrics, _added_angles
    ),
    "double_lane_change": Scenario("double lane change", Kind.DRIVER, DOUBLE_LANE_CHANGE, _lane_metrics, _tracks),
    "slalom": Scenario("slalom", Kind.DRIVER, SLALOM, path_following.path_following_metrics),
    "double_lane_change_low_mu": Scenario("slippery double lane change", Kind.DRIVER, SLIPPERY, _slippery_metrics),
}
"""Name of the manoeuvre -> its claims, in the order of the paper's sections."""
STATEMENTS: Final = {row.id: row for scenario in SCENARIOS.values() for row in scenario.statements}
"""Number -> statement, in the same order."""
SCENARIO_OF: Final = {row.id: name for name, scenario in SCENARIOS.items() for row in scenario.statements}
"""Number of a statement -> name of its manoeuvre."""
