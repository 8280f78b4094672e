"""An example folder for `activesteer compare` and `fit`: simulated files in place of measured ones, to be replaced."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from activesteer.errors import ParameterError
from activesteer.files import make_folder, shown_path, write_text
from activesteer.measured.folder_file import NAME
from activesteer.simulation.runner import simulate

_STEERING: Final = {
    "time_s": [0.5, 0.8, 1.3, 1.8, 2.2, 3.5, 3.8, 4.3, 4.8, 5.2],
    "steering_wheel_deg": [0, 40, 40, -40, 0, 0, -50, 0, 50, 0],
}
_CAR: Final = {"factors.front_cornering_stiffness": 0.9}
_SCALE: Final = 0.8
"""Scale of the steering signal."""
_COLUMNS: Final = {
    "Steering [deg]": ("steering_wheel_rad", _SCALE * np.degrees(1.0), 0.02),
    "v [km/h]": ("speed_mps", 3.6, 0.05),
    "Yaw rate [deg/s]": ("yaw_rate_radps", np.degrees(1.0), 0.2),
    "a_y [m/s2]": ("ay_mps2", 1.0, 0.1),
}
"""Column -> channel, factor to its unit, and standard deviation of its noise."""
_MAP: Final = """# Column, unit and sign of each channel. Try it: activesteer import run.csv --map map.toml
axes = "iso8855"          # or "sae_j670": y to the right, z down
time = "Time [s]"

[channels]
steering_wheel_rad = { column = "Steering [deg]", unit = "deg" }
speed_mps = { column = "v [km/h]", unit = "km/h" }
yaw_rate_radps = { column = "Yaw rate [deg/s]", unit = "deg/s" }
ay_mps2 = { column = "a_y [m/s2]", unit = "m/s2" }
"""
_FILE: Final = """# Example of `activesteer compare --new`: replace run.csv, map.toml and each line marked with <-.
# docs/measured.md explains the keys. As it is, run.csv is a simulated run: a compact with 10 % softer front tyres, and
# a steering signal that is 20 % too small.
title = "Example: compact, two lane changes at 80 km/h"   # <-
vehicle = "compact"                                       # <- name, or a vehicle file in this folder
filter = "iso15037"                                       # of both sides: iso15037, fmvss126 or none
assumptions = ["The road is level and dry."]              # <-

[[runs]]                  # one table for each run
name = "lane_changes"     # <-
files = ["run.csv"]       # <- one or several files of the data logger
map = "map.toml"
fit_s = [0.3, 3.0]        # <- window for fitting, in the time of the file
check_s = [3.0, 6.0]      # <- window for checking

[quantities]              # compared channels; tolerances are those of `activesteer compare`, or offset, gain, source
yaw_rate_degps = { noise = 0.2 }   # <- noise: weight in fits
ay_mps2 = { noise = 0.1 }          # <-

[predict]                 # what the data must give before anything can be predicted; leave it out if the scale is known
factors = ["steering.factor"]
channels = ["yaw_rate_degps"]

[factors]                 # of the fit
"steering.factor" = { uniform = [0.5, 2.0] }
"factors.front_cornering_stiffness" = { uniform = [0.5, 1.5] }   # <-

[intervals]               # of values that nobody knows, for the band around the prediction
"load.payload_kg" = { ends = [0.0, 150.0], source = "load not weighed" }   # <-
"""


def write_template(folder: Path) -> list[Path]:
    """Write a folder that `activesteer compare` and `fit` can run, and return its files."""
    make_folder(folder, ParameterError)
    if any(folder.iterdir()):
        raise ParameterError(f"{shown_path(folder)} is not empty; give a new folder", value=str(folder))
    table = {"kind": "open_loop", "speed_kmh": 80.0, "duration_s": 6.5, "hold_last": True, "steering": _STEERING}
    run = simulate(table, overrides=_CAR)
    rng = np.random.default_rng(1)
    columns = {"Time [s]": run.time_s[::10]}
    for name, (channel, factor, noise) in _COLUMNS.items():
        values = factor * run[channel][::10]
        columns[name] = values + noise * rng.standard_normal(len(values))
    rows = "\n".join(",".join(f"{value:.6g}" for value in row) for row in np.column_stack(list(columns.values())))
    texts = {"run.csv": f"{','.join(columns)}\n{rows}\n", "map.toml": _MAP, NAME: _FILE}
    return [write_text(folder / name, text, ParameterError) for name, text in texts.items()]
