"""A driver or controller of the user's own: by name, from a file, or as a class, an instance or a factory."""

from activesteer.plugins.file import USER_MODULE
from activesteer.plugins.kind import Kind, in_one_line
from activesteer.plugins.plugin import Plugin, find

__all__ = ["USER_MODULE", "Kind", "Plugin", "find", "in_one_line"]
