"""The paper's claims about the runs of a group, or the reason why they cannot be judged."""

from __future__ import annotations

from typing import NamedTuple

from activesteer.analysis.claims.judge import SYSTEMS
from activesteer.analysis.claims.scorecard import Scorecard, scorecard
from activesteer.analysis.claims.stored import LITERATURE, claims_for, setting_of
from activesteer.analysis.report.groups import Group, entry
from activesteer.errors import ActiveSteerError
from activesteer.recording import Recording


class Judgement(NamedTuple):
    """The claims about a group of runs.

    Attributes:
        scorecard: Claims with their verdicts; empty if there are no claims, or if they cannot be judged.
        obstacle: Why the claims cannot be judged; empty if they are, or if there are none.
    """

    scorecard: Scorecard
    obstacle: str = ""


def judge(group: Group) -> Judgement:
    """Check the paper's claims about the runs of a group.

    The group must hold a complete run of each of the three systems, in the same manoeuvre with the same car.
    """
    nothing = scorecard([], known={})
    recordings = group.by_name()
    check = claims_for(group.runs[0].recording)
    if check is None:
        return Judgement(nothing)
    missing = [system for system in SYSTEMS if system not in recordings]
    if missing:
        return Judgement(nothing, f"no run of {', '.join(missing)}, and the claims compare {', '.join(SYSTEMS)}")
    systems = [recordings[system] for system in SYSTEMS]
    for system, recording in zip(SYSTEMS, systems, strict=True):
        if not recording.metadata.get("complete", True):
            return Judgement(nothing, f"the run {system} is not complete")
    if not (_same(systems, "maneuver") and _same(systems, "vehicle")):
        return Judgement(nothing, "the three runs differ in manoeuvre or vehicle; see the parameters")
    try:
        claims, setting = check(recordings), setting_of(systems[0])
        return Judgement(scorecard(claims, entry(systems[0], "vehicle", "name"), setting=setting or LITERATURE))
    except ActiveSteerError as error:
        return Judgement(nothing, str(error))


def _same(recordings: list[Recording], table: str) -> bool:
    return all(recording.metadata.get(table) == recordings[0].metadata.get(table) for recording in recordings)
