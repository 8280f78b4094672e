"""`activesteer import`, `compare` and `run` of a recording: from a file of another program to a verdict."""

from __future__ import annotations

import re

import numpy as np
import pytest

import activesteer
from activesteer.errors import RecordingError
from activesteer.recording import Recording

NAMES = {
    "Lenkradwinkel [deg]": "steering_wheel_rad",
    "Gierrate [deg/s]": "yaw_rate_radps",
    "Wankwinkel [deg]": "roll_rad",
}


@pytest.fixture(scope="module")
def truth():
    table = {
        "kind": "open_loop", "speed_kmh": 72.0, "duration_s": 2.0, "settle_s": 0.5, "hold_last": True,
        "steering": {"time_s": [0.5, 0.7], "steering_wheel_deg": [0.0, 30.0]},
    }  # fmt: skip
    return activesteer.simulate(table)


@pytest.mark.parametrize("folder", [".", "..", "sub"])
def test_a_folder_cannot_be_imported(call, tmp_path, folder):
    (tmp_path / "sub").mkdir()
    told = call("import", folder)
    assert (told.status, told.out) == (1, "")
    assert told.err == f"activesteer: cannot read {folder}: it is a folder\n"


def test_what_is_unusual_in_a_file_is_said_on_standard_error(call, tmp_path):
    rows = "".join(f"{0.01 * row:.2f},0,0,72,1\n" for row in range(100))
    (tmp_path / "a.csv").write_text("t,yaw rate[rad/s],yaw rate[rad/s],v[km/h],roll[furlong]\n" + rows)
    for more in ((), ("--json",)):
        told = call("import", "a.csv", *more)
        assert told.status == 0
        assert "several columns are named 'yaw rate[rad/s]': the first is used" in told.err
        assert "'roll[furlong]' is left out: its unit is unknown" in told.err
        assert "furlong" not in told.out or more


def test_a_run_in_degrees_by_the_clock_of_a_logger_50_ms_late_comes_back_and_is_driven_again(call, tmp_path, truth):
    columns = [1234.5 + truth.time_s, *(np.degrees(truth[name]) for name in NAMES.values()), truth["ay_mps2"],
               3.6 * truth["speed_mps"]]  # fmt: skip
    header = ";".join(["t [s]", *NAMES, "ay [m/s2]", "v [km/h]"])
    rows = [";".join(f"{value:.9g}".replace(".", ",") for value in row) for row in np.column_stack(columns)[50:]]
    (tmp_path / "a.csv").write_text("\n".join([header, *rows]), encoding="utf-8")
    truth.save("simulated.mcap")

    told = call("import", "a.csv", "--json")
    assert (told.status, told.json["notes"]) == (0, ["the time begins at 1234.55 s in the file and at 0 here"])
    measured = activesteer.Recording.open(tmp_path / "a.mcap")
    assert measured.metadata["measured"]["time_offset_s"] == pytest.approx(1234.55)
    told = call("compare", "a.mcap", "simulated.mcap", "-o", "a.html", "--json")
    assert told.status == 0
    assert told.json["time_shift_s"] == pytest.approx(-0.05, abs=1e-4)
    assert told.json["inside"] is True
    channels = {each["channel"]: each for each in told.json["quantities"]}
    assert set(channels) == {*NAMES.values(), "ay_mps2", "speed_mps"}
    assert all(each["rms"] < 1e-4 and each["share_inside"] == 1.0 for each in channels.values())
    page = (tmp_path / "a.html").read_text()
    assert 'data-picture="0"' in page
    assert "50.0 ms" in page

    assert call("run", "a.mcap", "-o", "again.mcap", "--set", "settle_s=0.5").status == 0
    told = call("compare", "a.mcap", "again.mcap", "--json")
    again = activesteer.Recording.open(tmp_path / "again.mcap")
    assert again.time_s[-1] == pytest.approx(truth.time_s[-1] - 0.05, abs=0.002)
    # The steering wheel stands where it was recorded, though it follows any demand 2 ms later.
    assert told.json["time_shift_s"] == pytest.approx(0.0, abs=1e-4)
    assert told.status == 0
    rate = next(each for each in told.json["quantities"] if each["channel"] == "yaw_rate_radps")
    assert rate["rms"] < 0.005 * np.abs(truth["yaw_rate_radps"]).max()


