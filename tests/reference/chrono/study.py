"""Effects of the other code's tyre simplifications and of the step size, as tables beside the comparison."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.core.conventions import DEFAULT_TIMESTEP_S
from activesteer.simulation.runner import simulate
from activesteer.studies.engine.workers import in_parallel
from tests.reference.chrono.reference import ReferenceData
from tests.reference.chrono.reference_columns import reference_columns

_STEADY_S: Final = 0.5
_STEPS_S: Final = (0.000125, 0.00025, 0.0005, 0.001)
"""Step sizes [s]."""
_TYRE: Final = "vehicle.tyres.conventions."
_RELAXATION: Final = {f"{_TYRE}relaxation": True}
_CAMBER: Final = {f"{_TYRE}camber": True}
_COMBINED: Final = {f"{_TYRE}combined_slip": "weights"}
_OURS: Final = {
    **_RELAXATION, **_CAMBER, **_COMBINED, f"{_TYRE}slip_velocity": "contact_point", f"{_TYRE}rolling_radius": "file",
    f"{_TYRE}trail_load": "nominal", f"{_TYRE}friction_scales": "formula", f"{_TYRE}speed_offset_mps": 0.0,
}  # fmt: skip
_VARIANTS: Final[dict[str, dict[str, Any]]] = {
    "as the other code": {},
    "with relaxation lengths": _RELAXATION,
    "with camber": _CAMBER,
    "with the formula's combined slip": _COMBINED,
    "with all three": {**_RELAXATION, **_CAMBER, **_COMBINED},
    "all conventions ours": _OURS,
}
_TABLES: Final = {
    "conventions": [(name, overrides, DEFAULT_TIMESTEP_S) for name, overrides in _VARIANTS.items()],
    "step_sizes": [(f"{1e3 * step_s:g} ms", {}, step_s) for step_s in _STEPS_S],
}
"""Table -> its rows: name, overrides, step size [s]; the first row is the base of the comparison."""
TITLES: Final = {"conventions": "Effect of the other code's conventions", "step_sizes": "Effect of the step size"}


class Response(NamedTuple):
    """Characteristic values of a step steer."""

    name: str
    steady_yaw_rate_radps: float
    peak_yaw_rate_radps: float
    peak_time_s: float
    steady_sideslip_rad: float
    peak_sideslip_rad: float
    steady_roll_rad: float

    def relative_to(self, other: Response) -> dict[str, float]:
        """Return the relative changes from another response; the change of the time in seconds."""
        changes = {
            key: mine / theirs - 1.0
            for key, mine, theirs in zip(self._fields[1:], self[1:], other[1:], strict=True)
            if isinstance(mine, float) and isinstance(theirs, float)
        }
        return changes | {"peak_time_s": self.peak_time_s - other.peak_time_s}


def responses(
    data: ReferenceData,
    progress: Callable[[float, str], None],
    jobs: int | None = None,
    *,
    scheduler: str | None = None,
) -> dict[str, list[Response]]:
    """Drive the reference's step steer with each row of the tables.

    Args:
        data: The reference data.
        progress: Called with the finished fraction and the name of the finished row.
        jobs: Number of processes; by default the number of processors.
        scheduler: See `in_parallel`.

    Returns:
        Table -> responses, in the order of its rows.
    """
    rows = [row for table in _TABLES.values() for row in table]
    found = iter(
        in_parallel(
            _response,
            [(data, *row) for row in rows],
            jobs,
            lambda place, done: progress(done / len(rows), rows[place][0]),
            scheduler=scheduler,
        )
    )
    return {name: [next(found) for _ in table] for name, table in _TABLES.items()}


def _response(data: ReferenceData, name: str, overrides: Mapping[str, Any], step_s: float) -> Response:
    recording = simulate(data.maneuver(data.study_run), vehicle=data.vehicle, overrides=overrides, timestep_s=step_s)
    columns = reference_columns(recording, data.point_from_cg_m)
    end = columns["t"] >= columns["t"][-1] - _STEADY_S
    turn = float(np.sign(columns["r"][end].mean()))
    rate, slip = turn * columns["r"], turn * columns["beta"]
    return Response(
        name,
        float(rate[end].mean()),
        float(rate.max()),
        float(columns["t"][rate.argmax()]),
        float(slip[end].mean()),
        float(slip.min()),
        float(turn * columns["roll"][end].mean()),
    )
