"""Import of other programs' files: formats, units, signs, gaps, and questionable values."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet
from scipy.io import savemat

from activesteer.core.signals import Channel
from activesteer.errors import RecordingError
from activesteer.measured.columns import FOREIGN_READERS, csv_columns, find, read_columns
from activesteer.measured.importing import import_file
from activesteer.measured.signals import suspicions
from activesteer.playback.runs import runs_of
from activesteer.recording import Recording
from activesteer.scenario.scenario import open_loop_of
from tests.raising import raises

TIME_S = np.arange(0.0, 4.0, 0.01)
SPEED_MPS = np.full_like(TIME_S, 20.0)
WHEEL_RAD = 0.5 * np.sin(2.0 * np.pi * 0.5 * TIME_S)
RATE_RADPS = 0.01 * SPEED_MPS * WHEEL_RAD
AY_MPS2 = SPEED_MPS * RATE_RADPS


def write(path: Path, names: str, columns: list[np.ndarray], separator: str = ",", *, comma: bool = False) -> Path:
    lines = [names, *(separator.join(f"{value:.14g}" for value in row) for row in np.column_stack(columns))]
    text = "\n".join(lines[1:])
    path.write_text(f"{names}\n{text.replace('.', ',') if comma else text}\n", encoding="utf-8")
    return path


def check(recording: Recording) -> None:
    np.testing.assert_allclose(recording["yaw_rate_radps"], np.interp(recording.time_s, TIME_S, RATE_RADPS), atol=1e-6)
    np.testing.assert_allclose(recording["ay_mps2"], np.interp(recording.time_s, TIME_S, AY_MPS2), atol=1e-5)


@pytest.mark.parametrize(
    ("separator", "comma"), [(",", False), (";", True), ("\t", True), ("|", False), ("   ", False)]
)
def test_a_csv_has_any_separator_and_decimal_comma(tmp_path, separator, comma):
    names = separator.join(["time[s]", "LWI[deg]", "Gierrate[deg/s]", "Querbeschleunigung[g]", "v[km/h]"])
    columns = [TIME_S, np.degrees(WHEEL_RAD), np.degrees(RATE_RADPS), AY_MPS2 / 9.81, 3.6 * SPEED_MPS]
    found = import_file(write(tmp_path / "a.csv", names, columns, separator, comma=comma))
    check(found)
    assert found.metadata["measured"]["notes"] == []
    assert found["speed_mps"][0] == pytest.approx(20.0)
    assert found.metrics["yaw_rate_peak_abs_radps"] == pytest.approx(0.1, rel=1e-3)


def test_a_line_of_units_and_a_preamble_are_understood_and_bytes_of_windows(tmp_path):
    lines = ["Car: 12; driver: x", "time;yaw rate;speed", "s;°/s;km/h"]
    lines += [f"{t:.3f};{math.degrees(r):.6f};72.0" for t, r in zip(TIME_S, RATE_RADPS, strict=True)]
    path = tmp_path / "a.csv"
    path.write_bytes("\r\n".join(lines).encode("latin-1"))
    recording = import_file(path)
    np.testing.assert_allclose(recording["yaw_rate_radps"], RATE_RADPS, atol=1e-7)


@pytest.mark.parametrize(
    ("names", "cells", "coding"),
    [
        ('"t [s]","Gierrate [deg/s]","v [km/h]"', '"{t:.3f}","{r:.6f}","72"', "utf-8"),
        ("t [s];Gierrate [Grad/s];v [km/h];", "{t:.3f};{r:.6f};72;", "utf-16"),
        ("Zeit;Gierrate [deg/s];v [km/h];Gang", "2024-05-01 23:59:{t:06.3f};{r:.6f};72;D1", "utf-8"),
        ("Zeit;Gierrate [deg/s];v [km/h]", "09:59:{t:06.3f};{r:.6f};72", "utf-8"),
    ],
)
@pytest.mark.parametrize("comma", [True, False])
def test_quotes_words_clocks_and_unicode_text_are_understood(tmp_path, names, cells, coding, comma):
    lines = [cells.format(t=t, r=math.degrees(r)) for t, r in zip(TIME_S, RATE_RADPS, strict=True)]
    if comma and "2024" not in cells:
        lines = [line.replace(".", ",") for line in lines]
    (tmp_path / "a.csv").write_text("\n".join([names, *lines]), encoding=coding)
    recording = import_file(tmp_path / "a.csv")
    np.testing.assert_allclose(np.diff(recording.time_s), 0.01, atol=1e-6)
    np.testing.assert_allclose(recording["yaw_rate_radps"], RATE_RADPS, atol=1e-7)
    assert recording["speed_mps"][0] == pytest.approx(20.0)


def test_first_of_several_columns_with_one_name_is_used_with_a_note_and_a_map_names_another(tmp_path):
    path = write(tmp_path / "a.csv", "t,yawrate,yawrate,v", [TIME_S, RATE_RADPS, 2.0 * RATE_RADPS, SPEED_MPS])
    found = import_file(path)
    check_rate(found, 1.0)
    assert any(
        "several columns are named 'yawrate': the first is used" in note for note in found.metadata["measured"]["notes"]
    )
    (tmp_path / "map.toml").write_text('[channels]\nyaw_rate_radps = { column = "yawrate (2)" }\n')
    check_rate(import_file(path, tmp_path / "map.toml"), 2.0)


def test_a_column_with_an_unknown_unit_is_left_out_with_a_note(tmp_path):
    path = write(tmp_path / "a.csv", "t,yaw_rate[furlong],v[m/s],foo[bar]", [TIME_S, RATE_RADPS, SPEED_MPS, SPEED_MPS])
    found = import_file(path)
    assert "yaw_rate_radps" not in found.metadata["measured"]["columns"]
    (note,) = found.metadata["measured"]["notes"]
    assert note.startswith("'yaw_rate[furlong]' is left out: its unit is unknown; known: rad, deg")


@pytest.mark.parametrize("value", [1e308, -1e308, 1.1e12])
@pytest.mark.parametrize("column", [0, 1])
def test_a_number_above_the_limit_is_refused_with_the_limit(tmp_path, value, column):
    columns = [TIME_S.copy(), RATE_RADPS.copy(), SPEED_MPS]
    columns[column][0 if value < 0.0 else -1] = value
    with raises(RecordingError, file="a.csv", allowed=1e12) as refused:
        import_file(write(tmp_path / "a.csv", "time_s,yaw_rate_radps,speed_mps", columns))
    assert "the largest number allowed in a file is 1e+12" in str(refused.value)


def written_by(name: str, path: Path) -> Path:
    if name == "csv":
        return write(path, "time_s,yaw_rate_radps", [TIME_S, RATE_RADPS])
    if name == "mat":
        savemat(path, {"time_s": TIME_S, "yaw_rate_radps": RATE_RADPS})
    elif name == "parquet":
        parquet.write_table(pa.table({"time_s": TIME_S, "yaw_rate_radps": RATE_RADPS}), path)
    else:
        asammdf = pytest.importorskip("asammdf")
        with asammdf.MDF(version="4.10") as file:
            file.append([asammdf.Signal(RATE_RADPS, TIME_S, name="YawRate", unit="rad/s")])
            file.save(path, overwrite=True)
    return path


@pytest.mark.parametrize("name", ["csv", "mat", "parquet", "mf4"])
def test_too_many_rows_are_refused_before_one_is_read(tmp_path, monkeypatch, name):
    path = written_by(name, tmp_path / f"a.{name}")
    read = csv_columns if name == "csv" else FOREIGN_READERS[f".{name}"]
    assert len(read(path)) in (1, 2)
    monkeypatch.setattr("activesteer.core.limits.MAX_ROWS", len(TIME_S) - 1)
    for reader in ("pyarrow.csv.read_csv", "scipy.io.loadmat", "pyarrow.parquet.ParquetFile.read"):
        monkeypatch.setattr(reader, lambda *_, **__: pytest.fail("read"))
    rows = len(TIME_S) + (name == "csv")  # the line of names counts
    with raises(RecordingError, value=rows, allowed=len(TIME_S) - 1):
        read(path)


def test_a_parquet_column_of_texts_is_not_read(tmp_path, monkeypatch):
    table = pa.table({"time_s": TIME_S, "yaw_rate_radps": ["x" * 1000] * len(TIME_S)})
    path = tmp_path / "a.parquet"
    parquet.write_table(table, path)
    monkeypatch.setattr("pyarrow.parquet.ParquetFile.read", lambda *_, **__: pytest.fail("read"))
    with raises(RecordingError) as refused:
        find(FOREIGN_READERS[".parquet"](path), "yaw_rate_radps", path).read()
    assert "its type is string" in str(refused.value)


def check_rate(recording: Recording, factor: float) -> None:
    np.testing.assert_allclose(recording["yaw_rate_radps"], factor * RATE_RADPS, atol=1e-8)


def test_several_units_that_nobody_said_are_suspected_together_and_milliseconds_too():
    columns = {
        "speed_mps": 3.6 * SPEED_MPS, "yaw_rate_radps": np.degrees(RATE_RADPS), "ay_mps2": AY_MPS2 / 9.81,
        "steering_wheel_rad": np.degrees(WHEEL_RAD),
    }  # fmt: skip
    lines = suspicions(columns)
    assert [line.split()[0] for line in lines] == ["yaw_rate_radps", "speed_mps", "ay_mps2"]
    assert all("that were taken as" in line for line in lines)
    right = {"speed_mps": SPEED_MPS, "yaw_rate_radps": RATE_RADPS, "ay_mps2": AY_MPS2}
    assert suspicions(right, 0.01) == []
    assert "steps of 10 s" in suspicions(right, 10.0)[0]
    assert "one of the three units is wrong" in suspicions({**right, "ay_mps2": 1e5 * AY_MPS2})[0]


def test_a_car_that_rolls_into_the_turn_is_suspected():
    right = {"speed_mps": SPEED_MPS, "yaw_rate_radps": RATE_RADPS, "ay_mps2": AY_MPS2, "roll_rad": 0.01 * AY_MPS2}
    assert suspicions(right) == []
    sae = {**right, "yaw_rate_radps": -RATE_RADPS, "ay_mps2": -AY_MPS2}
    assert "SAE J670" in suspicions(sae)[0]


def test_mat_parquet_and_our_own_exports_come_back(tmp_path):
    savemat(tmp_path / "a.mat", {"run": {"t": TIME_S, "YawRate": RATE_RADPS}, "lateral_acceleration": AY_MPS2})
    (tmp_path / "map.toml").write_text(
        'time = "run.t"\n[channels]\nyaw_rate_radps = { column = "run.YawRate", unit = "rad/s" }\n'
        'ay_mps2 = { column = "lateral_acceleration", unit = "m/s2" }\n'
    )
    recording = import_file(tmp_path / "a.mat", tmp_path / "map.toml")
    check(recording)
    assert list(recording.attachments) == ["map.toml"]
    for export, ending in (("to_csv", "csv"), ("to_parquet", "parquet"), ("to_mat", "mat")):
        path = getattr(recording, export)(tmp_path / f"again.{ending}")
        check(import_file(path))


def test_mdf_channels_have_times_of_their_own(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    slow = TIME_S[::10]
    file = asammdf.MDF(version="4.10")
    file.append([asammdf.Signal(np.degrees(RATE_RADPS), TIME_S, name="YawRate", unit="deg/s")])
    file.append([asammdf.Signal(np.full_like(slow, 72.0), slow, name="VehicleSpeed", unit="km/h")])
    file.save(tmp_path / "a.mf4", overwrite=True)
    file.close()
    recording = import_file(tmp_path / "a.mf4")
    assert recording.time_s[1] - recording.time_s[0] == pytest.approx(0.01)
    np.testing.assert_allclose(recording["speed_mps"], 20.0)
    np.testing.assert_allclose(recording["yaw_rate_radps"], RATE_RADPS[: len(recording)], atol=1e-9)


def test_a_file_that_crashes_its_reader_is_an_error():
    pytest.importorskip("asammdf")
    path = Path(__file__).with_name("corrupted.mf4")
    columns = read_columns(path)
    with pytest.raises(RecordingError, match=r"cannot read|not a readable"):
        find(columns, "speed_mps", path).read()


@pytest.mark.parametrize("clock_s", [1234.5, 1.7e9, -3.0])
def test_the_clock_of_the_logger_is_set_to_zero_and_kept_in_the_metadata(tmp_path, clock_s):
    path = write(tmp_path / "a.csv", "t,steering_wheel_rad,yaw_rate_radps,speed_mps",
                 [clock_s + TIME_S, 0.1 * RATE_RADPS, RATE_RADPS, SPEED_MPS])  # fmt: skip
    found = import_file(path)
    np.testing.assert_allclose(found.time_s, TIME_S, atol=1e-12)
    np.testing.assert_allclose(found["yaw_rate_radps"], RATE_RADPS, atol=1e-5)
    assert found.metadata["measured"]["time_offset_s"] == clock_s
    assert any("begins at" in note for note in found.metadata["measured"]["notes"])
    assert open_loop_of(found, "a")["duration_s"] == pytest.approx(TIME_S[-1])


def test_a_recording_that_does_not_start_at_zero_is_driven_from_its_first_row():
    signals = {"steering_wheel_rad": 0.1 * RATE_RADPS, "speed_mps": 0.0 * TIME_S + 20.0}
    channels = [Channel(name, "", "", "measured") for name in signals]
    late = Recording(channels, 1234.5 + TIME_S, np.column_stack(list(signals.values())))
    table = open_loop_of(late, "late")
    assert table["steering"]["time_s"][0] == 0.0
    assert table["duration_s"] == pytest.approx(TIME_S[-1])


def test_a_map_gives_units_signs_offsets_and_the_axes_of_sae(tmp_path):
    path = write(tmp_path / "a.csv", "t,p,q,b", [TIME_S, -np.degrees(RATE_RADPS), -AY_MPS2 + 0.3, 0.1 + 0.0 * TIME_S])
    (tmp_path / "map.toml").write_text(
        'axes = "sae_j670"\nstep_s = 0.02\nstart_s = 1.0\nend_s = 3.0\n[channels]\n'
        'yaw_rate_radps = { column = "p", unit = "deg/s" }\n'
        'ay_mps2 = { column = "q", unit = "m/s2", offset = -0.3 }\n'
        'roll_rad = { column = "b", unit = "rad", zero_until_s = 2.0 }\n'
    )
    recording = import_file(path, tmp_path / "map.toml")
    assert (recording.time_s[0], recording.time_s[-1], len(recording)) == (0.0, 2.0, 101)
    # Averaged over a step of 20 ms, a sine of 0.5 Hz loses 0.02 %.
    np.testing.assert_allclose(recording["yaw_rate_radps"], RATE_RADPS[100:301:2], atol=3e-4)
    np.testing.assert_allclose(recording["ay_mps2"], AY_MPS2[100:301:2], atol=6e-3)
    np.testing.assert_allclose(recording["roll_rad"], 0.0, atol=1e-12)


def test_the_path_of_a_circle_follows_from_speed_and_yaw_rate_and_a_car_drives_it(tmp_path):
    path = write(tmp_path / "a.csv", "time_s,yaw_rate_radps,speed_mps", [TIME_S, 0.0 * TIME_S + 0.5, SPEED_MPS])
    recording = import_file(path)
    np.testing.assert_allclose(recording["x_m"], 40.0 * np.sin(0.5 * TIME_S), atol=1e-3)
    np.testing.assert_allclose(recording["y_m"], 40.0 * (1.0 - np.cos(0.5 * TIME_S)), atol=1e-3)
    recording.save(tmp_path / "a.mcap")
    run = runs_of({"a": Recording.open(tmp_path / "a.mcap")})[0]
    poses = run.recording.poses
    chassis, wheel = (poses.positions_m[:, poses.names.index(name)] for name in ("chassis", "fl_wheel"))
    assert np.ptp(np.linalg.norm(chassis - wheel, axis=1)) < 1e-9  # moved as one
    assert (chassis[-1] - chassis[0])[:2] == pytest.approx([recording["x_m"][-1] - 0.0, recording["y_m"][-1]], abs=3.0)


def test_gaps_are_bridged_as_long_as_the_map_allows(tmp_path):
    holed = RATE_RADPS.copy()
    holed[100:105] = np.nan
    path = write(tmp_path / "short.csv", "time_s,yaw_rate_radps,speed_mps", [TIME_S, holed, SPEED_MPS])
    np.testing.assert_allclose(import_file(path)["yaw_rate_radps"], RATE_RADPS, atol=1e-3)
    holed[100:150] = np.nan
    path = write(tmp_path / "long.csv", "time_s,yaw_rate_radps,speed_mps", [TIME_S, holed, SPEED_MPS])
    with raises(RecordingError, file="long.csv", key="yaw_rate_radps", value=pytest.approx((0.99, 1.5))):
        import_file(path)


@pytest.mark.parametrize(
    ("factors", "said"),
    [
        ({"yaw_rate_radps": math.degrees(1.0)}, "57 times too large: it looks like deg/s"),
        ({"yaw_rate_radps": math.radians(1.0)}, "57 times too small"),
        ({"speed_mps": 3.6}, "km/h that were taken as m/s"),
        ({"ay_mps2": 1.0 / 9.81}, "g that were taken as m/s2"),
        ({"ay_mps2": -1.0}, "ay_mps2 is positive to the right"),
        ({"yaw_rate_radps": -1.0}, "yaw_rate_radps is positive to the right"),
        ({"steering_wheel_rad": -1.0}, "steering_wheel_rad and yaw_rate_radps have opposite signs"),
        ({"steering_wheel_rad": math.degrees(1.0)}, "deg that were taken as rad"),
        ({"steering_wheel_rad": 1.0 / 16.0}, "angle of the road wheels, or"),
        ({"steering_wheel_rad": 1.0 / 48.0}, "has another scale: give its `factor`"),
    ],
)
def test_a_wrong_unit_or_sign_is_suspected_in_one_line(factors, said):
    right = {
        "speed_mps": SPEED_MPS, "yaw_rate_radps": RATE_RADPS, "ay_mps2": AY_MPS2, "steering_wheel_rad": WHEEL_RAD
    }  # fmt: skip
    assert suspicions(right) == []
    lines = suspicions({name: factors.get(name, 1.0) * values for name, values in right.items()})
    assert len(lines) == 1
    assert said in lines[0]


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.csv", b"", "no line of numbers"),
        ("a.csv", b"\x00\xff" * 100, "no line of numbers"),
        (
            "a.csv",
            b"time,yaw_rate_radps\n0,0\n\n0.1,\n0.2,x\n",
            "a.csv, line 5: column 'yaw_rate_radps' holds 'x', which is not a number; leave a missing cell empty",
        ),
        (
            "a.csv",
            b"time;yaw_rate_radps\n0,1;0\n0,2;0.1\n",
            "a.csv: column 'yaw_rate_radps' mixes decimal points and commas",
        ),
        (
            "a.csv",
            b"time;yaw_rate_radps\n0.1;0\n0.2;0\n\n0.3,0\n0.4,0\n",
            "a.csv, line 5: has 1 instead of 2 cells separated by ';'",
        ),
        (
            "a.csv",
            b"time,yaw_rate_radps\n0.1,0\n0.2,0\n0.3;0\n0.4;0\n",
            "a.csv, line 4: has no line with the names of its columns above the numbers; from here on, lines have 2",
        ),
        ("a.csv", b"time,yaw_rate_radps,v\n0,1,2\n1,1\n2,1,2\n3,1,2\n", "a.csv, line 4: has no line with the names"),
        ("a.csv", b"time,yaw_rate_radps\n0,0\n1,0\n0.5,0\n", "goes backwards, from 1 to 0.5 s"),
        ("a.csv", b"time,yaw_rate_radps\n0,0\n", "fewer than two samples"),
        ("a.csv", b"time,yaw_rate_radps[bar]\n0,0\n1,1\n", "yaw_rate_radps"),
        ("a.csv", b"time,yawrate,v\n0,00,0,01,72\n0,01,0,02,72\n", "names 3 columns but has 5"),
        ("a.csv", b"time,foo\n0,0\n1,1\n", "'foo'"),
        ("a.csv", b"u,yaw_rate_radps\n0,0\n1,1\n", "no column is named like a time"),
        ("a.csv", b"time,yawrate,YawRate\n0,0,0\n1,1,1\n", "are both yaw_rate_radps"),
        ("a.mat", b"MATLAB 5.0 MAT-file" + bytes(200), "not a readable MATLAB file"),
        ("a.parquet", b"PAR1" + bytes(50) + b"PAR1", "not a readable Parquet file"),
        ("a.mf4", b"MDF     4.10    " + bytes(200), "not a readable MDF file"),
        ("a.xlsx", b"PK", "end in .csv"),
    ],
)
def test_a_file_that_cannot_be_read_is_an_error_of_one_line(tmp_path, name, data, said):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(RecordingError) as caught:
        import_file(tmp_path / name)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_map_that_names_what_is_not_there_is_an_error(tmp_path):
    path = write(tmp_path / "a.csv", "t,p", [TIME_S, RATE_RADPS])
    for text, said in (
        ('[channels]\nyaw_rate_radps = { column = "P" }\n', "there is no column 'P'; known names: p, t"),
        ('[channels]\nyaw_rate_radps = { column = "p", unit = "bar" }\n', "is in rad/s, and 'p' in 'bar'"),
        ('[channels]\nyaw_rate_degps = { column = "p" }\n', "name it yaw_rate_radps"),
        ('axis = "sae_j670"\n', "axes"),
    ):
        (tmp_path / "map.toml").write_text(text)
        with pytest.raises(RecordingError) as caught:
            import_file(path, tmp_path / "map.toml")
        assert said in str(caught.value)


def test_several_files_with_clocks_of_their_own_are_one_recording(tmp_path):
    late = np.sort(np.append(TIME_S + 0.003 * np.sin(40.0 * TIME_S), TIME_S[5]))  # irregular, and one time twice
    car = write(tmp_path / "car.csv", "car_time,r,vel", [late, np.interp(late, TIME_S, RATE_RADPS), 0.0 * late + 20.0])
    driver = write(tmp_path / "driver.csv", "time,hand", [TIME_S - 0.5, WHEEL_RAD / 28.0])
    text = """time = "car_time"
