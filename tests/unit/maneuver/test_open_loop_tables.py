"""Open loop from CSV files: steering wheel or rack, wheel torques."""

from __future__ import annotations

from pathlib import Path

import pytest

from activesteer import simulate
from activesteer.errors import ManeuverError
from activesteer.maneuver.open_loop import OpenLoop
from activesteer.scenario import describe, resolve
from tests.raising import raises

HEAD = 'kind = "open_loop"\nspeed_kmh = 72\nduration_s = 1.0\nsettle_s = 0.5\ndrive = "coast"\nhold_last = true\n'


def write(folder: Path, toml: str, **csvs: str) -> Path:
    """A manoeuvre file with CSV files beside it."""
    for name, text in csvs.items():
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")
    path = folder / "mine.toml"
    path.write_text(HEAD + toml, encoding="utf-8")
    return path


def maneuver(path: Path) -> OpenLoop:
    built = resolve(path).maneuver
    assert isinstance(built, OpenLoop)
    return built


def test_a_steering_csv_is_found_beside_the_file_and_kept_with_the_run(tmp_path: Path) -> None:
    path = write(tmp_path, 'steering_csv = "wheel.csv"\n', wheel="time_s,steering_wheel_rad,note\n0,0,1\n1,0.5,2\n")
    assert maneuver(path).setpoint(0.5).steering_wheel_demand_rad == pytest.approx(0.25)
    scenario = resolve(path)
    assert "tables/wheel.csv" in scenario.files
    # From a recording's table alone, without the file, the same comes out.
    again = resolve(describe(scenario)["maneuver"]).maneuver
    assert again == scenario.maneuver


@pytest.mark.parametrize(
    ("key", "csv"), [("steering", "time_s,rack_m\n0,0\n0.8,0.1\n"), ("drive", "time_s,fl_drive_Nm\n0,0\n0.8,9\n")]
)
def test_a_csv_that_ends_before_the_manoeuvre_is_not_prolonged_without_a_word(
    tmp_path: Path, key: str, csv: str
) -> None:
    path = write(tmp_path, f'{key}_csv = "short.csv"\n', short=csv)
    assert maneuver(path).duration_s == 1.0
    path.write_text(path.read_text().replace("hold_last = true\n", ""))
    with raises(ManeuverError, file="mine.toml", value=0.8):
        maneuver(path)


def test_a_rack_column_asks_for_the_rack_not_the_wheel(tmp_path: Path) -> None:
    path = write(tmp_path, 'steering_csv = "rack.csv"\n', rack="time_s,rack_m\n0,0\n0.2,0.002\n")
    setpoint = maneuver(path).setpoint(0.1)
    assert setpoint.rack_demand_m == pytest.approx(0.001)
    run = simulate(path, vehicle="sedan")
    assert run["rack_m"][-1] == pytest.approx(0.002, rel=1e-3)
    assert run["yaw_rate_radps"][-1] > 0.05  # positive steers left


def test_every_car_with_a_rack_takes_rack_positions() -> None:
    table = {"kind": "open_loop", "speed_mps": 20.0, "duration_s": 1.0, "settle_s": 0.5, "hold_last": True,
             "steering": {"time_s": [0.0, 0.2], "rack_m": [0.0, 0.003]}}  # fmt: skip
    run = simulate(table, vehicle="compact")
    # The compact's column has a torsion bar, which the rack's load winds up.
    assert run["steering_wheel_rad"][-1] == pytest.approx(0.003 / 0.0074, rel=0.01)
    assert 0.7 * 0.003 < run["rack_m"][-1] < 0.003


def test_torques_of_the_wheels_drive_and_brake_one_by_one(tmp_path: Path) -> None:
    """With drive at the rear left and brake at the front right, the forces are torque over radius and the car turns
    right."""
    torques = "time_s,rl_drive_Nm,fr_brake_Nm\n0,0,0\n0.2,0,0\n0.21,200,300\n"
    run = simulate(write(tmp_path, 'drive_csv = "torque.csv"\n', torque=torques), vehicle="sedan")
    assert run["rl_drive_torque_Nm"][-1] == pytest.approx(200.0, rel=1e-6)
    assert run["fr_brake_torque_Nm"][-1] == pytest.approx(-300.0, rel=1e-3)
    assert run["fl_brake_torque_Nm"][-1] == 0.0
    before, after = 150, -1
    # By hand: torque over loaded radius, less what the wheel itself needs (about 1.3 kg m2 at the car's 0.2 m/s2: 2 N).
    for wheel, force_N in (("rl", 200.0 / 0.329), ("fr", -300.0 / 0.3296)):
        change = run[f"{wheel}_tyre_fx_N"][after] - run[f"{wheel}_tyre_fx_N"][before]
        assert change == pytest.approx(force_N, rel=0.03)
    assert abs(run["fl_tyre_fx_N"][after]) < 30.0
    assert run["yaw_rate_radps"][after] < -0.005


@pytest.mark.parametrize(
    ("toml", "csv", "words"),
    [
        ('steering_csv = "a.csv"\n', "time_s,angle\n0,1\n", ["line 1", "steering_wheel_rad", "rack_m"]),
        ('steering_csv = "a.csv"\n', "t,rack_m\n0,1\n", ["line 1", "time_s"]),
        ('steering_csv = "a.csv"\n', "time_s,rack_m\n0,0\n1,x\n", ["line 3", "rack_m", "'x'"]),
        ('steering_csv = "a.csv"\n', "time_s,rack_m\n0,0\n2,0\n1,0\n", ["line 4", "from 2 to 1 s"]),
        ('steering_csv = "a.csv"\n', "time_s,rack_m,steering_wheel_rad\n0,0,0\n", ["leave one out"]),
        ('steering_csv = "b.csv"\n', "", ["'b.csv'", "a"]),
        ('steering_csv = "a.csv"\nsteering = { time_s = [0.0] }\n', "time_s,rack_m\n0,0\n", ["leave one out"]),
        ('drive_csv = "a.csv"\n', "time_s,fl_brake_Nm\n0,-5\n", ["fl_brake_Nm", "at least 0"]),
        ('drive_csv = "a.csv"\nbrake = { time_s = [0.0], pedal = [0.1] }\n', "time_s,fl_brake_Nm\n0,5\n", ["brake"]),
    ],
)
def test_what_is_wrong_with_a_table_is_said(tmp_path: Path, toml: str, csv: str, words: list[str]) -> None:
    with pytest.raises(ManeuverError) as caught:
        resolve(write(tmp_path, toml, a=csv))
    for word in words:
        assert word in str(caught.value)


def test_the_car_settles_at_its_speed_before_the_torques_come() -> None:
    table = {"kind": "open_loop", "speed_mps": 20.0, "duration_s": 0.5, "settle_s": 2.0, "drive": "hold_speed",
             "wheel_torques": {"time_s": [0.0], "fl_drive_Nm": [500.0], "fr_drive_Nm": [500.0]}}  # fmt: skip
    run = simulate(table, vehicle="compact")
    assert run["vx_mps"][0] == pytest.approx(20.0, abs=0.1)
    # By hand: torque over radius, less drag of 156 N and rolling resistance of some 140 N, on car and wheels.
    assert run["ax_mps2"][-1] == pytest.approx((1000.0 / 0.297 - 300.0) / (1430.0 + 44.0), rel=0.05)
