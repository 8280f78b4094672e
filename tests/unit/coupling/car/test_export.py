"""The exported car: the numbers of a simulation to the last bit, states, threads, parameters, failures, C."""

import csv
import ctypes
import functools
import importlib
import math
import shutil
import subprocess
import threading
from pathlib import Path

import numpy as np
import pytest

import activesteer
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement, numbers_in, numbers_of
from activesteer.coupling.car import export_fmu, export_library
from activesteer.coupling.car.objects import native_memory
from activesteer.coupling.car.variables import MOTION
from activesteer.errors import ModelError
from activesteer.scenario import resolve
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.vehicle import Vehicle
from activesteer.vehicle.step_bindings import CARRIED_OUT, COMMANDS

fmpy = pytest.importorskip("fmpy")
fmi1, fmi2, validation = (importlib.import_module(f"fmpy.{name}") for name in ("fmi1", "fmi2", "validation"))
EXAMPLE = Path(__file__).resolve().parents[4] / "examples" / "car_in_c" / "step_steer.c"
SENSORS = {"duration_s": 2.0, "vehicle.sensors.preset": "production"}
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("car")


@pytest.fixture(scope="module")
def library(folder):
    (folder / "lib").mkdir()
    export_library(resolve("straight_line", overrides=SENSORS), folder / "lib")
    return folder / "lib"


@pytest.fixture(scope="module")
def fmus(folder):
    scenario = resolve("straight_line", overrides=SENSORS)
    for version in (2, 3):
        export_fmu(scenario, folder / f"car{version}.fmu", version)
    return folder


class Car:
    """The C library from Python."""

    def __init__(self, folder):
        lib = self.lib = ctypes.CDLL(str(folder / "libactivesteer_car.so"))
        address, whole, number, text, size = (
            ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_char_p, ctypes.c_size_t,
        )  # fmt: skip
        for name, result, *arguments in (
            ("create", address), ("free", None, address), ("message", text, address), ("find", whole, text),
            ("set", whole, address, whole, number), ("get", number, address, whole), ("step", whole, address, whole),
            ("state_size", size, address), ("save", whole, address, address, size),
            ("restore", whole, address, address, size), ("reset", whole, address), ("count", whole),
        ):  # fmt: skip
            function = getattr(lib, f"as_{name}")
            function.restype, function.argtypes = result, arguments
        self.find = functools.cache(lambda name: lib.as_find(name.encode()))
        self.car = lib.as_create()
        assert self.car, lib.as_message(None)

    def __getitem__(self, name):
        return self.lib.as_get(self.car, self.find(name))

    def __setitem__(self, name, value):
        assert self.lib.as_set(self.car, self.find(name), value) == 0, self.message

    def step(self, steps=1):
        assert self.lib.as_step(self.car, steps) == 0, self.message

    @property
    def message(self):
        return self.lib.as_message(self.car).decode()

    def all(self):
        return [self.lib.as_get(self.car, index) for index in range(self.lib.as_count())]

    def save(self):
        state = ctypes.create_string_buffer(self.lib.as_state_size(self.car))
        assert self.lib.as_save(self.car, state, len(state)) == 0, self.message
        return state

    def restore(self, state):
        return self.lib.as_restore(self.car, state, len(state))


def commands(step):
    """Steer, add rear and superposition angles, brake, release, with everything different at every wheel."""
    wheel = 0.8 * np.sin(2e-3 * np.pi * step)
    driver = DriverCommand(wheel, 200.0 - step, 0.0 if step < 900 else 0.4, gear=1 if step < 1500 else 0)
    return driver, ActuatorCommand(
        0.02 * wheel, -0.01 * wheel, brake_torque_demand_Nm=(10.0, 20.0, 30.0, 40.0), drive_torque_change_Nm=5.0
    )


def driven(car, steps):
    for step in range(steps):
        values = dict(zip(COMMANDS, (n for command in commands(step) for n in numbers_in(command)), strict=True))
        for name in CARRIED_OUT:
            car[name] = values[name]
        car.step()


