"""A tyre on a test rig in the engine.

The wheel hangs on joints with imposed positions and velocities: three slides, heading, inclination, spin. The tyre is
the compiled callback of the car. The rig computes its force on the wheel from the generalised passive forces by the
Jacobian of the engine, so that the measurement includes frames, signs and the transfer of the forces to the joints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import get_lapack_funcs

from activesteer.errors import ParameterError
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.kernels.vertical import effective_rolling_radius
from activesteer.tyre.tyre_parameters import Side, TyreParameters
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.loading import SLIP_RATES, chain_to
from activesteer.vehicle.native_forces import install_native_forces
from activesteer.vehicle.parameters import TyreFitment

Vector = NDArray[np.float64]
_SOLVE: Final[Any] = get_lapack_funcs("gesv")
"""Solution of linear equations; for six of them, `numpy.linalg.solve` takes five times as long."""


@dataclass(frozen=True)
class Motion:
    """Imposed position and orientation of the wheel, and their rates."""

    centre_height_m: float
    """Height of the wheel centre above the road."""
    velocity_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Velocity of the wheel centre, world frame."""
    spin_radps: float = 0.0
    """Rotation about the axis relative to the carrier, positive rolling forward."""
    heading_rad: float = 0.0
    """Angle of the wheel's heading about the world's z axis, from x."""
    inclination_rad: float = 0.0
    """Rotation of the wheel plane about its heading; positive leans the top to the right."""
    heading_rate_radps: float = 0.0
    """Rate of the heading."""
    inclination_rate_radps: float = 0.0
    """Rate of the inclination."""


@dataclass(frozen=True)
class RigForces:
    """Force of the road on the wheel, read from the engine, and its contact point.

    `force_N` and `moment_Nm` are in the world frame, the moment about the contact point; shape (3,), or (n, 3) for n
    operating points. The other members have the shape (n,).
    """

    force_N: Vector
    moment_Nm: Vector
    contact_point_m: Vector
    heading_rad: Vector
    loaded_radius_m: Vector
    spin_radps: Vector
    deflection_x_m: Vector
    """Relaxation state along the heading."""
    deflection_y_m: Vector
    """Relaxation state across the heading."""
    limited: Vector
    """1 if the tyre was outside the range of validity of its file."""


def turned(vectors: Vector, angle_rad: Vector) -> Vector:
    """Return vectors, shape (..., 3), turned about z."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=-1)


def stacked(forces: list[RigForces]) -> RigForces:
    """Return several operating points as one record of arrays."""
    names = RigForces.__dataclass_fields__
    return RigForces(**{name: np.stack([getattr(one, name) for one in forces]) for name in names})


_MJCF: Final = """
<mujoco model="tyre rig">
  <compiler angle="radian"/>
  <option integrator="discrete" gravity="0 0 0" jacobian="dense"/>
  <worldbody>
    <body name="carrier">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <joint name="heading" axis="0 0 1"/>
      <joint name="inclination" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <body name="wheel">
        <joint name="spin" axis="0 1 0"/>
        <inertial pos="0 0 0" mass="20" diaginertia="0.6 1 0.6"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <general name="slip_x" joint="spin" dyntype="user" gaintype="fixed" gainprm="0" biastype="none"/>
    <general name="slip_y" joint="spin" dyntype="user" gaintype="fixed" gainprm="0" biastype="none"/>
    <general name="slip_z" joint="spin" dyntype="user" gaintype="fixed" gainprm="0" biastype="none"/>
  </actuator>
