"""The report of runs as one HTML page that needs no other file and no network."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from datetime import date
from operator import neg
from pathlib import Path
from typing import Any, Final, NamedTuple

from markupsafe import Markup, escape

from activesteer.analysis.claims.scorecard import Judged, Scorecard, Verdict, number_lines
from activesteer.analysis.harm import LOST, is_controlled, kept, losses, shown
from activesteer.analysis.metrics import key_figures_of, label_of
from activesteer.analysis.report.curves import plots
from activesteer.analysis.report.groups import MOST_EVENTS, Group, ReportedRun, groups_of, judge
from activesteer.analysis.source import entry
from activesteer.analysis.step_response import NOT_FOLLOWED, follows_steering
from activesteer.analysis.tables import Cell, Change, difference_text, is_near, notes, number, significance
from activesteer.config import leaves
from activesteer.config.faults import faults_text
from activesteer.core.conventions import RunLook
from activesteer.core.files import write_text
from activesteer.core.metric_table import LANE_OVERSTEP, Better, recorded_metric
from activesteer.core.units import display_unit, parameter_label, parameter_title, typeset
from activesteer.errors import ParameterError
from activesteer.pages import Page, Section, Table, Text, failed, passed, render_page
from activesteer.recording import Recording

TITLE: Final = "activesteer report"
_VERDICT_LOOK: Final = {
    Verdict.PASSED: ("passed", "\N{CHECK MARK}"),
    Verdict.FAILED: ("failed", "\N{BALLOT X}"),
    Verdict.NOT_REPRODUCED: ("known", "\N{NOT EQUAL TO}"),
    Verdict.UNEXPECTED: ("passed", "\N{CHECK MARK}"),
}
"""Class in the stylesheet and mark of each verdict."""
_CHANGE_MARK: Final = {
    Change.BETTER: "\N{CHECK MARK}",
    Change.WORSE: "\N{BALLOT X}",
    Change.SAME: "\N{ALMOST EQUAL TO}",
    Change.OTHER: "",
}
"""Marks in addition to the colours, for readers who cannot see the colours."""


def write_report(recordings: Mapping[str, Recording], path: str | os.PathLike[str]) -> Path:
    """Write the report of runs and return its path.

    An existing file is replaced.

    Args:
        recordings: Recordings by their origin, such as the names of their files.
        path: The HTML file.

    Raises:
        ParameterError: there is no recording, or the file cannot be written.
        RecordingError: a recording has no rows.
    """
    return write_text(path, report_page(recordings), ParameterError)


def report_page(recordings: Mapping[str, Recording], made: date | None = None) -> str:
    """Return the report of runs as HTML. The same recordings and date give the same text."""
    groups = groups_of(recordings)
    anchors = {f"group-{number}": group for number, group in enumerate(groups, start=1)}
    cards, several = [judge(group) for group in groups], len(groups) > 1
    runs = [run for group in groups for run in group.runs]
    counted = f"{len(runs)} run{'s' * (len(runs) > 1)} of {len(groups)} manoeuvre{'s' * several}"
    facts = " · ".join([*_facts(groups, made or date.today()), counted])
    lead: list[Text] = [Markup('<span class="quiet">{}</span>').format(facts)]
    lead += [
        Markup('<span class="failed"><b>Incomplete:</b> {}: {}</span>').format(run.source, run.problem)
        for run in runs
        if run.problem
    ]
    everything = Scorecard(tuple(item for card in cards for item in card.judged))
    if everything.judged:
        counts = [
            Markup('<b class="{}">{} {} {}</b>').format(*_VERDICT_LOOK[verdict], count, verdict.value)
            for verdict, count in everything.counts.items()
        ]
        judged = ((anchor, card.judged) for anchor, card in zip(anchors, cards, strict=True))
        place = next((anchor, items[0].claim.id) for anchor, items in judged if items)
        words = Markup('Of {} <a href="#{}-{}">claims of the paper:</a> {}.')
        lead.append(words.format(len(everything.judged), *place, Markup(", ").join(counts)))
    sections = [_contents(anchors, cards)] if several else []
    for (anchor, group), card in zip(anchors.items(), cards, strict=True):
        sections += _sections(group, anchor, card, group.title if several else "")
    names = [f"{group.name} {run.name}" if several else run.name for group in groups for run in group.runs]
    data = [{"anchor": anchor, **plots(group)} for anchor, group in anchors.items()]
    page = Page(
        TITLE if several else f"{TITLE}: {groups[0].title}",
        f"Report: {len(groups)} manoeuvres" if several else groups[0].title,
        lead, [*sections, _vehicle(groups, names)], ("car.js", "report.js"), {"groups": data},
    )  # fmt: skip
    return render_page(page)


def _contents(anchors: Mapping[str, Group], cards: Sequence[Scorecard]) -> Section:
    """Return the table of all manoeuvres, with rows for the claims and for each run."""
    has_headline = any(HEADLINE in key_figures(group) for group in anchors.values())
    lines, about = [], []
    for (anchor, group), card in zip(anchors.items(), cards, strict=True):
        chips = Markup(" ").join(_chip(item, anchor) for item in card.judged)
        lines.append([Markup('<a href="#{}">{}</a>').format(anchor, group.title), chips, ""])
        titles = list(key_figures(group))
        place = titles.index(HEADLINE) if HEADLINE in titles else None
        for found in results(group):
            headline = "" if place is None else _told(found["figures"][place])
            lines.append([_swatch(found["run"].look) + found["run"].name, _outcome(found), headline])
        if card.judged:
            about.append(f"{card.judged[0].claim.id} to {card.judged[-1].claim.id} about {group.title}")
    note = (
        f"Claims of the paper: {'; '.join(about)}. \N{CHECK MARK} reproduced; \N{NOT EQUAL TO} not reproduced, with a "
        "reason in the report; \N{BALLOT X} not reproduced, unexpectedly."
    )
    heads = ["Manoeuvre, run", "Result", *([HEADLINE] if has_headline else [])]
    rows = [line[: len(heads)] for line in lines]
    return Section(tables=[Table("", heads, rows, kind="contents", note=note if about else "")])


def _swatch(look: RunLook) -> Markup:
    dashes = " ".join(f"{2 * length:g}" for length in look.dashes)
    return Markup(
        '<svg class="swatch" style="--run: var(--run-{})" viewBox="0 0 28 6" aria-hidden="true">'
        '<path d="M0 3h28" stroke-dasharray="{}"/></svg>'
    ).format(look.place, dashes)


def _outcome(found: Mapping[str, Any]) -> Markup:
    """Return the result of a drive, the failures of a run and the requirements that it met."""
    looks = ((failed, found["losses"]), (passed, found["kept"]))
    chips = [look(", ".join(words), chip=True) for look, words in looks if words]
    return Markup(" ").join(filter(None, [found["run"].result, *chips]))


def _told(figure: Mapping[str, Any]) -> Text:
    """Return a key figure with its difference from the first run."""
    if figure["difference"] in ("", "0"):
        return figure["text"]
    change: Change = figure["change"]
    difference = f"{_CHANGE_MARK[change]} {figure['difference']}"
    return Markup('{} <span class="{}">{}</span>').format(figure["text"], change.value, difference)


def _sections(group: Group, anchor: str, card: Scorecard, title: str) -> list[Section]:
    """Return the sections of a manoeuvre: its results and plots, the claims about it, its metrics and parameters."""
    runs, found, titles = [run.recording for run in group.runs], results(group), list(key_figures(group))
    names = [run.name for run in group.runs]
    told_first: list[Text] = []
    if changed := _changed(group):
        own = "" if group.runs[0].by_hand else " in place of the manoeuvre's own"
        words = Markup("Driven with <b>{}</b>" + own + ".")
        told_first.append(words.format("; ".join(changed)))
    if events := _events(group):
        told_first.append(Markup("Events: <b>{}</b>.").format("; ".join(events)))
    judged = any(map(_outcome, found))
    rows = [
        [_swatch(each["run"].look) + each["run"].look.label, *([_outcome(each)] if judged else []),
         *map(_told, each["figures"])]
        for each in found
    ]  # fmt: skip
    note = Markup(
        '<span class="better">\N{CHECK MARK} better</span>, <span class="worse">\N{BALLOT X} worse</span> than {}; '
        "\N{ALMOST EQUAL TO} a difference that neither a driver nor a sensor could tell."
    ).format(names[0])
    figures = [figure for each in found for figure in each["figures"]]
    if all(figure["change"] is Change.OTHER for figure in figures):
        compares = any(figure["difference"] not in ("", "0") for figure in figures)
        rated = "" if all(map(_is_judged, group.runs)) else ", rated only between complete runs under control"
        note = escape(f"Small: difference from {names[0]}{rated}.") if compares else Markup()
    heads = ["Run", *(["Result"] if judged else []), *titles]
    compared = Table("", heads, rows, kind="results", numbers=len(titles), note=note)
    first = Section(title, told_first, [compared] if len(heads) > 1 else [], anchor=anchor)
    details = [_claim(item, anchor) for item in card.judged]
    claims = Section("Claims of the paper", points=details, level=3, kind="claims")
    told = [f"The claims of the paper are not judged: {card.obstacle}."] if card.obstacle and not card.judged else []
    told += [f"{each[0].upper()}{each[1:]}." for each in notes({run.name: run.metrics for run in group.runs})]
    told += [f"{run.name}: {NOT_FOLLOWED}" for run in group.runs if not follows_steering(run.recording)]
    for name, run in zip(names, runs, strict=True):
        if error := run.metadata.get("metrics_error"):
            told.append(f"{name}: no metrics: {error}")
    others = [title for name in names[1:] for title in (name, f"{name} against {names[0]}")]
    metrics = metric_rows(group)
    tables = [Table("", ["Metric", "Unit", names[0], *others], metrics, kind="metrics", numbers=len(others) + 1)]
    settings = parameter_table(
        "Manoeuvre: parameters", parameters(runs, "controller", "maneuver", "timestep_s"), names, folded=True
    )
    last = Section("Metrics" if metrics else "", told, [*(tables if metrics else []), settings], level=3)
    return [first, *([claims] if card.judged else []), last]


def _chip(item: Judged, anchor: str) -> Markup:
    """Return the number of a claim with its verdict, as a link to its details."""
    (kind, mark), claim = _VERDICT_LOOK[item.verdict], item.claim
    return Markup('<a class="chip {}" href="#{}-{}" title="{} ({})">{} {}</a>').format(
        kind, anchor, claim.id, claim.text, item.verdict.value, mark, claim.id
    )


def _claim(item: Judged, anchor: str) -> Markup:
    """Return a claim with its numbers, its criterion, and the reason if it is not reproduced."""
    (kind, mark), claim = _VERDICT_LOOK[item.verdict], item.claim
    numbers = Markup().join(Markup("<li>{}</li>").format(typeset(line)) for line in number_lines(claim.values))
    why = Markup('<p class="why"><b>Why:</b> {}</p>').format(item.reason) if item.reason else ""
    return Markup(
        '<p id="{}-{}"><span class="chip {}">{} {}</span> {} <span class="verdict {}">{}</span></p>'
        '<ul class="numbers">{}</ul><details><summary>Criterion</summary><p>{}</p></details>{}'
    ).format(
        anchor, claim.id, kind, mark, claim.id, claim.text, kind, item.verdict.value, numbers,
        claim.statement.criterion, why,
    )  # fmt: skip


def parameter_table(title: str, found: Sequence[Row], names: Sequence[str], *, folded: bool = False) -> Table:
    """Return the table of parameters, with marked rows where the runs differ."""
    outside = frozenset(number for number, row in enumerate(found) if row.differs)
    columns = names if outside else ["Value"]
    rows = [
        [
            Markup('{} <code class="key quiet">{}</code>').format(parameter_title(row.key), row.key),
            *(row.values if row.differs else row.values * len(columns)),
        ]
        for row in found
    ]
    return Table(title, ["Parameter", *columns], rows, outside, kind="parameters", folded=folded)


_THINNED: Final = "The curves are thinned to 200 values per second; the metrics use every recorded value."


def _vehicle(groups: Sequence[Group], names: Sequence[str]) -> Section:
    recordings = [run.recording for group in groups for run in group.runs]
    vehicle = parameters(recordings, "vehicle")
    differing, alike = ([row for row in vehicle if row.differs is wanted] for wanted in (True, False))
    tables = [parameter_table("Vehicle: differences between the runs", differing, names)] if differing else []
    tables += [
        parameter_table("Vehicle: parameters of all runs", alike, names, folded=True),
        Table("Files", *file_rows(groups), kind="files"),
    ]
    versions, texts = parameters(recordings, "versions"), [_THINNED]
    if any(row.differs for row in versions):
        tables.append(parameter_table("Versions", versions, names))
    else:
        texts.append(f"Versions: {', '.join(f'{row.key} {row.values[0]}' for row in versions)}.")
    return Section("Vehicle and versions", texts, tables)


def _events(group: Group) -> list[str]:
    """Return the events during the runs, one line for each run."""
    several = len(group.runs) > 1
    listed = {f"{run.look.label}: " * several: run.events for run in group.runs}
    return [
        f"{label}{', '.join(f'{event.what} at {event.time_s:.4g} s' for event in events[:MOST_EVENTS])}"
        + (f" and {len(events) - MOST_EVENTS} more" if len(events) > MOST_EVENTS else "")
        for label, events in listed.items()
        if events
    ]


def _facts(groups: Sequence[Group], made: date) -> list[str]:
    """Return the date, the car, the driver, and the versions of the program."""
    recordings = [run.recording for group in groups for run in group.runs]
    facts = [made.isoformat()]
    for word, table, key in (
        ("vehicle", "vehicle", "name"), ("driver", "driver", "name"), ("activesteer", "versions", "activesteer"),
        ("MuJoCo", "versions", "mujoco"),
    ):  # fmt: skip
        if values := dict.fromkeys(value for run in recordings if (value := entry(run, table, key))):
            facts.append(f"{word} {', '.join(values)}")
    return facts


class Row(NamedTuple):
    """A parameter, and its value in each run."""

    key: str  # its name, with the names of its tables
    values: tuple[str, ...]  # its value in each run; a single value if all runs have the same

    @property
    def differs(self) -> bool:
        """True if the runs differ in this parameter."""
        return len(self.values) > 1


def parameters(recordings: Sequence[Recording], *tables: str) -> list[Row]:
    """Return the parameters of all runs as table rows, in the order of the first run."""
    flat = []
    for run in recordings:
        chosen = {key: run.metadata[key] for key in tables if key in run.metadata}
        one = chosen.get(tables[0])
        table = one if len(tables) == 1 and isinstance(one, Mapping) else chosen
        flat.append({".".join(path): _text(path[-1], value) for path, value in leaves(table).items()})
    found = []
    for key in dict.fromkeys(key for entries in flat for key in entries):
        values = tuple(entries.get(key, "") for entries in flat)
        found.append(Row(key, values if len(set(values)) > 1 else values[:1]))
    return found


def _text(key: str, value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return str(value).lower()
    if isinstance(value, int | float):
        unit, factor = display_unit(key)
        return typeset(f"{value:.6g}" if factor == 1.0 else f"{value:.6g} ({value * factor:.4g} {unit})")
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


MAX_FIGURES: Final = 6
"""Largest number of key figures that can be read quickly."""


HEADLINE: Final = "Largest sideslip angle [deg]"
"""Title of the key figure that is shown where there is room for only one."""


def results(group: Group) -> list[dict[str, Any]]:
    """Return failures, met requirements and key figures of each run of a group, compared with the first run."""
    chosen = key_figures(group).values()
    first = group.runs[0].metrics
    lost = [[*(["incomplete"] if run.problem else []), *losses(run.metrics)] for run in group.runs]
    found = []
    for place, run in enumerate(group.runs):
        metrics = run.metrics
        well = [*kept(metrics)] or (["stays under control"] if any(lost) and not lost[place] else [])
        figures = [_figure(name, metrics, first if place else None) for name in chosen]
        if not (_is_judged(group.runs[0]) and _is_judged(run)):
            figures = [figure | {"change": Change.OTHER} for figure in figures]
        found.append({"run": run, "losses": lost[place], "kept": well, "figures": figures})
    return found


def _is_judged(run: ReportedRun) -> bool:
    """Return whether differences from a run can be rated: it is complete, and the car is under control."""
    return not run.problem and is_controlled(run.metrics)


def key_figures(group: Group) -> dict[str, str]:
    """Return the key figures that at least one run has, and their column titles with units."""
    names = {name for run in group.runs for name, value in run.metrics.items() if math.isfinite(value)}
    found = {}
    for title, name in key_figures_of(names).items():
        unit = recorded_metric(name).unit_name
        found[f"{title} [{unit}]" if unit else title] = name
    return dict(list(found.items())[:MAX_FIGURES])


def _figure(name: str, metrics: Mapping[str, float], first: Mapping[str, float] | None) -> dict[str, Any]:
    """Return a key figure with its difference from the first run and the significance of the difference."""
    sizes = neg if name == LANE_OVERSTEP else abs if recorded_metric(name).better is Better.SMALLER else float
    value = sizes(metrics.get(name, math.nan))
    text = shown(name, metrics, number(name, value))
    before = math.nan if first is None else sizes(first.get(name, math.nan))
    if LOST in (text, shown(name, first or {}, "")) or not math.isfinite(value - before):
        return {"text": text, "difference": "", "change": Change.OTHER}
    difference = difference_text(name, value, before)
    # Percentages of the first value stand in the same row, so other differences have their unit.
    unit = {"%": "points"}.get(recorded_metric(name).unit_name, recorded_metric(name).unit_name)
    plain = f"{difference.text}\N{NO-BREAK SPACE}{unit}" if unit and difference.text != "0" else difference.text
    if is_near(name, value, before):
        return {"text": text, "difference": plain, "change": Change.SAME}
    change = significance(name, metrics[name], (first or {})[name])
    return {"text": text, "difference": difference.percent or plain, "change": change}


def file_rows(groups: Sequence[Group]) -> tuple[list[str], list[list[str]]]:
    """Return the table of files: its titles, and a row for each run."""
    runs = [(group, run) for group in groups for run in group.runs]
    changed = [changed_parameters(run) for _, run in runs]
    titles = ["File", "Manoeuvre", "Controller", "Vehicle", "Duration", *(["Changed"] if any(changed) else [])]
    rows = []
    for (group, run), overrides in zip(runs, changed, strict=True):
        span_s = float(run.recording.time_s[-1] - run.recording.time_s[0])
        controller = str(run.recording.metadata.get("controller", ""))
        vehicle = entry(run.recording, "vehicle", "name")
        name = group.title if run.by_hand else group.name
        rows.append([run.source, name, controller, vehicle, f"{span_s:.3f} s", overrides][: len(titles)])
    return titles, rows


def _changed(group: Group) -> list[str]:
    """Describe the overrides of the runs, once if they are equal in all runs."""
    words = [changed_parameters(run) for run in group.runs]
    if len(set(words)) == 1:
        return words[:1] if words[0] else []
    return [f"{run.name}: {said}" for run, said in zip(group.runs, words, strict=True) if said]


def changed_parameters(run: ReportedRun) -> str:
    """Describe the overrides of a run with their values and keys, empty without overrides."""
    changed: Any = run.recording.metadata.get("overrides")
    if not isinstance(changed, Mapping):
        return ""
    values = {key: faults_text(value) if key == "fault" else value for key, value in changed.items()}
    labels = {key: parameter_label(key) for key in values}
    return ", ".join(f"{words} {values[key]} {unit}".rstrip() + f" ({key})" for key, (words, unit) in labels.items())


def metric_rows(group: Group) -> list[list[Text]]:
    """Return the metrics that at least one run has, with units and differences from the first run."""
    values = [run.metrics for run in group.runs]
    rows = []
    for name in dict.fromkeys(name for metrics in values for name, value in metrics.items() if not math.isnan(value)):
        metric = recorded_metric(name)
        first, *others = (metrics.get(name, math.nan) for metrics in values)
        texts = [shown(name, run, number(name, run.get(name, math.nan))) for run in values]
        cells: list[Text] = [
            Markup('<span title="{}">{}</span>').format(name, label_of(name, values[0])),
            metric.unit_name,
            texts[0],
        ]
        for value, text in zip(others, texts[1:], strict=True):
            compared = difference_text(name, value, first) if LOST not in (text, texts[0]) else Cell("\N{EN DASH}")
            percent = Markup('{} <span class="quiet">({})</span>').format(*compared)
            cells += [text, percent if compared.percent else compared.text]
        rows.append(cells)
    return rows