def test_every_output_equals_that_of_a_simulation_to_the_last_bit(library):
    simulation, car = activesteer.Simulation("straight_line", overrides=SENSORS), Car(library)
    table = csv.DictReader((library / "variables.csv").read_text().splitlines())
    names = [row["name"] for row in table if row["causality"] == "output"]
    assert len(names) >= 50
    rows, measurements = [], []
    for step in range(1600):
        measurements.append(numbers_in(simulation.step(*commands(step))))
        driven_one(car, step)
        rows.append([car[name] for name in names])
    recording, ours = simulation.recording(), np.array(rows)
    measured = {f"measured_{number.name}": place for place, number in enumerate(numbers_of(Measurement))}
    for column, name in enumerate(names):
        expected = np.array(measurements)[:, measured[name]] if name in measured else recording[name]
        if name in MOTION:  # numpy's sine and the C library's differ in the last digit
            np.testing.assert_allclose(ours[:, column], expected, rtol=1e-12, atol=1e-13, err_msg=name)
        else:
            assert np.array_equal(ours[:, column], expected), name


def driven_one(car, step):
    values = dict(zip(COMMANDS, (n for command in commands(step) for n in numbers_in(command)), strict=True))
    for name in CARRIED_OUT:
        car[name] = values[name]
    car.step()


def test_a_state_is_exact_and_belongs_to_its_car(library):
    car, other = Car(library), Car(library)
    driven(car, 300)
    state, now = car.save(), car.all()
    car.step(200)
    after = car.all()
    assert car.restore(state) == 0
    assert car.all() == now
    assert other.restore(state) == 0
    for each in (car, other):
        each.step(200)
        assert each.all() == after
    assert car.restore(state[:-8]) == 1
    assert "no state of this car" in car.message
    other.lib.as_reset(other.car)
    assert other.all() == Car(library).all()


def test_no_car_no_name_and_no_state_are_failures_and_no_end(library):
    car = Car(library)
    lib, size = car.lib, car.lib.as_state_size(car.car)
    state = car.save()
    assert [lib.as_set(None, 0, 0.0), lib.as_step(None, 1), lib.as_reset(None)] == [1, 1, 1]
    assert [lib.as_save(None, state, size), lib.as_restore(None, state, size)] == [1, 1]
    assert math.isnan(lib.as_get(None, 0))
    assert lib.as_find(None) == -1
    assert lib.as_message(None) == b""
    assert [lib.as_save(car.car, None, size), lib.as_restore(car.car, None, size)] == [1, 1]
    assert car.restore(state) == 0


@pytest.mark.slow
def test_cars_in_two_threads_are_independent_and_a_long_step_is_many_short_ones(library):
    cars = [Car(library) for _ in range(2)]
    for car, angle in zip(cars, (0.3, -0.6), strict=True):
        car["steering_wheel_demand_rad"] = angle
    threads = [threading.Thread(target=car.step, args=(500,)) for car in cars]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for car, angle in zip(cars, (0.3, -0.6), strict=True):
        alone = Car(library)
        alone["steering_wheel_demand_rad"] = angle
        for _ in range(500):
            alone.step()
        assert alone.all() == car.all()


@pytest.mark.parametrize(
    ("parameters", "overrides"),
    [
        ({"start_speed_mps": 15.0}, {"speed_kmh": 54}),
        ({"tyre_friction_factor": 0.6, "front_cornering_stiffness_factor": 1.3},
         {"factors.tyre_friction": 0.6, "factors.front_cornering_stiffness": 1.3}),
        ({"cg_height_change_m": 0.1, "cg_forward_change_m": 0.1},
         {"load.cg_height_change_m": 0.1, "load.cg_forward_change_m": 0.1}),
        ({"added_mass_kg": 200.0, "added_mass_x_m": -2.0, "added_mass_z_m": 0.8},
         {"load.payload_kg": 200.0, "load.payload_position_m": [-2.0, 0.0, 0.8]}),
    ],
)  # fmt: skip
def test_a_parameter_acts_like_the_key_of_a_vehicle_file(library, parameters, overrides):
    car = Car(library)
    for name, value in parameters.items():
        car[name] = value
    car.step(0)
    simulation = activesteer.Simulation("straight_line", overrides={**SENSORS, **overrides})
    base = Car(library)
    for step in range(1500):
        driver = DriverCommand(min(max(step - 100, 0), 200) / 200, car["drive_torque_demand_Nm"])
        simulation.step(driver, ActuatorCommand())
        for each in (car, base):
            each["steering_wheel_demand_rad"] = driver.steering_wheel_demand_rad
            each.step()
    truth = simulation.truth
    for name in ("yaw_rate_radps", "ay_mps2", "roll_rad", "fl_tyre_fz_N"):
        assert car[name] == pytest.approx(truth[name], rel=2e-3), name
    assert any(abs(car[name] - base[name]) > 0.02 * abs(base[name]) for name in ("yaw_rate_radps", "fl_tyre_fz_N"))
    before = base.lib.as_set(base.car, base.lib.as_find(b"start_speed_mps"), 20.0)
    assert before == 1
    assert "before the first step" in base.message


