"""`activesteer figures`: figures of the paper, from runs of this program."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from activesteer.commands.arguments import add_jobs, add_output, add_vehicle
from activesteer.commands.progress import ProgressBar
from activesteer.errors import ParameterError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from activesteer.recording import Recording


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("figures", help="draw the figures of the paper from own runs: PNG, SVG, PDF")
    add_output(parser, "DIR", "folder for the figures", "figures")
    parser.add_argument(
        "--recordings", type=Path, metavar="DIR",
        help="recordings of `activesteer reproduce -o DIR` (default: driven now, into the folder runs of -o)",
    )  # fmt: skip
    add_vehicle(parser)
    parser.add_argument(
        "--setting", choices=("paper", "human"),
        help="setting of the driven runs, as for `reproduce` (default: paper, with another car human)",
    )  # fmt: skip
    add_jobs(parser)
    parser.set_defaults(action=_figures)


def _figures(options: argparse.Namespace) -> int:
    from activesteer.studies.paper.reproduction import recordings_in, reproduce

    if options.recordings is not None:
        for key in ("jobs", "setting"):
            if getattr(options, key) is not None:
                raise ParameterError("has no effect with --recordings: nothing is driven", key=f"--{key}")
        recordings = recordings_in(options.recordings)
    else:
        with ProgressBar("runs", quiet=False) as bar:
            result = reproduce(
                options.output / "runs",
                options.vehicle,
                setting=options.setting or ("paper" if options.vehicle == "compact" else "human"),
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
    """Draw all figures that these runs allow, and the figure of the suspension: PNG, SVG and PDF.

    Args:
        recordings: Scenario -> system -> recording.
        folder: Folder for the figures.
        vehicle: Name or path of the vehicle, for the rig and the linear models.
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
    """Return responses of linear models to the steering of a run: single track and, on a level road, the full car.

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
