"""Report of a study, and figure of a search."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
from markupsafe import Markup
from numpy.typing import NDArray
from scipy.stats import rankdata

from activesteer.controllers import controller_spec
from activesteer.core.conventions import Array, run_looks
from activesteer.core.files import file_word, write_text
from activesteer.core.metric_table import SIDESLIP_PEAKS, recorded_metric
from activesteer.core.units import parameter_label, parameter_title, typeset
from activesteer.driver import driver_spec
from activesteer.errors import ActiveSteerError, StudyError
from activesteer.pages import Page, Section, Table, Text, render_page
from activesteer.plotting import Curve, Panel, Picture, draw, save
from activesteer.studies.engine.analysis import MAX_SAMPLES, indices
from activesteer.studies.engine.factor_values import FactorValues
from activesteer.studies.engine.runs import CURVE, run_command
from activesteer.studies.engine.store import IDENTITY, OUTCOME, Progress, Store
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.engine.tuning import Goal, Trial, Tuning

_SHOWN_ROWS: Final = 3000
"""Largest number of runs whose points the page holds. Counts and means are over all runs."""
_FEW: Final = 20
"""Number of a controller's runs below which quantiles, ranks and shares say little: the page shows each run instead."""
_BINS: Final = 40
_EXTREMES: Final = 5
_FIRST: Final = (*SIDESLIP_PEAKS, "yaw_rate_peak_radps", "ay_peak_mps2")
"""Metrics that a page shows first."""
_MAX_INDICES: Final = 400
"""Largest number of sets of indices. Each takes some hundredths of a second."""

Places = NDArray[np.int64]


def write_report(folder: str | os.PathLike[str]) -> Path:
    """Write report.html into the folder of a finished study."""
    home = Path(folder)
    store = Store(home, ())
    progress = store.progress()
    study = read_study(home / "study.toml")
    table = store.read()
    if not table.num_rows:
        raise StudyError(f"{home}: no run is done yet")
    page = _page(study, progress, table, home.resolve().name)
    return write_text(home / "report.html", render_page(page), StudyError)


def _page(study: StudyFile, progress: Progress, table: pa.Table, name: str) -> Page:
    """Return the page with runs, plots, factors and study file."""
    title, data = study.title or name, _data(study, table)
    counts = ", ".join(f"{number} {status}" for status, number in progress.by_status.items())
    parts = (("Manoeuvres", "maneuver"), ("Vehicles", "vehicle"), ("Controllers", "controller"))
    driven = " ".join(f"{word}: {', '.join(map(_words, table[part].unique().to_pylist()))}." for word, part in parts)
    lead: list[Text] = [f"{progress.done} of {progress.total} runs: {counts}. {driven}", *_finding(data)]
    lead += [
        Markup("Without effect: <code>{}</code> changes no metric of any run.").format(key)
        for key in progress.without_effect
    ]
    errors = [(str(number), error) for error, number in progress.errors.items()]
    factors = [
        (each["label"], f"{each['range']} {each['unit']}".rstrip(), Markup("<code>{}</code>").format(each["key"]))
        for each in data["factors"]
    ]
    is_relative = any(factor.nominal for factor in study.factors)
    note = "Relative: ratio to the value of the file; change: difference from it." if is_relative else ""
    tables = [Table("", ["runs", "error"], errors)] if errors else []
    columns = ("factor", "driven values", "key")
    tables.append(Table("Factors", columns, factors, folded=len(factors) > _FACTORS, note=note))
    sections = [
        Section(tables=tables, anchor="study"),
        Section("File of the study", [Markup('<code class="file">{}</code>').format(study.to_toml())]),
    ]
    return Page(title, title, lead, sections, ["study.js"], data)


def _words(name: str) -> str:
    """Return a name of the package in words, or the name of a file unchanged."""
    return name if "." in name else name.replace("_", " ")


