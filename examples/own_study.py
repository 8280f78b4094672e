"""Run a study: one manoeuvre with many cars and roads, and a table of the results.

    python examples/own_study.py

The same as a file, for `activesteer study FILE -o DIR`: studies/mass_and_grip.toml.
"""

import math

from activesteer import study

STUDY = {
    "title": "Step steer: payload and grip",
    "maneuvers": ["step_steer"],
    "controllers": ["none", "ars_tuned"],
    "seed": 1,
    "factors": {  # keys as for --set
        "road.mu": {"grid": [0.7, 1.0]},
        "vehicle.load.payload_kg": {"uniform": [0.0, 300.0]},
    },
    "design": {"kind": "sobol", "samples": 4},
}


def overshoots(table):
    """Return the mean overshoot of the yaw rate by controller and friction."""
    found = {}
    for row in table.to_pylist():
        if row["status"] == "ok":
            found.setdefault((row["controller"], row["road.mu"]), []).append(row["yaw_rate_overshoot"])
    return {key: math.fsum(values) / len(values) for key, values in found.items()}


if __name__ == "__main__":  # the processes of the study read this file again
    for (controller, mu), overshoot in overshoots(study(STUDY)).items():
        print(f"{controller:9}  mu {mu:.1f}  yaw rate overshoots by {overshoot:.1%}")
