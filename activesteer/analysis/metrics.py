"""The metrics that belong to a recording, chosen by the kind of its manoeuvre."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from activesteer.analysis import (
    brake_in_turn,
    frequency_response,
    general,
    handling,
    path_following,
    sine_with_dwell,
    slow_ramp,
    step_response,
    straight_braking,
)
from activesteer.analysis.source import Evaluable, RecordingLike, maneuver_kind

BY_KIND: Final[dict[str, Callable[[RecordingLike], dict[str, float]]]] = {
    "step_steer": step_response.metrics,
    "slowly_increasing_steer": slow_ramp.metrics,
    "constant_radius": handling.metrics,
    "sine_sweep": frequency_response.metrics,
    "sine_with_dwell": sine_with_dwell.metrics,
    "lane_change": path_following.metrics,
    "slalom": path_following.metrics,
    "follow_path": path_following.metrics,
    "brake_in_turn": brake_in_turn.metrics,
    "straight_braking": straight_braking.metrics,
    "measured": general.measured_metrics,
}
"""Kinds of manoeuvre with metrics of their own; every other kind gets those of `general`."""


def metrics(recording: RecordingLike) -> dict[str, float]:
    """Metrics of a run.

    Args:
        recording: The run; `metadata["maneuver"]["kind"]` says what was driven.

    Returns:
        Metric name, ending in its unit, to value; nan where the run does not define one.

    Raises:
        RecordingError: the metadata name no kind, a channel is missing or not finite, there are less than two rows, or
            the run is not what its kind promises.
    """
    return BY_KIND.get(maneuver_kind(recording), general.metrics)(Evaluable(recording))