</mujoco>
"""


def compile_rig(
    tyre: TyreParameters,
    mu: float,
    pressure_Pa: float,
    low_speed_mps: float,
    low_speed_damping_Nspm: float,
    timestep_s: float,
) -> mujoco.MjModel:
    """Compile the model of the rig, with its block for the native callbacks."""
    spec = mujoco.MjSpec.from_string(_MJCF)
    spec.option.timestep = timestep_s
    spec.nuserdata = fb.USERDATA_PER_WHEEL
    model = spec.compile()
    wheel = model.body("wheel").id
    carrier = model.body("carrier").id
    chain = chain_to(model, wheel)
    states = [int(address) for address in model.actuator_actadr]
    mounted = fb.filled(
        fb.WHEEL,
        body=wheel,
        root=int(model.body_rootid[wheel]),
        act_x=states[0],
        act_y=states[1],
        act_z=states[2],
        mu=mu,
        pressure_Pa=pressure_Pa,
        low_speed_mps=low_speed_mps,
        low_speed_damping_Nspm=low_speed_damping_Nspm,
        chain_length=len(chain),
        chain=chain,
    )
    actuators = [
        fb.filled(fb.ACTUATOR, kind=fb.KIND_SLIP, act=address, userdata=fb.output_slot(0, rate), **fb.IN_ORDER)
        for address, rate in zip(states, SLIP_RATES.values(), strict=True)
    ]
    sections = {"wheels": [mounted], "tyres": [np.atleast_1d(tyre.record)], "actuators": actuators}
    array = fb.pack(fb.new_header(model, carrier, []), sections)
    spec.add_numeric(name=fb.BLOCK_NAME, size=array.size + fb.TRAILER_SIZE, data=fb.with_trailer(array, 0))
    return spec.compile()


_PLACE_M: Final = (12.0, -7.0)
"""Contact point on the road: away from the origin, so that a lever arm about the wrong point shows."""
_SPIN_ANGLE_RAD: Final = 0.7
"""Angle of the wheel about its axis: not zero, so that a force in the spinning frame shows."""
_LOAD_TOLERANCE: Final = 1e-10
_RATE_TOLERANCE_MPS: Final = 1e-9
"""Tolerated rate of the relaxation states: at 3 m/s and 0.5 m of relaxation length a slip of 2e-10."""
_MAX_STEPS: Final = 30
_LOWERING_M: Final = 0.005


class TyreRig:
    """One wheel on a plane road.

    Attributes:
        formula: `MagicFormula` of the tyre, mounted on the rig's side.
        mu: Friction of the road relative to that of the tyre file.
        pressure_Pa: Inflation pressure [Pa].
        timestep_s: Step of the engine [s].
    """

    def __init__(
        self,
        tyre: TyreParameters,
        side: Side = "LEFT",
        mu: float = 1.0,
        pressure_Pa: float | None = None,
        *,
        low_speed_mps: float = TyreFitment.low_speed_mps,
        low_speed_damping_Nspm: float = TyreFitment.low_speed_damping_Nspm,
        timestep_s: float = 0.001,
    ) -> None:
        """Compile the rig and install the native forces.

        Args:
            tyre: Tyre file.
            side: Side of the vehicle on which the tyre is mounted.
            mu: Friction of the road relative to that of the tyre file, > 0.
            pressure_Pa: Inflation pressure [Pa]; None for the pressure of the file.
            low_speed_mps: Speed below which the standstill model fades in [m/s], > 0.
            low_speed_damping_Nspm: Viscous coefficient of the contact patch at rest [N s/m], >= 0.
            timestep_s: Step of the engine [s], > 0.

        Raises:
            ParameterError: an argument is outside its range.
            ModelError: another part of the program uses MuJoCo's callbacks.
        """
        pressure = tyre["INFLPRES"] if pressure_Pa is None else pressure_Pa
        positive = {"mu": mu, "pressure_Pa": pressure, "low_speed_mps": low_speed_mps, "timestep_s": timestep_s}
        for name, value in positive.items():
            if not 0.0 < value < math.inf:
                raise ParameterError(f"is {value:g}, must be finite and greater than 0", key=name, value=value)
        if not 0.0 <= low_speed_damping_Nspm < math.inf:
            raise ParameterError(
                f"is {low_speed_damping_Nspm:g}, must be finite and not negative",
                key="low_speed_damping_Nspm",
                value=low_speed_damping_Nspm,
            )
        mounted = tyre.mounted_on(side)
        self.formula = MagicFormula(mounted)
        self.mu, self.pressure_Pa, self.timestep_s = mu, pressure, timestep_s
        install_native_forces()
        self._model = model = compile_rig(mounted, mu, pressure, low_speed_mps, low_speed_damping_Nspm, timestep_s)
        self._data = mujoco.MjData(model)
        self._wheel = model.body("wheel").id
        self._jacobian = np.zeros((6, model.nv))
        self.reset()

    def reset(self) -> None:
        """Reset to an unstressed tyre, with the wheel at the contact point."""
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:2] = _PLACE_M
        self._data.qpos[5] = _SPIN_ANGLE_RAD

    def advance(self, motion: Motion) -> RigForces:
        """Return the forces for the present deflection of the tyre, then advance the deflection by one step.

        Args:
            motion: Imposed motion of the wheel at this instant.
        """
        self._impose(motion)
        deflections = self._data.act.copy()
        # The step moves the wheel too, but the next call imposes the relevant motion again: the road is plane.
        # Positions, motion axes and passive forces stay those at the beginning of the step, and can be read afterwards.
        mujoco.mj_step(self._model, self._data)
        return self._read(motion, deflections)

    def steady(
        self,
        slip_angle_rad: float,
        slip_ratio: float,
        inclination_rad: float,
        load_N: float,
        speed_mps: float,
        heading_rad: float = 0.0,
    ) -> RigForces:
        """Return the forces of a tyre that rolls steadily at an operating point.

        A search in the engine finds height and relaxation states at which the tyre carries the load and the states are
        at rest. The spin follows from the slip and the rolling radius of the formula.

        Args:
            slip_angle_rad: Slip angle for the absolute value of the speed [rad], ISO-W: for a positive angle the
                contact point moves to the left of the heading, and the force is to the right.
            slip_ratio: Longitudinal slip; positive slip drives, also in reverse, against the sliding of the patch.
            inclination_rad: Camber [rad], positive with the top to the right.
            load_N: Vertical load [N], > 0.
            speed_mps: Speed along the heading [m/s], negative in reverse, not 0.
            heading_rad: Heading in the world [rad].

        Raises:
            ParameterError: the load is not positive, the speed is zero, or there is no such steady state.
        """
        if not load_N > 0.0:
            raise ParameterError(f"is {load_N:g}, must be greater than 0", key="load_N", value=load_N)
        if speed_mps == 0.0:
            raise ParameterError(
                "is 0, but steady rolling needs a speed; use advance() at rest", key="speed_mps", value=speed_mps
            )
        expected = self.formula.evaluate(
            load_N, slip_ratio, slip_angle_rad, inclination_rad, self.pressure_Pa, speed_mps, road_friction=self.mu
        )
        spin = self._spin(load_N, slip_ratio, speed_mps)
        cos, sin = math.cos(heading_rad), math.sin(heading_rad)
        across = abs(speed_mps) * math.tan(slip_angle_rad)

        def motion(height: float) -> Motion:
            return Motion(
                height,
                (cos * speed_mps - sin * across, sin * speed_mps + cos * across, 0.0),
                spin,
                heading_rad,
                inclination_rad,
            )

        height = float(expected.loaded_radius_m) * math.cos(inclination_rad)
        # Start of the search; it ends where the rates of the engine vanish.
        unknown: Vector = np.array(
            [
                height,
                slip_ratio * float(expected.relaxation_length_x_m),
                math.tan(slip_angle_rad) * float(expected.relaxation_length_y_m),
            ]
        )
        residual = self._residual(motion(unknown[0]), unknown, load_N)
        scale = np.array([_LOAD_TOLERANCE * load_N, _RATE_TOLERANCE_MPS, _RATE_TOLERANCE_MPS])
        for _ in range(_MAX_STEPS):
            if (np.abs(residual) <= scale).all():
                return self._read(motion(unknown[0]), unknown[1:])
            if residual[0] <= -load_N:
                # Lifted: here the tyre does not depend on the height.
                unknown[0] -= _LOWERING_M
                residual = self._residual(motion(unknown[0]), unknown, load_N)
                continue
            slopes = np.empty((3, 3))
            for index in range(3):
                step = 1e-7
                moved = unknown.copy()
                moved[index] += step
                slopes[:, index] = (self._residual(motion(moved[0]), moved, load_N) - residual) / step
            try:
                unknown -= np.linalg.solve(slopes, residual)
            except np.linalg.LinAlgError:
                break
            if not unknown[0] > 0.0:
                # The rim would be below the road.
                break
            residual = self._residual(motion(unknown[0]), unknown, load_N)
        raise ParameterError(
            f"tyre rig: no steady state at load {load_N:g} N, slip ratio {slip_ratio:g}, slip angle "
            f"{slip_angle_rad:g} rad, inclination {inclination_rad:g} rad, speed {speed_mps:g} m/s; "
            f"at a height of {unknown[0]:.3g} m the load differs by {residual[0]:.3g} N, and deflections change by "
            f"{residual[1]:.3g} and {residual[2]:.3g} m/s"
        )

    def sweep(
        self,
        slip_angle_rad: ArrayLike,
        slip_ratio: ArrayLike,
        inclination_rad: ArrayLike,
        load_N: ArrayLike,
        speed_mps: ArrayLike,
        heading_rad: ArrayLike = 0.0,
    ) -> RigForces:
        """Return `steady` at every point of arrays, which broadcast to shape (n,).

        Raises:
            ParameterError: the shapes do not broadcast to one dimension, or a point has no steady state.
        """
        given = (slip_angle_rad, slip_ratio, inclination_rad, load_N, speed_mps, heading_rad)
        try:
            points = np.broadcast_arrays(*(np.atleast_1d(np.asarray(value, dtype=np.float64)) for value in given))
        except ValueError as error:
            raise ParameterError(f"tyre rig: {error}") from error
        if points[0].ndim != 1:
            raise ParameterError(
                f"tyre rig: the points have {points[0].ndim} dimensions; one is needed", value=points[0].ndim
            )
        return stacked([self.steady(*point) for point in zip(*(array.tolist() for array in points), strict=True)])

    def transient(
        self,
        time_s: ArrayLike,
        velocity_mps: ArrayLike,
        spin_radps: ArrayLike,
        centre_height_m: ArrayLike,
        heading_rad: ArrayLike = 0.0,
        inclination_rad: ArrayLike = 0.0,
    ) -> RigForces:
        """Return the forces over time for an imposed motion, from the present deflection.

        Args:
            time_s: Instants [s], shape (n,), at the rig's time step.
            velocity_mps: Velocity of the wheel centre in the plane of the road, along and across the wheel's heading
                (x forward, y left) [m/s], shape (2,) or (n, 2).
            spin_radps: Spin [rad/s], a number or shape (n,), like the following arguments.
            centre_height_m: Height of the wheel centre [m]. The rates of height, heading and inclination are their
                differences.
            heading_rad: Heading [rad].
            inclination_rad: Inclination [rad].

        Raises:
            ParameterError: the instants are not at the rig's time step, or a shape does not fit.
        """
        time = np.asarray(time_s, dtype=np.float64)
        if time.ndim != 1 or len(time) < 2 or not np.allclose(np.diff(time), self.timestep_s, rtol=1e-6, atol=0.0):
            raise ParameterError(f"must have one dimension and steps of {self.timestep_s:g} s", key="time_s")
        try:
            velocity = np.broadcast_to(np.asarray(velocity_mps, dtype=np.float64), (len(time), 2))
            spin, height, heading, tilt = (
                np.broadcast_to(np.asarray(value, dtype=np.float64), time.shape)
                for value in (spin_radps, centre_height_m, heading_rad, inclination_rad)
            )
        except ValueError as error:
            raise ParameterError(f"tyre rig: {error}") from error
        height_rate, heading_rate, tilt_rate = (np.gradient(value, time) for value in (height, heading, tilt))
        plane = turned(np.column_stack([velocity, height_rate]), heading)
        columns = (height, plane, spin, heading, tilt, heading_rate, tilt_rate)
        return stacked([self.advance(Motion(*row)) for row in zip(*columns, strict=True)])

    def _spin(self, load_N: float, slip_ratio: float, speed_mps: float) -> float:
        """Return the spin at a slip ratio. The rolling radius grows with the spin [rad/s]."""
        tyre = self.formula.parameters.record
        spin = 0.0
        for _ in range(_MAX_STEPS):
            radius = effective_rolling_radius(tyre, load_N, spin, self.pressure_Pa)
            spin = (speed_mps + slip_ratio * abs(speed_mps)) / radius
        return spin

    def _impose(self, motion: Motion) -> None:
        data = self._data
        data.qpos[2] = motion.centre_height_m
        data.qpos[3] = motion.heading_rad
        data.qpos[4] = motion.inclination_rad
        data.qvel[:3] = motion.velocity_mps
        data.qvel[3] = motion.heading_rate_radps
        data.qvel[4] = motion.inclination_rate_radps
        data.qvel[5] = motion.spin_radps

    def _residual(self, motion: Motion, unknown: Vector, load_N: float) -> Vector:
        """Return missing load [N] and deflection rates along and across [m/s]. A steady wheel is not twisted."""
        self._impose(motion)
        self._data.act[:] = (unknown[1], unknown[2], 0.0)
        mujoco.mj_forward(self._model, self._data)
        return np.array([self._wrench(self._contact_point())[2] - load_N, *self._data.act_dot[:2]])

    def _contact_point(self) -> Vector:
        """Return the point below the wheel centre in the wheel plane, on the road, world frame [m]."""
        x, y, z = self._data.xmat[self._wheel, 1::3]
        # Component of the vertical in the wheel plane.
        up = np.array([-z * x, -z * y, 1.0 - z * z])
        centre = self._data.xpos[self._wheel]
        return centre - up * (centre[2] / up[2])

    def _wrench(self, point: Vector) -> Vector:
        """Return the force [N] and the moment about a point [Nm] of the passive forces, world frame."""
        model, data, jacobian = self._model, self._data, self._jacobian
        mujoco.mj_jac(model, data, jacobian[:3], jacobian[3:], point, self._wheel)
        *_, wrench, singular = _SOLVE(jacobian.T, data.qfrc_passive)
        if singular:
            raise ParameterError("a wheel that lies flat has no contact point: two axes of the rig coincide")
        return wrench

    def _read(self, motion: Motion, deflections_m: Vector) -> RigForces:
        point = self._contact_point()
        wrench = self._wrench(point)
        return RigForces(
            wrench[:3],
            wrench[3:],
            point,
            np.array(motion.heading_rad),
            np.array(math.dist(self._data.xpos[self._wheel], point)),
            np.array(motion.spin_radps),
            np.array(deflections_m[0]),
            np.array(deflections_m[1]),
            np.array(fb.wheel_outputs(self._data, 1)["limited"][0]),
        )
