"""Settings in which the paper's scenarios are driven: what the paper leaves open, as numbers with ranges and reasons.

`human` is the nominal car with a driver from published ranges; it changes nothing. `paper` was selected by the verdicts
of the claims (`activesteer tune match_paper`), within ranges that were written down before: it shows under which
conditions the paper's statements hold together, and is no evidence for them.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from activesteer.analysis.claims.scenarios import SCENARIOS, STATEMENTS
from activesteer.analysis.source import RecordingLike
from activesteer.config import build, read_toml
from activesteer.errors import ParameterError, nearest_names

HUMAN: Final = "human"
PAPER: Final = "paper"
SETTINGS: Final = {PAPER: "paper's setting", HUMAN: "human driver"}
"""Name of a setting -> its title."""
VEHICLE: Final = "compact"
"""Car of the paper's setting."""


@dataclass(frozen=True)
class Number:
    """A number of a setting."""

    key: str
    """Dotted key, as for `--set`."""
    value: float | str
    """Its value in this setting."""
    nominal: float | str
    """Its value in the setting `human`."""
    reason: str
    """Source of the range."""
    low: float | None = None
    """Lower end of the range that was allowed."""
    high: float | None = None
    """Upper end of the range."""
    maneuvers: tuple[str, ...] = ()
    """Manoeuvres in which it acts; empty for all."""


@dataclass(frozen=True)
class Setting:
    """A setting file."""

    title: str = ""
    """One line for people."""
    numbers: tuple[Number, ...] = ()
    """Everything that differs from the nominal car, driver and manoeuvre."""
    fails: dict[str, str] = field(default_factory=dict)
    """Number of each statement that does not hold -> reason."""

    def overrides(self, scenario: str) -> dict[str, Any]:
        """Return the overrides of a scenario."""
        return {
            number.key: number.value for number in self.numbers if not number.maneuvers or scenario in number.maneuvers
        }


@functools.cache
def read_setting(name: str) -> Setting:
    """Return a setting of the package.

    Args:
        name: `paper` or `human`.
    """
    if name not in SETTINGS:
        raise ParameterError(nearest_names(name, SETTINGS), key="--setting", value=name, allowed=tuple(SETTINGS))
    if name == HUMAN:
        return Setting()
    table, where = read_toml(Path(__file__).parent / f"{name}_setting.toml", ParameterError)
    found = build(Setting, table, where)
    for claim in found.fails:
        if claim not in STATEMENTS:
            raise where.fail(("fails", claim), nearest_names(claim, STATEMENTS), claim)
    return found


def setting_of(recording: RecordingLike) -> str:
    """Return the name of the setting in which a run was made; empty if it has other overrides or is of the user."""
    maneuver, overrides = recording.metadata.get("maneuver"), recording.metadata.get("overrides") or {}
    name = maneuver.get("name") if isinstance(maneuver, Mapping) else None
    if name not in SCENARIOS or not isinstance(overrides, Mapping):
        return ""
    if not overrides:
        return HUMAN
    return PAPER if dict(overrides) == read_setting(PAPER).overrides(str(name)) else ""
