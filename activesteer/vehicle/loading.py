"""Build of the MuJoCo model of a car from MJCF and vehicle parameters."""

from __future__ import annotations

import copy
import math
from collections import deque
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import CORNERS, GRAVITY_MPS2, Array
from activesteer.errors import ModelError
from activesteer.road.native_path import PathGrid
from activesteer.road.road import LaidRoad, Road
from activesteer.road.surface import surface_of
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.curve_axles import curve_axle_records, fit_curve_axles
from activesteer.vehicle.electric_actuators import NAME, SPEED_STATE, fit_motor, motor_record
from activesteer.vehicle.force_block import find
from activesteer.vehicle.native_contact import cam_record
from activesteer.vehicle.parameters import CLUTCH_OPEN, VIBRATION_AT_MPS, Factors, Load, VehicleParameters
from activesteer.vehicle.statics import mass_properties, point_mass_inertia
from activesteer.vehicle.toe_links import fit_screws, screw_records

_AXLES: Final = (CORNERS[:2], CORNERS[2:])
_BOOT_M: Final = (0.0, 0.0, 0.6)
_TANK_M: Final = (0.4, 0.0, 0.35)
"""Default position of payload and fuel, relative to the road below the middle of the rear axle, vehicle axes [m]."""


def apply_load(spec: mujoco.MjSpec, parameters: VehicleParameters) -> None:
    """Add the masses of a load as points fixed to the chassis, and move the site `cg`; no change without a load."""
    chassis = spec.body("chassis")
    if chassis is None:
        raise ModelError("there is no body 'chassis'", value="chassis")
    load, factors = parameters.load, parameters.factors
    if load == Load() and factors == Factors():
        return
    bare = spec.compile()
    _scale_springs(spec, bare, factors)
    body = bare.body("chassis")
    before = mass_properties(bare)
    fraction = before.mass_kg / float(body.mass[0])
    scale = 1.0 + (factors.mass - 1.0) * fraction
    if scale <= 0.0:
        minimum = 1.0 - 1.0 / fraction
        raise ModelError(
            f"{factors.mass:g} leaves no mass for the chassis; more than {minimum:.2f} is needed",
            key="factors.mass",
            value=factors.mass,
        )
    mass = scale * float(body.mass[0])
    # The shift is that of the whole empty car's centre of gravity; only the chassis' is moved.
    move_m = np.array([load.cg_forward_change_m, 0.0, load.cg_height_change_m])
    cg = body.ipos + move_m * factors.mass * before.mass_kg / mass
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, body.iquat)
    axes = axes.reshape(3, 3)
    inertia = scale * axes @ np.diag(body.inertia) @ axes.T
    spread = (factors.yaw_inertia - 1.0) * factors.mass * before.inertia_kgm2[2, 2]
    inertia += np.diag([0.0, spread, spread])
    points = [*_points(bare, load), (mass, cg)]
    total = sum(weight for weight, _ in points)
    middle = sum(weight * place for weight, place in points) / total
    inertia = inertia + sum(weight * point_mass_inertia(place - middle) for weight, place in points)
    chassis.mass, chassis.ipos, chassis.iquat, chassis.inertia = total, middle, (1.0, 0.0, 0.0, 0.0), np.zeros(3)
    chassis.fullinertia = inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
    moved = mass_properties(spec.compile()).cg_m - before.cg_m
    site = spec.site("cg")
    if site is not None:
        site.pos = site.pos + moved


def _points(bare: mujoco.MjModel, load: Load) -> list[tuple[float, Array]]:
    """Return mass and position of each load on the car, in vehicle axes [kg], [m]."""
    data = mujoco.MjData(bare)
    mujoco.mj_kinematics(bare, data)
    front, rear = (data.xpos[[bare.body(f"{corner}_wheel").id for corner in pair], 0].mean() for pair in _AXLES)
    below = np.array([rear, 0.0, 0.0])
    boot = below + _BOOT_M if load.payload_position_m is None else np.array(load.payload_position_m)
    boot = boot + np.array([load.payload_forward_change_m, 0.0, 0.0])
    tank = below + _TANK_M if load.fuel_position_m is None else np.array(load.fuel_position_m)
    roof = np.array([0.5 * (front + rear), 0.0, load.roof_height_m])
    return [(load.payload_kg, boot), (load.fuel_kg, tank), (load.roof_kg, roof)]


