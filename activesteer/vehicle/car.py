"""The car in the engine: commands, steps and measurements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import CORNERS, DEFAULT_TIMESTEP_S, Array
from activesteer.core.signals import (
    ActuatorCommand,
    DriverCommand,
    Estimate,
    Measurement,
    Motion,
    nested_fields,
    new_message,
)
from activesteer.errors import ModelError, ParameterError, SimulationDiverged, shown
from activesteer.native.records import Uncopyable
from activesteer.road.road import Road
from activesteer.sensors import SensorBlock
from activesteer.sensors.block import speed_radii
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import force_block as fb
from activesteer.vehicle import native_step
from activesteer.vehicle.brakes.records import BRAKE_SETUP, BRAKE_STATE, brake_setup, reset
from activesteer.vehicle.channels import ChannelMap
from activesteer.vehicle.electric_actuators import ENERGY, ElectricDrive
from activesteer.vehicle.force_block import find, tendon_arms
from activesteer.vehicle.implicit_plan import ImplicitPlan, drop_metric
from activesteer.vehicle.loading import load_model
from activesteer.vehicle.native_forces import install_native_forces
from activesteer.vehicle.native_step import FASTEST_MPS
from activesteer.vehicle.parameters import CLUTCH_OPEN, VehicleParameters
from activesteer.vehicle.statics import YAW_DOF, static_ride, turn_chassis_back
from activesteer.vehicle.step_bindings import (
    CARRIED_OUT,
    COMMANDS,
    ActuatorRecords,
    RecordedArrays,
    Tape,
    WheelSet,
    bind_step,
    engine_arrays,
    read_through,
    record_from,
    write_commands,
    write_estimate,
)

_STATE: Final = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_GEARS: Final = (-1, CLUTCH_OPEN, 1)


class Vehicle(Uncopyable):
    """A car with its tyres on a road.

    Attributes:
        model: The engine's model.
        data: The engine's state.
        parameters: Contents of the vehicle file.
        channels: Map from raw rows to recorded channels.
        actuators: Parameters of the actuators in the native forces.
        rows: Arrays that the row of a step is copied from.
        brakes: `BRAKE_SETUP` and `BRAKE_STATE`, shape (1,) each, as views to read.
        electric: Motors and battery, as views to read; a fault changes `motors`.
        sensors: Sensors between the truth and the measurement; None for ideal sensors.
        wheels: The wheels in the engine.
    """

    def __init__(
        self,
        mjcf: Path,
        parameters: VehicleParameters,
        tyres: tuple[TyreParameters, TyreParameters],
        road: Road,
        timestep_s: float = DEFAULT_TIMESTEP_S,
        content: Mapping[str, bytes] | None = None,
    ) -> None:
        """Compile the car, move it into static equilibrium and install the native forces.

        Args:
            mjcf: The model file.
            parameters: Contents of the vehicle file.
            tyres: Tyres of the front and of the rear axle.
            road: Friction and grade.
            timestep_s: Step of the engine [s].
            content: Content of the model's files; see `load_model`.

        Raises:
            ModelError: the MJCF does not compile, lacks a part, or has no static equilibrium.
        """
        install_native_forces()
        self.parameters = parameters
        self.timestep_s = timestep_s
        self._tyre_widths_m = tuple(tyre["WIDTH"] for tyre in tyres)
        try:
            self.model = load_model(mjcf, parameters, tyres, road, timestep_s, content)
            self.data = mujoco.MjData(self.model)
            self.sensors = None if parameters.sensors.is_ideal else SensorBlock(parameters.sensors, timestep_s)
            self.brakes = self._brake_setup, self._brake_state = np.zeros(1, BRAKE_SETUP), np.zeros(1, BRAKE_STATE)
            self._brake_row = self._brake_state.view(np.float64)
            measured = np.empty(0) if self.sensors is None else self.sensors.outputs
            self.electric = ElectricDrive.of(parameters.motors, parameters.battery, timestep_s)
            self.rows = RecordedArrays(self.model, self.data, measured, self._brake_row, self.electric.state)
            self._estimate_memory: memoryview | None = None
            self.channels = ChannelMap(self.model, parameters)
            self._bind()
            self._place()
            radii_m = self.wheels.effective_radii_m(tyres)
            inertias_kgm2, fractions = self.wheels.inertias_kgm2(), parameters.powertrain.wheel_fractions
            differential = [
                part > 0.0 and getattr(parameters.motors, corner) is None
                for corner, part in zip(CORNERS, fractions, strict=True)
            ]
            self._brake_setup[:] = brake_setup(
                parameters.brakes, timestep_s, radii_m, fractions, inertias_kgm2, differential
            )
            reset(self._brake_state, self._brake_setup, 0.0)
            if parameters.sensors.speed_from_wheels:
                self._bindings["wheel_radii_m"] = speed_radii(parameters.powertrain.front_fraction, radii_m)
        except ModelError as reason:
            raise ModelError(str(reason), file=str(mjcf), value=reason.value, allowed=reason.allowed) from reason

    def _bind(self) -> None:
        """Look up all addresses once, so that a step needs only integers and views."""
        model, data = self.model, self.data
        root = model.joint(find(model, mujoco.mjtObj.mjOBJ_JOINT, "root"))
        if root.qposadr[0] or root.dofadr[0]:
            raise ModelError("the free joint 'root' of the chassis must be the first joint of the model")
        self.wheels = WheelSet(model, data, self.parameters)
        self.actuators = ActuatorRecords(model)
        ratio = self.parameters.steering.ratio
        self._implicit = ImplicitPlan(model, data)
        self._bindings = bind_step(
            model, data, self._implicit.plan, self.rows.live(), self.wheels, ratio, self.sensors,
            self.brakes,
            self.electric,
        )  # fmt: skip
        self._address = self._bindings.ctypes.data
        kinds = {"measurement": nested_fields(Measurement), "motion": nested_fields(Motion)}
        self._sensed = np.zeros(1, list(kinds.items()))
        self._sensed_at = [self._sensed[name].ctypes.data for name in kinds]
        self._tape: Tape | None = None
        self._tape_address = self._bindings["tape"]
        self._forces = fb.header_of(model)
        self._hands = model.actuator("steering_wheel").id
        self._velocimeter = data.sensor("cg_velocimeter").data
        self._gyro = data.sensor("cg_gyro").data
        self._faults: NDArray[Any] | None = None

    def _place(self) -> None:
        """Move the car into static equilibrium at the origin of the world, heading along x."""
        mujoco.mj_resetData(self.model, self.data)
        plays = [link["backlash_m"] for link, _ in self.actuators.rear_screws()]
        originals = [play.copy() for play in plays]
        for play in plays:
            play[:] = 0.0  # the search follows slopes, and within the play the slope is zero
        static_ride(self.model, self.data, np.array([0, 1, YAW_DOF, *self.wheels.spins]))
        for play, value in zip(plays, originals, strict=True):
            play[:] = value

    def start(self, speed_mps: float, time_s: float = 0.0, *, placed: bool = False) -> Measurement:
        """Start the car from static ride, rolling straight ahead at a speed.

        Args:
            speed_mps: Speed along world x [m/s].
            time_s: Time at which the car starts; negative before a recording [s].
            placed: The car is still in the static equilibrium in which it was built.

        Returns:
            The first measurement.
        """
        data = self.data
        if not placed:
            self._forces["areas_felt"] = 0.0
            self._place()
        data.qvel[0] = speed_mps
        # The settling before a manoeuvre corrects the rest.
        data.qvel[self.wheels.spins] = speed_mps / self.wheels.heights_m()
        data.time = time_s
        reset(self._brake_state, self._brake_setup, speed_mps)
        self.electric.state[:] = 0.0
        mujoco.mj_forward(self.model, data)
        drop_metric(self.model, data)
        if self.sensors is not None:
            self.sensors.reset(self.truth()[0])
        return self.measure()

    @property
    def wheel_radius_m(self) -> float:
        """Current height of the driven wheels' centres, mean weighted by their fractions of the torque [m]."""
        fractions = self.parameters.powertrain.wheel_fractions
        return sum(part * height for part, height in zip(fractions, self.wheels.heights_m().tolist(), strict=True))

    def rebase(self) -> None:
        """Set the current position and heading as the origin of the road, and the current time as time 0.

        The motion continues unchanged. From here on the friction of the road's areas applies; before, the road's `mu`.
        """
        data = self.data
        # After a step the positions are those of its start, the state is that of its end.
        mujoco.mj_kinematics(self.model, data)
        half = math.atan2(data.qpos[6], data.qpos[3])
        cos, sin = math.cos(2 * half), math.sin(2 * half)
        cg_x, cg_y, _ = data.site_xpos[self.model.site("cg").id]
        x, y = data.qpos[0] - cg_x, data.qpos[1] - cg_y
        data.qpos[0], data.qpos[1] = cos * x + sin * y, -sin * x + cos * y
        turn_chassis_back(data, half)
        data.time = 0.0
        self.electric.state[ENERGY : ENERGY + 1] = 0.0
        self._forces["areas_felt"] = 1.0
        mujoco.mj_forward(self.model, data)
        drop_metric(self.model, data)

    def step(self, driver_command: DriverCommand, actuator_command: ActuatorCommand) -> tuple[Measurement, Motion]:
        """Apply the commands, advance the engine by one step, and record the step (see `record_on`).

        Args:
            driver_command: Command of the driver.
            actuator_command: Command of the controller.

        Returns:
            Measurement and motion after the step; see `measure` and `motion`.

        Raises:
            ParameterError: a command is not exactly such a message, or contains a value that is not a number.
            SimulationDiverged: the engine warns, or a recorded value is not finite or implausibly large.
        """
        write_commands(self.rows.commands, driver_command, actuator_command)
        if actuator_command.estimate is not None:
            self.note_estimate(actuator_command.estimate)
        self.wheels.check_driven(actuator_command.wheel_torque_demand_Nm)
        if (torques := driver_command.wheel_torques) is not None:
            self.wheels.apply(torques)
        else:
            check_gear(driver_command.gear)
        if not native_step.step(self._address, self.rows.commands.ctypes.data, torques is not None, *self._sensed_at):
            self.check()
        return self._said()

    def record_on(self, tape: Tape | None) -> None:
        """Record the following steps on a tape.

        None stops recording.

        Raises:
            ParameterError: `tape` is something else.
        """
        if tape is not None and type(tape) is not Tape:
            raise ParameterError(f"is {shown(tape)}; a Tape is needed", key="tape", value=tape)
        self._tape, self._tape_address[0] = tape, 0 if tape is None else tape.address

    @property
    def address(self) -> int:
        """Address of the record for compiled code that steps this car, which must outlive it."""
        return self._address

    @property
    def gear(self) -> float:
        """Current gear of the car."""
        return float(self._forces["gear"][0])

    def replay(self, inputs: NDArray[np.float64]) -> None:
        """Advance only the engine by several steps, without commands, checks or recording.

        Args:
            inputs: Inputs of all actuators in each step, as a run left them in `data.ctrl`; shape (steps, actuators).

        Raises:
            ParameterError: `inputs` is not a C-contiguous array of float64 of this shape.
        """
        if (
            not isinstance(inputs, np.ndarray)
            or inputs.dtype != np.float64
            or inputs.ndim != 2
            or inputs.shape[1] != self.model.nu
            or not (inputs.flags.c_contiguous and inputs.flags.aligned)
        ):
            needed = f"a C-contiguous array of float64, shape (steps, {self.model.nu}), is needed"
            raise ParameterError(f"is {shown(inputs)}; {needed}", key="inputs", value=inputs)
        self.follow_model()
        native_step.replay(self._address, inputs)

    def follow_model(self) -> None:
        """Apply changes of `model` to the plan of the step (see `ImplicitPlan.follow`)."""
        self._implicit.follow()

    @property
    def rack_per_steering_wheel_m(self) -> float | None:
        """Rack travel per steering wheel angle [m/rad], or None without a steering column."""
        arms = tendon_arms(self.model, "steering_column")
        if "rack" not in arms or "steering_wheel" not in arms:
            return None
        return -arms["steering_wheel"] / arms["rack"]

    @property
    def steering_lag_s(self) -> float:
        """Lag of the recorded steering wheel angle behind a steadily growing demand [s].

        The lag is one step plus damping over stiffness of the hands.
        """
        hands = self._hands
        stiffness, damping = self.model.actuator_gainprm[hands, 0], -self.model.actuator_biasprm[hands, 2]
        return float(self.model.opt.timestep + damping / stiffness)

    def measure(self) -> Measurement:
        """Return the sensors' signals at the start of the last step, with the yaw rate at its end.

        The yaw rate feeds the corrector's loop directly. With a delay of one step, the response would depend on the
        length of the step, so the yaw rate is read from the state (the gyro's third axis is the chassis' axis).

        Raises:
            SimulationDiverged: see `check`.
        """
        truth, _ = self.truth()
        return truth if self.sensors is None else self.sensors.measurement(truth.time_s)

    @property
    def roll_rate_radps(self) -> float:
        """Roll rate at the start of the last step, positive when the left side rises [rad/s]."""
        return float(self._gyro[0])

    def motion(self) -> Motion:
        """Return position and motion at the start of the last step, with the yaw rate at its end."""
        return self.truth()[1]

    def truth(self) -> tuple[Measurement, Motion]:
        """Return the signals of ideal sensors, and the motion of the car."""
        if not native_step.sense(self._address, *self._sensed_at):
            self.check()
        return self._said()

    def _said(self) -> tuple[Measurement, Motion]:
        measurement, motion = self._sensed.item()
        return new_message(Measurement, measurement), new_message(Motion, motion)

    def check(self) -> None:
        """Check for warnings of the engine and for values that are not finite.

        Raises:
            SimulationDiverged: there is a warning or such a value, or a wheel has left the known surface of a road
                where this is an error.
        """
        outputs = fb.wheel_outputs(self.data, len(CORNERS))
        for corner, wheel in zip(CORNERS, outputs, strict=True):
            if math.isnan(wheel["road_z_m"]) and math.isfinite(wheel["fz_N"]):
                raise SimulationDiverged(
                    f"the {corner} wheel leaves the known surface of the road at x = {wheel['contact_x_m']:.2f} m, y = "
                    f"{wheel['contact_y_m']:.2f} m, {self.data.time:.3f} s; road.outside = 'extend' extends its edge"
                )
        speed_mps = float(self._velocimeter[0])
        _raise_if_diverged(self.model, self.data, self.rows.commands, speed_mps)

    def record_estimate(self, estimate: Estimate) -> None:
        """Record the controller's estimate from now on.

        Args:
            estimate: The current estimate.

        Raises:
            ParameterError: `estimate` is not an `Estimate` of numbers.
        """
        numbers = np.zeros(len(Estimate._fields))
        _write_estimate(numbers.data, estimate)
        self.rows.estimate, self._estimate_memory = numbers, numbers.data
        record_from(self._bindings, self.rows.live())
        self.channels.add_estimate()

    def note_estimate(self, estimate: Estimate) -> None:
        """Set the estimate to record from the next step on (see `record_estimate`)."""
        if self._estimate_memory is not None:
            _write_estimate(self._estimate_memory, estimate)

    def save_state(self) -> NDArray[np.float64]:
        """Return the state of engine, brakes, motors, sensors and gear for a bit-identical continuation."""
        state = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        mujoco.mj_getState(self.model, self.data, state, _STATE)
        return np.concatenate((state, *self._memory(), (self.gear,)))

    def restore_state(self, state: NDArray[np.float64]) -> None:
        """Restore a state that `save_state` has returned.

        Raises:
            ParameterError: `state` is not a state of this car.
        """
        size, memory = mujoco.mj_stateSize(self.model, _STATE), self._memory()
        length = size + sum(part.size for part in memory) + 1
        if not isinstance(state, np.ndarray) or state.dtype != np.float64 or state.shape != (length,):
            raise ParameterError(f"is {shown(state)}; a state of this car is needed", key="state", value=state)
        self.data.warning.number[:] = 0
        mujoco.mj_setState(self.model, self.data, state[:size], _STATE)
        for part in memory:
            part[:] = state[size : size + part.size]
            size += part.size
        native_step.engage(self._address, float(state[-1]))

    def _memory(self) -> list[NDArray[np.float64]]:
        """Memory outside the engine: brakes, motors, sensors, estimate and current sensor data."""
        sensors = [] if self.sensors is None else [self.sensors.memory]
        return [self._brake_row, self.electric.state, self.data.sensordata, self.rows.estimate, *sensors]

    def native_parts(self) -> dict[str, NDArray[Any]]:
        """Return views of the native memory outside the engine, by name.

        An address in one of these records points into one of these arrays, into an array or a struct of the engine, or
        to a function of the engine.
        """
        sensors = self.sensors
        return {
            "bindings": self._bindings,
            **self._implicit.parts(),
            "brake_setup": self._brake_setup,
            "brake_state": self._brake_state,
            "motors": self.electric.motors,
            "battery": self.electric.battery,
            "electric_state": self.electric.state,
            "commands": self.rows.commands,
            "estimate": self.rows.estimate,
            **({} if sensors is None else {"sensors": sensors.chains, "sensor_memory": sensors.memory}),
        }

    def adopt_model(self, model: mujoco.MjModel) -> None:
        """Copy all numbers of another model of the same car, such as a mass changed at run time.

        Raises:
            ParameterError: `model` belongs to another car.
        """
        for own, other in ((self.model, model), (self.model.opt, model.opt)):
            for name in _changeable(own):
                present, value = getattr(own, name), getattr(other, name)
                if not isinstance(value, np.ndarray):
                    setattr(own, name, value)
                elif value.shape == present.shape:
                    present[...] = value
                else:
                    raise ParameterError(f"belongs to another car: {name} has another size", key="model")

    def change_road(self, road: Road) -> None:
        """Apply the frictions of a road with the same number of areas."""
        fb.section_of(self.model, "wheels")["mu"] = road.mu
        areas = fb.section_of(self.model, "areas")
        assert len(areas) == len(road.areas())
        for record, area in zip(areas, road.areas(), strict=True):
            record[...] = np.array(area, fb.AREA)

    def limit_hands(self, torque_Nm: float | None) -> None:
        """Limit the torque of the hands on the steering wheel [N m], or remove the limit with None."""
        hands, felt = self._hands, 1.0 - self.parameters.steering.assist_fraction
        self.model.actuator_forcelimited[hands] = torque_Nm is not None
        maximum = 0.0 if torque_Nm is None else torque_Nm / felt
        self.model.actuator_forcerange[hands] = -maximum, maximum

    def put_sensors_between(self, *, wanted: bool) -> None:
        """Insert fault-capable ideal sensors between the true motion and the brakes, or remove them.

        Args:
            wanted: Whether to insert the sensors; no effect on a car that already has sensors.
        """
        if self.parameters.sensors.is_ideal and wanted is (self.sensors is None):
            self.sensors = SensorBlock(self.parameters.sensors, float(self.model.opt.timestep)) if wanted else None
            read_through(self._bindings, self.sensors)
            if self.sensors is not None:
                self.sensors.reset(self.truth()[0])

    def act_in_every_step(self, faults: NDArray[Any] | None) -> None:
        """Set the `faults.FAULT` records that act in every step, or None without faults."""
        acting = None if faults is None or not faults.size else faults
        self._faults, self._bindings["n_faults"] = acting, 0 if acting is None else acting.size
        self._bindings["faults"] = 0 if acting is None else acting.ctypes.data

    def note_faults(self, count: int) -> None:
        """Set the number of active faults to record from now on."""
        self.data.userdata[-1] = count

    def dimensions(self) -> dict[str, float | list[float]]:
        """Return the dimensions of the car in the design position [m]."""
        at_rest = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, at_rest)
        fl, fr, rl, rr = (at_rest.xpos[self.model.body(f"{corner}_wheel").id] for corner in CORNERS)
        return {
            "width_m": self.parameters.width_m,
            "wheelbase_m": float(0.5 * (fl[0] + fr[0] - rl[0] - rr[0])),
            "front_track_m": float(fl[1] - fr[1]),
            "rear_track_m": float(rl[1] - rr[1]),
            "tyre_width_m": list(self._tyre_widths_m),
        }

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of all bodies but the world, in the engine's order."""
        return tuple(self.model.body(index).name for index in range(1, self.model.nbody))


