"""List the modules of the package through which a parameter of a run passes, in the order of their first call.

    python tools/trace_run.py [ARGUMENT ...]        by default: run step_steer -c ars

Counted is every module that executes a function in Python between the parsed command line and the last recorded row.
Compiled code calls no Python, so the loop itself appears by the modules that prepare its records.
"""

from __future__ import annotations

import inspect
import sys
import tempfile
from pathlib import Path
from types import FrameType
from typing import Any

PACKAGE = "activesteer"


def modules_of(arguments: list[str]) -> list[str]:
    """Drive a run and return the modules."""
    from activesteer.commands import cli  # noqa: PLC0415
    from activesteer.commands import drive as command  # noqa: PLC0415
    from activesteer.simulation.simulation import Simulation  # noqa: PLC0415

    found: dict[str, None] = {}
    inside = 0

    def seen(frame: FrameType, event: str, _: Any) -> None:
        nonlocal inside
        code, name = frame.f_code, frame.f_globals.get("__name__", "")
        if event == "call" and code is begins:
            inside = 1
        elif event == "call" and code is ends:
            inside = 2
        is_function = code.co_flags & inspect.CO_OPTIMIZED  # not the body of a module or a class
        if inside == 1 and event == "call" and is_function and name.startswith(PACKAGE):
            found.setdefault(name)

    begins, ends = command._run.__code__, Simulation.recording.__code__
    with tempfile.TemporaryDirectory() as folder:
        sys.setprofile(seen)
        try:
            cli.main([*arguments, "-o", str(Path(folder) / "a.mcap")])
        finally:
            sys.setprofile(None)
    return list(found)


if __name__ == "__main__":
    modules = modules_of(sys.argv[1:] or ["run", "step_steer", "-c", "ars"])
    print("\n".join([*modules, f"{len(modules)} modules"]))