def _scale_springs(spec: mujoco.MjSpec, bare: mujoco.MjModel, factors: Factors) -> None:
    """Scale springs and anti-roll bars, and keep the spring forces in the design position."""
    for tendon in spec.tendons:
        if tendon.name.endswith("_anti_roll_bar"):
            tendon.stiffness = factors.anti_roll_bar * np.asarray(tendon.stiffness)
        elif tendon.name.endswith("_spring") and factors.spring_rate != 1.0:
            design_m = float(bare.tendon_length0[bare.tendon(tendon.name).id])
            # The curve is compressed along x: G(x) = F(f x) has at x0 / f the force of F at x0, and f times the rate.
            free_m = design_m - (design_m - float(tendon.springlength[0])) / factors.spring_rate
            tendon.stiffness = factors.spring_rate ** np.arange(1, 4) * np.asarray(tendon.stiffness)
            tendon.springlength = [free_m, free_m]


_USER_DYNAMICS: Final = int(mujoco.mjtDyn.mjDYN_USER)
SLIP_RATES: Final = {
    "slip_x": "deflection_x_rate_mps",
    "slip_y": "deflection_y_rate_mps",
    "slip_z": "deflection_z_rate_radps",
}
"""Output that holds the rate of each relaxation state of a tyre, by the suffix of its actuator."""


_compiled: deque[tuple[tuple[Any, ...], mujoco.MjModel]] = deque(maxlen=4)
"""Cars compiled last, by everything that they were compiled from: a car is often driven several times."""


def load_model(
    mjcf: Path,
    parameters: VehicleParameters,
    tyres: tuple[TyreParameters, TyreParameters],
    road: Road,
    timestep_s: float,
    content: Mapping[str, bytes] | None = None,
) -> mujoco.MjModel:
    """Compile a car, or copy a recently compiled one."""
    if not content:
        return _compile(mjcf, parameters, tyres, road, timestep_s)
    # Controllers and their single-track model are in the vehicle file, but are not part of the car.
    physical = [getattr(parameters, field.name) for field in fields(VehicleParameters)]
    made_from = (mjcf, dict(content), physical, tyres, road, timestep_s)
    for known, model in _compiled:
        if known == made_from:
            return copy.copy(model)
    model = _compile(mjcf, parameters, tyres, road, timestep_s)
    _compiled.append((made_from, copy.copy(model)))
    return model


def _compile(
    mjcf: Path,
    parameters: VehicleParameters,
    tyres: tuple[TyreParameters, TyreParameters],
    road: Road,
    timestep_s: float,
) -> mujoco.MjModel:
    try:
        spec = mujoco.MjSpec.from_file(str(mjcf))
        spec.option.timestep = timestep_s
        angle, bank = math.atan(road.grade), road.bank_rad
        across = -GRAVITY_MPS2 * math.cos(angle) * math.sin(bank) if bank else 0.0
        down = -GRAVITY_MPS2 * math.cos(angle) * math.cos(bank)
        spec.option.gravity = [-GRAVITY_MPS2 * math.sin(angle), across, down]
        # A state that is not finite must end the run; by default the engine would restart from its reference position.
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        # `integrator` makes damping implicit; the step must not be damped a second time.
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
        spec.nuserdata = len(CORNERS) * (fb.USERDATA_PER_WHEEL + 1) + 1
        if parameters.rear_actuator.has_motor:
            fit_screws(spec, parameters.rear_actuator.resolved())
        if parameters.superposition_actuator.has_motor:
            fit_motor(spec)
        if parameters.curves.front or parameters.curves.rear:
            fit_curve_axles(spec, parameters.curves)
        _fit_actuators(spec, parameters)
        for corner in CORNERS:
            if inertia_kgm2 := parameters.motors.inertia_kgm2(corner):
                spec.joint(f"{corner}_spin").armature += inertia_kgm2
        apply_load(spec, parameters)
        block = _force_block(spec.compile(), parameters, tyres, road)
        start = sum(len(numeric.data) for numeric in spec.numerics)
        spec.add_numeric(name=fb.BLOCK_NAME, size=block.size + fb.TRAILER_SIZE, data=fb.with_trailer(block, start))
        return spec.compile()
    except ValueError as reason:
        raise ModelError(str(reason)) from reason


