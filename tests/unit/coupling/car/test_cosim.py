"""The exported car in libcosim, the co-simulation library of the Open Simulation Platform."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from activesteer import DriverCommand, Simulation
from activesteer.coupling.car.export import export_fmu
from activesteer.scenario import resolve

pytest.importorskip("libcosimpy", reason="needs pip install libcosimpy")

STEPS, TURN = 600, 100
COMMAND = {"steering_wheel_demand_rad": 0.5, "drive_torque_demand_Nm": 100.0}
HOST = f"""
import json, sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

execution = CosimExecution.from_step_size(step_size=1_000_000)
car = execution.add_local_slave(CosimLocalSlave(fmu_path=sys.argv[1], instance_name="car"))
places = {{v.name.decode(): v.reference for v in execution.slave_variables(slave_index=car)}}
by_hand, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
execution.add_manipulator(manipulator=by_hand)
execution.add_observer(observer=observer)
command, rates = {COMMAND}, []
for step in range({STEPS}):
    values = [0.0 if step < {TURN} and "wheel" in name else value for name, value in command.items()]
    by_hand.slave_real_values(slave_index=car, variable_references=[places[name] for name in command], values=values)
    execution.step()
    rates += observer.last_real_values(slave_index=car, variable_references=[places["measured_yaw_rate_radps"]])
open(sys.argv[2], "w").write(json.dumps(rates))
"""


@pytest.mark.slow
def test_libcosim_drives_a_step_steer_as_a_simulation_does(tmp_path: Path) -> None:
    """In a process of its own, because foreign native code runs there."""
    fmu, found = tmp_path / "compact.fmu", tmp_path / "found.json"
    export_fmu(resolve("straight_line"), fmu)
    subprocess.run([sys.executable, "-c", HOST, fmu, found], check=True, capture_output=True, timeout=120)
    simulation, expected = Simulation("straight_line"), []
    for step in range(STEPS):
        wheel_rad = 0.0 if step < TURN else COMMAND["steering_wheel_demand_rad"]
        command = DriverCommand(wheel_rad, COMMAND["drive_torque_demand_Nm"])
        expected.append(simulation.step(command).yaw_rate_radps)
    assert expected[-1] > 0.1
    assert json.loads(found.read_text()) == expected
