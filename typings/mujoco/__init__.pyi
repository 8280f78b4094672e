# mujoco 4 ships no types: its names come from a compiled module. Everything in it is Any to pyright.
from typing import Any

def __getattr__(name: str) -> Any: ...
