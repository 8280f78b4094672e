"""The paper's statements about the three systems, as checks on recordings; one file for each manoeuvre.

Every criterion comes from the paper's words and from what a driver or a sensor can notice, and was written down before
anything was tuned. Each statement names the fakes that it must reject. `not_reproduced.toml` lists the claims that are
known not to be reproduced, with the reason. `scorecard` combines verdicts and reasons.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from activesteer.analysis.claims.claim import SYSTEMS, Claim, Fake, Kind, Statement
from activesteer.analysis.claims.scenarios import SCENARIO_OF, SCENARIOS, STATEMENTS, Claims
from activesteer.analysis.claims.scorecard import Scorecard, Verdict, not_reproduced, scorecard
from activesteer.analysis.claims.setting import HUMAN, PAPER, SETTINGS, Setting, read_setting, setting_of
from activesteer.analysis.source import RecordingLike

_NO_SETTING: Final = frozenset({"vehicle", "duration_s", "settle_s", "title"})
"""Keys that may differ from the paper's: these keys of the manoeuvre, and the whole car."""


def claims_for(recording: RecordingLike) -> Claims | None:
    """Return the function that checks the paper's claims about the manoeuvre of a run; None if it has none.

    The name of its manoeuvre counts, and for the two open-loop manoeuvres also its kind: a user's step steer is a step
    steer. The paper has no claims about a manoeuvre with other settings, except those of `setting`.
    """
    maneuver = recording.metadata.get("maneuver")
    if not isinstance(maneuver, Mapping):
        return None
    if setting_of(recording) != PAPER and any(
        _is_of_maneuver(key, recording.metadata.get("vehicle")) for key in recording.metadata.get("overrides") or ()
    ):
        return None
    name, kind = maneuver.get("name"), maneuver.get("kind")
    if name in SCENARIOS:
        return SCENARIOS[name]
    return SCENARIOS[kind] if kind in {"step_steer", "sine_with_dwell"} else None


def _is_of_maneuver(key: str, vehicle: object) -> bool:
    """Return whether an override changes the manoeuvre; any car and any duration are judged."""
    part = key.removeprefix("maneuver.").partition(".")[0]
    return part not in _NO_SETTING and not (isinstance(vehicle, Mapping) and part in vehicle)


__all__ = [
    "HUMAN",
    "PAPER",
    "SCENARIOS",
    "SCENARIO_OF",
    "SETTINGS",
    "STATEMENTS",
    "SYSTEMS",
    "Claim",
    "Claims",
    "Fake",
    "Kind",
    "Scorecard",
    "Setting",
    "Statement",
    "Verdict",
    "claims_for",
    "not_reproduced",
    "read_setting",
    "scorecard",
    "setting_of",
]
