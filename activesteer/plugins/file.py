"""A class or function in a user's file, such as `my_file.py:MyController?gain=2`, or a file such as an FMU.

The group `activesteer.formats` maps the ending of a file to a function of the file and the kind of block, which returns
a `Plugin`. Another distribution can add a format.
"""

from __future__ import annotations

import ast
import functools
import importlib.util
import os
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, ClassVar, Final, NoReturn

from activesteer.config import parse_value
from activesteer.core.files import is_file, read_bytes, shown_path, user_path, why_no_file
from activesteer.errors import ActiveSteerError, ParameterError, nearest_names, shown
from activesteer.plugins.kind import Kind, in_one_line

_FORM: Final = re.compile(r"(?P<path>.+?):(?P<name>[^:?]+)(?:\?(?P<parameters>.*))?", re.DOTALL)
_USER_MODULE: Final = "activesteer_user_"
"""Start of the names of modules loaded from a user's file."""
_PARAMETER: Final = re.compile(r"([A-Za-z_]\w*)=(.*)", re.DOTALL)


def from_file(text: str, kind: Kind) -> tuple[Any, dict[str, Any], dict[str, bytes]]:
    """Load a user's file: class or function, typed parameters, and the contents of file and imports by path."""
    # The file can import modules next to it. Every call loads the file and these modules again.

    def fail(problem: str, value: Any = text, allowed: Any = None) -> Exception:
        return kind.fail(text, problem, value, allowed)

    form = _FORM.fullmatch(text)
    if form is None:
        known = nearest_names(text, kind.names())
        problem = f"there is no {kind.word} {shown(text)}; {known} (give your own as {kind.example})"
        if text.endswith(".py"):
            problem = f"{shown(text)} needs the name of its class, as in {kind.example}"
        raise kind.error(problem, value=text, allowed=tuple(kind.names()))
    if not form["name"].isidentifier():
        raise fail(f"{shown(form['name'])} cannot be the name of a class; give your own as {kind.example}")
    path = user_path(form["path"], kind.error)
    if not is_file(path):
        raise fail(f"{shown_path(path)} {why_no_file(path)}")
    name = f"{_USER_MODULE}{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise fail(f"{shown_path(path)} is not a Python file")
    if isinstance(spec.loader, SourceFileLoader):
        spec.loader = _Uncached(name, str(path))
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    files = _with_neighbours(path, kind.error)
    try:
        with _Neighbours.first(path.parent, files):
            spec.loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as reason:  # a script may end with exit()
        raise fail(f"{shown_path(path)} cannot be run: {in_one_line(reason, files)}") from reason
    origin = getattr(module, form["name"], None)
    if origin is None or not (callable(origin) or hasattr(origin, "step")):
        own = [key for key, value in vars(module).items() if getattr(value, "__module__", "") == name]
        raise fail(
            f"{shown_path(path)} has no class {shown(form['name'])}; {nearest_names(form['name'], own)}",
            form["name"],
            own,
        )
    return origin, parse_parameters(form["parameters"] or "", fail), files


def is_user_module(name: str) -> bool:
    """Return whether a module was loaded from the folder of a user's file."""
    return isinstance(getattr(getattr(sys.modules.get(name), "__spec__", None), "loader", None), _Uncached)


class _Uncached(SourceFileLoader):
    """Loader without bytecode cache, which would hide a change within the same second."""

    def path_stats(self, path: str) -> NoReturn:  # type: ignore[override]
        raise OSError("no compiled file")


class _Neighbours:
    """Finder of modules next to users' files. It stores the names of the imported modules by folder."""

    folders: ClassVar[dict[str, frozenset[str]]] = {}

    @classmethod
    def find_spec(cls, name: str, path: Sequence[str] | None = None, _target: object = None) -> ModuleSpec | None:
        """Find a module, first in the folder of the file loaded last."""
        top = name.partition(".")[0]
        folder = next((folder for folder, names in reversed(cls.folders.items()) if top in names), None)
        spec = None if folder is None else PathFinder.find_spec(name, [folder] if path is None else path)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Uncached(name, spec.loader.path)
        return spec

    @classmethod
    @contextmanager
    def first(cls, folder: Path, files: Iterable[str]) -> Iterator[None]:
        """Context in which modules of a folder take precedence and are loaded anew."""
        names = frozenset(Path(file).parts[0].removesuffix(".py") for file in files)
        loaded = [name for name in sys.modules if name.partition(".")[0] in names]
        others = {name: sys.modules[name] for name in loaded if not is_user_module(name)}
        for name in loaded:
            del sys.modules[name]
        cls.folders.pop(str(folder), None)
        cls.folders[str(folder)] = names
        sys.meta_path[:] = [cls, *(finder for finder in sys.meta_path if finder is not cls)]
        importlib.invalidate_caches()
        try:
            yield
        finally:
            sys.meta_path.remove(cls)
            sys.meta_path.append(cls)
            sys.modules.update(others)


def source_of(text: str) -> dict[str, bytes]:
    """Return the file of a specification and the neighbouring modules that it imports, without execution."""
    form = _FORM.fullmatch(text)
    return {} if form is None else _with_neighbours(user_path(form["path"], ParameterError), ParameterError)


def _with_neighbours(path: Path, error: type[ActiveSteerError]) -> dict[str, bytes]:
    contents: dict[str, bytes] = {}
    waiting = [path]
    while waiting:
        file = waiting.pop()
        name = file.relative_to(path.parent).as_posix()
        if name not in contents:
            contents[name] = read_bytes(file, error)
            waiting += [
                module
                for folder in dict.fromkeys((file.parent, path.parent))
                for module in _imported_from(folder, contents[name])
            ]
    return contents


def _imported_from(folder: Path, source: bytes) -> list[Path]:
    """Find the modules and package files in a folder that a source imports, none if it is not Python."""
    try:
        nodes = list(ast.walk(ast.parse(source)))
    except (SyntaxError, ValueError, RecursionError):
        return []
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    for node in nodes:
        if isinstance(node, ast.ImportFrom):
            names |= {node.module} if node.module else {alias.name for alias in node.names}
    files = []
    # A user's file may be in our checkout, next to the package, which is loaded once.
    for name in sorted({name.partition(".")[0] for name in names} - {__name__.partition(".")[0]}):
        if is_file(folder / f"{name}.py"):
            files.append(folder / f"{name}.py")
        elif is_file(folder / name / "__init__.py"):
            files += sorted((folder / name).rglob("*.py"))
    return files


def parse_parameters(text: str, fail: Any) -> dict[str, Any]:
    """Parse `gain=2&side="left"`. An `&` splits only before a name, so a value may contain it."""
    parameters: dict[str, Any] = {}
    for part in re.split(r"&(?=[A-Za-z_]\w*=)", text) if text else ():
        pair = _PARAMETER.fullmatch(part)
        if pair is None:
            raise fail(f"{shown(part)} is not a parameter; name=value is needed, as in ?gain=2&limit_rad=0.05", part)
        if pair[1] in parameters:
            raise fail(f"the parameter {pair[1]} is given twice", pair[1])
        parameters[pair[1]] = parse_value(pair[2])
    return parameters


@functools.cache
def _formats() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group="activesteer.formats")}


def format_of(given: Any) -> EntryPoint | None:
    """Return the format of a block given as a file, or None for others."""
    if not isinstance(given, (str, os.PathLike)):
        return None
    name, dot, ending = os.fspath(given).partition("?")[0].lower().rpartition(".")
    return _formats().get(ending) if name and dot and ending.isalnum() else None
