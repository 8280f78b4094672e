"""The native callbacks: passive forces of tyres, dampers, drag and curve axles, and actuator dynamics.

Compiled once by numba, cached on disk, called by the engine without any Python. They are pure functions of the state:
their output in `userdata` is scratch for the recorder, written anew at every evaluation. Models without our block are
left alone.

Forces reach the joints by the transposed Jacobian: for every degree of freedom between the world and the body, the
scalar product of its motion axis (`cdof`, about the centre of mass of the tree) with the wrench about the same point.
"""

from __future__ import annotations

import contextlib
import math
import threading
from collections.abc import Iterator
from typing import Any, Final

import mujoco
from numba import carray, config, types

from activesteer.errors import ModelError
from activesteer.native.compilation import compiled_callback, inlined, inlined_by_llvm
from activesteer.native.memory import array_at, f64_pointer, records_at, word
from activesteer.road.native_path import along_path
from activesteer.road.obstacles import OBSTACLE
from activesteer.road.surface import SURFACE, left_grid
from activesteer.tyre.kernels.contact import tyre_on_road
from activesteer.tyre.tyre_parameters import TYRE_RECORD
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.curve_axles import add_curve_axle_forces
from activesteer.vehicle.force_block import EngineLayout, engine_layout
from activesteer.vehicle.native_actuators import brake_rate, drive_rate, dry_friction_rate, screw_rate, servo_rate
from activesteer.vehicle.native_contact import CAM, contact_plane, plane_axes, spin_on_bend

_MARKER: Final = fb.MARKER
_headers_at: Final = records_at(fb.HEADER)
_wheels_at: Final = records_at(fb.WHEEL)
_tyres_at: Final = records_at(TYRE_RECORD)
_dampers_at: Final = records_at(fb.DAMPER)
_actuators_at: Final = records_at(fb.ACTUATOR)
_areas_at: Final = records_at(fb.AREA)
_path_grids_at: Final = records_at(fb.PATH_GRID)
_surfaces_at: Final = records_at(SURFACE)
_obstacles_at: Final = records_at(OBSTACLE)
_cams_at: Final = records_at(CAM)
_outputs_at: Final = records_at(fb.WHEEL_OUTPUT)
_LEAST_STRETCH: Final = 0.1
"""Inverse of the largest ratio of a distance along a road's middle to the one beside it, near a curve's centre."""


@inlined
def _our_block(model, m_count, m_numbers):
    """Return the address of the force block of a model of this package, or 0 for other models."""
    count = word(model + m_count)
    address = word(model + m_numbers)
    numbers = carray(f64_pointer(address), (count,))
    if count < fb.TRAILER_SIZE or numbers[count - 1] != _MARKER:
        return 0
    return address + 8 * int(numbers[count - 2])


@inlined
def _apply(qfrc, cdof, chain, fx, fy, fz, tx, ty, tz):
    """Add J^T w to the generalised forces, for a wrench w about the tree's centre of mass."""
    for index in range(chain.size):
        dof = int(chain[index])
        axis = 6 * dof
        qfrc[dof] += (
            cdof[axis] * tx + cdof[axis + 1] * ty + cdof[axis + 2] * tz
            + cdof[axis + 3] * fx + cdof[axis + 4] * fy + cdof[axis + 5] * fz
        )  # fmt: skip


@inlined
def _interpolate(x, xs, ys, count):
    """Evaluate a piecewise linear curve, extrapolated at its ends."""
    index = 1
    while index < count - 1 and x > xs[index]:
        index += 1
    return ys[index - 1] + (x - xs[index - 1]) * (ys[index] - ys[index - 1]) / (xs[index] - xs[index - 1])


@inlined
def _road_mu(block, header, mu, x, y):
    """Return the friction of the road at a position on it [m]."""
    if header.areas_felt == 0.0:
        return mu
    areas = _areas_at(block, header.areas, header.n_areas)
    for index in range(areas.size - 1, -1, -1):
        area = areas[index]
        if area.start_m <= x < area.end_m and area.right_m < y <= area.left_m:
            return area.mu if area.slope_1pm == 0.0 else area.mu + area.slope_1pm * (x - area.start_m)
    return mu


