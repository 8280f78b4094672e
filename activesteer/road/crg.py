"""Road surfaces of ASAM OpenCRG files: a grid of heights along a curved reference line.

A file has a header of text in blocks `$NAME`, then the data: for each step along the line the columns that the block
`$KD_DEFINITION` names, as text of 80 characters a line (LRFI, LDFI) or as big-endian numbers (KRBI, KDBI). u runs along
the line, v to its left. The height is grid(u, v) + z of the line + banking(u) v. Headings and slopes belong to the
step before their point.

Read are: blocks `$ROAD_CRG`, `$ROAD_CRG_FILE` (a reference to another file), `$ROAD_CRG_MODS` (scales of heights,
slope, banking, length, width and curvature; treatment of missing heights), and the data. Missing heights are filled
from the nearest height towards the middle of the row, unless the file wants zero; a hole there raises an error. The
place of the line in the world and the border modes do not matter: the car enters the surface at its start, and
`road.outside` rules what is beyond.

Source: ASAM OpenCRG 1.2.0, user guide and file format.
"""

from __future__ import annotations

import base64
import functools
import math
import re
import zlib
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

import numpy as np

from activesteer.core import limits
from activesteer.core.conventions import Array
from activesteer.core.path import Path
from activesteer.errors import ManeuverError, shown
from activesteer.road.obstacles import Grid

_HIGHEST_M: Final = 1000.0
_LINE_BYTES: Final = 80
_PIECE: Final = 1000
"""Letters of each piece of a file in the metadata of a recording."""
_LINE_STEP_M: Final = 0.25
"""Least distance of the points of the reference line [m]."""
_TEXT_CELLS: Final = {"LRFI": 10, "LDFI": 20}
_BINARY: Final = {"KRBI": ">f4", "KDBI": ">f8"}
_SCALES: Final = ("scale_z_grid", "scale_slope", "scale_banking", "scale_length", "scale_width", "scale_curvature")
_ZERO, _KEEP_LAST = 1, 2
"""Modes of missing heights that are not an error."""


class CrgRoad(NamedTuple):
    """Heights along the reference line, and the line itself if it is curved."""

    grid: Grid
    line: Path | None


def packed(files: Mapping[str, bytes]) -> tuple[str, ...]:
    """Return the contents of the files for a recording, with the road's own file first."""
    content = b"".join(f"{name}\0{len(text)}\0".encode() + text for name, text in files.items())
    text = base64.b64encode(zlib.compress(content, 9)).decode()
    return tuple(text[start : start + _PIECE] for start in range(0, len(text), _PIECE))


@functools.lru_cache(maxsize=4)
def unpacked(texts: tuple[str, ...]) -> CrgRoad:
    """Return the surface from packed file contents."""
    try:
        unpacking = zlib.decompressobj()
        content = unpacking.decompress(
            base64.b64decode("".join(texts), validate=True), limits.MAX_CRG_FILES * limits.MAX_CRG_BYTES
        )
        files = {}
        while content:
            name, size, content = content.split(b"\0", 2)
            files[name.decode()], content = content[: int(size)], content[int(size) :]
    except (ValueError, zlib.error) as reason:
        raise ManeuverError(f"is damaged: {reason}", key="crg_data") from reason
    if not files:
        raise ManeuverError("is empty; the content of an OpenCRG file is needed", key="crg_data")
    return read_crg(next(iter(files)), files.__getitem__)


def referenced(content: bytes) -> str | None:
    """Return the name of the file that an OpenCRG file refers to, or None."""
    lines = _split(content)[0].get("ROAD_CRG_FILE")
    if lines is None:
        return None
    name = "".join(lines)
    if not name or name.startswith("$"):
        raise ManeuverError(f"refers to {shown(name)}; a path without environment variables is needed")
    return name


def read_crg(name: str, content_of: Callable[[str], bytes]) -> CrgRoad:
    """Read the surface of an OpenCRG file."""
    blocks, data = _split(content_of(name))
    mods = blocks.get("ROAD_CRG_MODS")
    for _ in range(limits.MAX_CRG_FILES):
        if "ROAD_CRG_FILE" not in blocks:
            break
        blocks, data = _split(content_of("".join(blocks["ROAD_CRG_FILE"])))
        mods = blocks.get("ROAD_CRG_MODS") if mods is None else mods
    else:
        raise ManeuverError(f"refers to more than {limits.MAX_CRG_FILES} files in a chain")
    for block in ("ROAD_CRG", "KD_DEFINITION"):
        if block not in blocks:
            raise ManeuverError(f"is not an OpenCRG file: there is no block ${block}")
    return _road(_values(blocks["ROAD_CRG"]), _values(mods or []), blocks["KD_DEFINITION"], data)


