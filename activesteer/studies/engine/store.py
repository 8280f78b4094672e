"""Folder of a study: the study file, tables of finished runs, and finally one table of all runs.

    DIR/study.toml         the study as it runs, with absolute paths
    DIR/environment.json   hash of everything that decides the result, versions, machine
    DIR/parts/             FIRST-LAST.parquet of each finished task, until all are joined
    DIR/results.parquet    one row per run
    DIR/recordings/        recordings that are kept

Files are written under another name and renamed, so that they appear completely or not at all.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import platform
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from activesteer.core.files import atomic_write, make_folder, reading, write_text, writing
from activesteer.core.units import unit_of
from activesteer.errors import StudyError
from activesteer.studies.engine.runs import CURVE, Row, versions

IDENTITY: Final = ("run", "run_id", "sample", "maneuver", "vehicle", "controller")
"""Columns that identify the run of a row. The factors follow them."""
OUTCOME: Final = ("status", "error")
"""Columns after the factors. The metrics follow them."""
_TYPES: Final = {"run": pa.int64(), "sample": pa.int64()} | dict.fromkeys(
    ("run_id", "maneuver", "vehicle", "controller", "status", "error"), pa.string()
)


def table_of(rows: Sequence[Row], factors: Sequence[str]) -> pa.Table:
    """Return rows as a table, with a unit for each column."""
    names = dict.fromkeys([*IDENTITY, *factors, *OUTCOME, *(name for row in rows for name in row)])
    columns = {}
    for name in names:
        values = [row.get(name) for row in rows]
        if name in _TYPES:
            columns[name] = pa.array(values, _TYPES[name])
        elif name in factors:
            columns[name] = _factor_column(values)
        elif name.startswith(CURVE):
            columns[name] = pa.array(values, pa.list_(pa.float32()))
        else:
            columns[name] = pa.array(values, pa.float64(), from_pandas=False)
    fields = [pa.field(name, column.type, metadata={"unit": unit_of(name)}) for name, column in columns.items()]
    return pa.Table.from_arrays(list(columns.values()), schema=pa.schema(fields))


def _factor_column(values: Sequence[Any]) -> pa.Array:
    """Return a column of numbers, strings or booleans. Other values become JSON."""
    try:
        numbers = any(isinstance(value, float) for value in values)
        plain = [float(value) if numbers and value is not None else value for value in values]
        if not any(isinstance(value, (list, dict)) for value in plain):
            return pa.array(plain)
    except (TypeError, ValueError, pa.ArrowInvalid, pa.ArrowTypeError):
        pass
    return pa.array([None if value is None else json.dumps(value) for value in values], pa.string())


def joined(tables: Sequence[pa.Table]) -> pa.Table:
    """Return the rows of all tables, with a factor as strings if it is not numeric in all of them."""
    kinds: dict[str, set[pa.DataType]] = {}
    for field in (field for table in tables for field in table.schema if not pa.types.is_null(field.type)):
        kinds.setdefault(field.name, set()).add(field.type)
    mixed = [name for name, found in kinds.items() if len(found) > 1 and found != {pa.int64(), pa.float64()}]
    fitted = []
    for table in tables:
        fields = [field.with_type(pa.string()) if field.name in mixed else field for field in table.schema]
        fitted.append(table.cast(pa.schema(fields)))
    return pa.concat_tables(fitted, promote_options="permissive")


RESULTS: Final = "results.parquet"
LOCK: Final = ".lock"
"""File that the process at work locks."""
_ROW_GROUP: Final = 65536
_WITHOUT_EFFECT: Final = "without_effect.json"
_KEY_CHARACTERS: Final = 200


class Progress(NamedTuple):
    """Progress of a study in its folder."""

    total: int  # runs of the study
    done: int  # runs that have a row
    by_status: dict[str, int]  # status -> number of runs
    errors: dict[str, int]  # the most frequent errors, with their numbers
    running: bool  # whether a process works on the study
    without_effect: list[str]  # factors that change no metric of any run, once the study is complete

    def to_json(self) -> dict[str, Any]:
        """Return the progress as JSON values."""
        return {**self._asdict(), "missing": self.total - self.done}


class Store:
    """A study's folder, locked by one process."""

    def __init__(self, folder: Path, factors: Sequence[str]) -> None:
        """Prepare the store, which `opened` opens."""
        self.folder = folder
        self._factors = tuple(factors)
        self._parts = folder / "parts"

    @contextlib.contextmanager
    def opened(self, study_toml: str, identity: str, total: int) -> Iterator[Store]:
        """Create the folder, or resume the study in it."""
        make_folder(self._parts, StudyError)
        with locked(self.folder / LOCK):
            about = {"digest": identity, "runs": total, "versions": versions(), "platform": platform.platform()}
            path = self.folder / "environment.json"
            if path.exists():
                _compare(read_environment(self.folder), about, self.folder)
            else:
                if any(self.folder.glob("*.parquet")) or any(self._parts.iterdir()):
                    raise StudyError(f"{self.folder} holds results without their study; use a new folder")
                write_text(self.folder / "study.toml", study_toml, StudyError)
                write_text(path, json.dumps(about, indent=2) + "\n", StudyError)
            for left in self._parts.glob(".*"):  # left by a process that was killed while writing
                left.unlink(missing_ok=True)
            yield self

    def missing(self, total: int) -> list[range]:
        """Return the numbers of the missing runs, as ranges."""
        if (self.folder / RESULTS).exists():
            return []
        found, begin = [], 0
        for first, last in sorted(tuple(map(int, path.stem.split("-"))) for path in self._paths()):
            if first > begin:
                found.append(range(begin, first))
            begin = max(begin, last + 1)
        return [*found, range(begin, total)] if begin < total else found

    def write(self, rows: Sequence[Row]) -> None:
        """Store the rows of a finished task, which belong to consecutive runs."""
        name = f"{rows[0]['run']:09d}-{rows[-1]['run']:09d}.parquet"
        with atomic_write(self._parts / name, StudyError) as path:
            pq.write_table(table_of(rows, self._factors), path)

    def join(self) -> Path:
        """Join all tables into one file in the order of the runs, and delete them."""
        target = self.folder / RESULTS
        if not target.exists():
            # In one piece, so that the file does not depend on the division of the work.
            table = self.read().combine_chunks()
            with atomic_write(target, StudyError) as path:
                pq.write_table(table, path, row_group_size=_ROW_GROUP)
        shutil.rmtree(self._parts, ignore_errors=True)
        return target

    def read(self) -> pa.Table:
        """Return all rows so far, in the order of the runs."""
        return joined(list(_tables(self._paths())) or [table_of([], self._factors)])

    def progress(self) -> Progress:
        """Return the progress of the study."""
        about = read_environment(self.folder)
        counts: dict[str, int] = {}
        errors: dict[str, int] = {}
        for table in _tables(self._paths(), ["status", "error"]):
            for column, found in (("status", counts), ("error", errors)):
                for entry in table[column].combine_chunks().value_counts().to_pylist():
                    if entry["values"]:
                        found[entry["values"]] = found.get(entry["values"], 0) + entry["counts"]
        maximum = dict(sorted(errors.items(), key=lambda item: -item[1])[:10])
        running = _is_locked(self.folder / LOCK)
        return Progress(about["runs"], sum(counts.values()), counts, maximum, running, self.without_effect())

    def note_without_effect(self, factors: Sequence[str]) -> None:
        """Store the factors that change no metric of any run."""
        if factors:
            write_text(self.folder / _WITHOUT_EFFECT, json.dumps(factors) + "\n", StudyError)

    def without_effect(self) -> list[str]:
        """Return the stored factors of `note_without_effect`, empty if the file is damaged."""
        with contextlib.suppress(OSError, ValueError):
            found = json.loads((self.folder / _WITHOUT_EFFECT).read_text(encoding="utf-8"))
            return [str(key)[:_KEY_CHARACTERS] for key in found] if isinstance(found, list) else []
        return []

    def _paths(self) -> list[Path]:
        results = self.folder / RESULTS
        return [results] if results.exists() else sorted(self._parts.glob("[0-9]*.parquet"))


