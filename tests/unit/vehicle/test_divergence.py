"""A failing run ends with a clear error; the data recorded before are kept, in memory and on disk."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from activesteer.controllers import RearSteer
from activesteer.core.signals import DriverCommand
from activesteer.driver import HumanDriver
from activesteer.errors import SimulationDiverged
from activesteer.recording import Recording
from activesteer.scenario import resolve
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.runner import run_scenario
from activesteer.vehicle import Vehicle
from tests.raising import raises

SPOILED_S = 1.2345
SHORT = {"settle_s": 0.2, "duration_s": 2.0}


def not_a_number(vehicle: Vehicle) -> None:
    vehicle.data.qvel[vehicle.model.joint("rl_rot").dofadr[0]] = np.nan


def not_a_position(vehicle: Vehicle) -> None:
    vehicle.data.qpos[vehicle.model.joint("fr_jounce").qposadr[0]] = np.inf


def too_fast(vehicle: Vehicle) -> None:
    vehicle.data.qvel[vehicle.model.joint("fl_spin").dofadr[0]] = 1e12


def not_a_force(vehicle: Vehicle) -> None:
    vehicle.data.act[vehicle.model.actuator_actadr[vehicle.model.actuator("fr_slip_y").id]] = np.nan


SPOILERS = [not_a_number, not_a_position, too_fast, not_a_force]


@pytest.fixture(autouse=True)
def engine_s_log_goes_elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """MuJoCo writes its warnings to a file in the working directory."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def spoil(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[Vehicle], None]], None]:
    """Corrupt the state of the next run at one instant, after the manoeuvre has started."""

    def install(change: Callable[[Vehicle], None]) -> None:
        step, rebase = HumanDriver.step, Vehicle.rebase
        under_way: list[Vehicle] = []

        def started(vehicle: Vehicle) -> None:
            rebase(vehicle)
            under_way.append(vehicle)

        def spoiled(driver: HumanDriver, *inputs: Any) -> DriverCommand:
            for vehicle in under_way:
                if abs(vehicle.data.time - SPOILED_S) < 0.5 * vehicle.timestep_s:
                    change(vehicle)
                    under_way.clear()
                    break
            return step(driver, *inputs)

        monkeypatch.setattr(Vehicle, "rebase", started)
        monkeypatch.setattr(HumanDriver, "step", spoiled)

    return install


def good_run() -> Recording:
    return run_scenario(resolve("straight_line", overrides=SHORT))


@pytest.mark.parametrize("change", SPOILERS)
def test_a_state_that_is_not_finite_ends_the_run(
    spoil: Callable[[Callable[[Vehicle], None]], None], change: Callable[[Vehicle], None]
) -> None:
    expected = good_run()
    spoil(change)
    with pytest.raises(SimulationDiverged) as caught:
        good_run()
    kept = caught.value.recording
    assert SPOILED_S - 0.002 < kept.time_s[-1] < SPOILED_S + 0.101
    before = kept.time_s < SPOILED_S - 1e-3
    np.testing.assert_array_equal(kept.values[before], expected.values[: before.sum()])
    assert kept.metadata["complete"] is False
    assert kept.metadata["error"].startswith("SimulationDiverged: ")


@pytest.mark.parametrize("change", SPOILERS)
def test_what_was_recorded_is_on_disk_and_opens(
    tmp_path: Path, spoil: Callable[[Callable[[Vehicle], None]], None], change: Callable[[Vehicle], None]
) -> None:
    spoil(change)
    path = tmp_path / "broken.mcap"
    with pytest.raises(SimulationDiverged) as caught:
        run_scenario(resolve("straight_line", overrides=SHORT), path=path)
    assert any(str(path) in note for note in caught.value.__notes__)
    opened = Recording.open(path)
    assert len(opened) == len(caught.value.recording)
    assert len(opened) > 1000 * SPOILED_S
    assert opened["speed_mps"][0] == pytest.approx(80.0 / 3.6, rel=0.01)
    assert opened.metadata["complete"] is False
    assert "SimulationDiverged" in opened.metadata["error"]


def test_no_row_after_the_failure_looks_like_a_car_that_drives_on(
    spoil: Callable[[Callable[[Vehicle], None]], None],
) -> None:
    """The engine may not reset a broken state and continue."""
    spoil(not_a_number)
    with pytest.raises(SimulationDiverged) as caught:
        good_run()
    kept = caught.value.recording
    after = kept.time_s > SPOILED_S
    assert not (np.abs(kept["speed_mps"][after]) < 10.0).any()
    assert not (np.abs(kept["x_m"][after]) < 1.0).any()


def test_a_warning_of_the_engine_ends_the_run() -> None:
    simulation = ClosedLoop(resolve("straight_line", overrides=SHORT))
    simulation.advance(10)
    simulation.vehicle.data.warning[mujoco.mjtWarning.mjWARN_INERTIA].number += 1
    with raises(SimulationDiverged, value=mujoco.mjtWarning.mjWARN_INERTIA):
        simulation.advance(10)


def test_without_a_fault_nothing_is_reported() -> None:
    simulation = ClosedLoop(resolve("straight_line", overrides=SHORT))
    simulation.advance(300)
    simulation.vehicle.check()


@pytest.mark.parametrize(
    ("block", "field", "name"),
    [
        (RearSteer, "rear_steer_demand_rad", "rear_steer_demand_rad"),
        (RearSteer, "superposition_demand_rad", "superposition_demand_rad"),
        (RearSteer, "drive_torque_change_Nm", "drive_torque_change_Nm"),
        (RearSteer, "brake_torque_demand_Nm", "rl_brake_torque_demand_Nm"),
        (HumanDriver, "steering_wheel_demand_rad", "steering_wheel_demand_rad"),
        (HumanDriver, "drive_torque_demand_Nm", "drive_torque_demand_Nm"),
        (HumanDriver, "brake_pedal", "brake_pedal"),
    ],
)
def test_command_that_is_no_number_ends_the_run_with_its_name(block, field, name, monkeypatch):
    """Commands of built-in blocks are not checked one by one; the applied command must show the error."""
    step = block.step

    def spoiled(self: Any, *inputs: Any) -> Any:
        return step(self, *inputs)._replace(
            **{field: (0.0, 0.0, np.nan, 0.0) if field.startswith("brake_t") else np.nan}
        )

    loop = ClosedLoop(resolve("straight_line", overrides=SHORT), "ars")
    monkeypatch.setattr(block, "step", spoiled)
    with raises(SimulationDiverged, value=name):
        loop.advance(1)


def test_part_of_a_command_that_is_only_recorded_has_to_be_a_number_too(monkeypatch):
    step = RearSteer.step
    monkeypatch.setattr(RearSteer, "step", lambda *inputs: step(*inputs)._replace(prediction_rad=np.nan))
    with raises(SimulationDiverged, value="prediction_rad"):
        run_scenario(resolve("straight_line", overrides={"duration_s": 0.1}), "ars")
