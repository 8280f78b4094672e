"""Faults as they are written on the command line: `rear:stuck@2.0`, `rear:offset=1deg@2-3`."""

from __future__ import annotations

import re
from typing import Any, Final

from activesteer.errors import ParameterError, shown

_NUMBER: Final = r"\d+(?:\.\d*)?(?:[eE][+-]?\d+)?|\.\d+"
_FAULT: Final = re.compile(
    rf"(?P<part>\w+):(?P<kind>\w+)(?:=(?P<value>[+-]?(?:{_NUMBER}))(?P<unit>[A-Za-z]\w*)|=(?P<side>[a-z]+))?"
    rf"(?:@(?P<start>{_NUMBER})(?:-(?P<end>{_NUMBER}))?)?"
)
_WHAT: Final = "PART:KIND[=SIZE]"
_WHEN: Final = "@START[-END]"


def fault_table(text: str, start_s: float | None = None) -> dict[str, Any]:
    """Read a fault into the table that a manoeuvre file has; the table is checked there.

    Args:
        text: Part, kind, size with its unit, and time [s].
        start_s: Start if the text must not give it [s].
    """
    found = _FAULT.fullmatch(text.strip())
    if found is None or (found["start"] is None) is (start_s is None):
        if start_s is None:
            form = f"{_WHAT}{_WHEN}, as rear:stuck@2.0, rear:offset=1deg@2-3 or rear:runaway=left@2"
        else:
            form = f"{_WHAT}, as rear:stuck, rear:offset=1deg or rear:runaway=left, without a time"
        raise ParameterError(f"{shown(text)}: a fault is written {form}", key="--fault", value=text)
    table: dict[str, Any] = {"part": found["part"], "kind": found["kind"]}
    table["start_s"] = float(found["start"]) if start_s is None else start_s
    if found["end"] is not None:
        table["end_s"] = float(found["end"])
    if found["side"] is not None:
        table["side"] = found["side"]
    elif found["unit"] is not None:
        table["delay_s" if found["unit"] == "s" else f"size_{found['unit']}"] = float(found["value"])
    return table
