"""The car in the engine: commands in, one step, measurements out. Binds MuJoCo's arrays once, by name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.brakes.records import BRAKE_SETUP, BRAKE_STATE, brake_setup, reset
from activesteer.conventions import CORNERS, DEFAULT_TIMESTEP_S
from activesteer.errors import ModelError
from activesteer.road.road import Road
from activesteer.sensors import SensorBlock
from activesteer.sensors.block import speed_radii
from activesteer.signals import ActuatorCommand, DriverCommand, Estimate, Measurement, Motion, made
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import force_block as fb
from activesteer.vehicle import native_step
from activesteer.vehicle.actuator_records import ActuatorRecords
from activesteer.vehicle.channels import ChannelMap
from activesteer.vehicle.chassis_heading import YAW_DOF, turn_chassis_back
from activesteer.vehicle.divergence import raise_if_diverged
from activesteer.vehicle.equilibrium import static_ride
from activesteer.vehicle.estimate_row import write_estimate
from activesteer.vehicle.implicit_plan import ImplicitPlan, drop_metric
from activesteer.vehicle.loading import load_model
from activesteer.vehicle.named_parts import find, tendon_arms
from activesteer.vehicle.native_forces import install_native_forces
from activesteer.vehicle.parameters import VehicleParameters
from activesteer.vehicle.powertrain import CLUTCH_OPEN
from activesteer.vehicle.recorded_arrays import RecordedArrays
from activesteer.vehicle.step_plan import read_through, record_from, step_plan
from activesteer.vehicle.wheel_set import WheelSet

_STATE: Final = int(mujoco.mjtState.mjSTATE_INTEGRATION)


class Vehicle:
    """A car with its tyres on a road.

    Attributes:
        model: The engine's model.
        data: The engine's state.
        parameters: What the vehicle file says.
        channels: Map from raw rows to recorded channels.
        actuators: What the native forces know of the actuators.
        rows: What the row of a step is copied from.
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
        """Compiles the car, puts it at rest in static equilibrium and installs the native forces.

        Args:
            mjcf: The model file.
            parameters: What the vehicle file says.
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
            self._sensors = None if parameters.sensors.is_ideal else SensorBlock(parameters.sensors, timestep_s)
            self._brake_setup, self._brake_state = np.zeros(1, BRAKE_SETUP), np.zeros(1, BRAKE_STATE)
            self._brake_row = self._brake_state.view(np.float64)
            measured = np.empty(0) if self._sensors is None else self._sensors.outputs
            self.rows = RecordedArrays(self.model, self.data, measured, self._brake_row)
            self._estimate_memory: memoryview | None = None
            self.channels = ChannelMap(self.model, parameters)
            self._bind()
            self._place()
            radii_m = self._wheels.effective_radii_m(tyres)
            inertias_kgm2, fractions = self._wheels.inertias_kgm2(), parameters.powertrain.wheel_fractions
            self._brake_setup[:] = brake_setup(parameters.brakes, timestep_s, radii_m, fractions, inertias_kgm2)
            reset(self._brake_state, self._brake_setup, 0.0)
            if parameters.sensors.speed_from_wheels:
                self._plan["wheel_radii_m"] = speed_radii(parameters.powertrain.front_fraction, radii_m)
        except ModelError as reason:
            raise ModelError(str(reason), file=str(mjcf), value=reason.value, allowed=reason.allowed) from reason

    def _bind(self) -> None:
        """Looks up addresses once; the step uses nothing but integers and views."""
        model, data = self.model, self.data
        root = model.joint(find(model, mujoco.mjtObj.mjOBJ_JOINT, "root"))
        if root.qposadr[0] or root.dofadr[0]:
            raise ModelError("the free joint 'root' of the chassis must be the first joint of the model")
        self._wheels = WheelSet(model, data, self.parameters.powertrain)
        self.actuators = ActuatorRecords(model)
        ratio, brakes = self.parameters.steering.ratio, (self._brake_setup, self._brake_state)
        self._implicit = ImplicitPlan(model, data)
        self._plan = step_plan(
            model, data, self._implicit.plan, self.rows.live(), self._wheels.torques, ratio, self._sensors, brakes
        )
        self._plan_address = self._plan.ctypes.data
        self._forces = fb.header_of(model)
        self._hands = model.actuator("steering_wheel").id
        self._velocimeter = data.sensor("cg_velocimeter").data
        self._gear: float = CLUTCH_OPEN

    def _place(self) -> None:
        """Static equilibrium at the origin of the world, heading along x."""
        mujoco.mj_resetData(self.model, self.data)
        plays = [link["backlash_m"] for link, _ in self.actuators.rear_screws()]
        given = [play.copy() for play in plays]
        for play in plays:
            play[:] = 0.0  # the search finds its way by slopes, and within a play there is none
        static_ride(self.model, self.data, np.array([0, 1, YAW_DOF, *self._wheels.spins]))
        for play, value in zip(plays, given, strict=True):
            play[:] = value

    def start(self, speed_mps: float, time_s: float = 0.0) -> Measurement:
        """Sets the car rolling straight ahead at a speed, from static ride.

        Args:
            speed_mps: Speed along world x [m/s].
            time_s: Time from which it counts; below 0 before a recording [s].

        Returns:
            The first measurement.
        """
        data = self.data
        self._forces["areas_felt"] = 0.0
        self._place()
        data.qvel[0] = speed_mps
        # The settling before a manoeuvre corrects the rest.
        data.qvel[self._wheels.spins] = speed_mps / self._wheels.heights_m()
        data.time = time_s
        reset(self._brake_state, self._brake_setup, speed_mps)
        mujoco.mj_forward(self.model, data)
        drop_metric(self.model, data)
        if self._sensors is not None:
            self._sensors.reset(self.truth()[0])
        return self.measure()

    @property
    def wheel_radius_m(self) -> float:
        """Mean height of the driven wheels' centres where the car now is, by their fractions of the torque [m]."""
        fractions = self.parameters.powertrain.wheel_fractions
        return sum(part * height for part, height in zip(fractions, self._wheels.heights_m().tolist(), strict=True))

    def rebase(self) -> None:
        """Makes where the car is the origin of road and time, its heading along x; its motion goes on unchanged.

        From here on the wheels feel the areas of the road; before, there is only the road's `mu`.
        """
        data = self.data
        # The step leaves positions of its beginning beside the state of its end.
        mujoco.mj_kinematics(self.model, data)
        half = math.atan2(data.qpos[6], data.qpos[3])
        cos, sin = math.cos(2 * half), math.sin(2 * half)
        cg_x, cg_y, _ = data.site_xpos[self.model.site("cg").id]
        x, y = data.qpos[0] - cg_x, data.qpos[1] - cg_y
        data.qpos[0], data.qpos[1] = cos * x + sin * y, -sin * x + cos * y
        turn_chassis_back(data, half)
        data.time = 0.0
        self._forces["areas_felt"] = 1.0
        mujoco.mj_forward(self.model, data)
        drop_metric(self.model, data)

    def step(self, command: DriverCommand, asked: ActuatorCommand, tape_address: int = 0) -> tuple[Measurement, Motion]:
        """Applies the commands and advances the engine by one step.

        Args:
            command: What the driver does.
            asked: What the controller asks for.
            tape_address: Address of the `TAPE` that the step is recorded on; 0 where none is wanted.

        Returns:
            What the sensors then say, and where the car is; see `measure` and `motion`.

        Raises:
            TypeError: `command` or `asked` is something else, or holds what is no number.
            SimulationDiverged: the engine warns, or something recorded is not finite or beyond all reason.
        """
        # Native code takes the messages apart without a look: what is no message would end the process.
        if command.__class__ is not DriverCommand or asked.__class__ is not ActuatorCommand:
            raise TypeError(f"a DriverCommand and an ActuatorCommand are needed, not {command!r} and {asked!r}")
        if self._estimate_memory is not None:
            write_estimate(self._estimate_memory, asked.estimate)
        torques = command.wheel_torques
        gear = command.gear if torques is None else CLUTCH_OPEN
        if gear != self._gear:
            self._gear = gear
            self._forces["gear"] = gear
            self._wheels.engage(gear)
        if torques is not None:
            self._wheels.apply(torques)
        sane, measurement, motion = native_step.step(
            self._plan_address, command, asked, tape_address, torques is not None
        )
        if not sane:
            self.check()
        return made(Measurement, measurement), made(Motion, motion)

    def replay(self, inputs: NDArray[np.float64]) -> None:
        """Makes steps of the engine alone, in one native call: nothing is looked at, asked or recorded.

        Args:
            inputs: Inputs of all actuators in each step, as a run left them in `data.ctrl`; shape (steps, actuators).
        """
        self.follow_model()
        native_step.replay(self._plan_address, inputs)

    def follow_model(self) -> None:
        """Take over changes of `model` that a plan of the step froze; see `ImplicitPlan.follow`."""
        self._implicit.follow()

    @property
    def rack_per_steering_wheel_m(self) -> float | None:
        """Rack travel per steering wheel angle [m/rad], from the fixed tendon `steering_column`; None without one."""
        arms = tendon_arms(self.model, "steering_column")
        if "rack" not in arms or "steering_wheel" not in arms:
            return None
        return -arms["steering_wheel"] / arms["rack"]

    @property
    def steering_lag_s(self) -> float:
        """Time by which the recorded steering wheel follows a steady turning of the demanded one [s].

        One step, and damping over stiffness of the hands.
        """
        hands = self._hands
        stiffness, damping = self.model.actuator_gainprm[hands, 0], -self.model.actuator_biasprm[hands, 2]
        return float(self.model.opt.timestep + damping / stiffness)

    def measure(self) -> Measurement:
        """What the car's sensors say of the instant at which the last step began, and the yaw rate at its end.

        The yaw rate goes straight into the corrector's loop, where a step of age would shift the response with the
        step's length: it is taken from the state (the gyro's third axis is that of the chassis).

        Raises:
            SimulationDiverged: see `check`.
        """
        truth, _ = self.truth()
        return truth if self._sensors is None else self._sensors.measurement(truth.time_s)

    def motion(self) -> Motion:
        """Where the car is and how it moves, at the instant at which the last step began; the yaw rate at its end."""
        return self.truth()[1]

    def truth(self) -> tuple[Measurement, Motion]:
        """What ideal sensors would say, and `motion`."""
        sane, measurement, motion = native_step.sense(self._plan_address)
        if not sane:
            self.check()
        return made(Measurement, measurement), made(Motion, motion)

    def check(self) -> None:
        """Looks for warnings of the engine and for what is not finite, commands first.

        Raises:
            SimulationDiverged: there is one.
        """
        speed_mps = float(self._velocimeter[0])
        raise_if_diverged(self.model, self.data, self.rows.commands, speed_mps)

    def record_estimate(self, estimate: Estimate) -> None:
        """From now on what the controller estimates is recorded too.

        Args:
            estimate: What it estimates now.
        """
        self.rows.estimate = np.array(estimate, np.float64)
        self._estimate_memory = self.rows.estimate.data
        record_from(self._plan, self.rows.live())
        self.channels.add_estimate()

    def save_state(self) -> NDArray[np.float64]:
        """The state of engine, brakes and sensors, complete: what continues from it is bit-identical."""
        state = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        mujoco.mj_getState(self.model, self.data, state, _STATE)
        sensors = () if self._sensors is None else (self._sensors.memory,)
        return np.concatenate((state, self._brake_row, *sensors))

    def restore_state(self, state: NDArray[np.float64]) -> None:
        """Puts a saved state back."""
        size = mujoco.mj_stateSize(self.model, _STATE)
        brakes = size + len(self._brake_row)
        mujoco.mj_setState(self.model, self.data, state[:size], _STATE)
        self._brake_row[:] = state[size:brakes]
        if self._sensors is not None:
            self._sensors.memory[:] = state[brakes:]
        # The step engages a gear only where it changes; this one never occurs, so it does so now.
        self._gear = math.nan

    def limit_hands(self, torque_Nm: float | None) -> None:
        """Lets the hands on the steering wheel hold no more than a torque [N m]; any where not given."""
        hands, felt = self._hands, 1.0 - self.parameters.steering.assist_fraction
        self.model.actuator_forcelimited[hands] = torque_Nm is not None
        maximum = 0.0 if torque_Nm is None else torque_Nm / felt
        self.model.actuator_forcerange[hands] = -maximum, maximum

    @property
    def brakes(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """`BRAKE_SETUP` and `BRAKE_STATE` of the car, shape (1,) each; views, for looking at."""
        return self._brake_setup, self._brake_state

    @property
    def sensors(self) -> SensorBlock | None:
        """What is between the truth and the measurement; None where nothing is."""
        return self._sensors

    def put_sensors_between(self, *, wanted: bool) -> None:
        """Has brakes listen to sensors where these are ideal, as they must where a sensor may fail.

        Args:
            wanted: Whether they shall; else they are the truth again.
        """
        if self.parameters.sensors.is_ideal and wanted is (self._sensors is None):
            self._sensors = SensorBlock(self.parameters.sensors, float(self.model.opt.timestep)) if wanted else None
            read_through(self._plan, self._sensors)
            if self._sensors is not None:
                self._sensors.reset(self.truth()[0])

    def note_measurement(self, measurement: Measurement) -> None:
        """Has recorded what faulty sensors say, where the measurement is recorded at all, and tells it the brakes."""
        if self._sensors is not None:
            self._sensors.say(measurement)

    def note_faults(self, count: int) -> None:
        """Has it recorded from now on how many faults act."""
        self.data.userdata[-1] = count

    def dimensions(self) -> dict[str, float | list[float]]:
        """What an evaluation needs of the car's outline [m]: width, wheelbase, tracks and tyre widths, as designed."""
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
        """All bodies but the world, in the engine's order."""
        return tuple(self.model.body(index).name for index in range(1, self.model.nbody))
