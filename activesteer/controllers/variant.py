"""Controller variants: a controller of the package with other gains, from a file with `system` and [controllers] keys.

A file named like its controller gives default gains: keys of the vehicle file and overrides replace them.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from activesteer.config import Source, build, field_path, leaves, merged, read_toml, to_table
from activesteer.controllers.parameters import ControllerParameters, ControllerSetup
from activesteer.controllers.registry import CONTROLLERS, UNIT_READS, is_read
from activesteer.errors import ControllerError, nearest_names, shown
from activesteer.resources import find_controller_variant, models_dir

_OWN_KEYS: Final = ("name", "title", "system")


@dataclass(frozen=True, kw_only=True)
class VariantFile(ControllerParameters):
    """Keys of a variant file, in addition to the table [controllers] of a vehicle file."""

    system: str
    """Name of the controller in `CONTROLLERS`."""
    name: str = ""
    """Short name for tables; default: the file's name."""
    title: str = ""
    """Title in one line, for lists."""


@dataclass(frozen=True)
class Variant:
    """A variant that can be created for any car: gains that replace those of the vehicle file."""

    name: str
    title: str
    system: str
    gains: Mapping[str, Any]
    source: Source

    @property
    def files(self) -> dict[str, bytes]:
        """Text of the variant's file, stored in the recording, by path."""
        return {f"controllers/{self.name}.toml": self.source.text.encode()}

    @property
    def interval_s(self) -> float | None:
        """Time between two calls of the controller [s]."""
        return getattr(CONTROLLERS[self.system], "interval_s", None)

    @property
    def rates_radps(self) -> Mapping[str, float]:
        """Rates of the actuators that the controller needs [rad/s]."""
        return getattr(CONTROLLERS[self.system], "rates_radps", {})

    @property
    def reads(self) -> tuple[str, ...]:
        """Keys of the table [controllers] that the controller reads."""
        return CONTROLLERS[self.system].reads

    def from_vehicle(self, setup: ControllerSetup) -> Any:
        """Create the controller for a car, or raise the errors of `gains_in`."""
        return CONTROLLERS[self.system](replace(setup, gains=self.gains_in(setup)))

    def gains_in(self, setup: ControllerSetup) -> ControllerParameters:
        """Merge the gains into those of a car; an override of a gain of the variant raises ControllerError."""
        table = to_table(setup.gains)
        for path, value in leaves(self.gains).items():
            if (key := ".".join(field_path(ControllerParameters, path))) in setup.overridden:
                problem = f"{self.name} has its own controllers.{key}, and the override would have no effect"
                raise self.source.fail(path, f"{problem}; leave it out, or change a copy of this file")
            table = merged(ControllerParameters, table, path, value, self.source)
        return build(ControllerParameters, table, self.source)


def read_variant(given: str | os.PathLike[str]) -> Variant:
    """Read a controller variant by its name or the path of its file."""
    path = find_controller_variant(given)
    table, source = read_toml(path, ControllerError)
    known = build(VariantFile, {"name": path.stem, **table}, source)
    if known.system not in CONTROLLERS:
        problem = f"there is no controller {shown(known.system)}; {nearest_names(known.system, CONTROLLERS)}"
        raise source.fail(("system",), problem, known.system, list(CONTROLLERS))
    gains = {key: value for key, value in table.items() if key not in _OWN_KEYS}
    if not gains:
        raise source.fail(
            (), f"no gain differs from {known.system}; give gains, such as [{known.system}] limit_deg = 2"
        )
    reads = (*CONTROLLERS[known.system].reads, *UNIT_READS)
    for place, value in leaves(gains).items():
        if not is_read(".".join(field_path(ControllerParameters, place)), reads):
            raise source.fail(place, f"has no effect on {known.system}; leave it out", value, reads)
    if path == models_dir() / "controllers" / f"{known.system}.toml":
        gains = {}
    return Variant(known.name, known.title, known.system, gains, source)
