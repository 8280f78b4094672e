"""The paper's co-simulation with open parts: the car and its active front steering as two FMUs, coupled by FMPy.

    python examples/cosimulation.py
    FOLDER=build/cosimulation python examples/cosimulation.py

Both FMUs exchange data every millisecond, as in the paper, and then every 5 and 10 ms. The same car with the same
controller in a single process is the reference. With FOLDER, the FMUs and their SSP file stay there.
Needs a C compiler and `pip install '.[fmi]'` in a checkout.
Guide: docs/coupling.md.
"""

import ctypes
import math
import os
import runpy
import shutil
import tempfile
import time
import zipfile
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.ssp.simulation import simulate_ssp

import activesteer
from activesteer import DriverCommand
from activesteer.coupling.car import export_fmu
from activesteer.scenario import resolve

HERE = Path(__file__).parent
DURATION_S, STEP_S = 4.0, 0.001
CAR = {"duration_s": DURATION_S, "speed_kmh": 80.0}
SEEN = {"measured_speed_mps": "speed_mps", "measured_yaw_rate_radps": "yaw_rate_radps"}
"""Output of the car -> input of the controller; its output `superposition_demand_rad` is an input of the car."""
RESULTS = ("sideslip_rad", "yaw_rate_radps", "y_m", "fl_tyre_fy_N", "measured_superposition_rad")


def steering_wheel_rad(time_s):
    """Return the driver's angle: a sine with dwell of 0.7 Hz and 140 deg, after FMVSS 126."""
    frequency_hz, dwell_s, start_s = 0.7, 0.5, 0.5
    phase_s, third_s = time_s - start_s, 0.75 / frequency_hz
    if phase_s > third_s:
        phase_s = max(third_s, phase_s - dwell_s)
    inside = 0.0 <= phase_s <= 1.0 / frequency_hz
    return math.radians(140.0) * math.sin(2.0 * math.pi * frequency_hz * phase_s) if inside else 0.0


def made_fmus(folder):
    """Export the car, compile the controller, and return both FMUs."""
    build = runpy.run_path(str(HERE / "fmu" / "build.py"))["build"]
    controller = build(HERE / "fmu" / "paper_afs.c", 2, folder)
    export_fmu(resolve("straight_line", "compact", CAR), folder / "car.fmu")
    return folder / "car.fmu", controller


def single_process(delay_s=0.0):
    """Drive the car with the built-in controller, and return the results and the processor time of a step."""
    overrides = {**CAR, "controllers.bus_delay_s": delay_s}
    simulation = activesteer.Simulation("straight_line", "afs", overrides=overrides)
    drive_nm, began = simulation.loop.commands[0].drive_torque_demand_Nm, time.process_time()
    for step in range(simulation.steps):
        simulation.step(DriverCommand(steering_wheel_rad(step * STEP_S), drive_nm))
    spent = (time.process_time() - began) / simulation.steps
    recording = simulation.recording()
    return np.column_stack([recording[name.removeprefix("measured_")] for name in RESULTS]), spent


class Slave:
    """An FMU driven by FMPy, with its variables by name."""

    def __init__(self, path):
        """Unpack, instantiate and initialise the FMU."""
        about = read_model_description(path)
        self.references = {variable.name: variable.valueReference for variable in about.modelVariables}
        self.folder = extract(path)
        identifier = about.modelIdentifier
        self.fmu = FMU2Slave(
            guid=about.guid, unzipDirectory=self.folder, modelIdentifier=identifier, instanceName=path.stem
        )
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def group(self, *names):
        """Return value references and memory for some variables."""
        count, references = len(names), [self.references[name] for name in names]
        return (ctypes.c_uint32 * count)(*references), (ctypes.c_double * count)()

    def set(self, group, values):
        """Set inputs."""
        group[1][:] = values
        self.fmu.fmi2SetReal(self.fmu.component, group[0], len(values), group[1])

    def get(self, group):
        """Return outputs."""
        self.fmu.fmi2GetReal(self.fmu.component, group[0], len(group[1]), group[1])
        return group[1][:]

    def close(self):
        """Free the FMU and its folder."""
        self.fmu.terminate()
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


def coupled(car_path, controller_path, exchange_s, *, delayed):
    """Couple both FMUs, and return the results and the processor time of a millisecond.

    Args:
        car_path: FMU of the car.
        controller_path: FMU of the controller.
        exchange_s: Time between two exchanges.
        delayed: Whether both FMUs step at the same time, so that the car gets the command one exchange later; or one
            after the other.
    """
    car, controller = Slave(car_path), Slave(controller_path)
    wheel, angle = car.group("steering_wheel_demand_rad"), car.group("superposition_demand_rad")
    seen, results = car.group(*SEEN), car.group(*RESULTS)
    inputs = controller.group("front_steer_demand_rad", *SEEN.values())
    command = controller.group("superposition_demand_rad")
    ratio = resolve("straight_line").car.config.steering.ratio
    rows, every, began = [], round(exchange_s / STEP_S), time.process_time()
    for step in range(0, round(DURATION_S / STEP_S), every):
        demand = steering_wheel_rad(step * STEP_S)
        before = controller.get(command)
        controller.set(inputs, [demand / ratio, *car.get(seen)])
        controller.fmu.doStep(step * STEP_S, exchange_s)
        car.set(wheel, [demand])
        car.set(angle, before if delayed else controller.get(command))
        car.fmu.doStep(step * STEP_S, exchange_s)
        rows.append(car.get(results))
    spent = (time.process_time() - began) / len(rows) / every
    car.close()
    controller.close()
    return np.array(rows), spent


