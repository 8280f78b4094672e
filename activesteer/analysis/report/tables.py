"""The tables of a report, as HTML."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from activesteer.analysis.claims.scorecard import Judged, Scorecard, Verdict, number_lines
from activesteer.analysis.report.parameters import Row
from activesteer.analysis.report.runs import Group, Run, entry
from activesteer.quantities import metric_label

_CLASS = {
    Verdict.PASSED: "passed",
    Verdict.FAILED: "failed",
    Verdict.NOT_REPRODUCED: "known",
    Verdict.UNEXPECTED: "passed",
}


def verdict_counts(scorecards: Iterable[Scorecard]) -> dict[Verdict, int]:
    """How many claims came to each verdict that any came to."""
    verdicts = [item.verdict for card in scorecards for item in card.judged]
    return {verdict: verdicts.count(verdict) for verdict in Verdict if verdict in verdicts}


def contents(groups: Sequence[tuple[Group, str, Scorecard]]) -> str:
    """The manoeuvres, each with its runs and the numbers of its claims, linked to where they are told.

    Args:
        groups: Each with the id of its section and its claims.
    """
    lines = []
    for group, anchor, card in groups:
        names = "".join(f'<span class="run">{swatch(run)}{escape(run.name)}</span>' for run in group.runs)
        chips = "".join(
            f'<a class="chip {_CLASS[item.verdict]}" href="#{anchor}-{escape(item.claim.id)}" '
            f'title="{escape(item.claim.text)} ({item.verdict.value})">{escape(item.claim.id)}</a>'
            for item in card.judged
        )
        lines.append(
            f'<tr><th scope="row"><a href="#{anchor}">{escape(group.title)}</a></th>'
            f"<td>{names}</td><td>{chips}</td></tr>"
        )
    claimed = any(card.judged for _, _, card in groups)
    head = _head(["Manoeuvre", "Runs", "Scorecard" if claimed else ""])
    return _scrolling(f'<table class="contents">{head}<tbody>{"".join(lines)}</tbody></table>')


def claims(card: Scorecard, anchor: str) -> str:
    """The claims with their verdicts and numbers."""
    return f'<ul class="claims">{"".join(_claim(item, anchor) for item in card.judged)}</ul>'


def _claim(item: Judged, anchor: str) -> str:
    claim, verdict, reason = item
    numbers = "".join(f"<li>{escape(line)}</li>" for line in number_lines(claim.values))
    because = f'<p class="why"><b>Why:</b> {escape(reason)}</p>' if reason else ""
    return (
        f'<li id="{anchor}-{escape(claim.id)}"><p><span class="chip {_CLASS[verdict]}">{escape(claim.id)}</span> '
        f'{escape(claim.text)} <span class="verdict {_CLASS[verdict]}">{verdict.value}</span></p>'
        f'<ul class="numbers">{numbers}</ul><p class="quiet">Criterion: {escape(claim.criterion)}</p>{because}</li>'
    )


def files(groups: Sequence[Group]) -> str:
    """What was run, a line for each run."""
    runs = [(group, run) for group in groups for run in group.runs]
    told = {id(run): _changed(run) for _, run in runs}
    titles = ["File", "Manoeuvre", "Controller", "Vehicle", "Duration", *(["Changed"] if any(told.values()) else [])]
    lines = []
    for group, run in runs:
        span_s = float(run.recording.time_s[-1] - run.recording.time_s[0])
        words = (run.source, group.name, str(run.recording.metadata.get("controller", "")))
        cells = [*words, entry(run.recording, "vehicle", "name"), f"{span_s:.3f} s", told[id(run)]][: len(titles)]
        lines.append(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>")
    return _scrolling(f'<table class="files">{_head(titles)}<tbody>{"".join(lines)}</tbody></table>')


def _changed(run: Run) -> str:
    """The parameters that the user replaced."""
    changed: Any = run.recording.metadata.get("overrides")
    return ", ".join(f"{key} = {value}" for key, value in changed.items()) if isinstance(changed, Mapping) else ""


def metrics(group: Group) -> str:
    """Metrics with the differences to the first run; empty where no run has any."""
    values = [run.recording.metrics for run in group.runs]
    names = list(dict.fromkeys(name for metrics in values for name in metrics))
    if not names:
        return ""
    titles = ["Metric", "Unit"]
    for place, run in enumerate(group.runs):
        titles += [run.name] if place == 0 else [run.name, f"{run.name} against {group.runs[0].name}"]
    lines = []
    for name in names:
        words, unit, factor = metric_label(name)
        shown = [factor * metrics.get(name, math.nan) for metrics in values]
        cells = [number(shown[0])]
        for value in shown[1:]:
            cells += [number(value), _difference(value, shown[0])]
        numbers = "".join(f'<td class="number">{cell}</td>' for cell in cells)
        lines.append(f'<tr><th scope="row">{escape(words)}</th><td>{escape(unit)}</td>{numbers}</tr>')
    return _scrolling(f'<table class="metrics">{_head(titles)}<tbody>{"".join(lines)}</tbody></table>')


def number(value: float) -> str:
    """A value with three decimals, fewer where it is large; a dash where it does not exist."""
    if not math.isfinite(value):
        return "&ndash;"
    decimals = next((decimals for most, decimals in ((10.0, 3), (100.0, 2), (1000.0, 1)) if abs(value) < most), 0)
    return _with_minus(f"{value:.{decimals}f}")


def _difference(value: float, first: float) -> str:
    """The difference, and its share of the first value where that means something."""
    if not (math.isfinite(value) and math.isfinite(first)):
        return number(math.nan)
    difference = value - first
    if abs(difference) < 0.0005:
        return "0"
    text = f"{'+' if difference > 0.0 else ''}{number(difference)}"
    share = difference / abs(first) if first else math.inf
    if not 0.005 <= abs(share) < 10.0:
        return text
    return f'{text} <span class="quiet">({_with_minus(f"{share * 100.0:+.0f}")}&nbsp;%)</span>'


def _with_minus(text: str) -> str:
    return text.replace("-", "&minus;")


def parameters(found: Sequence[Row], names: Sequence[str]) -> str:
    """Parameters, those that differ between runs marked.

    Args:
        found: The parameters.
        names: Names of the runs that they are of.
    """
    several = any(row.differs for row in found)
    head = _head(["Parameter", *names]) if several else _head(["Parameter", "Value"])
    lines = []
    for row in found:
        mark = ' class="differs"' if row.differs else ""
        if row.differs or not several:
            cells = "".join(f"<td>{escape(value)}</td>" for value in row.values)
        else:
            cells = f'<td colspan="{len(names)}">{escape(row.values[0])}</td>'
        lines.append(f'<tr{mark}><th scope="row"><code>{escape(row.key)}</code></th>{cells}</tr>')
    return _scrolling(f'<table class="parameters">{head}<tbody>{"".join(lines)}</tbody></table>')


def swatch(run: Run) -> str:
    """The colour of a run."""
    return f'<span class="swatch" style="background:{run.colour}"></span>'


def _head(titles: Sequence[str]) -> str:
    cells = "".join(f'<th scope="col">{escape(title)}</th>' for title in titles)
    return f"<thead><tr>{cells}</tr></thead>"


def _scrolling(table: str) -> str:
    return f'<div class="scrolling" tabindex="0">{table}</div>'
