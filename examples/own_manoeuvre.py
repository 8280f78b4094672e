"""Drive your own manoeuvre, written in Python, at several speeds: a bend that tightens (clothoid).

    python examples/own_manoeuvre.py

A manoeuvre is a table with the keys of a manoeuvre file; `own_manoeuvre.toml` in this folder is such a file.
"""

import math

import numpy as np

import activesteer


def tightening_bend(straight_m=40.0, length_m=80.0, radius_m=45.0):
    """Return points of the path [m]: straight ahead, then a curvature that grows linearly to 1 / `radius_m`."""
    along_m = np.arange(0.0, straight_m + length_m, 0.5)
    into_bend_m = np.clip(along_m - straight_m, 0.0, None)
    heading_rad = into_bend_m**2 / (2.0 * length_m * radius_m)
    x_m = np.concatenate([[0.0], np.cumsum(0.5 * np.cos(heading_rad[1:]))])
    y_m = np.concatenate([[0.0], np.cumsum(0.5 * np.sin(heading_rad[1:]))])
    return {"x_m": x_m.round(4).tolist(), "y_m": y_m.round(4).tolist()}


def drive(speed_kmh, controller="none"):
    """Drive the bend at a speed [km/h]."""
    table = {
        "kind": "follow_path",
        "name": "tightening_bend",
        "title": "Bend that tightens",
        "speed_kmh": speed_kmh,
        "duration_s": 110.0 / (speed_kmh / 3.6),
        "path": tightening_bend(),
        "road": {"mu": 0.9},
    }
    return activesteer.simulate(table, controller)


if __name__ == "__main__":
    for speed_kmh in (40.0, 50.0, 60.0):
        metrics = drive(speed_kmh).metrics
        print(
            f"{speed_kmh:.0f} km/h: {metrics['ay_peak_abs_mps2']:.1f} m/s2, "
            f"{metrics['track_deviation_max_m']:.2f} m off the path, "
            f"steering wheel {math.degrees(metrics['steering_wheel_peak_abs_rad']):.0f} deg"
        )