@pytest.mark.parametrize("faults", [
    {"rear_left": ("stuck", 1), "fl_brake": ("stuck", 1), "superposition": ("runaway=right", 3)},
    {"rear_right": ("float", 4), "superposition": ("reversed", 5), "rr_brake": ("dropout", 6)},
    {"rear_left": ("runaway=left", 2), "rl_brake": ("runaway", 2), "superposition": ("offset=1deg", 0)},
])  # fmt: skip
def test_a_fault_acts_as_in_a_simulation_to_the_last_bit(library, faults):
    begins, ends = 950, 1100
    simulation, car = activesteer.Simulation("straight_line", overrides=SENSORS), Car(library)
    for step in range(1250):
        if step == begins:
            for part, (fault, kind) in faults.items():
                simulation.fail(f"{part}:{fault}@0.95-1.1")
                car[f"{part}_fault"] = kind
                if not kind:
                    car[f"{part}_offset_rad"] = np.radians(1.0)
        if step == ends:
            for part, (_, kind) in faults.items():
                car[f"{part}_fault"] = 0
                if not kind:
                    car[f"{part}_offset_rad"] = 0.0
        measurement = simulation.step(*commands(step))
        driven_one(car, step)
        if step == begins + 50:
            state = car.save()
            later = [(driven_one(car, step + 1 + more), car.all())[1] for more in range(100)]
            assert car["active_faults"] == 3
            assert car.lib.as_reset(car.car) == 0
            assert car.restore(state) == 0
            assert [(driven_one(car, step + 1 + more), car.all())[1] for more in range(100)] == later
            assert car.restore(state) == 0
        names = [f"measured_{number.name}" for number in numbers_of(Measurement) if number.recorded is not None]
        expected = [
            n for n, number in zip(numbers_in(measurement), numbers_of(Measurement), strict=True) if number.recorded
        ]
        assert [car[name] for name in names] == expected, step


def test_a_fault_that_a_part_cannot_have_is_refused(library):
    car = Car(library)
    for name, value in (("fl_brake_fault", 4.0), ("rear_left_fault", 1.5), ("rear_left_fault", 7.0)):
        assert car.lib.as_set(car.car, car.lib.as_find(name.encode()), value) == 1
        assert name in car.message


def test_inputs_act(library):
    slow, quick, free = Car(library), Car(library), Car(library)
    slow["road_mu"], free["wheel_torques_set"] = 0.2, 1.0
    for corner in ("fl", "fr", "rl", "rr"):
        slow[f"{corner}_brake_pressure_request_Pa"] = quick[f"{corner}_brake_pressure_request_Pa"] = 8e6
        free[f"{corner}_drive_torque_Nm"] = 300.0
    for car in (slow, quick, free):
        car.step(1000)
    assert quick["vx_mps"] < slow["vx_mps"] < free["vx_mps"]
    assert quick["fl_brake_pressure_Pa"] > 4e6  # the anti-lock system holds less than requested
    for name, value in (("brake_pedal", 2.0), ("brake_pedal", float("nan")), ("gear", 0.5), ("yaw_rate_radps", 1.0)):
        assert free.lib.as_set(free.car, free.lib.as_find(name.encode()), value) == 1
        assert name in free.message


def test_a_state_that_is_not_finite_is_a_failure_and_no_end(library):
    car = Car(library)
    state = bytearray(car.save().raw)
    numbers = np.frombuffer(state, np.float64)
    numbers[1 + 4] = np.nan  # a coordinate behind the time
    assert car.restore(ctypes.create_string_buffer(bytes(state), len(state))) == 0
    assert car.lib.as_step(car.car, 5) == 1
    assert "non-finite" in car.message or "engine" in car.message
    assert car.lib.as_step(car.car, 1) == 1
    assert "has failed" in car.message
    assert car.lib.as_reset(car.car) == 0
    car.step(10)


