"""Drivers and controllers of a user, given by name, as a file, or as a class, an instance or a factory.

In: a name, a file, a class or a factory.
Out: a specification that makes the block, with its declared parameters.
"""

from activesteer.plugins.file import is_user_module
from activesteer.plugins.kind import Kind, in_one_line
from activesteer.plugins.plugin import Declared, Plugin, declared_in, find

__all__ = ["Declared", "Kind", "Plugin", "declared_in", "find", "in_one_line", "is_user_module"]