@inlined
def _place_on_road(block, header, x, y):
    """Convert a position in the world to a position along the road [m], as `along_path` does."""
    if header.n_path_grids == 0.0 or header.areas_felt == 0.0:
        return x, y, 1.0, 0.0, 0.0
    grid = _path_grids_at(block, header.path_grids, 1)[0]
    points = carray(f64_pointer(block + 8 * int(header.path_points)), (int(header.n_path_points),))
    cells = carray(f64_pointer(block + 8 * int(header.path_cells)), (int(header.n_path_cells),))
    return along_path(x, y, grid.x0_m, grid.y0_m, grid.cell_m, grid.columns, grid.rows, grid.spacing_m, points, cells)


@inlined
def _across(axes, first, x, y, z):
    """Return the component of a vector along one of the axes of `plane_axes`."""
    return axes[first] * x + axes[first + 1] * y + axes[first + 2] * z


@inlined
def _back(axes, x, y, z):
    """Convert a vector of the plane to world axes."""
    return (
        axes[3] * x + axes[6] * y + axes[0] * z,
        axes[4] * x + axes[7] * y + axes[1] * z,
        axes[5] * x + axes[8] * y + axes[2] * z,
    )


@inlined_by_llvm
def _wheels(block, header, timestep_s, xpos, xmat, com, cvel, cdof, act, outputs, qfrc):  # noqa: PLR0915 - one wheel, compiled as one function
    wheels = _wheels_at(block, header.wheels, header.n_wheels)
    tyres = _tyres_at(block, header.tyres, header.n_tyres)
    uneven = header.n_surfaces != 0.0 and header.areas_felt != 0.0
    surface = _surfaces_at(block, header.surfaces, 1)[0]
    obstacles = _obstacles_at(block, header.obstacles, header.n_obstacles)
    cams = _cams_at(block, header.cams, header.n_cams)
    heights = carray(f64_pointer(block + 8 * int(header.heights)), (int(header.n_heights),))
    for index in range(wheels.size):
        wheel = wheels[index]
        body = int(wheel.body)
        root = int(wheel.root)
        to_x = xpos[3 * body] - com[3 * root]
        to_y = xpos[3 * body + 1] - com[3 * root + 1]
        to_z = xpos[3 * body + 2] - com[3 * root + 2]
        wx, wy, wz = cvel[6 * body], cvel[6 * body + 1], cvel[6 * body + 2]
        ax, ay, az = xmat[9 * body + 1], xmat[9 * body + 4], xmat[9 * body + 7]
        # Down in the wheel plane to the road, as in `tyre_on_road`.
        reach = xpos[3 * body + 2] * az / (ax * ax + ay * ay)
        contact_x = xpos[3 * body] + reach * ax
        contact_y = xpos[3 * body + 1] + reach * ay
        height = xpos[3 * body + 2]
        vx = cvel[6 * body + 3] + wy * to_z - wz * to_y
        vy = cvel[6 * body + 4] + wz * to_x - wx * to_z
        vz = cvel[6 * body + 5] + wx * to_y - wy * to_x
        axes = (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
        road_z, forward, sideways = 0.0, 0.0, 0.0
        p, hx, hy = tyres[index], 1.0, 0.0
        if uneven:
            horizontal = (ax * ax + ay * ay) ** 0.5
            to_lowest = p.UNLOADED_RADIUS * az / horizontal
            contact_x = xpos[3 * body] + to_lowest * ax
            contact_y = xpos[3 * body + 1] + to_lowest * ay
            hx, hy = ay / horizontal, -ax / horizontal
        along, across, cos, sin, curvature = _place_on_road(block, header, contact_x, contact_y)
        if uneven:
            stretch = 1.0 / max(1.0 - curvature * across, _LEAST_STRETCH)
            road_z, forward, sideways, bend = contact_plane(
                surface, heights, obstacles, cams[index], along, across, cos, sin, stretch, hx, hy, p.UNLOADED_RADIUS
            )
            axes = plane_axes(forward, sideways, hx, hy)
            height = _across(
                axes, 0, xpos[3 * body] - contact_x, xpos[3 * body + 1] - contact_y, xpos[3 * body + 2] - road_z
            )
            if bend != 0.0:
                spin = wx * ax + wy * ay + wz * az
                more = spin_on_bend(p, spin, vx * hx + vy * hy, bend, height, wheel.pressure_Pa) - spin
                wx, wy, wz = wx + more * ax, wy + more * ay, wz + more * az
            ax, ay, az = _across(axes, 3, ax, ay, az), _across(axes, 6, ax, ay, az), _across(axes, 0, ax, ay, az)
            vx, vy, vz = _across(axes, 3, vx, vy, vz), _across(axes, 6, vx, vy, vz), _across(axes, 0, vx, vy, vz)
            wx, wy, wz = _across(axes, 3, wx, wy, wz), _across(axes, 6, wx, wy, wz), _across(axes, 0, wx, wy, wz)
        mu = _road_mu(block, header, wheel.mu, along, across)
        tyre = tyre_on_road(
            p,
            mu,
            wheel.pressure_Pa,
            wheel.low_speed_mps,
            wheel.low_speed_damping_Nspm,
            timestep_s,
            height,
            ax,
            ay,
            az,
            vx,
            vy,
            vz,
            wx,
            wy,
            wz,
            act[int(wheel.act_x)],
            act[int(wheel.act_y)],
            act[int(wheel.act_z)],
        )
        hx, hy = tyre.heading_x, tyre.heading_y
        fz = tyre.fz_N
        gx = tyre.fx_N * hx - tyre.fy_N * hy
        gy = tyre.fx_N * hy + tyre.fy_N * hx
        arm_x, arm_y, arm_z = tyre.arm_x_m, tyre.arm_y_m, tyre.arm_z_m
        if uneven:
            gx, gy, fz = _back(axes, gx, gy, fz)
            arm_x, arm_y, arm_z = _back(axes, arm_x, arm_y, arm_z)
            contact_x, contact_y = xpos[3 * body] + arm_x, xpos[3 * body + 1] + arm_y
        out = outputs[index]
        out.fx_N = tyre.fx_N
        out.fy_N = tyre.fy_N
        out.fz_N = tyre.fz_N
        out.mx_Nm = tyre.mx_Nm
        out.my_Nm = tyre.my_Nm
        out.mz_Nm = tyre.mz_Nm
        out.slip_ratio = tyre.slip_ratio
        out.slip_angle_rad = tyre.slip_angle_rad
        out.inclination_rad = tyre.inclination_rad
        out.deflection_x_rate_mps = tyre.deflection_x_rate_mps
        out.deflection_y_rate_mps = tyre.deflection_y_rate_mps
        out.deflection_z_rate_radps = tyre.deflection_z_rate_radps
        out.loaded_radius_m = tyre.loaded_radius_m
        out.limited = tyre.limited
        out.friction_utilisation = tyre.friction_utilisation
        out.mu = mu
        out.contact_x_m = contact_x
        out.contact_y_m = contact_y
        out.road_z_m = road_z
        if uneven and surface.ends != 0.0 and left_grid(surface, along, across):
            out.road_z_m = math.nan  # noticed like any value that is not finite; `Vehicle.check` says why
        out.road_slope_x = forward
        out.road_slope_y = sideways
        px, py, pz = to_x + arm_x, to_y + arm_y, to_z + arm_z
        chain = wheel.chain[: int(wheel.chain_length)]
        tx = py * fz - pz * gy + tyre.mx_Nm * hx - tyre.my_Nm * hy
        ty = pz * gx - px * fz + tyre.mx_Nm * hy + tyre.my_Nm * hx
        tz = px * gy - py * gx + tyre.mz_Nm
        if uneven:
            mx, my, mz = _back(axes, tyre.mx_Nm * hx - tyre.my_Nm * hy, tyre.mx_Nm * hy + tyre.my_Nm * hx, tyre.mz_Nm)
            tx, ty, tz = py * fz - pz * gy + mx, pz * gx - px * fz + my, px * gy - py * gx + mz
        _apply(qfrc, cdof, chain, gx, gy, fz, tx, ty, tz)


@inlined_by_llvm
def _dampers(block, header, ten_velocity, jacobian, userdata, qfrc):
    first_slot = int(header.n_wheels) * fb.USERDATA_PER_WHEEL
    dampers = _dampers_at(block, header.dampers, header.n_dampers)
    for index in range(dampers.size):
        damper = dampers[index]
        velocity = -ten_velocity[int(damper.tendon)]
        force = _interpolate(velocity, damper.velocity_mps, damper.force_N, int(damper.points))
        userdata[first_slot + index] = force
        row = int(damper.row)
        for entry in range(int(damper.length)):
            qfrc[int(damper.chain[entry])] += jacobian[row + entry] * force


@inlined_by_llvm
def _drag(header, xpos, xmat, com, cvel, cdof, qfrc):
    """Add aerodynamic drag, against the velocity of the pressure point in the road plane."""
    body = int(header.chassis_body)
    root = int(header.chassis_root)
    ax, ay, az = header.aero_point_m[0], header.aero_point_m[1], header.aero_point_m[2]
    rot = xmat[9 * body : 9 * body + 9]
    px = xpos[3 * body] + rot[0] * ax + rot[1] * ay + rot[2] * az - com[3 * root]
    py = xpos[3 * body + 1] + rot[3] * ax + rot[4] * ay + rot[5] * az - com[3 * root + 1]
    pz = xpos[3 * body + 2] + rot[6] * ax + rot[7] * ay + rot[8] * az - com[3 * root + 2]
    wx, wy, wz = cvel[6 * body], cvel[6 * body + 1], cvel[6 * body + 2]
    vx = cvel[6 * body + 3] + wy * pz - wz * py
    vy = cvel[6 * body + 4] + wz * px - wx * pz
    factor = -header.drag_Ns2pm2 * (vx * vx + vy * vy) ** 0.5
    fx, fy = factor * vx, factor * vy
    chain = header.chassis_dofs[: int(header.n_chassis_dofs)]
    _apply(qfrc, cdof, chain, fx, fy, 0.0, -pz * fy, pz * fx, px * fy - py * fx)


def _make_callbacks(layout: EngineLayout) -> tuple[Any, Any, Any]:  # noqa: PLR0915 - three functions in one
    """Compile the three callbacks, or load them from numba's cache."""
    # The offsets are closure variables on purpose: numba makes those part of the cache key.
    (
        m_count, m_timestep, m_numbers, d_qvel, d_act, d_ctrl, d_userdata, d_xpos, d_xmat, d_com, d_cdof, d_ten_j,
        d_ten_velocity, d_cvel, d_qfrc, d_ten_length, d_sensordata, d_qpos, _,
    ) = layout  # fmt: skip

    @compiled_callback(types.void, types.intp, types.intp)
    def passive(model, data):
        block = _our_block(model, m_count, m_numbers)
        if block == 0:
            return
        header = _headers_at(block, 0, 1)[0]
        bodies = int(header.n_bodies)
        dofs = int(header.n_dofs)
        timestep_s = carray(f64_pointer(model + m_timestep), (1,))[0]
        xpos = array_at(data, d_xpos, 3 * bodies)
        xmat = array_at(data, d_xmat, 9 * bodies)
        com = array_at(data, d_com, 3 * bodies)
        cvel = array_at(data, d_cvel, 6 * bodies)
        cdof = array_at(data, d_cdof, 6 * dofs)
        act = array_at(data, d_act, int(header.n_activations))
        outputs = _outputs_at(word(data + d_userdata), 0, header.n_wheels)
        qfrc = array_at(data, d_qfrc, dofs)
        _wheels(block, header, timestep_s, xpos, xmat, com, cvel, cdof, act, outputs, qfrc)
        userdata = array_at(data, d_userdata, int(header.n_userdata))
        jacobian = array_at(data, d_ten_j, int(header.n_tendon_jacobian))
        ten_velocity = array_at(data, d_ten_velocity, int(header.n_tendons))
        _dampers(block, header, ten_velocity, jacobian, userdata, qfrc)
        _drag(header, xpos, xmat, com, cvel, cdof, qfrc)
        qpos = array_at(data, d_qpos, int(header.n_coordinates))
        add_curve_axle_forces(block, header, qpos, array_at(data, d_qvel, dofs), qfrc)

    @compiled_callback(types.double, types.intp, types.intp, types.intc)
    def actuator_rate(model, data, actuator):
        block = _our_block(model, m_count, m_numbers)
        if block == 0:
            return 0.0
        header = _headers_at(block, 0, 1)[0]
        actuators = _actuators_at(block, header.actuators, header.n_actuators)
        entry = actuators[actuator]
        kind = entry.kind
        if kind == fb.KIND_SLIP:
            return array_at(data, d_userdata, int(header.n_userdata))[int(entry.userdata)]
        state = array_at(data, d_act, int(header.n_activations))[int(entry.act)]
        command = entry.scale * array_at(data, d_ctrl, int(header.n_controls))[actuator] + entry.offset
        if kind == fb.KIND_SERVO:
            return servo_rate(entry, command, state)
        timestep_s = carray(f64_pointer(model + m_timestep), (1,))[0]
        qvel = array_at(data, d_qvel, int(header.n_dofs))
        rate = 0.0
        if kind == fb.KIND_DRIVE:
            rate = drive_rate(
                _wheels_at(block, header.wheels, header.n_wheels), header, entry, qvel, command, state, timestep_s
            )
        elif kind == fb.KIND_FRICTION:
            ten_velocity = array_at(data, d_ten_velocity, int(header.n_tendons))
            rate = dry_friction_rate(entry, qvel, ten_velocity, state, timestep_s)
        elif kind == fb.KIND_BRAKE:
            rate = brake_rate(entry, qvel, command, state, timestep_s)
        elif kind >= fb.KIND_LINK:
            rate = screw_rate(
                block, header, actuators, entry, array_at(data, d_act, int(header.n_activations)),
                array_at(data, d_ctrl, int(header.n_controls)), array_at(data, d_ten_length, int(header.n_tendons)),
                array_at(data, d_userdata, int(header.n_userdata)), timestep_s,
            )  # fmt: skip
        return rate

    @compiled_callback(types.void, types.intp, types.intp, types.intc)
    def screw_sensors(model, data, _stage):
        block = _our_block(model, m_count, m_numbers)
        if block == 0:
            return
        header = _headers_at(block, 0, 1)[0]
        count, start = int(header.n_screw_sensors), int(header.screw_sensors)
        # The number of active faults follows them.
        said, first = array_at(data, d_userdata, int(header.n_userdata)), int(header.n_userdata) - 1 - count
        sensors = array_at(data, d_sensordata, start + count)
        for sensor in range(count):  # a slice would compile numba's check of shapes, for a second
            sensors[start + sensor] = said[first + sensor]

    return passive, actuator_rate, screw_sensors


@compiled_callback(types.double)
def _no_clock():
    """Replace the clock that the engine reads about twenty times per step."""
    return 0.0


_installed: list[Any] = []
_installing: Final = threading.Lock()
"""The callbacks as the engine sees them. Kept for the life of the process, since the engine holds bare pointers."""


def install_native_forces() -> None:
    """Install the callbacks in this process, if they are not installed already."""
    with _installing:
        _install()


_SLOTS: Final = (
    ("mjcb_passive", mujoco.get_mjcb_passive, mujoco.set_mjcb_passive),
    ("mjcb_act_dyn", mujoco.get_mjcb_act_dyn, mujoco.set_mjcb_act_dyn),
    ("mjcb_sensor", mujoco.get_mjcb_sensor, mujoco.set_mjcb_sensor),
)


def _install() -> None:
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        raise ModelError(
            "NUMBA_DISABLE_JIT is set, but a car needs compiled code; without it only kernels such as those of "
            "activesteer.tyre.kernels can be called"
        )
    present = [get() for _, get, _ in _SLOTS]
    for (name, *_), other in zip(_SLOTS, present, strict=True):
        if other is not None and not any(other is ours for ours in _installed):
            raise ModelError(
                f"MuJoCo's {name} is already taken by {other!r}; there is one per process and the tyre forces need "
                f"it: call mujoco.set_{name}(None) before using activesteer",
                value=name,
            )
    if not _installed:
        compiled = _make_callbacks(engine_layout())
        _installed.extend(callback.ctypes for callback in compiled)
    for (*_, install), before, ours in zip(_SLOTS, present, _installed, strict=True):
        if before is None:
            install(ours)
    if mujoco.get_mjcb_time() is None:
        mujoco.set_mjcb_time(_no_clock.ctypes)


def remove_native_forces() -> None:
    """Remove our callbacks from this process, for example to measure the bare engine."""
    for _, present, install in _SLOTS:
        if any(present() is ours for ours in _installed):
            install(None)
    if mujoco.get_mjcb_time() is _no_clock.ctypes:
        mujoco.set_mjcb_time(None)


@contextlib.contextmanager
def engine_warnings_held() -> Iterator[None]:
    """Leave the engine's warnings, which it writes to the user's folder, to `Vehicle.check` or an installed handler."""
    if mujoco.get_mju_user_warning() is not None:
        yield
        return
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(None)
