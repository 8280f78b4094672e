"""Names, order, colours and samples of shown runs."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.core.conventions import RUN_COLOURS_ON_DARK
from activesteer.errors import RecordingError
from activesteer.playback import runs_of
from activesteer.recording import Poses, Recording
from tests.contrast import contrast
from tests.raising import raises
from tests.unit.playback.synthetic import circle


def test_the_three_systems_have_their_order_numbers_and_colours_whatever_the_order_of_the_files() -> None:
    run = circle(0.1)
    runs = runs_of({"mine": run, "afs": run, "none": run, "ars": run, "other": run})
    assert [r.short for r in runs] == ["none", "ars", "afs", "mine", "other"]
    assert [r.label for r in runs] == [r.short for r in runs]
    systems = runs_of({"afs": run, "none": run, "ars": run})
    assert [r.label for r in systems] == ["1 no control", "2 active rear steering", "3 active front steering"]
    assert [r.name for r in runs] == ["1_none", "2_ars", "3_afs", "4_mine", "5_other"]
    assert [r.colour for r in runs[1:]] == list(RUN_COLOURS_ON_DARK[1:5])
    assert all(contrast(runs[0].colour, background) > 3.0 for background in ("#ffffff", "#000000"))


def test_a_system_keeps_its_colour_without_the_others() -> None:
    assert [r.colour for r in runs_of({"afs": circle(0.1)})] == [RUN_COLOURS_ON_DARK[2]]


def test_names_are_fit_for_paths_and_differ() -> None:
    run = circle(0.1)
    names = [r.name for r in runs_of({"a b/c": run, "a-b/c": run})]
    assert names == ["1_a_b_c", "2_a_b_c"]


def test_a_hundred_samples_a_second_are_shown_from_the_first_to_the_last() -> None:
    recording = circle(2.0)
    (run,) = runs_of({"ars": recording})
    shown = run.recording.time_s
    assert shown[0] == recording.time_s[0]
    assert shown[-1] == recording.time_s[-1]
    assert np.allclose(np.diff(shown)[:-1], 0.01)


def test_poses_that_are_not_finite_are_left_out() -> None:
    recording = circle(1.0)
    positions = recording.poses.positions_m.copy()
    positions[-3:, 2] = np.nan
    broken = _with_poses(recording, recording.poses._replace(positions_m=positions))
    (run,) = runs_of({"ars": broken})
    assert run.poses.tolist() == list(range(len(positions) - 3))


def test_what_cannot_be_played_back_is_refused() -> None:
    recording = circle(0.1)
    with pytest.raises(RecordingError):
        runs_of({})
    for poses in (None, recording.poses._replace(names=tuple(f"body{i}" for i in range(5)))):
        with raises(RecordingError, value="ars"):
            runs_of({"ars": _with_poses(recording, poses)})
    with raises(RecordingError, value="ars"):
        runs_of(
            {"ars": Recording(recording.channels, [], np.empty((0, len(recording.channels))), poses=recording.poses)}
        )


def _with_poses(recording: Recording, poses: Poses | None) -> Recording:
    return Recording(recording.channels, recording.time_s, recording.values, poses=poses, scene=recording.scene)
