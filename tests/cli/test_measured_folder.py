"""`activesteer compare FOLDER` and `fit FOLDER`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import activesteer

EXAMPLE = Path(activesteer.__file__).parent / "measured" / "example"


def test_a_new_folder_is_made_once(call, tmp_path: Path) -> None:
    assert "validation.toml" in call("compare", "--new", "mine").out
    told = call("compare", "--new", "mine")
    assert told.status == 1
    assert "is not empty" in told.err


def test_a_table_that_is_gone_is_refused_with_its_successor(call) -> None:
    call("compare", "--new", "mine")
    file = Path("mine/validation.toml")
    file.write_text(f"{file.read_text()}\n[effects]\nsteering = 1.0\n")
    told = call("compare", "mine")
    assert told.status == 1
    assert "[circle.prediction]" in told.err


@pytest.mark.slow
def test_the_example_is_predicted_and_fitted(call) -> None:
    call("compare", "--new", "mine")
    predicted = call("compare", "mine", "--json", "--jobs", "1").json
    assert predicted["fitted"] is None
    assert {row["stage"] for row in predicted["quantities"]} == {"predicted"}
    told = call("fit", "mine", "-o", "page", "--jobs", "1")
    assert told.status == 0
    assert Path("page/page.html").stat().st_size > 10_000
    # The front tyres of the example are 10 % softer than those of the car.
    assert "factors.front_cornering_stiffness" in told.out


def test_the_example_is_a_noisy_run_of_a_car_with_softer_front_tyres_and_a_scaled_steering_signal() -> None:
    """If the car has changed, write the run again with these numbers."""
    steering = {
        "time_s": [0.5, 0.8, 1.3, 1.8, 2.2, 3.5, 3.8, 4.3, 4.8, 5.2],
        "steering_wheel_deg": [0, 40, 40, -40, 0, 0, -50, 0, 50, 0],
    }
    table = {"kind": "open_loop", "speed_kmh": 80.0, "duration_s": 6.5, "hold_last": True, "steering": steering}
    run = activesteer.simulate(table, overrides={"factors.front_cornering_stiffness": 0.9})
    columns = {  # channel, factor to the unit of the column, and standard deviation of its noise
        "Steering [deg]": ("steering_wheel_rad", 0.8 * np.degrees(1.0), 0.02),
        "v [km/h]": ("speed_mps", 3.6, 0.05),
        "Yaw rate [deg/s]": ("yaw_rate_radps", np.degrees(1.0), 0.2),
        "a_y [m/s2]": ("ay_mps2", 1.0, 0.1),
    }
    noise = np.random.default_rng(1)
    stored = np.genfromtxt(EXAMPLE / "run.csv", delimiter=",", names=True, deletechars="", replace_space=" ")
    for name, (channel, factor, size) in columns.items():
        values = factor * run[channel][::10]
        values = values + size * noise.standard_normal(len(values))
        assert stored[name] == pytest.approx(values, rel=1e-4, abs=0.01 * size), name
