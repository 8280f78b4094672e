"""The metrics that belong to a recording, chosen by the kind of its manoeuvre."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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


def _evaluation(metrics: Callable[[RecordingLike], dict[str, float]], key_metrics: Sequence[str]) -> Evaluation:
    return Evaluation(metrics, tuple(map(metric, key_metrics)))


_GENERAL: Final = _evaluation(general.general_metrics, general.KEY_METRICS)
EVALUATIONS: Final[dict[str, Evaluation]] = {
    "step_steer": _evaluation(step_response.step_response_metrics, step_response.KEY_METRICS),
    "open_loop": _GENERAL,
    "random_steer": _GENERAL,
    "slowly_increasing_steer": _evaluation(step_response.slow_ramp_metrics, step_response.SLOW_RAMP_KEY_METRICS),
    "constant_radius": _evaluation(handling.handling_metrics, handling.KEY_METRICS),
    "sine_sweep": _evaluation(frequency_response.frequency_response_metrics, frequency_response.KEY_METRICS),
    "sine_with_dwell": _evaluation(sine_with_dwell.sine_with_dwell_metrics, sine_with_dwell.KEY_METRICS),
    "lane_change": _evaluation(path_following.path_following_metrics, path_following.LANE_CHANGE_KEY_METRICS),
    "slalom": _evaluation(path_following.path_following_metrics, path_following.SLALOM_KEY_METRICS),
    "follow_path": _evaluation(path_following.path_following_metrics, path_following.PATH_KEY_METRICS),
    "brake_in_turn": _evaluation(braking.brake_in_turn_metrics, braking.BRAKE_IN_TURN_KEY_METRICS),
    "phases": _evaluation(general.rollover_metrics, general.ROLLOVER_KEY_METRICS),
    "straight_braking": _evaluation(braking.straight_braking_metrics, braking.STRAIGHT_BRAKING_KEY_METRICS),
    "measured": _evaluation(general.measured_metrics, general.KEY_METRICS),
}
"""Kind of manoeuvre -> its evaluation."""


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