shift_s = { "driver.csv" = 0.5 }
[channels]
steering_wheel_rad = { column = "hand", factor = 28.0 }
yaw_rate_radps = { column = "r" }
speed_mps = { column = "vel" }
"""
    (tmp_path / "map.toml").write_text(text)
    run = import_file([car, driver], tmp_path / "map.toml")
    assert [note for note in run.metadata["measured"]["notes"] if "time begins" not in note] == []
    offset = run.metadata["measured"]["time_offset_s"]
    np.testing.assert_allclose(run["steering_wheel_rad"], np.interp(run.time_s + offset, TIME_S, WHEEL_RAD), atol=1e-4)
    inside = run.time_s + offset <= TIME_S[-1] - 0.02
    np.testing.assert_allclose(
        run["yaw_rate_radps"][inside], np.interp(run.time_s + offset, TIME_S, RATE_RADPS)[inside], atol=1e-4
    )
    (tmp_path / "map.toml").write_text(text.replace("driver.csv", "drivers.csv"))
    with raises(RecordingError, key="shift_s.drivers.csv"):
        import_file([car, driver], tmp_path / "map.toml")
    write(driver, "time,r", [TIME_S, WHEEL_RAD])
    (tmp_path / "map.toml").write_text('time = "car_time"\n[channels]\nyaw_rate_radps = { column = "r" }\n')
    with pytest.raises(RecordingError, match=r"column 'r' is in car.csv and in driver.csv"):
        import_file([car, driver], tmp_path / "map.toml")
