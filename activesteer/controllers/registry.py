"""Registry of the controllers that come with the package.

A registered class has the method `step` of `Controller` and is made from a `ControllerSetup`. Its attributes say

    reads        keys of the table [controllers] that it reads, or dotted keys of a table that it reads in part
    interval_s   time between two calls [s]; every step of the simulation if absent
    rates_radps  rates of the actuators that it needs at the road wheels, by the names of `SteeringRates` [rad/s];
                 a run with slower actuators records a note; absent if any rate suffices
    gains        dataclass of its own table, whose values are those of `models/controllers/NAME.toml`;
                 absent if the vehicle file gives all gains
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

from activesteer.controllers.esc import Esc
from activesteer.controllers.front_superposition import FrontSuperposition
from activesteer.controllers.integrated import Integrated
from activesteer.controllers.lqr import Lqr
from activesteer.controllers.no_control import NoControl, Observer
from activesteer.controllers.rear_steer import RearSteer, SideslipRearSteer
from activesteer.controllers.torque_vectoring import TorqueVectoring

CONTROLLERS: Final[dict[str, type[Any]]] = {
    "none": NoControl,
    "observer": Observer,
    "ars": RearSteer,
    "afs": FrontSuperposition,
    "ars_sideslip": SideslipRearSteer,
    "esc": Esc,
    "lqr": Lqr,
    "integrated": Integrated,
    "tv": TorqueVectoring,
}
"""Classes of the controllers, by name."""
WITHOUT_FILE: Final = {name: kind for name, kind in CONTROLLERS.items() if not hasattr(kind, "gains")}
"""Controllers whose gains are in the vehicle file."""
IN_EXAMPLES: Final = {"mpc": "examples/own_mpc.py:EnvelopeMpc"}
"""Examples that replace former controllers, by the former name."""
UNIT_READS: Final = frozenset(("interval_s", "bus_delay_s"))
"""Keys of the table [controllers] that set when a command is computed and when it arrives."""


def is_read(key: str, keys: Iterable[str]) -> bool:
    """Return whether a dotted key (with the names of fields) is one of the keys read, is in one, or holds one."""
    return any(f"{key}.".startswith(f"{each}.") or each.startswith(f"{key}.") for each in keys)
