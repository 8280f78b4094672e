"""activesteer: a multibody car in MuJoCo with active rear steering and active front steering superposition."""

from __future__ import annotations

from activesteer.core.version import __version__

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from activesteer.core.signals import ActuatorCommand, DriverCommand, Estimate, Measurement, Motion, Setpoint
    from activesteer.recording import Recording
    from activesteer.simulation.batch import Batch
    from activesteer.simulation.runner import simulate
    from activesteer.simulation.simulation import Simulation
    from activesteer.studies.engine.study import study

__all__ = [
    "ActuatorCommand",
    "Batch",
    "DriverCommand",
    "Estimate",
    "Measurement",
    "Motion",
    "Recording",
    "Setpoint",
    "Simulation",
    "__version__",
    "simulate",
    "study",
]

# Imported at first use: engine and compiler take a second, which help and lists of names need not wait for.
_HOMES = {
    "Batch": "activesteer.simulation.batch",
    "Recording": "activesteer.recording",
    "DriverCommand": "activesteer.core.signals",
    "Estimate": "activesteer.core.signals",
    "Measurement": "activesteer.core.signals",
    "Motion": "activesteer.core.signals",
    "Setpoint": "activesteer.core.signals",
    "Simulation": "activesteer.simulation.simulation",
    "ActuatorCommand": "activesteer.core.signals",
    "simulate": "activesteer.simulation.runner",
    "study": "activesteer.studies.engine.study",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    value = globals()[name] = getattr(import_module(_HOMES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
