"""Figures of the paper, from runs of this program."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from activesteer.recording import Recording


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
