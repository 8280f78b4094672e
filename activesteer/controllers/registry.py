"""Registry of the controllers that come with the package.

A registered class has the method `step` of `Controller` and is made from a `ControllerSetup`. Its attributes say

    reads        keys of the table [controllers] that it reads
    interval_s   time between two calls [s]; every step of the simulation if absent
    rates_radps  rates of the actuators that it needs at the road wheels, by the names of `SteeringRates` [rad/s];
                 a run with slower actuators records a note; absent if any rate suffices
    gains        dataclass of its own table, whose values are those of `models/controllers/NAME.toml`;
                 absent if the vehicle file gives all gains
"""

from __future__ import annotations

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