def _write_estimate(memory: memoryview, estimate: Estimate) -> None:
    try:
        write_estimate(memory, 0, *Estimate(*estimate))
    except Exception as reason:
        raise ParameterError(f"is {shown(estimate)}; an Estimate is needed", key="estimate", value=estimate) from reason


def _raise_if_diverged(model: mujoco.MjModel, data: mujoco.MjData, commands: Array, speed_mps: float) -> None:
    """Raise `SimulationDiverged` if the engine warns or a value is not finite."""
    for name in CARRIED_OUT:
        value = commands[COMMANDS.index(name)]
        if not math.isfinite(value):
            raise SimulationDiverged(f"the command {name} is {value:g} at {data.time:.3f} s", value=name)
    for kind, warning in enumerate(data.warning):
        if warning.number:
            text = mujoco.mju_warningText(kind, warning.lastinfo)
            raise SimulationDiverged(f"MuJoCo warns at {data.time:.3f} s: {text}", value=mujoco.mjtWarning(kind))
    if not np.isfinite(data.qpos).all() or not np.isfinite(data.qvel).all():
        bad = np.flatnonzero(~np.isfinite(data.qvel))
        joints = sorted({model.joint(int(model.dof_jntid[dof])).name for dof in bad})
        raise SimulationDiverged(f"the state is not finite at {data.time:.3f} s; joints: {', '.join(joints)}")
    if not np.isfinite(data.act).all():
        raise SimulationDiverged(f"an activation (slip of a tyre, angle of a servo) is not finite at {data.time:.3f} s")
    if not -FASTEST_MPS < speed_mps < FASTEST_MPS:
        raise SimulationDiverged(f"the speed is {speed_mps:g} m/s at {data.time:.3f} s")
    for name, live in engine_arrays(data).items():
        if not np.isfinite(live).all():
            raise SimulationDiverged(f"the recorded {name} is not finite at {data.time:.3f} s", value=name)


def _changeable(part: mujoco.MjModel | mujoco.MjOption) -> list[str]:
    """Return the names of the numbers that can change at run time in a model, or in its options."""
    kinds = (np.ndarray, int, float) if isinstance(part, mujoco.MjOption) else (np.ndarray,)
    return [name for name in dir(part) if not name.startswith("_") and isinstance(getattr(part, name), kinds)]


def check_gear(gear: Any) -> None:
    """Raise a `ParameterError` for a gear that the car does not have."""
    if gear not in _GEARS:
        raise ParameterError(f"is {shown(gear)}; -1, 0 or 1 is needed", key="gear", value=gear, allowed=_GEARS)
