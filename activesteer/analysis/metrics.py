"""The metrics that belong to a recording, chosen by the kind of its manoeuvre."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
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
from activesteer.config import read_toml
from activesteer.core.metric_table import Metric, metric
from activesteer.errors import RecordingError, nearest_names


class Evaluation(NamedTuple):
    """Evaluation of the runs of one kind of manoeuvre."""

    metrics: Callable[[RecordingLike], dict[str, float]]  # function from a run to its metrics
    # the metrics that are printed first and held against the baseline, the most telling first
    key_metrics: tuple[Metric, ...]


_TABLE: Final = read_toml(Path(__file__).with_name("key_metrics.toml"), RecordingError)[0]
_METRICS: Final[dict[str, Callable[[RecordingLike], dict[str, float]]]] = {
    "step_steer": step_response.step_response_metrics,
    "open_loop": general.general_metrics,
    "random_steer": general.general_metrics,
    "slowly_increasing_steer": step_response.slow_ramp_metrics,
    "constant_radius": handling.handling_metrics,
    "sine_sweep": frequency_response.frequency_response_metrics,
    "sine_with_dwell": sine_with_dwell.sine_with_dwell_metrics,
    "lane_change": path_following.path_following_metrics,
    "slalom": path_following.path_following_metrics,
    "follow_path": path_following.path_following_metrics,
    "brake_in_turn": braking.brake_in_turn_metrics,
    "phases": general.rollover_metrics,
    "straight_braking": braking.straight_braking_metrics,
    "measured": general.measured_metrics,
}
EVALUATIONS: Final = {
    kind: Evaluation(metrics, tuple(map(metric, _TABLE["key_metrics"].get(kind, _TABLE["key_metrics"]["open_loop"]))))
    for kind, metrics in _METRICS.items()
}
"""Kind of manoeuvre -> its evaluation."""
KEY_FIGURES: Final = {title: tuple(metrics) for title, metrics in _TABLE["key_figures"].items()}
"""Title of a key figure -> names of metrics, of which the first one that a run has is shown."""


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
