"""The car in the engine: commands in, one step, measurements out. Binds MuJoCo's arrays once, by name."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.brakes.records import BRAKE_SETUP, BRAKE_STATE, brake_setup, reset
from activesteer.conventions import CORNERS, DEFAULT_TIMESTEP_S
from activesteer.errors import ModelError, SimulationDiverged
from activesteer.road.road import Road
from activesteer.sensors import SensorBlock
from activesteer.sensors.block import speed_radii
from activesteer.signals import ActuatorCommand, DriverCommand, Estimate, Measurement, Motion, WheelTorques
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import force_block as fb
from activesteer.vehicle import native_step
from activesteer.vehicle.actuator_records import ActuatorRecords
from activesteer.vehicle.channels import ChannelMap, RawRows
from activesteer.vehicle.command_row import CARRIED_OUT, COMMANDS, write_commands
from activesteer.vehicle.equilibrium import static_ride
from activesteer.vehicle.estimate_row import write_estimate
from activesteer.vehicle.loading import load_model
from activesteer.vehicle.named_parts import find, sensor_columns, tendon_arms
from activesteer.vehicle.native_forces import install_native_forces
from activesteer.vehicle.native_step import FASTEST_MPS, Places, Wheels, sensed, step_plan
from activesteer.vehicle.parameters import VehicleParameters
from activesteer.vehicle.powertrain import CLUTCH_OPEN

_CALIBRATED_AT_MPS: Final = 20.0
"""Speed at which the rolling radii are taken that turn wheel speeds into the speed of the car [m/s]."""
_STATE: Final = int(mujoco.mjtState.mjSTATE_INTEGRATION)


@contextlib.contextmanager
def engine_warnings_held() -> Iterator[None]:
    """While this lasts, the engine's warnings are left to `Vehicle.check`, not written to a file in the user's folder.

    A handler that someone else has installed stays in force.
    """
    if mujoco.get_mju_user_warning() is not None:
        yield
        return
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(None)


class Vehicle:
    """A car with its tyres on a road.

    Attributes:
        model: The engine's model.
        data: The engine's state.
        parameters: What the vehicle file says.
        channels: Map from raw rows to recorded channels.
        actuators: What the native forces know of the actuators.
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
            self._commands = np.zeros(len(COMMANDS))
            self._command_memory = self._commands.data
            self._sensors = None if parameters.sensors.is_ideal else SensorBlock(parameters.sensors, timestep_s)
            self._measured = np.empty(0) if self._sensors is None else self._sensors.outputs
            self._brake_setup, self._brake_state = np.zeros(1, BRAKE_SETUP), np.zeros(1, BRAKE_STATE)
            self._brake_row = self._brake_state.view(np.float64)
            self._estimate, self._estimates = np.empty(0), False
            self.channels = ChannelMap(self.model, parameters)
            self._bind()
            self._place()
            radii_m = self._effective_radii(tyres)
            self._brake_setup[:] = self._brakes_of(radii_m)
            reset(self._brake_state, self._brake_setup, 0.0)
            if parameters.sensors.speed_from_wheels:
                self._plan["wheel_radii_m"] = speed_radii(parameters.powertrain.front_fraction, radii_m)
        except ModelError as reason:
            raise ModelError(str(reason), file=str(mjcf), value=reason.value, allowed=reason.allowed) from reason

    def _bind(self) -> None:
        """Looks up addresses once; the step uses nothing but integers and views."""
        model, data = self.model, self.data

        def actuator(name: str) -> int:
            return find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)

        def joint(name: str) -> int:
            return find(model, mujoco.mjtObj.mjOBJ_JOINT, name)

        self._root, self._root_dof = int(model.jnt_qposadr[joint("root")]), int(model.jnt_dofadr[joint("root")])
        if self._root or self._root_dof:
            raise ModelError("the free joint 'root' of the chassis must be the first joint of the model")
        self._ctrl = data.ctrl
        self._places = Places(
            *(actuator(name) for name in ("steering_wheel", "superposition", "rl_steer", "rr_steer")),
            *(
                sensor_columns(model, name).start
                for name in (
                    "cg_velocimeter", "cg_accelerometer", "steering_wheel_angle", "superposition_angle",
                    "rl_steer_angle", "rr_steer_angle", "fl_wheel_speed", "cg_position", "cg_velocity",
                    "chassis_orientation",
                )
            ),
            yaw_dof=self._root_dof + 5,
        )  # fmt: skip
        self._wheels = Wheels(
            [actuator(f"{corner}_drive") for corner in CORNERS],
            [actuator(f"{corner}_brake") for corner in CORNERS],
            self.parameters.powertrain.wheel_fractions,
        )
        self.actuators = ActuatorRecords(model, (self._places.rear_left, self._places.rear_right))
        ratio, brakes = self.parameters.steering.ratio, (self._brake_setup, self._brake_state)
        self._plan = step_plan(
            model, data, self.live_arrays(), self._places, self._wheels, ratio, self._sensors, brakes
        )
        self._plan_address = self._plan.ctypes.data
        self._forces = fb.header_of(model)
        self._gear: float = CLUTCH_OPEN
        self._spins = [int(model.jnt_dofadr[joint(f"{corner}_spin")]) for corner in CORNERS]
        self._spin_armature_kgm2 = model.dof_armature[self._spins].tolist()

    def _place(self) -> None:
        """Static equilibrium at the origin of the world, heading along x."""
        mujoco.mj_resetData(self.model, self.data)
        held = [self._root_dof, self._root_dof + 1, self._root_dof + 5, *self._spins]
        plays = [link["backlash_m"] for link, _ in self.actuators.rear_screws()]
        given = [play.copy() for play in plays]
        for play in plays:
            play[:] = 0.0  # the search finds its way by slopes, and within a play there is none
        static_ride(self.model, self.data, np.asarray(held))
        for play, value in zip(plays, given, strict=True):
            play[:] = value

    def _brakes_of(self, rolling_radii_m: list[float]) -> NDArray[Any]:
        """What the brakes' control unit knows of the car: rolling radii [m] and inertias of its wheels."""
        inertias_kgm2 = []
        unit, product = np.zeros(self.model.nv), np.zeros(self.model.nv)
        for spin in self._spins:
            unit[:] = 0.0
            unit[spin] = 1.0
            mujoco.mj_mulM(self.model, self.data, product, unit)
            inertias_kgm2.append(float(product[spin]))
        fractions = self.parameters.powertrain.wheel_fractions
        return brake_setup(self.parameters.brakes, self.timestep_s, rolling_radii_m, fractions, inertias_kgm2)

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
        data.qvel[self._root_dof] = speed_mps
        for index, dof in enumerate(self._spins):
            data.qvel[dof] = speed_mps / self._rolling_radius(index)
        data.time = time_s
        reset(self._brake_state, self._brake_setup, speed_mps)
        mujoco.mj_forward(self.model, data)
        if self._sensors is not None:
            self._sensors.reset(self.truth()[0])
        return self.measure()

    def _effective_radii(self, tyres: tuple[TyreParameters, TyreParameters]) -> list[float]:
        """Rolling radii under the loads of standing still, as measured when the sensors are fitted [m]."""
        loads_N = fb.wheel_outputs(self.data, len(CORNERS))["fz_N"]
        axles = (tyres[0], tyres[0], tyres[1], tyres[1])
        return [
            float(MagicFormula(tyre).evaluate(load_N, 0.0, 0.0, vx_mps=_CALIBRATED_AT_MPS).effective_radius_m)
            for tyre, load_N in zip(axles, loads_N, strict=True)
        ]

    @property
    def wheel_radius_m(self) -> float:
        """Mean height of the driven wheels' centres where the car now is, by their fractions of the torque [m]."""
        return sum(
            fraction * self._rolling_radius(index)
            for index, fraction in enumerate(self.parameters.powertrain.wheel_fractions)
        )

    def _rolling_radius(self, corner: int) -> float:
        """Height of a wheel centre [m]: the settling before a manoeuvre corrects the rest."""
        return float(self.data.xpos[self.model.body(f"{CORNERS[corner]}_wheel").id, 2])

    def rebase(self) -> None:
        """Makes where the car is the origin of road and time, its heading along x; its motion goes on unchanged.

        From here on the wheels feel the areas of the road; before, there is only the road's `mu`.
        """
        data, root = self.data, self._root
        # The step leaves positions of its beginning beside the state of its end.
        mujoco.mj_kinematics(self.model, data)
        w, z = data.qpos[root + 3], data.qpos[root + 6]
        half = math.atan2(z, w)
        cos, sin = math.cos(2 * half), math.sin(2 * half)
        x, y = data.qpos[root : root + 2]
        cg_x, cg_y = self._cg_offset()
        data.qpos[root] = cos * (x - cg_x) + sin * (y - cg_y)
        data.qpos[root + 1] = -sin * (x - cg_x) + cos * (y - cg_y)
        turn = np.array([math.cos(half), 0.0, 0.0, -math.sin(half)])
        turned = np.empty(4)
        mujoco.mju_mulQuat(turned, turn, data.qpos[root + 3 : root + 7])
        data.qpos[root + 3 : root + 7] = turned
        vx, vy = data.qvel[self._root_dof : self._root_dof + 2]
        data.qvel[self._root_dof] = cos * vx + sin * vy
        data.qvel[self._root_dof + 1] = -sin * vx + cos * vy
        data.time = 0.0
        self._forces["areas_felt"] = 1.0
        mujoco.mj_forward(self.model, data)

    def _cg_offset(self) -> tuple[float, float]:
        site = self.data.site_xpos[self.model.site("cg").id]
        return float(site[0]), float(site[1])

    def step(self, command: DriverCommand, asked: ActuatorCommand, tape_address: int = 0) -> tuple[Measurement, Motion]:
        """Applies the commands and advances the engine by one step.

        Args:
            command: What the driver does.
            asked: What the controller asks for.
            tape_address: Address of the `TAPE` that the step is recorded on; 0 where none is wanted.

        Returns:
            What the sensors then say, and where the car is; see `measure` and `motion`.

        Raises:
            SimulationDiverged: the engine warns, or something recorded is not finite or beyond all reason.
        """
        write_commands(self._command_memory, command, asked)
        if self._estimates:
            write_estimate(self._estimate.data, asked.estimate)
        torques = command.wheel_torques
        gear = command.gear if torques is None else CLUTCH_OPEN
        if gear != self._gear:
            self._engage(gear)
        if torques is not None:
            self._apply_torques(torques)
        sane, measurement, motion = native_step.step(self._plan_address, tape_address, torques is not None)
        if not sane:
            self.check()
        return sensed(measurement, motion)

    def replay(self, inputs: NDArray[np.float64]) -> None:
        """Makes steps of the engine alone, in one native call: nothing is looked at, asked or recorded.

        Args:
            inputs: Inputs of all actuators in each step, as a run left them in `data.ctrl`; shape (steps, actuators).
        """
        native_step.replay(self._plan_address, inputs)

    def _engage(self, gear: int) -> None:
        """Couples the engine to the driven wheels, each of which then carries its part of the inertia, or frees it."""
        self._gear = gear
        self._forces["gear"] = gear
        powertrain = self.parameters.powertrain
        inertia_kgm2 = 0.0 if gear == CLUTCH_OPEN else powertrain.inertia_kgm2
        for dof, own, fraction in zip(self._spins, self._spin_armature_kgm2, powertrain.wheel_fractions, strict=True):
            self.model.dof_armature[dof] = own + fraction * inertia_kgm2

    def _apply_torques(self, torques: WheelTorques) -> None:
        """Torques of the wheels, one by one: past the engine, so at once and whatever that can give."""
        self._ctrl[self._wheels.drives] = torques.drive_Nm
        self._ctrl[self._wheels.brakes] = torques.brake_Nm

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
        hands = self._places.steering_wheel
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
        return sensed(measurement, motion)

    def check(self) -> None:
        """Looks for warnings of the engine and for what is not finite, commands first.

        Raises:
            SimulationDiverged: there is one.
        """
        data = self.data
        for name in CARRIED_OUT:
            value = self._commands[COMMANDS.index(name)]
            if not math.isfinite(value):
                raise SimulationDiverged(f"the command {name} is {value:g} at {data.time:.3f} s", value=name)
        for kind, warning in enumerate(data.warning):
            if warning.number:
                text = mujoco.mju_warningText(kind, warning.lastinfo)
                raise SimulationDiverged(f"MuJoCo warns at {data.time:.3f} s: {text}", value=mujoco.mjtWarning(kind))
        if not np.isfinite(data.qpos).all() or not np.isfinite(data.qvel).all():
            bad = np.flatnonzero(~np.isfinite(data.qvel))
            joints = sorted({self.model.joint(int(self.model.dof_jntid[dof])).name for dof in bad})
            raise SimulationDiverged(f"the state is not finite at {data.time:.3f} s; joints: {', '.join(joints)}")
        if not np.isfinite(data.act).all():
            raise SimulationDiverged(
                f"an activation (slip of a tyre, angle of a servo) is not finite at {data.time:.3f} s"
            )
        speed = data.sensordata[self._places.velocimeter]
        if not -FASTEST_MPS < speed < FASTEST_MPS:
            raise SimulationDiverged(f"the speed is {speed:g} m/s at {data.time:.3f} s")
        for name, live in zip(RawRows._fields, self._arrays_of(data), strict=False):
            if not np.isfinite(live).all():
                raise SimulationDiverged(f"what is recorded of {name} is not finite at {data.time:.3f} s", value=name)

    def raw_rows(self, count: int) -> RawRows:
        """Empty rows for `count` steps: `live_arrays`, one behind the other in one block, as `step` fills them."""
        live = self.live_arrays()
        ends = np.cumsum([array.size for array in live])
        block = np.empty((count, ends[-1]))
        return RawRows(*(block[:, end - array.size : end] for array, end in zip(live, ends, strict=True)))

    def present_row(self, command: DriverCommand, asked: ActuatorCommand) -> RawRows:
        """One row as `step` fills it, of the present instant with the inputs that are in force; nothing is changed.

        Args:
            command: What the driver last did.
            asked: What the controller last asked for.
        """
        now, commands = mujoco.MjData(self.model), np.empty_like(self._commands)
        mujoco.mj_copyData(now, self.model, self.data)
        mujoco.mj_forward(self.model, now)
        write_commands(commands.data, command, asked)
        return RawRows(
            *(
                array[np.newaxis]
                for array in (*self._arrays_of(now), commands, self._measured, self._brake_row, self._estimate)
            )
        )

    def live_arrays(self) -> tuple[NDArray[np.float64], ...]:
        """The engine's arrays, the last commands, what the sensors say, the brakes, in the order of `RawRows`."""
        return (*self._arrays_of(self.data), self._commands, self._measured, self._brake_row, self._estimate)

    def record_estimate(self, estimate: Estimate) -> None:
        """From now on what the controller estimates is recorded too.

        Args:
            estimate: What it estimates now.
        """
        self._estimate, self._estimates = np.array(estimate, np.float64), True
        native_step.record_from(self._plan, self.live_arrays())
        self.channels.add_estimate()

    @staticmethod
    def _arrays_of(data: mujoco.MjData) -> tuple[NDArray[np.float64], ...]:
        return (
            data.sensordata, data.userdata, data.ten_length, data.ten_velocity, data.act, data.actuator_force,
            data.ctrl,
        )  # fmt: skip

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
        hands, felt = self._places.steering_wheel, 1.0 - self.parameters.steering.assist_fraction
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
            native_step.read_through(self._plan, self._sensors)
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