def test_what_cannot_be_compared_or_imported_is_answered(call, truth, tmp_path):
    truth.save(tmp_path / "a.mcap")
    assert call("compare", "a.mcap").err.startswith("activesteer: at least two recordings")
    assert "file does not exist" in call("import", "no.csv").err or call("import", "no.csv").status == 1
    (tmp_path / "a.csv").write_text("t,yawrate\n0,0\n1,1\n")
    assert "ends in .mcap" in call("import", "a.csv", "-o", "a.txt").err
    told = call("import", "a.csv")
    assert "yawrate has no unit; rad/s is assumed" in told.err
    assert "steering_wheel_rad or rack_m is needed" in call("run", "a.mcap").err


def test_a_comparison_of_different_manoeuvres_says_so(call, truth, tmp_path):
    for name in ("a", "b"):
        metadata = truth.metadata | {"maneuver": truth.metadata["maneuver"] | {"name": f"drive_{name}"}}
        values = np.column_stack([truth[channel.name] for channel in truth.channels])
        Recording(truth.channels, truth.time_s, values, metadata=metadata).save(tmp_path / f"{name}.mcap")
    told = call("compare", "a.mcap", "b.mcap")
    assert (told.status, told.err) == (0, "! different manoeuvres: a.mcap is drive_a, b.mcap is drive_b\n")
    assert call("compare", "a.mcap", "a.mcap").err == ""


def test_a_folder_that_cannot_be_made_is_an_error_before_the_fit(call):
    told = call("fit", "tesla_model_s", "-o", "/proc/found")  # also for root
    assert told.status == 1
    assert told.err.startswith("activesteer: cannot make the folder /proc/found: ")


def test_what_was_fitted_is_printed_and_drives_the_car(call, truth, tmp_path):
    rows = slice(None, None, 10)
    noise = 0.002 * np.random.default_rng(1).standard_normal(len(truth.time_s[rows]))
    columns = [truth.time_s, truth["steering_wheel_rad"], truth["yaw_rate_radps"], truth["speed_mps"]]
    table = np.column_stack([values[rows] for values in columns]) + np.outer(noise, [0.0, 0.0, 1.0, 0.0])
    names = "t [s],steering_wheel_rad,yaw_rate_radps,speed_mps"
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header=names, comments="")
    assert call("import", "a.csv").status == 0
    (tmp_path / "fit.toml").write_text(
        'maneuvers = ["a.mcap"]\noverrides = { settle_s = 0.5 }\n'
        '[factors]\n"factors.tyre_cornering_stiffness" = { uniform = [0.7, 1.3] }\n'
        "[fit]\nnoise = { yaw_rate_radps = 0.002 }\nfrom_s = 0.4\n"
        'start = { "factors.tyre_cornering_stiffness" = 0.9 }\n'
    )
    told = call("fit", "fit.toml", "-o", "found", "--jobs", "1")
    assert told.status == 0
    assert re.search(r"tyre cornering stiffness factor, +\d.\d+ ± \d", told.out)
    assert "the remaining difference is" in told.out
    driven = call("run", "a.mcap", "--overrides", "found/overrides.toml", "--set", "settle_s=0.5", "-o", "b.mcap")
    assert driven.status == 0
    found = activesteer.Recording.open(tmp_path / "b.mcap").metadata["overrides"]["factors.tyre_cornering_stiffness"]
    assert found == pytest.approx(1.0, abs=0.03)
    twice = call("run", "a.mcap", "--overrides", "found/overrides.toml", "--set", "factors.tyre_cornering_stiffness=1")
    assert "is given twice; leave one out" in twice.err


def test_an_import_that_fails_while_writing_leaves_the_old_recording(call, tmp_path, monkeypatch):
    (tmp_path / "run.csv").write_text(
        "Time [s],v [km/h]\n" + "".join(f"{i / 100},{50 + i / 100}\n" for i in range(200))
    )
    assert call("import", "run.csv").status == 0
    before = (tmp_path / "run.mcap").read_bytes()

    def fill_up(_recording, path):
        path.write_bytes(before[:100])
        raise RecordingError(f"cannot write {path}: No space left on device")

    monkeypatch.setattr(Recording, "save", fill_up)
    told = call("import", "run.csv")
    assert told.status == 1
    assert "cannot write run.mcap: No space left on device" in told.err
    assert (tmp_path / "run.mcap").read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.csv", "run.mcap"]


def test_a_page_has_the_name_of_a_page(call):
    told = call("compare", "a.mcap", "b.mcap", "-o", "cmp")
    assert told.status == 1
    assert "-o cmp: the name of a page ends in .html" in told.err
