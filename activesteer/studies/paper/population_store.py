"""Store of populations in the package: results, a row for every run, and the bands of the curves.

studies/population/summary.json    proportions and effects, seed, versions
studies/comparison/summary.json    the same of the comparison of controllers
studies/population/runs.parquet    one row per run: claims and metrics; the factors follow from the seed
studies/population/bands.parquet   10 to 90 % of the curves
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from activesteer.analysis.bands import FILE as BANDS
from activesteer.analysis.bands import TRACK, Band, band_of_tracks, band_over_time, table_of
from activesteer.analysis.claims.population import SUMMARY, Population, read_population
from activesteer.conventions import CURVE_STEP_S
from activesteer.errors import StudyError
from activesteer.files import make_folder, replacing, write_text
from activesteer.resources import studies_dir
from activesteer.studies.engine.run_task import CLAIM, CURVE
from activesteer.studies.engine.store import RESULTS
from activesteer.studies.paper.population_studies import STUDY, population_study

RUNS: Final = "runs.parquet"
_EVERY: Final = 2
"""Interval of the stored values of a band, which is smoother than the curves."""
_KEPT: Final = ("sample", "maneuver", "controller", "status")


def store_summary(found: Population, name: str) -> Path:
    """Store the results of a population or a comparison with the package, without the medians of all metrics.

    Args:
        found: The results.
        name: Folder to write, in the folder of the study files; see `read_population`.

    Returns:
        The file.

    Raises:
        StudyError: the file cannot be written.
    """
    folder = make_folder(studies_dir() / name, StudyError)
    text = json.dumps(replace(found, table=()).to_json(), indent=1)
    return write_text(folder / SUMMARY, f"{text}\n", StudyError)


def store_population(found: Population, study_folder: Path) -> list[Path]:
    """Store a population with the package.

    Args:
        found: Results of the population.
        study_folder: Folder of its finished study.

    Returns:
        The files written.

    Raises:
        StudyError: the study is not finished, or a file cannot be written.
    """
    results = study_folder / RESULTS
    if not results.is_file():
        raise StudyError(f"{study_folder} holds no finished study; go on with it")
    table = pq.read_table(results)
    about = {b"vehicle": found.vehicle.encode()}
    paths = [store_summary(found, STUDY)]
    folder = paths[0].parent
    for name, kept in ((RUNS, _in_short(table)), (BANDS, table_of(_bands(table)))):
        with replacing(folder / name, StudyError) as path:
            pq.write_table(kept.replace_schema_metadata(about), path, compression="zstd", compression_level=19)
        paths.append(folder / name)
    return paths


def stored_runs() -> pa.Table:
    """Return the runs of the package's population with their factors.

    Raises:
        StudyError: the package stores no population.
    """
    folder = studies_dir() / STUDY
    summary = read_population(STUDY)
    if summary is None or not (folder / RUNS).is_file():
        raise StudyError(f"{folder} holds no population; make one with tools/renew_population.py")
    table = pq.read_table(folder / RUNS)
    table = table.append_column("vehicle", pa.array([summary.vehicle] * len(table)))
    samples = population_study(summary.samples, summary.seed).samples()[0]
    places = table["sample"].to_numpy()
    for key, values in samples.columns.items():
        table = table.append_column(key, pa.array(np.asarray(values)[places]))
    return table


def _in_short(table: pa.Table) -> pa.Table:
    factors = population_study().keys
    columns = {}
    for name in table.column_names:
        if name.startswith(CLAIM):
            columns[name] = table[name].cast(pa.int8())
        elif name in _KEPT:
            columns[name] = table[name].cast(pa.int16()) if name == "sample" else table[name].dictionary_encode()
        elif name not in factors and not name.startswith(CURVE) and pa.types.is_floating(table.schema.field(name).type):
            columns[name] = table[name].cast(pa.float32())
    return pa.table(columns)


def _bands(table: pa.Table) -> dict[tuple[str, str, str], Band]:
    found = {}
    channels = [name.removeprefix(CURVE) for name in table.column_names if name.startswith(CURVE)]
    for maneuver in table["maneuver"].unique().to_pylist():
        for controller in table["controller"].unique().to_pylist():
            chosen = (pc.field("maneuver") == maneuver) & (pc.field("controller") == controller)
            rows = table.filter(chosen & (pc.field("status") == "ok"))
            curves = {name: _curves(rows, name) for name in channels}
            if not rows.num_rows:
                continue
            for name in channels:
                if name not in TRACK:
                    found[maneuver, controller, name] = band_over_time(
                        [curve[::_EVERY] for curve in curves[name]], _EVERY * CURVE_STEP_S
                    )
            tracks = list(zip(*(curves[name] for name in TRACK), strict=True))
            found[maneuver, controller, TRACK[1]] = band_of_tracks(tracks)
    return found


def _curves(rows: pa.Table, channel: str) -> list[np.ndarray]:
    return [np.asarray(curve.values, dtype=np.float64) for curve in rows[f"{CURVE}{channel}"]]
