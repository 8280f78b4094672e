"""The outcome of runs in a few words, where there is no room for a report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from activesteer.analysis.harm import kept, losses
from activesteer.analysis.report.groups import groups_of, judge
from activesteer.metric_table import SIDESLIP_PEAKS, metric
from activesteer.recording import Recording

_ALSO: Final = ("yaw_rate_steady_state_radps", "stopping_distance_m", "steering_wheel_rms_rad")
"""Metrics that the outcome names if a manoeuvre has them."""


def outcome(recording: Recording) -> str:
    """Describe failures, met requirements and key figures of a run, in the words of the report."""
    metadata, metrics = recording.metadata, recording.metrics
    if not metadata.get("complete", True):
        return f"the run did not end properly: {metadata.get('error', 'no reason is recorded')}"
    said = [*losses(metrics), *kept(metrics)]
    peaks = [name for name in SIDESLIP_PEAKS if name in metrics]
    for name in (*peaks[:1], *_ALSO):
        if name in metrics:
            shown = metric(name)
            said.append(f"{shown.label.removesuffix(' abs')} {shown.text(metrics[name])} {shown.unit.name}")
    return ", ".join(said)


def verdict(recordings: Mapping[str, Recording]) -> list[str]:
    """Return a line for each run, then a line for each claim of the paper about them."""
    lines = [f"{name}: {outcome(recording)}" for name, recording in recordings.items()]
    groups = groups_of({f"{name}.mcap": recording for name, recording in recordings.items()})
    judged = judge(groups[0]).scorecard.judged if len(groups) == 1 else ()
    return lines + [f"{item.claim.id} {item.verdict.value}: {item.claim.text}" for item in judged]