@pytest.mark.parametrize("version", [2, 3])
def test_fmpy_validates_and_drives_the_fmu(fmus, version):
    fmu = str(fmus / f"car{version}.fmu")
    assert validation.validate_fmu(fmu) == []
    given = np.array([(0.0, 0.3), (1.0, 0.3)], [("time", float), ("steering_wheel_demand_rad", float)])
    result = fmpy.simulate_fmu(fmu, stop_time=1.0, step_size=0.01, output_interval=0.01, input=given,
                          start_values={"road_mu": 0.8}, output=["yaw_rate_radps", "fl_tyre_fz_N"])  # fmt: skip
    assert 0.05 < result["yaw_rate_radps"][-1] < 0.3
    assert (fmus / f"car{version}.fmu").stat().st_size < 10e6


def test_an_fmu_reports_its_failures_as_status_with_a_message(fmus):
    description, folder = fmpy.read_model_description(fmus / "car2.fmu"), fmpy.extract(fmus / "car2.fmu")
    said = []

    def made(guid):
        car = fmi2.FMU2Slave(guid=guid, unzipDirectory=folder, modelIdentifier="compact", instanceName="car")
        car.instantiate(callbacks=None)
        return car

    with pytest.raises(Exception, match="instantiate"):
        made("wrong")

    def is_refused(call):
        with pytest.raises(fmi1.FMICallException) as caught:
            call()
        said.append(caught.value.status)

    car = made(description.guid)
    for too_early in (lambda: car.doStep(0.0, 0.001), car.exitInitializationMode, car.terminate):
        is_refused(too_early)
    car.setupExperiment(startTime=0.0)
    car.enterInitializationMode()
    is_refused(lambda: car.doStep(0.0, 0.001))
    car.exitInitializationMode()
    pedal = next(v.valueReference for v in description.modelVariables if v.name == "brake_pedal")
    wrong_values = (
        lambda: car.setReal([pedal], [3.0]), lambda: car.setReal([pedal], [math.nan]),
        lambda: car.doStep(0.0, 0.0005), lambda: car.getReal([99999]),
    )  # fmt: skip
    for call in wrong_values:
        is_refused(call)
    state = car.getFMUstate()
    content = car.serializeFMUstate(state)
    car.doStep(0.0, 0.05)
    rates = [v.valueReference for v in description.modelVariables if v.causality == "output"]
    after = car.getReal(rates)
    car.setFMUstate(car.deSerializeFMUstate(content, state))
    car.doStep(0.0, 0.05)
    assert car.getReal(rates) == after
    car.terminate()
    is_refused(lambda: car.doStep(0.05, 0.001))
    assert said == 9 * [3]
    car.freeInstance()


def test_the_example_in_c_drives_a_step_steer(library, tmp_path):
    program = tmp_path / "step_steer"
    options = [f"-I{library}", f"-Wl,-rpath,{library}", f"-Wl,-rpath-link,{library}", "-Werror", "-lm"]
    source = [str(EXAMPLE), str(library / "libactivesteer_car.so")]
    subprocess.run(["cc", *source, *options, "-o", str(program)], check=True)
    printed = subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout.splitlines()
    assert len(printed) == 13
    assert abs(float(printed[0].split()[2])) < 1e-3
    assert float(printed[11].split()[2]) > 0.05
    assert printed[12] == "from the saved state: equal"


def test_an_address_that_nobody_knows_stops_the_export(monkeypatch):
    vehicle = ClosedLoop(resolve("straight_line")).vehicle
    assert len(native_memory(vehicle).relocations) > 50
    whole = Vehicle.native_parts
    monkeypatch.setattr(Vehicle, "native_parts", lambda self: {k: v for k, v in whole(self).items() if k != "plan_row"})
    with pytest.raises(ModelError, match=r"plan\.row of the native step points to memory"):
        native_memory(vehicle)


def test_without_a_compiler_the_export_says_so(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(ModelError, match="needs a C compiler"):
        export_fmu(resolve("straight_line"), tmp_path / "x.fmu")
    assert not list(tmp_path.iterdir())
