"""The metrics that belong to a recording, chosen by the kind of its manoeuvre."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from activesteer.analysis import (
    braking,
    frequency_response,
    general,
    handling,
    path_following,
    sine_with_dwell,
    step_response,
)
from activesteer.analysis.source import Evaluable, RecordingLike, maneuver_kind
from activesteer.errors import RecordingError, nearest_names
from activesteer.metric_table import Metric, metric


class Evaluation(NamedTuple):
    """Evaluation of the runs of one kind of manoeuvre."""

    metrics: Callable[[RecordingLike], dict[str, float]]  # function from a run to its metrics
    # the metrics that are printed first and held against the baseline, the most telling first
    key_metrics: tuple[Metric, ...]


EVALUATIONS: Final[dict[str, Evaluation]] = {
    kind: Evaluation(metrics, tuple(map(metric, key_metrics.split())))
    for kind, metrics, key_metrics in (
        ("step_steer", step_response.step_response_metrics,
            "yaw_rate_response_time_s yaw_rate_peak_radps yaw_rate_overshoot yaw_rate_steady_state_radps "
            "ay_response_time_s ay_overshoot sideslip_peak_rad sideslip_steady_state_rad roll_peak_rad tb_srad"),
        ("slowly_increasing_steer", step_response.slow_ramp_metrics,
            "steering_wheel_at_0_3g_rad understeer_gradient_radpmps2 characteristic_speed_mps yaw_rate_gain_1ps "
            "steering_wheel_gain_mps2prad steer_gradient_radpmps2 roll_gradient_radpmps2 sideslip_gradient_radpmps2 "
            "linear_range_mps2 limit_acceleration_mps2"),
        ("constant_radius", handling.handling_metrics,
            "understeer_gradient_radpmps2 characteristic_speed_mps steer_gradient_radpmps2 ackermann_gradient_radpmps2 "
            "roll_gradient_radpmps2 sideslip_gradient_radpmps2 front_slip_gradient_radpmps2 "
            "rear_slip_gradient_radpmps2 linear_range_mps2 limit_acceleration_mps2"),
        ("sine_sweep", frequency_response.frequency_response_metrics,
            "yaw_rate_gain_1ps yaw_rate_phase_at_1Hz_rad yaw_rate_peak_gain_ratio yaw_rate_peak_gain_Hz "
            "yaw_rate_45deg_Hz yaw_rate_bandwidth_Hz ay_gain_mps2prad ay_phase_at_1Hz_rad roll_gain_radprad "
            "roll_phase_at_1Hz_rad"),
        ("sine_with_dwell", sine_with_dwell.sine_with_dwell_metrics,
            "yaw_rate_after_1000ms_share yaw_rate_after_1750ms_share lateral_displacement_m sideslip_peak_abs_rad "
            "yaw_rate_peak_abs_radps yaw_rate_reversal_peak_radps ay_peak_abs_mps2 roll_peak_abs_rad "
            "steering_wheel_peak_abs_rad speed_end_mps"),
        ("lane_change", path_following.path_following_metrics,
            "lane_overstep_m cones_hit track_deviation_max_m sideslip_peak_abs_rad yaw_rate_peak_abs_radps "
            "ay_peak_abs_mps2 yaw_rate_after_gates_rms_radps sideslip_after_gates_rms_rad steering_wheel_peak_abs_rad "
            "speed_loss_mps"),
        ("slalom", path_following.path_following_metrics,
            "track_amplitude_m cone_distance_mean_m cones_hit cones_missed sideslip_peak_abs_rad "
            "yaw_rate_peak_abs_radps ay_peak_abs_mps2 yaw_rate_after_gates_rms_radps steering_wheel_peak_abs_rad "
            "speed_loss_mps"),
        ("follow_path", path_following.path_following_metrics,
            "lap_time_s track_deviation_max_m track_deviation_rms_m sideslip_peak_abs_rad yaw_rate_peak_abs_radps "
            "ay_peak_abs_mps2 roll_peak_abs_rad steering_wheel_peak_abs_rad friction_utilisation_max speed_loss_mps"),
        ("brake_in_turn", braking.brake_in_turn_metrics,
            "yaw_rate_deviation_after_1000ms_radps path_deviation_after_1000ms_m yaw_rate_after_1000ms_radps "
            "yaw_rate_peak_abs_radps sideslip_peak_abs_rad mean_deceleration_mps2 ay_begin_mps2 radius_begin_m "
            "speed_begin_mps speed_end_mps"),
        ("straight_braking", braking.straight_braking_metrics,
            "stopping_distance_m mean_deceleration_mps2 braking_efficiency wheel_slip_max brake_pressure_peak_Pa "
            "yaw_rate_peak_abs_radps lateral_deviation_max_m steering_wheel_peak_abs_rad speed_begin_mps "
            "braking_begin_time_s"),
        ("phases", general.rollover_metrics,
            "two_wheel_lift_time_s wheel_load_min_N roll_peak_abs_rad ay_peak_abs_mps2 sideslip_peak_abs_rad "
            "yaw_rate_peak_abs_radps yaw_rate_rms_radps friction_utilisation_max steering_wheel_peak_abs_rad "
            "speed_end_mps"),
        ("open_loop", general.general_metrics,
            "yaw_rate_peak_abs_radps yaw_rate_rms_radps ay_peak_abs_mps2 ay_rms_mps2 sideslip_peak_abs_rad "
            "sideslip_rms_rad roll_peak_abs_rad roll_rms_rad steering_wheel_peak_abs_rad speed_end_mps"),
    )
}  # fmt: skip
"""Kind of manoeuvre -> its evaluation."""
EVALUATIONS["random_steer"] = EVALUATIONS["open_loop"]
EVALUATIONS["measured"] = EVALUATIONS["open_loop"]._replace(metrics=general.measured_metrics)


def evaluation_of(recording: RecordingLike) -> Evaluation:
    """Return the evaluation of a run's kind of manoeuvre."""
    kind = maneuver_kind(recording)
    if kind not in EVALUATIONS:
        raise RecordingError(
            f"there is no evaluation for the kind {kind!r}; {nearest_names(kind, EVALUATIONS)}",
            file="the metadata",
            key="maneuver.kind",
            value=kind,
        )
    return EVALUATIONS[kind]


def metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of a run.

    Args:
        recording: The run; `metadata["maneuver"]["kind"]` names the kind of manoeuvre.

    Returns:
        Metric name, ending in its unit, to value; nan where the run does not define one.

    Raises:
        RecordingError: the metadata name no kind or an unknown one, a channel is missing or not finite, there are fewer
            than two rows, or the run is not what its kind promises.
        ParameterError: the evaluation returns a metric that `metric_table` does not declare.
    """
    values = evaluation_of(recording).metrics(Evaluable(recording)) | general.energy_metrics(recording)
    if general.is_uneven(recording):
        values |= general.ride_metrics(Evaluable(recording))
    for name in values:
        metric(name)
    return values
