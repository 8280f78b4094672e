"""Recordings with nonsense values: opening refuses them, or every command handles them."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.records import Channel as Topic
from mcap.records import Metadata

from activesteer import simulate
from activesteer.analysis.claims.judge import SCENARIOS, SYSTEMS
from activesteer.analysis.claims.scorecard import claims_for
from activesteer.analysis.metrics import EVALUATIONS, metrics
from activesteer.analysis.report import report_page
from activesteer.commands.cli import main
from activesteer.errors import ActiveSteerError, RecordingError
from activesteer.playback import runs_of, save
from activesteer.recording import Poses, Recording
from activesteer.recording.contents import RUN_RECORD
from activesteer.video.track import Track
from tests.unit.recording.records import records_of, write_records

NONSENSE: tuple[Any, ...] = (
    None, True, 0, -1, 1e308, -(10**30), 10**400, float("nan"), float("inf"), "", "x", "\ud800",
    "\x1b[2J\n<!--<script>", "A" * 200_000, [], [1], [None], ["x", {}], {}, {"": 1}, {"x": {"y": [1, "z"]}},
    [[[[1]]]], [1e300] * 3,
)  # fmt: skip
"""What stands in place of a value."""


def thinned(recording: Recording, every: int = 50) -> Recording:
    """Return a run thinned to every n-th row."""
    poses = recording.poses
    few = slice(None, None, every)
    kept = Poses(poses.time_s[few], poses.names, poses.positions_m[few], poses.quaternions[few])
    return Recording(
        recording.channels, recording.time_s[few], recording.values[few], poses=kept, metadata=recording.metadata,
        metrics=recording.metrics, attachments={"a.toml": b"x = 1"}, scene=recording.scene,
    )  # fmt: skip


@pytest.fixture(scope="module")
def driven() -> Recording:
    return thinned(simulate("double_lane_change", "ars"))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def use(path: Path) -> bool:
    """Open a file and use it in every way; return True if it opens."""
    try:
        recording = Recording.open(path, recover=True)
    except RecordingError:
        return False
    assert main(["info", str(path)]) == 0
    runs = {"ars": recording}
    everything: Sequence[Callable[[], object]] = (
        lambda: metrics(recording),
        lambda: (claims_for(recording) or (lambda _: []))(dict.fromkeys(SYSTEMS, recording)),
        lambda: report_page({str(path): recording, "again.mcap": recording}),
        lambda: save(runs_of(runs), path.with_suffix(".rrd")),
        lambda: Track(recording, "ars"),
        lambda: recording.to_csv(path.with_suffix(".csv")),
        lambda: recording.to_parquet(path.with_suffix(".parquet")),
        lambda: recording.to_mat(path.with_suffix(".mat")),
        lambda: recording.save(path.with_suffix(".again.mcap")),
    )
    for action in everything:
        with suppress(ActiveSteerError):
            action()
    return True


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the places of a tree where another value can stand: tables, lists with their first value, values."""
    if path:
        yield path
    if isinstance(value, Mapping):
        for key, entry in value.items():
            yield from places(entry, (*path, key))
    elif isinstance(value, list) and value:
        yield from places(value[0], (*path, 0))


def put(tree: Any, path: Sequence[Any], value: Any) -> Any:
    """Return a copy of a tree with another value at a place; the value `...` removes the place."""
    tree = copy.deepcopy(tree)
    inner = tree
    for key in path[:-1]:
        inner = inner[key]
    if value is ...:
        del inner[path[-1]]
    else:
        inner[path[-1]] = value
    return tree


def check_texts(driven: Recording, folder: Path, count: int, rng: np.random.Generator) -> None:
    """Try nonsense in the metadata of the run and in the descriptions of channels and bodies."""
    driven.save(folder / "sound.mcap")
    records: list[Any] = list(records_of(folder / "sound.mcap"))
    of_run, of_topics = (
        [(index, key) for index in range(len(records)) if chosen(records[index]) for key in records[index].metadata]
        for chosen in (
            lambda record: isinstance(record, Metadata) and record.name == RUN_RECORD,
            lambda record: isinstance(record, Topic),
        )
    )
    opened = 0
    for number in range(2 * count):
        entries = of_topics if number % 2 else of_run
        index, key = entries[rng.integers(len(entries))]
        texts = {name: json.loads(text) for name, text in records[index].metadata.items()}
        where = [place for place in places(texts) if place[0] == key]
        place, value = where[rng.integers(len(where))], (..., *NONSENSE)[rng.integers(len(NONSENSE) + 1)]
        told = {name: json.dumps(entry) for name, entry in put(texts, place, value).items()}
        changed = [*records]
        changed[index] = replace(records[index], metadata=told)
        try:
            opened += use(write_records(folder / "changed.mcap", changed))
        except Exception as error:
            error.add_note(f"with {value!r:.80} at {place}")
            raise
    assert 0 < opened < 2 * count


