"""A controller variant: one of the package's systems with gains of its own, as data.

A variant file names its `system` and holds those keys of the table [controllers] that it has otherwise than the vehicle
file; what it leaves out stays the vehicle's.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

from activesteer.config import Source, build, field_path, leaf_keys, merged, read_toml, to_table
from activesteer.controllers.esc import Esc
from activesteer.controllers.front_superposition import FrontSuperposition
from activesteer.controllers.integrated import Integrated
from activesteer.controllers.lqr import Lqr
from activesteer.controllers.mpc import Mpc
from activesteer.controllers.parameters import ControllerParameters, ControllerSetup
from activesteer.controllers.rear_steer import RearSteer
from activesteer.controllers.sideslip_rear_steer import SideslipRearSteer
from activesteer.errors import ControllerError
from activesteer.resources import find_controller_variant

_SYSTEMS: Final = {
    "ars": RearSteer,
    "afs": FrontSuperposition,
    "ars_sideslip": SideslipRearSteer,
    "lqr": Lqr,
    "esc": Esc,
    "integrated": Integrated,
    "mpc": Mpc,
}
_OWN_KEYS: Final = ("name", "title", "system")


@dataclass(frozen=True, kw_only=True)
class VariantFile(ControllerParameters):
    """The keys of a variant file: those of the table [controllers] of a vehicle file, and these."""

    system: Literal["ars", "afs", "ars_sideslip", "lqr", "esc", "integrated", "mpc"]
    """What it is a variant of."""
    name: str = ""
    """Short name, for tables; the file's name where not given."""
    title: str = ""
    """One line for lists."""


@dataclass(frozen=True)
class Variant:
    """A variant that can be made for any car.

    Attributes:
        name: Its name.
        title: One line.
        system: What it is a variant of.
        gains: Keys of the table [controllers] that it has otherwise.
        source: Where they stand.
    """

    name: str
    title: str
    system: str
    gains: Mapping[str, Any]
    source: Source

    @property
    def files(self) -> dict[str, bytes]:
        """The file, to be kept with a recording."""
        return {f"controllers/{self.name}.toml": self.source.text.encode()}

    @property
    def interval_s(self) -> float | None:
        """Time between two calls that the system asks for [s]."""
        return getattr(_SYSTEMS[self.system], "interval_s", None)

    @property
    def reads(self) -> tuple[str, ...]:
        """Keys of the table [controllers] that the system reads."""
        return _SYSTEMS[self.system].reads

    def from_vehicle(self, setup: ControllerSetup) -> Any:
        """Makes the controller for a car; raises as `gains_in` does."""
        return _SYSTEMS[self.system].from_vehicle(replace(setup, gains=self.gains_in(setup)))

    def gains_in(self, setup: ControllerSetup) -> ControllerParameters:
        """The gains of a car with those of the variant in their places.

        Raises:
            ControllerError: a gain that the variant has of its own was overridden for the car, without effect here.
        """
        table = to_table(setup.gains)
        for path in leaf_keys(self.gains):
            if (key := ".".join(field_path(ControllerParameters, path))) in setup.overridden:
                problem = f"{self.name} has controllers.{key} of its own, and the override would change nothing"
                raise self.source.fail(path, f"{problem}; leave it out, or change a copy of this file")
            value: Any = self.gains
            for part in path:
                value = value[part]
            table = merged(ControllerParameters, table, path, value, self.source)
        return build(ControllerParameters, table, self.source)


def read_variant(given: str | os.PathLike[str]) -> Variant:
    """Reads a variant.

    Args:
        given: Name, or path of a variant file.

    Raises:
        ControllerError: it is not found or wrong.
    """
    path = find_controller_variant(given)
    table, source = read_toml(path, ControllerError)
    known = build(VariantFile, {"name": path.stem, **table}, source)
    gains = {key: value for key, value in table.items() if key not in _OWN_KEYS}
    if not gains:
        raise source.fail((), f"nothing differs from {known.system}; give gains, as [{known.system}] limit_deg = 2")
    return Variant(known.name, known.title, known.system, gains, source)
