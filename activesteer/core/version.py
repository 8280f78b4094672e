"""Version of the package, which pyproject.toml reads from this module."""

from __future__ import annotations

__version__ = "0.1.0"