def _split(content: bytes) -> tuple[dict[str, list[str]], bytes]:
    """Split a file into its header lines, by block, and its data."""
    end = re.search(rb"^\$\$\$\$[^\r\n]*\r?\n", content, re.MULTILINE)
    head = content[: end.start()] if end else content
    blocks: dict[str, list[str]] = {}
    lines: list[str] = []
    for line in head.decode("latin-1").splitlines():
        if line.startswith("*"):
            continue
        text = line.partition("!")[0].strip()
        if text.startswith("$"):
            lines = []
            if len(text) > 1:
                lines = blocks.setdefault(text[1:].split()[0].upper(), [])
        elif text:
            lines.append(text)
    return blocks, content[end.end() :] if end else b""


def _values(lines: list[str]) -> dict[str, float]:
    """Return the numbers of a block by their names in lower case."""
    values = {}
    for line in lines:
        key, sign, text = (part.strip() for part in line.partition("="))
        if sign:
            values[key.lower()] = limits.number_in(re.sub(r"\+e", "e+", text), ManeuverError, key=key)
    return values


def _road(head: dict[str, float], mods: dict[str, float], definition: list[str], content: bytes) -> CrgRoad:
    columns, form = _columns(definition)
    scale = {name: mods.get(name, 1.0) for name in _SCALES}
    step = head.get("reference_line_increment", 0.0) * scale["scale_length"]
    if not 1e-3 <= step <= 1000.0:
        raise ManeuverError(f"REFERENCE_LINE_INCREMENT is {step:g} m; 0.001 to 1000 m are allowed")
    data = _data(content, form, len(columns))
    limits.check_numbers(data, ManeuverError, key="data")
    if "reference_line_end_u" in head:
        span = (head["reference_line_end_u"] - head.get("reference_line_start_u", 0.0)) * scale["scale_length"]
        rows = round(span / step) + 1
        if not 2 <= rows <= len(data):
            raise ManeuverError(f"has {len(data)} rows of data, but its header says {rows}")
        data = data[:rows]
    sections = [index for index, name in enumerate(columns) if name.startswith("long section")]
    if len(sections) < 2 or len(data) < 2:
        raise ManeuverError(f"has {len(sections)} long sections and {len(data)} rows; at least 2 of each are needed")
    places = _places(head, [columns[index] for index in sections]) * scale["scale_width"]
    if (np.diff(places) <= 0.0).any():
        bad = int((np.diff(places) <= 0.0).argmax())
        raise ManeuverError(
            f"its long sections {bad + 1} and {bad + 2} are at {places[bad]:g} and {places[bad + 1]:g} m; "
            "positions must increase from right to left"
        )
    heights = _filled(data[:, sections], int(mods.get("grid_nan_mode", _KEEP_LAST)), mods.get("grid_nan_offset", 0.0))
    heights = heights * scale["scale_z_grid"]
    along = {name.removeprefix("reference line "): data[:, index] for index, name in enumerate(columns)}
    slope = _channel(along, "slope", head.get("reference_line_start_s", 0.0), len(data)) * scale["scale_slope"]
    banking = _channel(along, "banking", head.get("reference_line_start_b", 0.0), len(data)) * scale["scale_banking"]
    rise = np.concatenate([[0.0], np.cumsum(slope[1:]) * step])
    heights = heights + rise[:, None] + banking[:, None] * places
    # Heights count from the middle of the start, where the car enters.
    heights = heights - float(np.interp(0.0, places, heights[0]))
    if not np.isfinite(heights).all() or np.abs(heights).max() > _HIGHEST_M:
        raise ManeuverError(f"has heights that are not finite or exceed {_HIGHEST_M:g} m")
    turn = np.zeros(len(data) - 1)
    if "phi" in along:
        phi = along["phi"][1:]
        if not np.isfinite(phi).all():
            raise ManeuverError("the heading of the reference line has missing values")
        change = np.remainder(np.diff(phi, prepend=phi[0]) + math.pi, math.tau) - math.pi
        turn = np.cumsum(change * scale["scale_curvature"])
        folds = np.abs(change * scale["scale_curvature"] / step) * np.abs(places).max()
        if (folds >= 1.0).any():
            raise ManeuverError(
                f"folds over itself at row {int(folds.argmax()) + 1}: the curve is narrower than the grid"
            )
    even, start, width = _evenly(places, heights)
    return CrgRoad(Grid(0.0, step, start, width, even), _line(turn, step))


def _columns(lines: list[str]) -> tuple[list[str], str]:
    """Return the names of the data columns in lower case, and the data format."""
    form = next((line[2:].strip().upper() for line in lines if line.startswith("#:")), "")
    if form not in (*_TEXT_CELLS, *_BINARY):
        raise ManeuverError(f"the data format is {shown(form)}; known: {', '.join((*_TEXT_CELLS, *_BINARY))}")
    names = [line[2:].partition(",")[0].strip().lower() for line in lines if line.startswith("D:")]
    limits.check_count(len(names), limits.MAX_CRG_COLUMNS, "data columns", ManeuverError)
    if not names:
        raise ManeuverError("has no data columns")
    return names, form