def _fit_actuators(spec: mujoco.MjSpec, parameters: VehicleParameters) -> None:
    """Set up the actuators, whose new activation acts within the same step."""
    for actuator in spec.actuators:
        if actuator.name.endswith("_drive"):
            actuator.dyntype = mujoco.mjtDyn.mjDYN_USER
        actuator.actearly = int(actuator.dyntype) == _USER_DYNAMICS
        if actuator.name == NAME or actuator.name.endswith("_steer"):
            actuator.dynprm[0] *= parameters.factors.servo_lag
        if actuator.name.endswith("_brake"):
            actuator.gainprm[0] = -parameters.brakes.stiffness_Nmprad
        if actuator.name.endswith("_friction"):
            force, stiffness = _friction(actuator.name, parameters)
            actuator.gainprm[0] = -stiffness if force > 0.0 else 0.0


def _friction(actuator: str, parameters: VehicleParameters) -> tuple[float, float]:
    """Return force [N] and stiffness [N/m] of a dry friction actuator."""
    friction = parameters.friction
    if actuator == "rack_friction":
        return friction.rack_N, friction.rack_stiffness_Npm
    force = friction.front_damper_N if actuator.startswith("f") else friction.rear_damper_N
    return force, friction.damper_stiffness_Npm


def chain_to(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the degrees of freedom between the world and a body, nearest to the body first."""
    while model.body_dofnum[body] == 0:
        body = int(model.body_parentid[body])
        if body == 0:
            return []
    dof = int(model.body_dofadr[body] + model.body_dofnum[body] - 1)
    chain = []
    while dof >= 0:
        chain.append(dof)
        dof = int(model.dof_parentid[dof])
    return chain


def _force_block(
    model: mujoco.MjModel,
    parameters: VehicleParameters,
    tyres: tuple[TyreParameters, TyreParameters],
    road: Road,
) -> NDArray[np.float64]:
    chassis = find(model, mujoco.mjtObj.mjOBJ_BODY, "chassis")
    aero, powertrain = parameters.aerodynamics, parameters.powertrain
    share = parameters.engine_share
    header = fb.new_header(model, chassis, chain_to(model, chassis))
    header["drag_Ns2pm2"] = 0.5 * aero.air_density_kgpm3 * aero.drag_area_m2
    header["aero_point_m"] = _triple(aero.pressure_point_m)
    header["engine_torque_Nm"] = (share or 1.0) * powertrain.max_torque_Nm
    header["engine_power_W"] = (share or 1.0) * powertrain.max_power_W
    header["engine_limit_radps"] = powertrain.max_wheel_speed_radps
    header["engine_drag_Nm"], header["gear"] = share * powertrain.engine_brake_torque_Nm, CLUTCH_OPEN
    header["screw_sensors"], header["n_screw_sensors"] = fb.sensor_range(model)
    for name in ("rack_friction", *(f"{corner}_damper_friction" for corner in CORNERS)):
        if _friction(name, parameters)[0] > 0.0:
            # Friction in the vehicle file must not get lost because the model has no actuator for it.
            find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
    mounted = {corner: _tyre(corner, tyres) for corner in CORNERS}
    sections: dict[str, list[NDArray[Any]]] = {
        "wheels": [_wheel(model, corner, parameters, tyre, road) for corner, tyre in mounted.items()],
        "tyres": [np.atleast_1d(tyre.record) for tyre in mounted.values()],
        "dampers": [_damper(model, corner, parameters) for corner in CORNERS],
        "areas": [np.array([area], fb.AREA) for area in road.areas()],
    }
    if isinstance(road, LaidRoad):
        grid = PathGrid.of(road.path)
        sections["path_points"], sections["path_cells"] = [grid.points], [grid.cells]
        sections["path_grids"] = [np.array([grid[:6]], fb.PATH_GRID)]
    if road.is_uneven:
        surface = surface_of(road)
        pressures = [float(wheel["pressure_Pa"][0]) for wheel in sections["wheels"]]
        sections["surfaces"], sections["obstacles"] = [surface.head], [surface.obstacles]
        sections["heights"] = [surface.numbers]
        sections["cams"] = [cam_record(tyre, at) for tyre, at in zip(mounted.values(), pressures, strict=True)]
    if parameters.curves.front or parameters.curves.rear:
        sections["curve_axle_wheels"], sections["curves"] = curve_axle_records(model, parameters.curves)
    places: dict[str, tuple[float, int]] = {}
    if parameters.rear_actuator.has_motor:
        resolved = parameters.rear_actuator.resolved()
        sections["links"], sections["screws"], places = screw_records(model, resolved)
    if parameters.superposition_actuator.has_motor:
        motors = sections.setdefault("screws", [])
        places |= {NAME: (fb.KIND_SCREW, len(motors)), NAME + SPEED_STATE: (fb.KIND_MOTOR, len(motors))}
        motors.append(motor_record(model, parameters.superposition_actuator.resolved()))
    sections["actuators"] = [_actuator(model, index, parameters, places) for index in range(model.nu)]
    return fb.pack(header, sections)


def _triple(values: tuple[float, ...]) -> tuple[float, float, float]:
    if len(values) != 3:
        raise ModelError(
            f"{len(values)} numbers given; 3 are needed", key="aerodynamics.pressure_point_m", value=values
        )
    return values[0], values[1], values[2]


def _tyre(corner: str, tyres: tuple[TyreParameters, TyreParameters]) -> TyreParameters:
    return tyres[0 if corner.startswith("f") else 1].mounted_on("LEFT" if corner.endswith("l") else "RIGHT")


def _wheel(
    model: mujoco.MjModel, corner: str, parameters: VehicleParameters, tyre: TyreParameters, road: Road
) -> NDArray[Any]:
    body = find(model, mujoco.mjtObj.mjOBJ_BODY, f"{corner}_wheel")
    chain = chain_to(model, body)
    if len(chain) > fb.MAX_CHAIN:
        raise ModelError(
            f"{corner}_wheel: {len(chain)} degrees of freedom above the wheel; at most {fb.MAX_CHAIN} are supported"
        )
    fitment = parameters.tyres
    pressure = fitment.front_pressure_Pa if corner.startswith("f") else fitment.rear_pressure_Pa
    return fb.filled(
        fb.WHEEL,
        body=body,
        root=int(model.body_rootid[body]),
        act_x=_activation(model, f"{corner}_slip_x"),
        act_y=_activation(model, f"{corner}_slip_y"),
        act_z=_activation(model, f"{corner}_slip_z"),
        mu=road.mu,
        pressure_Pa=pressure if pressure is not None else tyre["INFLPRES"],
        low_speed_mps=fitment.low_speed_mps,
        low_speed_damping_Nspm=fitment.low_speed_damping_Nspm,
        spin_dof=int(model.jnt_dofadr[find(model, mujoco.mjtObj.mjOBJ_JOINT, f"{corner}_spin")]),
        drive_fraction=parameters.engine_fractions[CORNERS.index(corner)],
        chain_length=len(chain),
        chain=chain,
    )


def _activation(model: mujoco.MjModel, actuator: str) -> int:
    index = find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator)
    address = int(model.actuator_actadr[index])
    if address < 0:
        raise ModelError(f'actuator {actuator!r} has no activation; it needs dyntype="user"')
    return address


def _damper(model: mujoco.MjModel, corner: str, parameters: VehicleParameters) -> NDArray[Any]:
    curve = parameters.dampers.front if corner.startswith("f") else parameters.dampers.rear
    tendon = find(model, mujoco.mjtObj.mjOBJ_TENDON, f"{corner}_damper")
    row, length = int(model.ten_J_rowadr[tendon]), int(model.ten_J_rownnz[tendon])
    return fb.filled(
        fb.DAMPER,
        tendon=tendon,
        row=row,
        length=length,
        points=len(curve.velocity_mps),
        chain=model.ten_J_colind[row : row + length],
        velocity_mps=curve.velocity_mps,
        force_N=[parameters.factors.damper * force for force in curve.force_N],
    )


def _actuator(
    model: mujoco.MjModel, index: int, parameters: VehicleParameters, places: Mapping[str, tuple[float, int]]
) -> NDArray[Any]:
    """Return the record of one actuator for the activation callback."""
    if int(model.actuator_dyntype[index]) != _USER_DYNAMICS:
        return fb.filled(fb.ACTUATOR, kind=fb.KIND_NONE, **fb.IN_ORDER)
    name, act = model.actuator(index).name, model.actuator_actadr[index]
    if name in places:
        kind, place = places[name]
        low, high = model.actuator_ctrlrange[index]
        return fb.filled(fb.ACTUATOR, kind=kind, act=act, record=place, low=low, high=high, **fb.IN_ORDER)
    return fb.filled(fb.ACTUATOR, act=act, **fb.IN_ORDER, **_dynamics(model, index, name, parameters))


def _dynamics(model: mujoco.MjModel, index: int, name: str, parameters: VehicleParameters) -> dict[str, float]:
    """Return the kind of an actuator, and the fields of its record."""
    corner, _, state = name.partition("_")
    if state in SLIP_RATES:
        return {"kind": fb.KIND_SLIP, "userdata": fb.output_slot(CORNERS.index(corner), SLIP_RATES[state])}
    if state == "drive":
        fraction = parameters.engine_fractions[CORNERS.index(corner)]
        motor, lag_s = float(parameters.motors.at(corner) is not None), parameters.powertrain.lag_s
        return {"kind": fb.KIND_DRIVE, "drive_fraction": fraction, "lag_s": lag_s, "motor": motor}
    if name.endswith("_brake"):
        brakes = parameters.brakes
        rear_Nm = max(brakes.rear_torque_Nm, brakes.parking_torque_Nm)
        low, high = brakes.drag_torque_Nm, brakes.front_torque_Nm if corner.startswith("f") else rear_Nm
        dof = int(model.jnt_dofadr[int(model.actuator_trnid[index, 0])])
        return {"kind": fb.KIND_BRAKE, "stiffness": brakes.stiffness_Nmprad, "dof": dof, "low": low, "high": high}
    if name.endswith("_friction"):
        return _dry_friction(model, index, name, parameters)
    lag, rate = (float(value) for value in model.actuator_dynprm[index, :2])
    if lag <= 0.0 or rate <= 0.0:
        raise ModelError(
            f"actuator {name!r}: dynprm is {lag:g} {rate:g}; a lag [s] and a rate limit [rad/s] above 0 are needed",
            value=name,
        )
    low, high = model.actuator_ctrlrange[index]
    return {"kind": fb.KIND_SERVO, "lag_s": lag, "rate_limit": rate, "low": low, "high": high}


def _dry_friction(model: mujoco.MjModel, index: int, name: str, parameters: VehicleParameters) -> dict[str, float]:
    force, stiffness = _friction(name, parameters)
    part = int(model.actuator_trnid[index, 0])
    fields = {"kind": fb.KIND_FRICTION, "wound_limit": force / stiffness}
    if int(model.actuator_trntype[index]) == mujoco.mjtTrn.mjTRN_TENDON:
        vibration = parameters.friction.vibration_mps / math.sqrt(VIBRATION_AT_MPS)
        return fields | {"tendon": part, "dof": -1.0, "vibration": vibration}
    # Vertical vibration of the wheels hardly moves the rack.
    return fields | {"tendon": -1.0, "dof": int(model.jnt_dofadr[part])}
