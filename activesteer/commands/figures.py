"""`activesteer figures DIR`: the paper's figures from our own runs."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from activesteer.commands.arguments import add_jobs, add_vehicle
from activesteer.commands.progress import ProgressBar
from activesteer.errors import ParameterError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from activesteer.recording import Recording


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser("figures", help="the paper's figures from our own runs, as PNG, SVG and PDF")
    parser.add_argument("output", type=Path, metavar="DIR", help="folder for the figures")
    parser.add_argument(
        "--recordings", type=Path, metavar="DIR",
        help="recordings that `activesteer reproduce -o DIR` has made; where not given they are made now, in DIR/runs",
    )  # fmt: skip
    add_vehicle(parser)
    add_jobs(parser)
    parser.set_defaults(action=_figures)


def _figures(options: argparse.Namespace) -> int:
    from activesteer.studies.paper.reproduction import recordings_in, reproduce

    if options.recordings is not None:
        if options.jobs is not None:
            raise ParameterError("has no effect with --recordings: nothing is driven", key="--jobs")
        recordings = recordings_in(options.recordings)
    else:
        with ProgressBar("runs", quiet=False) as bar:
            result = reproduce(
                options.output / "runs",
                options.vehicle,
                jobs=options.jobs,
                progress=lambda what, done, total: bar(done / total, what),
            )
        if result.failures:
            first = next(iter(result.failures))
            raise ParameterError(f"{' '.join(first)} failed: {result.failures[first]}")
        recordings = result.recordings()
    for path in draw_all(recordings, options.output, options.vehicle):
        print(path)
    return 0


def draw_all(recordings: Mapping[str, Mapping[str, Any]], folder: Path, vehicle: str) -> list[Path]:
    """All figures that can be drawn from these runs, and the suspension's, which needs none.

    Args:
        recordings: Scenario -> system -> recording.
        folder: Where they go.
        vehicle: Name or path of the vehicle, for what the rig measures and for the linear models.

    Returns:
        The files written, PNG, SVG and PDF of each.

    Raises:
        ActiveSteerError: matplotlib is not installed, a file cannot be written, or the rig fails.
    """
    from activesteer.analysis.figures import FORMATS, figure_2
    from activesteer.analysis.figures import draw_all as draw_runs
    from activesteer.plotting import save
    from activesteer.rigs import kinematics_compliance
    from activesteer.rigs.kc import rear_camber_figure

    files = draw_runs(recordings, folder)
    camber = rear_camber_figure(kinematics_compliance(vehicle))
    files += [save(camber, folder / f"figure_01_rear_camber{ending}") for ending in FORMATS]
    if step_steers := recordings.get("step_steer"):
        run = step_steers["none"]
        models = models_beside(run)
        files += [figure_2(run, folder / f"figure_02_step_steer_models{ending}", models) for ending in FORMATS]
    return sorted(files)


def models_beside(run: Recording) -> dict[str, dict[str, NDArray[np.float64]]]:
    """What the single-track model and, on a level road, the linearised car make of the steering of a run.

    Args:
        run: A run without control; what it was made from is taken from its metadata.

    Returns:
        Name of the model -> channel -> values over the time of the run.
    """
    from activesteer.controllers import SingleTrackParameters
    from activesteer.studies.linear.identification import single_track_response
    from activesteer.studies.linear.linearisation import linear_response, linearise

    maneuver, vehicle = run.metadata["maneuver"], run.metadata["vehicle"]
    single_track = SingleTrackParameters(**vehicle["single_track"])
    models = {"single-track model": single_track_response(run, single_track, vehicle["steering"]["ratio"])}
    if maneuver["road"]["grade"] == 0.0:
        linear = linearise(vehicle, maneuver["speed_mps"], {"road.mu": maneuver["road"]["mu"]})
        models["linear car"] = linear_response(run, linear)
    return models
