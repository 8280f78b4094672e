"""Design of a study: combinations of factor values from a grid, a list of cases, or a sample."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Range, Source, parse_value
from activesteer.core.files import read_csv
from activesteer.errors import ParameterError, StudyError, not_installed, shown
from activesteer.studies.engine.factors import Factor, Value

FOR_INDICES: Final = ("saltelli", "morris")
"""Designs that SALib creates for its sensitivity indices. Every factor must be sampled."""
MORRIS_LEVELS: Final = 4
MAX_SAMPLES: Final = 10_000_000
"""Largest number of combinations of a design."""


@dataclass(frozen=True)
class DesignTable:
    """The table [design] of a study file."""

    kind: Literal["", "grid", "list", "sobol", "latin_hypercube", "random", "saltelli", "morris"] = ""
    """Default: `list` if there are cases, `grid` if every factor is a grid, else `sobol`."""
    samples: Annotated[int, Range(1, MAX_SAMPLES)] = 0
    """Size of the sample. For `saltelli` the base sample (D + 2 runs each), for `morris` trajectories (D + 1 each)."""
    paired: bool = True
    """True if all controllers are driven with the same sample."""
    maneuvers: Literal["all", "one"] = "all"
    """`all`: every sample drives every manoeuvre. `one`: every sample drives one of them, drawn at random, all equally
    often."""


@dataclass(frozen=True)
class Samples:
    """Combinations of factor values, stored as columns to save memory."""

    # Key -> value in every combination; None for a key that a case of a list does not name
    columns: dict[str, list[Value]]
    count: int

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, number: int) -> dict[str, Value]:
        """Return one combination as overrides."""
        return {key: value for key, values in self.columns.items() if (value := values[number]) is not None}


def draw(factors: Sequence[Factor], kind: str, count: int, seed: int, stream: int = 0) -> Samples:
    """Return the combinations of a design. Each grid value is combined with the same sample of the other factors."""
    grids = [factor for factor in factors if factor.kind == "grid"]
    sampled = [factor for factor in factors if factor.kind != "grid"]
    if sampled:
        unit = _unit_sample(kind, len(sampled), count, [seed, stream] if stream else [seed])
        columns: dict[str, list[Value]] = {
            factor.key: [*factor.from_unit(unit[:, place])] for place, factor in enumerate(sampled)
        }
        inner = len(unit)
    else:
        columns, inner = {}, 1
    crossed = math.prod(len(factor.values) for factor in grids)
    repeats = crossed * inner
    for factor in grids:
        repeats //= len(factor.values)
        once = [value for value in factor.values for _ in range(repeats)]
        columns[factor.key] = once * (crossed * inner // len(once))
    for factor in sampled:
        columns[factor.key] *= crossed
    return Samples({factor.key: columns[factor.key] for factor in factors}, crossed * inner)


def _unit_sample(kind: str, dimensions: int, count: int, seed: list[int]) -> NDArray[np.float64]:
    """Return points of the unit cube, shape (points, dimensions)."""
    from scipy.stats import qmc  # noqa: PLC0415 - slow to import, and workers draw nothing

    rng = np.random.default_rng(seed)
    if kind == "random":
        return rng.random((count, dimensions))
    if kind == "latin_hypercube":
        return qmc.LatinHypercube(dimensions, rng=rng).random(count)
    if kind == "sobol":
        # Draw a whole power of 2 and cut it: the part is as balanced as the sequence up to there.
        return qmc.Sobol(dimensions, rng=rng).random_base2(math.ceil(math.log2(count)))[:count]
    problem = {
        "num_vars": dimensions,
        "names": [str(i) for i in range(dimensions)],
        "bounds": [[0.0, 1.0]] * dimensions,
    }
    try:
        from SALib.sample import morris, sobol  # noqa: PLC0415 - an extra
    except ImportError as reason:
        raise not_installed(StudyError, f"design.kind = {kind!r}", "SALib", "study") from reason
    number = int(rng.integers(2**31))
    if kind == "saltelli":
        return np.asarray(sobol.sample(problem, count, calc_second_order=False, seed=number))
    return np.asarray(morris.sample(problem, count, num_levels=MORRIS_LEVELS, seed=number))


def cases(given: Iterable[Mapping[str, Any]]) -> Samples:
    """Return the combinations of a list of cases, each with the keys that it sets."""
    rows = list(given)
    keys = dict.fromkeys(key for row in rows for key in row)
    return Samples({key: [row.get(key) for row in rows] for key in keys}, len(rows))


def read_cases(path: Path) -> Samples:
    """Read a list of cases from a CSV file with keys in its header. Empty cells set nothing."""

    def fail(problem: str, line: int, key: str | None = None) -> StudyError:
        return StudyError(problem, file=path.name, line=line, key=key)

    rows = read_csv(path, StudyError, empty_cells_count=True)
    if len(rows) < 2:
        raise StudyError("holds no cases; a header with keys and rows of values are needed", file=path.name)
    header, *body = rows
    keys = header.cells
    if len(set(keys)) != len(keys) or "" in keys:
        raise fail(f"every column of the cases needs a different key; found {shown(keys)}", header.line)
    found: list[dict[str, Value]] = []
    for line, cells in body:
        if len(cells) != len(keys):
            raise fail(f"the case has {len(cells)} cells, but the header has {len(keys)}", line)
        found.append({})
        for key, cell in zip(keys, cells, strict=True):
            if cell:
                try:
                    found[-1][key] = parse_value(cell)
                except ParameterError as reason:
                    raise fail(reason.problem, line, key) from reason
    return cases(found)


def choose_design(table: DesignTable, factors: Sequence[Factor], has_cases: bool, source: Source) -> DesignTable:
    """Complete and check a design."""
    all_grids = all(factor.kind == "grid" for factor in factors)
    kind = table.kind or ("list" if has_cases else "grid" if all_grids else "sobol")
    where = ("design", "kind")
    if has_cases != (kind == "list"):
        wanted = "needs design.cases" if kind == "list" else f"design.cases belongs to a list, not to {kind}"
        raise source.fail(where, wanted)
    if kind == "list" and factors:
        raise source.fail(("factors",), "the list of cases already names the keys; leave [factors] out")
    if kind == "grid" and not all_grids:
        other = next(factor for factor in factors if factor.kind != "grid")
        raise source.fail(where, f"is grid, but {other.key} is {other.kind}; give a grid there or another design")
    if kind in ("grid", "list"):
        if table.samples:
            raise source.fail(("design", "samples"), f"has no effect on a {kind}; leave it out")
        _check_size(factors, 1, source)
        return replace(table, kind=kind, samples=0)
    if all_grids:
        raise source.fail(where, f"is {kind}, but every factor is a grid; leave it out, or give a distribution")
    if kind in FOR_INDICES and table.maneuvers == "one":
        raise source.fail(("design", "maneuvers"), f"{kind} needs every sample in every manoeuvre")
    if kind in FOR_INDICES and any(factor.kind == "grid" for factor in factors):
        raise source.fail(where, f"{kind} samples every factor; write choice in place of grid")
    if not table.samples:
        raise source.fail(("design", "samples"), f"{kind} needs the size of the sample")
    if kind == "saltelli" and table.samples & (table.samples - 1):
        raise source.fail(("design", "samples"), f"is {table.samples}; saltelli needs a power of 2")
    points = {"saltelli": len(factors) + 2, "morris": len(factors) + 1}.get(kind, 1) * table.samples
    _check_size(factors, points, source)
    return replace(table, kind=kind)


def _check_size(factors: Sequence[Factor], points: int, source: Source) -> None:
    """Reject a design with too many combinations before they are created."""
    sizes = [len(factor.values) for factor in factors if factor.kind == "grid"]
    count = math.prod(sizes) * points
    if count > MAX_SAMPLES:
        parts = " x ".join(map(str, [*sizes, *([points] if points > 1 else [])]))
        raise source.fail(
            ("design",), f"has {parts} = {count} combinations; at most {MAX_SAMPLES} are allowed", count, MAX_SAMPLES
        )