def _finding(data: Mapping[str, Any]) -> list[Text]:
    """Name, for each controller, the factor with the largest rank correlation with the first metric."""
    rows, names, told = data["rows"], data["by_group"][0], []
    name = next((name for name in (*_FIRST, *names) if name in names), None)
    for place, controller in enumerate(data["controllers"] if name else ()):
        own = (np.array(rows["group"]) == 0) & (np.array(rows["controller"]) == place)
        columns = {each["label"]: rows["factors"][each["key"]] for each in data["factors"] if each["numeric"]}
        if len(columns) < 2 or np.sum(own) < _FEW:
            continue
        pairs = ((label, np.array([x, rows["metrics"][name]], np.float64)) for label, x in columns.items())
        found = [(_correlation(*pair[:, own & np.isfinite(pair).all(axis=0)]), label) for label, pair in pairs]
        value, most = max(found, key=lambda pair: abs(pair[0]), default=(0.0, ""))
        told += [f"{most} with {controller} ({typeset(f'{value:.2f}')})"] if value else []
    words = f"{recorded_metric(name or '').label} depends most on {', '.join(told)}"
    return [f"{data['groups'][0]}: {words}. Values in brackets are rank correlations."] if told else []


def _data(study: StudyFile, table: pa.Table) -> dict[str, Any]:
    """Return the data of the page as JSON values, in display units."""
    others = (*IDENTITY, *OUTCOME, *study.keys)
    metrics = [name for name in table.column_names if name not in others and not name.startswith(CURVE)]
    values = {name: table[name].to_numpy(zero_copy_only=False).astype(np.float64) for name in metrics}
    found = [recorded_metric(name) for name, column in values.items() if np.isfinite(column).any()]
    values = {metric.name: values[metric.name] * metric.unit.factor for metric in found}
    who = {name: _codes(table[name]) for name in ("maneuver", "vehicle", "controller")}
    groups = sorted(set(zip(who["maneuver"][1].tolist(), who["vehicle"][1].tolist(), strict=True)))
    # Evenly spread, complete samples keep paired runs together.
    shown = np.flatnonzero(table["sample"].to_numpy() % -(-table.num_rows // _SHOWN_ROWS) == 0)
    shown_table = table.take(pa.array(shown))
    return {
        "controllers": who["controller"][0],
        "places": [run_looks(who["controller"][0])[name].place for name in who["controller"][0]],
        "first": _FIRST,
        "groups": [f"{_words(who['maneuver'][0][m])}, {_words(who['vehicle'][0][v])}" for m, v in groups],
        "metrics": [{"name": metric.name, "label": metric.label, "unit": metric.unit.name} for metric in found],
        "factors": [_factor(study, key, table[key]) for key in study.keys],
        "rows": {
            "group": [groups.index(pair) for pair in zip(
                who["maneuver"][1][shown].tolist(), who["vehicle"][1][shown].tolist(), strict=True)],
            "controller": who["controller"][1][shown].tolist(),
            "sample": table["sample"].to_numpy()[shown].tolist(),
            "run": table["run"].to_numpy()[shown].tolist(),
            "factors": {key: _acting(study, key, shown_table) for key in study.keys},
            "metrics": {name: _json(column[shown]) for name, column in values.items()},
        },
        "all": table.num_rows,
        "by_group": [_of_group(study, table, values, who, pair) for pair in groups],
    }  # fmt: skip


def _codes(column: pa.ChunkedArray) -> tuple[list[str], Places]:
    """Return the distinct values of a column in order of occurrence, and the index of each row's value."""
    encoded = column.combine_chunks().dictionary_encode()
    return encoded.dictionary.to_pylist(), encoded.indices.to_numpy()


def _acting(study: StudyFile, key: str, rows: pa.Table) -> list[Any]:
    """Return the values of a factor, with None in manoeuvres in which it does not vary."""
    named = [factor.maneuvers for factor in study.factors if factor.key == key]
    values, maneuvers = rows[key].to_pylist(), rows["maneuver"].to_pylist()
    if not all(named):
        return values
    where = {name for names in named for name in names}
    return [value if name in where else None for value, name in zip(values, maneuvers, strict=True)]


_RELATIVE: Final = {"times": ", relative", "plus": ", change"}
"""Note on values that are relative to the files, by `Factor.nominal`."""


def _factor(study: StudyFile, key: str, column: pa.ChunkedArray) -> dict[str, Any]:
    numeric = pa.types.is_floating(column.type) or pa.types.is_integer(column.type)
    levels = column.drop_null().unique().to_pylist()
    few = len(levels) <= _BINS
    ordered = (sorted(levels) if numeric else [str(level) for level in levels]) if few or not numeric else []
    relative = next((factor.nominal for factor in study.factors if factor.key == key), None)
    words, unit = _label(study, key)
    told = {"label": f"{words}{_RELATIVE.get(relative or '', '')}", "unit": "" if relative == "times" else unit}
    several = ", ".join(map(str, ordered)) if len(ordered) <= _FACTORS else f"{len(ordered)} different"
    told["range"] = f"{min(levels):.4g} to {max(levels):.4g}" if numeric and levels else several
    return {"key": key, **told, "numeric": numeric, "levels": ordered}


def _label(study: StudyFile, key: str) -> tuple[str, str]:
    """Return label and unit of a factor. For a parameter of a user's code, the code declares the unit."""
    words, unit = parameter_label(key)
    with contextlib.suppress(ActiveSteerError):  # the code may be elsewhere by now
        for plugin in (*map(controller_spec, study.controllers), driver_spec(study.driver)):
            table, _, name = key.partition(f"{plugin.kind.table}.{plugin.key}.")
            if not plugin.is_builtin and not table and name in plugin.declared:
                return f"{plugin.key}: {name}", plugin.declared[name].unit
    return words, unit


def _of_group(
    study: StudyFile, table: pa.Table, values: Mapping[str, Array], who: Mapping[str, Any], group: tuple[int, int]
) -> dict[str, Any]:
    """Return the results of all rows of a manoeuvre with a vehicle, by metric."""
    inside = (who["maneuver"][1] == group[0]) & (who["vehicle"][1] == group[1])
    controllers = who["controller"][0]
    rows = [np.flatnonzero(inside & (who["controller"][1] == place)) for place in range(len(controllers))]
    samples = table["sample"].to_numpy()
    indexed = len(values) * len(controllers) <= _MAX_INDICES and len({len(each) for each in rows}) == 1
    indexed = indexed and study.case_list is None
    points = [
        {key: table[key].take(pa.array(each[:MAX_SAMPLES])).to_pylist() for key in study.keys} if indexed else {}
        for each in rows
    ]
    driven = table.select([*IDENTITY, *study.keys]).combine_chunks()
    pairs: list[Any] = [
        np.intersect1d(samples[rows[0]], samples[each], assume_unique=True, return_indices=True)[1:]
        for each in (rows[1:] if study.design.paired else ())
    ]
    factor_values = FactorValues(study)
    few = max(map(len, rows)) < _FEW
    shares = (0.0, 0.5, 1.0) if few else (0.05, 0.5, 0.95)
    found = {}
    for name, column in values.items():
        parts = [column[each] for each in rows]
        finite = [part[np.isfinite(part)] for part in parts]
        if not any(len(part) for part in finite):
            continue
        found[name] = {
            "histogram": _histogram(finite),
            "few": few,
            "quantiles": [_json(np.quantile(part, shares)) if len(part) else None for part in finite],
            "paired": _paired(pairs, parts, shares),
            "heat": _heat(study, table, rows, parts),
            "indices": _indices(study, points, parts) if indexed else [],
            "extremes": [_extremes(factor_values, driven, each, part) for each, part in zip(rows, parts, strict=True)],
        }
    return found


def _histogram(parts: Sequence[Array]) -> dict[str, Any]:
    together = np.concatenate(parts)
    low, high = float(together.min()), float(together.max())
    # The page holds five digits; values that differ by less are one value.
    if high - low <= 1e-3 * max(abs(low), abs(high), 1e-300):
        low, high = low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)
    edges = np.linspace(low, high, min(_BINS, max(8, 2 * int(np.sqrt(max(map(len, parts)))))) + 1)
    return {"edges": _json(edges), "counts": [np.histogram(part, edges)[0].tolist() for part in parts]}


def _paired(
    pairs: Sequence[tuple[Places, Places]], parts: Sequence[Array], shares: tuple[float, float, float]
) -> list[Any]:
    """Return quantiles of the differences from the first controller in each sample, and the share of smaller values."""
    found: list[Any] = []
    for (first, second), part in zip(pairs, parts[1:], strict=False):
        a, b = parts[0][first], part[second]
        both = np.isfinite(a) & np.isfinite(b)
        if not both.any():
            found.append(None)
            continue
        difference = (b - a)[both]
        smaller = float(np.mean(np.abs(b[both]) < np.abs(a[both])))
        found.append({"quantiles": _json(np.quantile(difference, shares)), "smaller": round(smaller, 4)})
    return found


def _heat(study: StudyFile, table: pa.Table, rows: Sequence[Places], parts: Sequence[Array]) -> dict[str, Any] | None:
    """Return the means over the grid of the first two factors, by controller."""
    grids = [factor for factor in study.factors if factor.kind == "grid"][:2]
    if len(grids) < 2:
        return None
    places = []
    for factor in grids:
        levels = {value: place for place, value in enumerate(factor.values)}
        places.append(np.array([levels[value] for value in table[factor.key].to_pylist()]))
    maps = []
    for each, part in zip(rows, parts, strict=True):
        total, count = np.zeros([len(factor.values) for factor in grids]), np.zeros([len(f.values) for f in grids])
        good = np.isfinite(part)
        where = (places[0][each][good], places[1][each][good])
        np.add.at(total, where, part[good])
        np.add.at(count, where, 1)
        with np.errstate(invalid="ignore"):
            maps.append([_json(row) for row in total / count])
    return {"axes": [{"key": factor.key, "levels": list(factor.values)} for factor in grids], "maps": maps}


def _indices(study: StudyFile, points: Sequence[Mapping[str, Any]], parts: Sequence[Array]) -> list[list[Any]]:
    """Return the indices of each controller as [factor, name, value, confidence, spread]."""
    found = [
        [
            [index.factor, index.name, *_json(np.array([index.value, index.confidence, index.spread]))]
            for index in indices(study.design.kind, study.factors, columns, part[:MAX_SAMPLES])
        ]
        for columns, part in zip(points, parts, strict=True)
    ]
    return found if any(found) else []


def _extremes(values: FactorValues, table: pa.Table, rows: Places, part: Array) -> list[list[Any]]:
    """Return the runs with the largest and the smallest magnitudes, each with value and command line."""
    good = np.flatnonzero(np.isfinite(part))
    if len(good) > 2 * _EXTREMES:
        good = good[np.argpartition(np.abs(part[good]), (_EXTREMES - 1, len(good) - _EXTREMES))]
        good = np.concatenate([good[:_EXTREMES], good[-_EXTREMES:]])
    chosen = good[np.argsort(-np.abs(part[good]), kind="stable")]
    return [
        [row["run"], float(f"{part[place]:.5g}"), _command(values, row)]
        for place, row in zip(chosen, table.take(pa.array(rows[chosen])).to_pylist(), strict=True)
    ]


def _command(factor_values: FactorValues, row: Mapping[str, Any]) -> str:
    """Return the command line that drives and replays a run, empty if its manoeuvre or vehicle has no file."""
    study = factor_values.study
    place = study.place_of(row)
    maneuver, vehicle = study.maneuvers[place[0]], study.vehicles[place[1]]
    if not (isinstance(maneuver, str) and isinstance(vehicle, str)):
        return ""
    sample = {key: row[key] for key in study.keys}
    values = study.overrides | factor_values.overrides(*place[:2], sample)
    command = run_command(maneuver, study.controllers[place[2]], vehicle, values, study.driver)
    file = f"run-{row['run']}.mcap"
    return f"{command} -o {file} && activesteer replay {file}"


def _json(column: Array) -> list[float | None]:
    """Round numbers to five digits for the page, with None for values that are not finite."""
    return [float(f"{value:.5g}") if np.isfinite(value) else None for value in column.tolist()]


_FACTORS: Final = 5
"""Largest number of factors that a page shows unfolded, or draws: those with which the margin correlates most."""
_KEPT, _BROKEN, _GREY = "#5b9fd0", "#b3261e", "0.6"


def draw_tuning(found: Tuning, folder: Path) -> list[Path]:
    """Draw the figure of a search into its folder, and return the files."""
    if not found.trials:
        return []
    if found.goal is Goal.VIOLATE:
        below = folder / f"{file_word(found.controller)}-{file_word(found.maneuver)}"
        return [save(draw(_violations(found)), below / "violations.png")]
    figure = draw(Picture("Sets that were tried", [_front(found)], None, 1, 6.0, 4.5))
    return [save(figure, folder / f"front.{kind}") for kind in ("png", "svg")]


def _front(found: Tuning) -> Panel:
    """Return the figure of two objectives, of one objective over the sets, or of statements versus implausibility."""
    names = list(found.trials[0].objectives)
    x, y = names[:2] if len(names) > 1 else ("set", *names, "statements that hold")[:2]
    if found.goal is Goal.SATISFY:
        x = "implausibility"

    def place(trial: Trial) -> tuple[float, float]:
        if found.goal is Goal.SATISFY:
            return trial.implausibility, len(trial.holding)
        return trial.objectives.get(x, trial.number), trial.objectives[y]

    curves = []
    for trials, label, look in (
        ([trial for trial in found.trials if not trial.allowed], "breaks a constraint", (_GREY, "", 1.2, "x")),
        ([trial for trial in found.trials if trial.allowed], "tried", (_GREY, "", 1.2, "o")),
        (found.front, "best", (_BROKEN, "", 1.2, "o")),
    ):
        if trials:
            places = np.array([place(trial) for trial in trials])
            curves.append(Curve(places[:, 0], places[:, 1], label, *look))
    better = {
        "implausibility": "smaller is better",
        "statements that hold": "more is better",
        "set": "in the order of the search",
    }
    # An objective is an expression in SI units, whose unit is unknown here.
    unit = {name: "" if name in found.trials[0].objectives else " [-]" for name in (x, y)}
    x_title, y_title = (f"{name}{unit[name]}, {better.get(name, 'smaller is better')}" for name in (x, y))
    return Panel(x_title, y_title, curves)


def _violations(found: Tuning) -> Picture:
    """Return the figure of the falling margin and of the violations."""
    ((name, _),) = found.trials[0].margins.items()
    margins = np.array([trial.margins[name] for trial in found.trials])
    judged = np.abs(margins) < 0.99e6  # others define no metric
    # A set far below zero is drawn at the edge, so that the others can be told apart.
    floor = 1.1 * float(np.min(margins[judged], initial=0.0)) - 1e-9
    shown = np.clip(margins, floor, float(np.max(margins[judged], initial=1e-9)))
    falls = np.maximum([value for _, value in found.fall], floor)
    limits = ((0.0, "violated below"),)
    # A stair that ends at the last run.
    runs = np.repeat([*(run for run, _ in found.fall), found.runs], 2)[1:-1]
    panels = [Panel("runs", "least margin so far [-]", [Curve(runs, np.repeat(falls, 2))], limits=limits)]
    broken = margins < 0.0
    columns = {key: [trial.values.get(key) for trial in found.trials] for key in found.front[0].values}
    texts = {
        key: [] if all(isinstance(value, int | float) for value in column) else sorted(set(map(str, column)))
        for key, column in columns.items()
    }
    numbers = {
        key: np.array([texts[key].index(str(value)) if texts[key] else value for value in column], dtype=np.float64)
        for key, column in columns.items()
    }
    for key in sorted(numbers, key=lambda key: -abs(_correlation(numbers[key], shown)))[:_FACTORS]:
        points = [
            Curve(numbers[key][part], shown[part], label, colour, "", 0.0, "o")
            for part, label, colour in ((~broken, "holds", _KEPT), (broken, "violated", _BROKEN))
            if part.any()
        ]
        words = ", ".join(f"{place}: {text}" for place, text in enumerate(texts[key]))
        title = parameter_title(key)
        panels.append(Panel(f"{title}\n{words}" if words else title, "margin [-]", points, limits=limits))
    heading = f"{found.controller}, {found.maneuver}: {found.requirement}"
    return Picture(heading, panels, None, 3, 12.0, 7.0)


def _correlation(x: np.ndarray, y: np.ndarray) -> float:
    """Return Spearman's rank correlation, or 0 for a constant."""
    if len(x) < 3 or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return 0.0
    return float(np.corrcoef(rankdata(x), rankdata(y))[0, 1])