def _data(data: bytes, form: str, columns: int) -> Array:
    """Return the data, shape (rows, columns), with nan for missing values."""
    if form in _BINARY:
        number = np.dtype(_BINARY[form])
        row = number.itemsize * columns
        rows = len(data) // row
        # Zeros fill the last record of 80 bytes.
        if len(data) % _LINE_BYTES and len(data) % row:
            raise ManeuverError("has lost or gained bytes, as in a text transfer; transfer it again in binary mode")
        limits.check_count(rows * columns, limits.MAX_CRG_POINTS, "points", ManeuverError)
        padding = min(_LINE_BYTES - 1, len(data) - len(data.rstrip(b"\0")))
        rows = max(rows - max(0, padding - len(data) % row) // row, 0)
        with np.errstate(invalid="ignore"):  # missing values may be signalling
            return np.frombuffer(data, number, rows * columns).reshape(rows, columns).astype(np.float64)
    width = _TEXT_CELLS[form]
    lines = [line for line in data.decode("latin-1").splitlines() if line.strip()]
    per_row = -(-columns // (_LINE_BYTES // width))
    rows = len(lines) // per_row
    limits.check_count(rows * columns, limits.MAX_CRG_POINTS, "points", ManeuverError)
    found = np.empty((rows, columns))
    for row in range(rows):
        text = "".join(line.ljust(_LINE_BYTES)[:_LINE_BYTES] for line in lines[row * per_row : (row + 1) * per_row])
        for column in range(columns):
            cell = text[column * width : (column + 1) * width].strip()
            try:
                found[row, column] = math.nan if cell.startswith("*") else float(cell)
            except ValueError as reason:
                raise ManeuverError(f"row {row + 1} of the data: {shown(cell)} is not a number") from reason
    return found


def _places(head: dict[str, float], names: list[str]) -> Array:
    """Return the lateral positions of the long sections [m]."""
    if all("v =" in name for name in names):
        texts = [name.partition("v =")[2].strip() for name in names]
        return np.array([limits.number_in(text, ManeuverError, key="v of a long section") for text in texts])
    count = len(names)
    right, left = head.get("long_section_v_right"), head.get("long_section_v_left")
    if right is not None and left is not None:
        return np.linspace(right, left, count, dtype=np.float64)
    step = head.get("long_section_v_increment")
    if step is None or not step > 0.0:
        raise ManeuverError("does not give the positions of its long sections")
    first = -0.5 * step * (count - 1) if right is None else right
    return first + step * np.arange(count, dtype=np.float64)


def _channel(along: Mapping[str, Array], name: str, constant: float, rows: int) -> Array:
    """Return slope or banking of each row, with 0 for missing values."""
    return np.nan_to_num(along[name]) if name in along else np.full(rows, constant)


def _filled(heights: Array, mode: int, offset: float) -> Array:
    """Fill missing heights at the sides, and raise an error for a hole."""
    missing = np.isnan(heights)
    if not missing.any():
        return heights
    if mode not in (_ZERO, _KEEP_LAST):
        raise ManeuverError(f"has {int(missing.sum())} missing heights, which GRID_NAN_MODE = {mode} keeps")
    filled = heights.copy()
    for row in np.flatnonzero(missing.any(axis=1)):
        known = np.flatnonzero(~missing[row])
        if not known.size:
            raise ManeuverError(f"row {row + 1} has no height at all")
        if missing[row, known[0] : known[-1]].any():
            raise ManeuverError(f"row {row + 1} has a hole between its heights")
        filled[row, : known[0]] = 0.0 if mode == _ZERO else heights[row, known[0]] + offset
        filled[row, known[-1] + 1 :] = 0.0 if mode == _ZERO else heights[row, known[-1]] + offset
    return filled


def _evenly(places: Array, heights: Array) -> tuple[Array, float, float]:
    """Resample heights at even lateral positions, and return them with the first position and the step [m]."""
    step = float(np.diff(places).min())
    count = max(2, round((places[-1] - places[0]) / step) + 1)
    if heights.shape[0] * count > limits.MAX_CRG_POINTS:
        raise ManeuverError(f"has long sections too close together for its width of {places[-1] - places[0]:g} m")
    even, step = np.linspace(places[0], places[-1], count, retstep=True)
    if np.allclose(even, places[: len(even)] if len(even) == len(places) else math.inf):
        return heights, float(places[0]), float(step)
    return np.array([np.interp(even, places, row) for row in heights]), float(places[0]), float(step)


def _line(turn_rad: Array, step_m: float) -> Path | None:
    """Return the reference line relative to the first heading, or None if it is straight."""
    if np.abs(turn_rad).max() < 1e-9:
        return None
    x, y = (np.concatenate([[0.0], np.cumsum(step_m * function(turn_rad))]) for function in (np.cos, np.sin))
    every = max(1, math.ceil(_LINE_STEP_M / step_m))
    kept = np.unique(np.append(np.arange(0, len(x), every), len(x) - 1))
    return Path.through(x[kept], y[kept]) if len(kept) > 2 else None
