"""Summary text: scenario, results and metrics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from activesteer.metric_table import recorded_metric
from activesteer.playback.runs import Run


def summary(runs: Sequence[Run], verdict: Sequence[str] = ()) -> str:
    """Return a page in Markdown: scenario, results, metrics side by side, systems.

    Args:
        runs: The runs.
        verdict: Results, line by line.
    """
    lines: list[str] = []
    for text in dict.fromkeys(_scenario(run.recording.metadata) for run in runs):
        lines += [f"**{text}**", ""]
    if verdict:
        lines += [*(f"- {_emphasised(line)}" for line in verdict), ""]
    names = list(dict.fromkeys(name for run in runs for name in run.recording.metrics))
    if names:
        lines += [f"| metric | {' | '.join(run.short for run in runs)} |", "|---" * (1 + len(runs)) + "|"]
    for name in names:
        metric = recorded_metric(name)
        found = [run.recording.metrics.get(name) for run in runs]
        values = ("" if value is None else metric.text(value) for value in found)
        lines.append(f"| {metric.label}{metric.unit_name and f' [{metric.unit_name}]'} | {' | '.join(values)} |")
    lines.append("")
    for run in runs:
        metadata = run.recording.metadata
        versions = metadata.get("versions", {})
        text = f"- **{run.label}**: controller {metadata.get('controller', '?')}, "
        text += f"vehicle {_named(metadata, 'vehicle', 'name')}, activesteer {versions.get('activesteer', '?')}"
        if metadata.get("overrides"):
            text += ", " + ", ".join(f"{key} = {value}" for key, value in metadata["overrides"].items())
        if not metadata.get("complete", True):
            text += f". **Incomplete**: {metadata.get('error', 'the run did not end properly')}"
        lines.append(text)
    return "\n".join(lines) + "\n"


def _emphasised(line: str) -> str:
    """Set the subject of a verdict in bold type."""
    about, colon, words = line.partition(":")
    return f"**{about}{colon}**{words}" if colon else line


def _scenario(metadata: Mapping[str, Any]) -> str:
    return _named(metadata, "maneuver", "title") or _named(metadata, "maneuver", "name") or "a run"


def _named(metadata: Mapping[str, Any], table: str, key: str) -> str:
    entry = metadata.get(table, {})
    return str(entry.get(key, "")) if isinstance(entry, Mapping) else ""
