"""The files of an MJCF model, read and checked before the engine compiles them.

The engine trusts its input: a few bytes can request a height field, a texture or copies of a body that fill the memory
or take minutes. A car needs much less, so this module limits the sizes and names the limit in its message.
"""

from __future__ import annotations

import hashlib
import os
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from activesteer.errors import ModelError, shown
from activesteer.files import is_file, read_bytes, why_no_file

_MAX_XML_BYTES: Final = 4_000_000
_MAX_FILES: Final = 50
_MAX_ELEMENTS: Final = 20_000
_MAX_DEPTH: Final = 100
_MAX_ASSET_BYTES: Final = 50_000_000
_MAX_PIXELS: Final = 20_000_000
"""Pixels of a texture, samples of a height field."""
_MAX_COPIES: Final = 1000
"""Maximum of copies by `replicate`, `composite` and `flexcomp`, over all levels."""
_MAX_NUMBER: Final = 1e5
"""Largest number in an attribute of _COUNTS."""
_MAX_MEMORY: Final = 1e9
"""Maximum of memory that a model reserves for the engine [bytes]."""
_BYTES: Final = {"K": 2.0**10, "M": 2.0**20, "G": 2.0**30, "T": 2.0**40, "P": 2.0**50, "E": 2.0**60}
_COUNTS: Final = {
    "size": None,
    "numeric": ("size",),
    "option": (
        "iterations",
        "ls_iterations",
        "noslip_iterations",
        "ccd_iterations",
        "sdf_iterations",
        "sdf_initpoints",
    ),
    "mesh": ("maxhullvert",),
}
"""Element -> attributes with amounts of memory or numbers of iterations; None for all attributes."""
_COPYING: Final = ("replicate", "composite", "flexcomp")
_COMMENT: Final = re.compile(r"<!--.*?-->", re.DOTALL)
_NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?")


def model_files(mjcf: Path) -> dict[str, bytes]:
    """Read an MJCF file, its included files, and the files of its meshes, textures and height fields.

    Returns:
        Path relative to the model's folder -> content, the model file first. A mesh or picture may be large, so only
        its SHA-256 is returned, under its path and `.sha256`.
    """
    files: dict[str, bytes] = {}
    elements = 0
    waiting, assets, folders = [mjcf], {}, {mjcf.parent}
    while waiting:
        path = waiting.pop()
        if (name := _name(path, mjcf)) in files:
            continue
        files[name] = read_bytes(path, ModelError, _MAX_XML_BYTES)
        root = _parsed(files[name], name)
        if path == mjcf and root.tag != "mujoco":
            raise ModelError("is not an MJCF file: its first element is not <mujoco>", file=name)
        for element, copies, depth in _walk(root):
            elements += 1
            if elements > _MAX_ELEMENTS or depth > _MAX_DEPTH or len(files) > _MAX_FILES:
                raise ModelError(
                    f"the model has more than {_MAX_ELEMENTS} elements, {_MAX_DEPTH} levels or {_MAX_FILES} files",
                    file=name,
                )
            if element.tag == "include":
                waiting.append(_included(element, path, mjcf, name))
            else:
                _check(element, copies, name)
                assets |= dict.fromkeys(_asset_names(element), name)
            if element.tag == "compiler":
                folders |= {mjcf.parent / element.get(key, "") for key in ("meshdir", "texturedir", "assetdir")}
    for file, name in assets.items():
        for path in (folder / asked for folder in folders for asked in (file, Path(file).name)):
            if os.path.lexists(path):
                found = _check_asset(path, name)
                files[f"{_name(path, mjcf)}.sha256"] = hashlib.sha256(found).hexdigest().encode()
    return files


def _name(path: Path, mjcf: Path) -> str:
    try:
        name = path.relative_to(mjcf.parent).as_posix()
    except ValueError:  # beside or above the model's folder
        name = path.name
    return name.encode("utf-8", "backslashreplace").decode()


def _parsed(data: bytes, name: str) -> ElementTree.Element:
    text = _COMMENT.sub("", data.decode("utf-8", "replace").removeprefix("\ufeff"))
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ModelError("an MJCF file must not have a DOCTYPE or entities", file=name)
    try:
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as reason:
        # Report the position only: the content may be confidential.
        line = getattr(reason, "position", (None,))[0]
        raise ModelError("is not valid XML", file=name, line=line) from reason


def _walk(root: ElementTree.Element) -> Iterator[tuple[ElementTree.Element, float, int]]:
    """Yield every element, the number of its copies, and its depth."""
    stack = [(root, 1.0, 0)]
    while stack:
        element, copies, depth = stack.pop()
        if element.tag in _COPYING:
            for number in _numbers(element.get("count", "1")):
                copies *= max(1.0, number)
        yield element, copies, depth
        stack += [(child, copies, depth + 1) for child in element]


def _numbers(text: str) -> list[float]:
    return [float(found) for found in _NUMBER.findall(text)]


def _included(element: ElementTree.Element, path: Path, mjcf: Path, name: str) -> Path:
    file = element.get("file", "")
    for folder in (mjcf.parent, path.parent):
        if is_file(folder / file):
            return folder / file
    raise ModelError(f"the included file {shown(file)} {why_no_file(mjcf.parent / file)}", file=name, value=file)


def _check(element: ElementTree.Element, copies: float, name: str) -> None:
    """Check the amounts that an element requests from the engine."""
    tag = element.tag
    if copies > _MAX_COPIES:
        raise _too_much(f"<{tag}> makes {copies:.3g} copies", _MAX_COPIES, name)
    if tag in ("hfield", "texture"):
        sides = ("nrow", "ncol") if tag == "hfield" else ("width", "height")
        pixels = 1.0
        for side in sides:
            pixels *= max([1.0, *map(abs, _numbers(element.get(side, "")))])
        if pixels > _MAX_PIXELS:
            raise _too_much(f"<{tag}> has {pixels:.3g} points", _MAX_PIXELS, name)
    if tag in _COUNTS:
        attributes = _COUNTS[tag] or tuple(element.keys())
        for attribute in attributes:
            text = element.get(attribute, "").strip()
            maximum = max(map(abs, _numbers(text)), default=0.0)
            if attribute == "memory":
                if maximum * _BYTES.get(text[-1:].upper(), 1.0) > _MAX_MEMORY:
                    raise _too_much(f"<{tag} memory={shown(text)}>", _MAX_MEMORY, name)
            elif maximum > _MAX_NUMBER:
                raise _too_much(f"<{tag} {attribute}={shown(text)}>", _MAX_NUMBER, name)


def _asset_names(element: ElementTree.Element) -> list[str]:
    """Return the files of a mesh, texture, height field or skin."""
    return [file for attribute, file in element.items() if attribute.startswith("file") and file]


def _check_asset(path: Path, name: str) -> bytes:
    data = read_bytes(path, ModelError, _MAX_ASSET_BYTES)
    if data.startswith(b"\x89PNG") and len(data) > 24:
        width, height = struct.unpack(">II", data[16:24])
        if width * height > _MAX_PIXELS:
            raise _too_much(f"the picture {shown(path.name)} has {width * height:.3g} points", _MAX_PIXELS, name)
    return data


def _too_much(what: str, maximum: float, name: str) -> ModelError:
    return ModelError(f"{what}; a car needs at most {maximum:g}", file=name, allowed=maximum)