def read_environment(folder: Path) -> dict[str, Any]:
    """Return the description in a study's folder."""
    path = folder / "environment.json"
    if not path.is_file():
        raise StudyError(
            f"{folder} holds no study; make one with `activesteer study STUDY.toml -o {folder}`", value=folder
        )
    with reading(path, StudyError):
        text = path.read_text(encoding="utf-8", errors="replace")
    try:
        about = json.loads(text)
        return {"digest": str(about["digest"]), "runs": int(about["runs"]), "versions": dict(about["versions"])}
    except (ValueError, KeyError, TypeError) as reason:
        raise StudyError(f"{path}: is damaged: {reason}", value=path) from reason


def _compare(stored: Mapping[str, Any], now: Mapping[str, Any], folder: Path) -> None:
    if stored["digest"] == now["digest"]:
        return
    changed = [
        f"{key} {stored['versions'].get(key)} in place of {value}"
        for key, value in now["versions"].items()
        if key in ("activesteer", "source", "mujoco") and stored["versions"].get(key) != value
    ]
    why = f" (made with {', '.join(changed)})" if changed else ": file, inputs or seed differ"
    raise StudyError(f"{folder} holds another study{why}; use a new folder, or delete this one", value=folder)


def _tables(paths: Iterable[Path], columns: list[str] | None = None) -> Iterator[pa.Table]:
    for path in paths:
        try:
            with reading(path, StudyError):
                table = pq.read_table(path, columns=columns)
        except pa.ArrowException as reason:
            raise StudyError(f"cannot read {path}: {reason}", value=path) from reason
        yield table


@contextlib.contextmanager
def locked(path: Path) -> Iterator[None]:
    """Lock the folder of this file while it is in use, unless the file system has no locks."""
    with writing(path, StudyError):
        file = path.open("w")
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as reason:
            raise StudyError(f"{path.parent}: another process works on this study", value=path.parent) from reason
        except OSError:
            pass
        yield


def _is_locked(path: Path) -> bool:
    if not path.exists():
        return False
    with contextlib.suppress(OSError), path.open("r+") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