def write_ssp(path, car_path, controller_path):
    """Write both FMUs as one system after the standard SSP 1.0."""
    namespaces = "xmlns:ssd='http://ssp-standard.org/SSP1/SystemStructureDescription' "
    namespaces += "xmlns:ssc='http://ssp-standard.org/SSP1/SystemStructureCommon'"

    def connectors(kinds):
        rows = (f"<ssd:Connector name='{name}' kind='{kind}'><ssc:Real/></ssd:Connector>" for name, kind in kinds)
        return f"<ssd:Connectors>{''.join(rows)}</ssd:Connectors>"

    def component(name, file, kinds):
        kind = "application/x-fmu-sharedlibrary"
        about = f"name='{name}' type='{kind}' source='resources/{file}'"
        return f"<ssd:Component {about}>{connectors(kinds)}</ssd:Component>"

    inputs, outputs = ("steering_wheel_demand_rad", "front_steer_demand_rad"), ("yaw_rate_radps", "sideslip_rad", "y_m")
    car = [("steering_wheel_demand_rad", "input"), ("superposition_demand_rad", "input")]
    car += [(name, "output") for name in (*SEEN, *outputs)]
    afs = [(name, "input") for name in ("front_steer_demand_rad", *SEEN.values())]
    afs += [("superposition_demand_rad", "output")]
    lines = [("", inputs[0], "car", inputs[0]), ("", inputs[1], "afs", inputs[1])]
    lines += [("car", one, "afs", other) for one, other in SEEN.items()]
    lines += [("afs", "superposition_demand_rad", "car", "superposition_demand_rad")]
    lines += [("car", name, "", name) for name in outputs]

    def end(side, element, connector):
        return (f"{side}Element='{element}' " if element else "") + f"{side}Connector='{connector}'"

    wires = "".join(f"<ssd:Connection {end('start', a, b)} {end('end', c, d)}/>" for a, b, c, d in lines)
    system = connectors([*((name, "input") for name in inputs), *((name, "output") for name in outputs)])
    elements = component("car", "car.fmu", car) + component("afs", controller_path.name, afs)
    text = (
        f"<?xml version='1.0' encoding='UTF-8'?>\n<ssd:SystemStructureDescription {namespaces} version='1.0' "
        f"name='active_front_steering'><ssd:System name='root'>{system}<ssd:Elements>{elements}</ssd:Elements>"
        f"<ssd:Connections>{wires}</ssd:Connections></ssd:System></ssd:SystemStructureDescription>\n"
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("SystemStructure.ssd", text)
        archive.write(car_path, "resources/car.fmu")
        archive.write(controller_path, f"resources/{controller_path.name}")
    return path


def simulate_system(path):
    """Simulate an SSP file of `write_ssp` with FMPy."""
    ratio = resolve("straight_line").car.config.steering.ratio
    given = {
        "steering_wheel_demand_rad": steering_wheel_rad,
        "front_steer_demand_rad": lambda time_s: steering_wheel_rad(time_s) / ratio,
    }
    return simulate_ssp(str(path), stop_time=DURATION_S, step_size=STEP_S, input=given)


def compare(folder):
    """Print each way of coupling with its largest differences from the single process."""
    car, controller = made_fmus(folder)
    reference, spent = single_process()
    delayed, _ = single_process(delay_s=STEP_S)
    print(f"{'':34}{'us per ms':>10}{'peak sideslip':>15}  largest difference in yaw rate, y")
    print(f"{'single process':34}{1e6 * spent:10.1f}{peak_deg(reference[:, 0]):11.3f} deg")
    for exchange_ms, late in ((1, False), (1, True), (5, False), (10, False), (10, True)):
        against = delayed if exchange_ms == 1 and late else reference
        found, spent = coupled(car, controller, exchange_ms * STEP_S, delayed=late)
        expected = against[exchange_ms - 1 :: exchange_ms]
        error = np.abs(found - expected).max(axis=0)
        # The first two are computed with the sine of NumPy or of C, which differ in the last digit.
        same = np.array_equal(found[:, 2:], expected[:, 2:])
        words = "equal to the last bit" if same else f"{error[1]:.2g} rad/s, {error[2]:.2g} m"
        name = f"FMUs, {exchange_ms} ms, {'at the same time' if late else 'one after the other'}"
        note = " (single process with 1 ms of bus delay)" if against is delayed else ""
        print(f"{name:34}{1e6 * spent:10.1f}{peak_deg(found[:, 0]):11.3f} deg  {words}{note}")
    system = simulate_system(write_ssp(folder / "active_front_steering.ssp", car, controller))
    print(f"SSP with FMPy: {len(system)} rows, peak sideslip {peak_deg(system['sideslip_rad']):.3f} deg")


def peak_deg(angles_rad):
    """Return the largest magnitude of an angle [deg]."""
    return math.degrees(np.abs(angles_rad).max())


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        compare(Path(os.environ.get("FOLDER", scratch)))
