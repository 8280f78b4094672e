"""The recorder: rows, blocks and poses of a run, in memory and in a file."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from activesteer.core.signals import ActuatorCommand, DriverCommand
from activesteer.errors import SimulationDiverged
from activesteer.recording import McapWriter, Recording
from activesteer.scenario import resolve
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.recorder import BLOCK_INTERVAL_S, POSE_INTERVAL_S, Recorder
from activesteer.simulation.runner import run_scenario
from activesteer.vehicle.channels import ChannelMap, RawRows
from activesteer.vehicle.force_block import output_slot
from tests.raising import raises

BLOCK_ROWS = round(BLOCK_INTERVAL_S / 0.001)
KEYS = {"settle_s": 0.0, "duration_s": 5.0, "steer.start_s": 0.01, "steer.steering_wheel_deg": 40}
PROMISED = """
    x_m y_m yaw_rad roll_rad pitch_rad vx_mps vy_mps speed_mps yaw_rate_radps ax_mps2 ay_mps2 sideslip_rad
    front_axle_x_m front_axle_y_m steering_wheel_rad steering_wheel_demand_rad front_steer_rad superposition_rad
    rear_steer_rad yaw_rate_desired_radps controller_saturated
"""
AT_EACH_WHEEL = """
    tyre_fx_N tyre_fy_N tyre_fz_N tyre_mz_Nm slip_ratio slip_angle_rad inclination_rad wheel_speed_radps travel_m
