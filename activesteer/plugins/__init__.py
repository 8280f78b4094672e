"""A driver or controller of the user's own: by name, from a file, or as a class, an instance or a factory."""

from activesteer.plugins.kind import Kind
from activesteer.plugins.plugin import Plugin, find

__all__ = ["Kind", "Plugin", "find"]