def odd_runs(driven: Recording, count: int, rng: np.random.Generator) -> Iterator[tuple[str, Recording]]:
    """Yield runs with few rows, few channels, unusual values or poses, and all kinds of manoeuvres."""
    kinds = [*EVALUATIONS, "standstill"]
    names = [*SCENARIOS, "mine"]
    for _ in range(count):
        rows = [0, 1, 2, 3, len(driven)][rng.integers(5)]
        kept = np.flatnonzero(rng.random(len(driven.channels)) < [0.02, 0.5, 0.95, 1.0, 1.0][rng.integers(5)])
        channels = list(driven.channels)
        values = driven.values[:rows].copy()
        amount, kind_of_value = rng.random() < 0.5, rng.integers(7)
        chosen = slice(None) if amount else rng.integers(values.shape[1], size=5)
        if kind_of_value < 6:
            values[:, chosen] = (np.nan, np.inf, 0.0, 1e300, -1e30, 1.0)[kind_of_value]
        poses = driven.poses
        sets = min(rows, len(poses.time_s))
        positions, turns = poses.positions_m[:sets].copy(), poses.quaternions[:sets].copy()
        strange = rng.integers(5)
        if strange < 4:
            (positions if strange % 2 else turns)[..., rng.integers(3)] = (0.0, np.nan, 0.0, 1e300)[strange]
        metadata = copy.deepcopy(driven.metadata)
        metadata["maneuver"] |= {"kind": kinds[rng.integers(len(kinds))], "name": names[rng.integers(len(names))]}
        for key in ("course", "car", "vehicle", "controller", "maneuver"):
            if rng.random() < 0.1:
                del metadata[key]
        words = f"{rows} rows, {len(kept)} channels, values {kind_of_value} in {chosen}, poses {strange}, "
        words += str({key: metadata.get("maneuver", {}).get(key) for key in ("name", "kind")})
        yield words, Recording(
            [channels[column] for column in kept], driven.time_s[:rows], values[:, kept],
            poses=None if rng.random() < 0.1 else Poses(poses.time_s[:sets], poses.names, positions, turns),
            metadata=metadata, scene=driven.scene,
        )  # fmt: skip


def check_odd_runs(driven: Recording, folder: Path, count: int, rng: np.random.Generator) -> None:
    for words, recording in odd_runs(driven, count, rng):
        try:
            recording.save(folder / "odd.mcap")
            assert use(folder / "odd.mcap")
        except Exception as error:
            error.add_note(words)
            raise


def check_bytes(driven: Recording, folder: Path, count: int, rng: np.random.Generator) -> None:
    """Try files with changed bytes and no checksum, and files cut at any place."""
    driven.save(folder / "sound.mcap")
    data = write_records(folder / "sound.mcap", records_of(folder / "sound.mcap")).read_bytes()
    for _ in range(count):
        changed = bytearray(data)
        start = int(rng.integers(8, len(data)))
        if rng.random() < 0.3:
            del changed[start:]
        else:
            # Half of the changes before the rows, which are most of the file.
            start = start if rng.random() < 0.5 else int(rng.integers(8, 40_000))
            changed[start : start + 4] = rng.bytes(4)
        (folder / "changed.mcap").write_bytes(changed)
        try:
            use(folder / "changed.mcap")
        except Exception as error:
            error.add_note(f"changed at {start}")
            raise


CHECKS = [check_texts, check_odd_runs, check_bytes]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # overflow: what is shown of nonsense may be nonsense
@pytest.mark.parametrize("check", CHECKS)
def test_recording_is_refused_or_every_command_can_handle_it(check, driven, folder, capsys, rng):
    check(driven, folder, 4, rng)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("check", CHECKS)
def test_hundreds_of_recordings_are_refused_or_every_command_can_handle_them(check, driven, folder, capsys, rng):
    check(driven, folder, 200, rng)