"""
COMMAND = DriverCommand(0.3, 150.0, 0.25, saturated=True, front_steer_demand_rad=0.02)
ASKED = ActuatorCommand(-0.01, 0.003, 0.2, 0.004, -0.014, True, (10.0, 20.0, 30.0, 40.0), -50.0)


def simulation(controller: str = "ars", timestep_s: float = 0.001) -> ClosedLoop:
    return ClosedLoop(resolve("step_steer", overrides=KEYS), controller, timestep_s)


def column(recorder: Recorder, name: str) -> np.ndarray:
    return recorder.result()[1][:, [channel.name for channel in recorder.channels].index(name)]


def test_every_channel_is_named_once_and_ends_in_its_unit():
    channels = simulation().vehicle.channels.channels
    names = [channel.name for channel in channels]
    assert len(set(names)) == len(names)
    suffixes = {
        "rad": "_rad", "rad/s": "_radps", "m": "_m", "m/s": "_mps", "m/s2": "_mps2", "N": "_N",
        "Nm": "_Nm", "Pa": "_Pa",
    }  # fmt: skip
    for channel in channels:
        assert channel.meaning
        if channel.unit in suffixes:
            assert channel.name.endswith(suffixes[channel.unit]), channel


def test_channels_that_the_interface_promises_are_there():
    names = {channel.name for channel in simulation().vehicle.channels.channels}
    promised = {*PROMISED.split(), *(f"{corner}_{name}" for corner in CORNERS for name in AT_EACH_WHEEL.split())}
    assert not promised - names


def test_commands_are_recorded_as_they_were_given():
    simulated = simulation()
    recorder = Recorder(simulated.vehicle, 3)
    simulated.vehicle.record_on(recorder.tape)
    simulated.vehicle.step(COMMAND, ASKED)
    given = {
        "front_steer_demand_rad": 0.02, "drive_torque_demand_Nm": 150.0, "brake_pedal": 0.25, "parking_brake": 0.0,
        "driver_saturated": 1.0, "rear_steer_demand_rad": -0.01, "superposition_demand_rad": 0.003,
        "yaw_rate_desired_radps": 0.2,
        "prediction_rad": 0.004, "correction_rad": -0.014, "controller_saturated": 1.0,
        "fl_brake_torque_demand_Nm": 10.0, "fr_brake_torque_demand_Nm": 20.0, "rl_brake_torque_demand_Nm": 30.0,
        "rr_brake_torque_demand_Nm": 40.0, "drive_torque_change_Nm": -50.0, "side_difference_Pa": 0.0,
        "fl_wheel_torque_demand_Nm": 0.0, "fr_wheel_torque_demand_Nm": 0.0, "rl_wheel_torque_demand_Nm": 0.0,
        "rr_wheel_torque_demand_Nm": 0.0,
    }  # fmt: skip
    assert {channel.name for channel in recorder.channels if channel.group == "control"} == set(given)
    assert {name: column(recorder, name)[0] for name in given} == given


def test_first_row_is_the_start_and_rows_are_a_step_apart():
    simulated = simulation()
    speed = simulated.vehicle.measure().speed_mps
    recorder = Recorder(simulated.vehicle, 50)
    simulated.advance(50, recorder)
    time_s, values, _ = recorder.result()
    assert time_s == pytest.approx(0.001 * np.arange(50), abs=1e-15)
    assert values.shape == (50, len(recorder.channels))
    assert column(recorder, "speed_mps")[0] == pytest.approx(speed, abs=1e-3)
    assert abs(column(recorder, "x_m")[0]) < 1e-6
    along = column(recorder, "vx_mps") * np.cos(column(recorder, "yaw_rad")) - column(recorder, "vy_mps") * np.sin(
        column(recorder, "yaw_rad")
    )
    # Positions and velocities of the same instants: the trapezoidal rule holds between them.
    assert np.diff(column(recorder, "x_m")) == pytest.approx(0.0005 * (along[1:] + along[:-1]), rel=1e-4)


def test_rows_do_not_depend_on_when_they_are_flushed():
    count = BLOCK_ROWS + 300
    whole, often = simulation(), simulation()
    first, second = Recorder(whole.vehicle, count), Recorder(often.vehicle, count)
    whole.advance(count, first)
    for part in (1, 299, BLOCK_ROWS - 1, 1):
        often.advance(part, second)
        second.flush()
    for one, other in zip(first.result()[:2], second.result()[:2], strict=True):
        assert np.array_equal(one, other)
    for one, other in zip(first.result()[2], second.result()[2], strict=True):
        assert np.array_equal(one, other)


@pytest.mark.parametrize("timestep_s", [0.001, 0.0005])
def test_poses_are_taken_every_ten_milliseconds(timestep_s):
    simulated = simulation(timestep_s=timestep_s)
    steps = round(0.105 / timestep_s)
    recorder = Recorder(simulated.vehicle, steps)
    simulated.advance(steps, recorder)
    _, _, poses = recorder.result()
    assert poses.time_s == pytest.approx(POSE_INTERVAL_S * np.arange(11), abs=1e-12)
    assert poses.positions_m.shape == (11, len(poses.names), 3)
    assert "chassis" in poses.names
    assert np.linalg.norm(poses.quaternions, axis=2) == pytest.approx(1.0, abs=1e-9)
    travelled = poses.positions_m[-1, poses.names.index("chassis"), 0] - poses.positions_m[0, 0, 0]
    assert travelled == pytest.approx(0.1 * 22.2, rel=0.01)


def test_run_that_stops_early_has_the_rows_so_far():
    simulated = simulation()
    recorder = Recorder(simulated.vehicle, 5000)
    simulated.advance(123, recorder)
    time_s, values, poses = recorder.result()
    assert (len(time_s), len(values), len(poses.time_s)) == (123, 123, 13)
    assert np.isfinite(values).all()


def test_nothing_recorded_is_nothing():
    time_s, values, poses = Recorder(simulation().vehicle, 10).result()
    assert (len(time_s), len(values), len(poses.time_s)) == (0, 0, 0)


def test_whole_blocks_are_in_the_file_while_the_run_goes_on(tmp_path):
    driven, again = simulation(), simulation()
    path = tmp_path / "run.mcap"
    with McapWriter(path, driven.vehicle.channels.channels, driven.vehicle.body_names) as writer:
        driven.advance(3 * BLOCK_ROWS + 10, Recorder(driven.vehicle, 5000, writer))
        # The last block may still be on its way: the writer has a thread of its own.
        so_far = Recording.open(path)
        assert len(so_far) >= 2 * BLOCK_ROWS
        assert so_far.metadata["complete"] is False
    kept = Recording.open(path)
    assert len(kept) == 3 * BLOCK_ROWS
    memory = Recorder(again.vehicle, 3 * BLOCK_ROWS)
    again.advance(3 * BLOCK_ROWS, memory)
    # Single precision in the file where the channel says so.
    assert np.allclose(kept.values, memory.result()[1], rtol=1e-7, atol=1e-30)


def test_yaw_angle_of_a_recording_does_not_depend_on_the_one_before():
    simulated = simulation()
    before = simulated.save_state()
    turned = Recorder(simulated.vehicle, 3)
    # As at the end of a run that has turned round more than once.
    turned._yaw_rad = 7.0
    simulated.advance(3, turned)
    assert np.abs(column(turned, "yaw_rad") - math.tau).max() < 0.1
    recorder = Recorder(simulated.vehicle, 3)
    simulated.restore_state(before)
    simulated.advance(3, recorder)
    assert np.abs(column(recorder, "yaw_rad")).max() < 0.1


def test_file_of_a_run_is_the_same_where_only_a_block_stays_in_memory(tmp_path):
    count = 2 * BLOCK_ROWS + 123
    kept, dropped = simulation(), simulation()
    for driven, keep in ((kept, True), (dropped, False)):
        with McapWriter(
            tmp_path / f"{keep}.mcap", driven.vehicle.channels.channels, driven.vehicle.body_names
        ) as writer:
            recorder = Recorder(driven.vehicle, 5000, writer, keep=keep)
            driven.advance(count, recorder)
            assert len(recorder._kept.values) == (5000 if keep else BLOCK_ROWS)
            recorder.flush()
    assert (tmp_path / "True.mcap").read_bytes() == (tmp_path / "False.mcap").read_bytes()


def test_run_too_long_for_memory_gives_what_its_file_holds(tmp_path, monkeypatch):
    scenario = resolve("step_steer", overrides=KEYS | {"duration_s": 0.7})
    short = run_scenario(scenario, "ars", path=tmp_path / "short.mcap")
    monkeypatch.setattr("activesteer.simulation.simulation.MAX_KEPT_VALUES", 0)
    long = run_scenario(scenario, "ars", path=tmp_path / "long.mcap")
    assert np.allclose(long.values, short.values, rtol=1e-7, atol=1e-30)
    assert np.array_equal(long.poses.positions_m, short.poses.positions_m)
    assert long.metrics == pytest.approx(short.metrics, rel=1e-6)
    assert long.metadata == short.metadata
    assert long.attachments == short.attachments
    assert Recording.open(tmp_path / "long.mcap").metrics == long.metrics


@pytest.mark.parametrize(
    ("keep_values", "channel"),
    [(0, "rl_tyre_mz_Nm"), (2**25, "rl_tyre_mz_Nm"), (2**25, "rl_spring_force_N"), (2**25, "fr_camber_rad")],
)
def test_recorded_value_that_no_file_can_hold_ends_the_run_with_its_name(tmp_path, monkeypatch, keep_values, channel):
    """The state may remain finite for a whole run while a tyre records nan."""
    scenario = resolve("step_steer", overrides=KEYS)
    monkeypatch.setattr("activesteer.simulation.simulation.MAX_KEPT_VALUES", keep_values)
    take, taken, model = ChannelMap.take, [0], simulation().vehicle.model
    array, column, value = {
        "rl_tyre_mz_Nm": ("userdata", output_slot(CORNERS.index("rl"), "mz_Nm"), math.nan),
        "rl_spring_force_N": ("ten_length", model.tendon("rl_spring").id, -1e39),
        "fr_camber_rad": ("sensordata", model.sensor("fr_wheel_axis").adr[0] + 2, 2.0),
    }[channel]

    def damaged(self: ChannelMap, rows: RawRows, out: np.ndarray, inputs: np.ndarray) -> bool:
        if taken[0] <= 1100 < taken[0] + len(out):
            getattr(rows, array)[1100 - taken[0], column] = value
        taken[0] += len(out)
        return take(self, rows, out, inputs)

    monkeypatch.setattr(ChannelMap, "take", damaged)
    path = tmp_path / "run.mcap"
    with raises(SimulationDiverged, value=channel) as caught:
        run_scenario(scenario, "ars", path=path)
    saved = Recording.open(path)
    assert len(saved) == len(caught.value.recording) == math.ceil(1101 / BLOCK_ROWS) * BLOCK_ROWS
    assert saved.metadata["complete"] is False
    assert re.fullmatch(rf"SimulationDiverged: {channel} is \S+ at 1\.100 s", saved.metadata["error"])
    assert np.flatnonzero(~np.isfinite(saved[channel])).tolist() == [1100]
