"""A class or function in a Python file of the user's, named as `my_file.py:MyController?gain=2`."""

from __future__ import annotations

import ast
import importlib.util
import re
import sys
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.config import parse_value
from activesteer.errors import ParameterError, nearest_names, shown
from activesteer.files import is_file, read_bytes, shown_path, user_path, why_no_file
from activesteer.plugins.kind import Kind, in_one_line

_FORM: Final = re.compile(r"(?P<path>.+?):(?P<name>[^:?]+)(?:\?(?P<parameters>.*))?", re.DOTALL)
USER_MODULE: Final = "activesteer_user_"
"""Beginning of the names of modules loaded from a user's file."""
_PARAMETER: Final = re.compile(r"([A-Za-z_]\w*)=(.*)", re.DOTALL)


class FromFile(NamedTuple):
    """What a text of this form names.

    Attributes:
        path: The file.
        content: What stands in it.
        found: The class or function.
        parameters: Name -> value, typed as in TOML.
    """

    path: Path
    content: bytes
    found: Any
    parameters: dict[str, Any]


def from_file(text: str, kind: Kind) -> FromFile:
    """Reads the file and looks up what is named.

    Args:
        text: `path/to/file.py:Name`, with `?parameter=value&other=value` behind it if need be.
        kind: What is wanted.

    Raises:
        ActiveSteerError: of the kind's type: the text has another form, the file is not there, does not run, or has no
            such class or function.
    """

    def fail(problem: str, value: Any = text, allowed: Any = None) -> Exception:
        return kind.fail(text, problem, value, allowed)

    form = _FORM.fullmatch(text)
    if form is None:
        hint = nearest_names(text, kind.names())
        raise kind.error(
            f"there is no {kind.word} {shown(text)}; {hint} Your own is given as {kind.example}",
            value=text,
            allowed=tuple(kind.names()),
        )
    if not form["name"].isidentifier():
        raise fail(f"{shown(form['name'])} cannot be the name of a class; your own is given as {kind.example}")
    path = user_path(form["path"], kind.error)
    if not is_file(path):
        raise fail(f"there is no file {shown_path(path)}: it {why_no_file(path)}")
    name = f"{USER_MODULE}{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise fail(f"{shown_path(path)} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    content = read_bytes(path, kind.error)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as reason:  # a script may end with exit()
        raise fail(f"{shown_path(path)} cannot be run: {in_one_line(reason)}") from reason
    found = getattr(module, form["name"], None)
    if found is None or not (callable(found) or hasattr(found, "step")):
        own = [key for key, value in vars(module).items() if getattr(value, "__module__", "") == name]
        raise fail(
            f"{shown_path(path)} has no class {shown(form['name'])}; {nearest_names(form['name'], own)}",
            form["name"],
            own,
        )
    return FromFile(path, content, found, _parameters(form["parameters"] or "", fail))


def source_of(text: str) -> dict[str, bytes]:
    """The file that a text names and the modules beside it that it imports, without running them.

    Args:
        text: As in `from_file`.

    Returns:
        Path in the file's folder -> content; empty for anything that names no file, as a built-in one.

    Raises:
        ParameterError: a file cannot be read.
    """
    form = _FORM.fullmatch(text)
    path = None if form is None else user_path(form["path"], ParameterError)
    found: dict[str, bytes] = {}
    waiting = [] if path is None else [path]
    while waiting:
        file = waiting.pop()
        name = file.relative_to(path.parent).as_posix() if path else file.name
        if name not in found:
            found[name] = read_bytes(file, ParameterError)
            waiting += _imported_from(file.parent, found[name])
    return found


def _imported_from(folder: Path, source: bytes) -> list[Path]:
    """The modules, and files of the packages, of a folder that a source imports; none where it is no Python."""
    try:
        nodes = list(ast.walk(ast.parse(source)))
    except (SyntaxError, ValueError, RecursionError):
        return []
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    for node in nodes:
        if isinstance(node, ast.ImportFrom):
            names |= {node.module} if node.module else {alias.name for alias in node.names}
    found = []
    for name in sorted({name.partition(".")[0] for name in names}):
        if is_file(folder / f"{name}.py"):
            found.append(folder / f"{name}.py")
        elif is_file(folder / name / "__init__.py"):
            found += sorted((folder / name).rglob("*.py"))
    return found


def _parameters(text: str, fail: Any) -> dict[str, Any]:
    """`gain=2&side="left"`: split where a name follows, so that a value may hold the sign itself."""
    parameters: dict[str, Any] = {}
    for part in re.split(r"&(?=[A-Za-z_]\w*=)", text) if text else ():
        pair = _PARAMETER.fullmatch(part)
        if pair is None:
            raise fail(f"{shown(part)} is no parameter; name=value is needed, as in ?gain=2&limit_rad=0.05", part)
        if pair[1] in parameters:
            raise fail(f"the parameter {pair[1]} is given twice", pair[1])
        parameters[pair[1]] = parse_value(pair[2])
    return parameters
