"""Section, default, quantity and meaning of every key of a .tir file, read from `coefficients.txt` beside this file.

The columns of the table are: key, default, quantity, meaning. A default of `!` means that the file must give the key;
`-` means that it may be absent and that another quantity replaces it (see `parameters.parameter_array`).
The quantity decides how `[UNITS]` of a file is applied; `1` is a pure number.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, appendix 3; the names are those of the TNO/Siemens MF-Tyre
and the MSC PAC2002 property files.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple


class Coefficient(NamedTuple):
    """One key of a .tir file.

    Attributes:
        name: Key as in the file, upper case.
        section: Section that the writer puts it in.
        default: Default in SI; None if another quantity replaces it.
        required: Whether a file without the key is refused.
        quantity: Kind of quantity, as in `units.DIMENSIONS`; `1` is a pure number.
        meaning: One line.
    """

    name: str
    section: str
    default: float | None
    required: bool
    quantity: str
    meaning: str


def _parse(table: str) -> tuple[Coefficient, ...]:
    """Turn the table into records, in its order."""
    section, rows = "", []
    for line in table.splitlines():
        if line.startswith("["):
            section = line.strip("[]")
            continue
        name, default, quantity, meaning = line.split(maxsplit=3)
        value = None if default in ("!", "-") else float(default)
        rows.append(Coefficient(name, section, value, default == "!", quantity, meaning))
    return tuple(rows)


COEFFICIENTS: tuple[Coefficient, ...] = _parse(Path(__file__).with_suffix(".txt").read_text(encoding="utf-8"))
"""Every numeric key that the package knows, in the order of the table."""

BY_NAME: dict[str, Coefficient] = {coefficient.name: coefficient for coefficient in COEFFICIENTS}
"""The same records by key."""
