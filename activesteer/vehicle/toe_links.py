"""Toe links with screws: steer angle versus link length, and the screws in the model.

The chassis is fixed, and the damper and all other links keep their lengths. For each length of the toe link, Newton's
method finds the position of the corner in which no link carries a force.

The hinge between knuckle and carrier is removed, and each toe link gets an actuator along it. A link of stiffness k
that is longer by z carries -k (L - L_0 - z): the tendon has the first part, the actuator k z. There are two more states
without a force: position of the screw, speed of the motor. With free play, z is anywhere within the play about the
screw's position: at the length without force if that is possible, at an end of the play otherwise.

A screw on a motor of speed w, with the lead l per radian of the motor and the links' tension T, has

    J dw/dt = M + l T - friction        |friction| <= M_0 + r l |T|, as much as needed at rest
    dz/dt = l w

so that it is self-locking if r >= 1. M is the torque that the speed loop needs, within current, voltage and power; its
integral part counts as settled, so that it includes load and friction.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.errors import ModelError
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.electric_actuators import SPEED_STATE, STOP_BEYOND, RearActuator, known
from activesteer.vehicle.statics import move_by, slopes

DEGREE: Final = 5
"""Degree of the polynomials. They have no constant term."""
_POINTS: Final = 15
_ITERATIONS: Final = 30
_TOLERANCE_M: Final = 1e-10
_BEYOND: Final = 1.05
"""Range of the solution, relative to the limit."""
_FIT: Final = 2e-3
"""Largest error of the polynomials, relative to the range."""


class ToeLinkMap(NamedTuple):
    """Polynomials from length change of a toe link to steer angle and back; `travel_m` is the limit to either side."""

    travel_of_angle: NDArray[np.float64]
    angle_of_travel: NDArray[np.float64]
    travel_m: float


def evaluated(coefficients: NDArray[np.float64], x: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Evaluate a polynomial without a constant term."""
    return np.asarray(np.polynomial.polynomial.polyval(x, np.concatenate(([0.0], coefficients))), dtype=np.float64)


def toe_link_map(model: mujoco.MjModel, corner: str, link: str, limit_rad: float) -> ToeLinkMap:
    """Compute the map between link length and steer angle of a corner."""
    solver = _Corner(model, corner, link)
    slope = (solver.angle(1e-4) - solver.angle(-1e-4)) / 2e-4
    if abs(slope) < 0.5:
        raise ModelError(f"the tendon {link!r} does not steer its wheel: {slope:.3g} rad/m; at least 0.5 are needed")
    reach = _BEYOND * limit_rad / abs(slope)
    minimum = 0.0
    for _ in range(4):
        travels = reach * np.linspace(-1.0, 1.0, _POINTS)
        angles = solver.angles(travels)
        minimum = min(abs(angles[0]), abs(angles[-1]))
        if minimum >= limit_rad and (np.diff(angles) * slope > 0.0).all():
            break
        reach *= 1.02 * limit_rad / max(minimum, 0.5 * limit_rad)
    else:
        raise ModelError(
            f"the tendon {link!r} steers its wheel by {np.degrees(minimum):.2g} deg at most; "
            f"{np.degrees(limit_rad):.3g} deg are demanded (rear_actuator.limit_deg)"
        )
    ways = [_fit(angles, travels), _fit(travels, angles)]
    for coefficients, x, y in zip(ways, (angles, travels), (travels, angles), strict=True):
        if np.abs(evaluated(coefficients, x) - y).max() > _FIT * np.ptp(y):
            raise ModelError(f"the tendon {link!r}: steer angle versus length is not a smooth curve up to the limit")
    ends = np.abs(evaluated(ways[0], np.array([-limit_rad, limit_rad])))
    return ToeLinkMap(ways[0], ways[1], float(ends.max()))


def _fit(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    scale = np.abs(x).max()
    powers = np.arange(1, DEGREE + 1)
    columns = (x[:, None] / scale) ** powers
    return np.linalg.lstsq(columns, y, rcond=None)[0] / scale**powers


class _Corner:
    """Coordinates of a rear corner, and the link lengths that constrain them."""

    def __init__(self, model: mujoco.MjModel, corner: str, link: str) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        spin = model.joint(f"{corner}_spin").id
        self._dofs = [
            dof
            for dof in range(model.nv)
            if model.joint(int(model.dof_jntid[dof])).name.startswith(f"{corner}_") and model.dof_jntid[dof] != spin
        ]
        self._tendons, weights = [], []
        for tendon in range(model.ntendon):
            name = model.tendon(tendon).name
            if not name.startswith(f"{corner}_") or name.endswith(("_spring", "_viewer_damper")):
                continue
            if name.endswith("_damper") or model.tendon_stiffness[tendon] > 0.0:
                self._tendons.append(tendon)
                weights.append(1.0)
        self._link = self._tendons.index(model.tendon(link).id)
        self._wheel, self._chassis = model.body(f"{corner}_wheel").id, model.body("chassis").id
        self._restart()
        self._lengths = self._data.ten_length[self._tendons].copy()
        self._design_rad = self._steer()

    def _restart(self) -> None:
        mujoco.mj_resetData(self._model, self._data)
        mujoco.mj_fwdPosition(self._model, self._data)

    def _steer(self) -> float:
        data = self._data
        axis = data.xmat[self._chassis].reshape(3, 3).T @ data.xmat[self._wheel].reshape(3, 3)[:, 1]
        return float(np.arctan2(-axis[0], axis[1]))

    def _missing(self, travel_m: float) -> NDArray[np.float64]:
        mujoco.mj_fwdPosition(self._model, self._data)
        missing = self._data.ten_length[self._tendons] - self._lengths
        missing[self._link] -= travel_m
        return missing

    def angles(self, travels_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the steer angles at several lengths [rad], each searched from the previous angle."""
        middle = len(travels_m) // 2
        outwards = [self._along(travels_m[middle:]), self._along(travels_m[middle::-1])]
        return np.concatenate([outwards[1][:0:-1], outwards[0]])

    def _along(self, travels_m: NDArray[np.float64]) -> list[float]:
        self._restart()
        return [self._solved(float(travel)) for travel in travels_m]

    def angle(self, travel_m: float) -> float:
        """Return the steer angle relative to the design position, left positive [rad]."""
        self._restart()
        return self._solved(travel_m)

    def _solved(self, travel_m: float) -> float:
        model, data = self._model, self._data
        missing = self._missing(travel_m)
        for _ in range(_ITERATIONS):
            if np.abs(missing).max() < _TOLERANCE_M:
                return self._steer() - self._design_rad
            rates = slopes(model, data, self._dofs, missing, lambda: self._missing(travel_m))
            move_by(model, data, self._dofs, np.linalg.lstsq(rates, -missing, rcond=1e-9)[0])
            missing = self._missing(travel_m)
        raise ModelError(f"the corner has no position in which its toe link is longer by {1e3 * travel_m:.3g} mm")


CORNERS: Final = ("rl", "rr")
LINKS: Final = ("toe_link", "tie_rod")
"""Names of a rear toe link after its corner."""
SCREW: Final = "_screw"
"""Suffix of the state next to an actuator that is its screw's position: one per side, or `rear_screw` in the middle."""


def fit_screws(spec: mujoco.MjSpec, actuator: RearActuator) -> None:
    """Replace the steering hinges of a model by actuators in its rear toe links."""
    spec.nuserdata += len(CORNERS)
    for key in list(spec.keys):
        spec.delete(key)  # made for a car with hinges
    parts = CORNERS if actuator.arrangement == "per_side" else ("rear",)
    for corner in CORNERS:
        link = toe_link_of(spec, corner)
        name = f"{corner}_steer"
        for part in (spec.sensor(f"{name}_angle"), spec.actuator(name), spec.joint(name)):
            if part is None:
                raise ModelError(f"the model has no rear steering hinge {name!r} that the screws could replace")
            spec.delete(part)
        stiffness = np.asarray(link.stiffness, dtype=np.float64)
        if stiffness[0] <= 0.0 or stiffness[1:].any():
            raise ModelError(f"the toe link {link.name!r} needs one stiffness above 0 and no hardening")
        assert actuator.screw_stiffness_Npm is not None
        together = 1.0 / (1.0 / stiffness[0] + 1.0 / actuator.screw_stiffness_Npm)
        link.stiffness = [together, 0.0, 0.0]
        _add(spec, name, link.name, together, actuator)
    # The callback fills these, in this order: what the actuator's own controller knows of its screw ...
    for corner in CORNERS:
        spec.add_sensor(name=f"{corner}_steer_angle", type=mujoco.mjtSensor.mjSENS_USER, dim=1)
    for part in parts:
        # ... and torque of the motor, and whether it is at a limit.
        spec.add_sensor(name=part + SPEED_STATE, type=mujoco.mjtSensor.mjSENS_USER, dim=2)
        spec.nuserdata += 2
        for state in (SCREW, SPEED_STATE):
            _add(spec, part + state, toe_link_of(spec, "rl" if part == "rear" else part).name, 0.0, None)


def _add(spec: mujoco.MjSpec, name: str, tendon: str, gain: float, actuator: RearActuator | None) -> None:
    added = spec.add_actuator(
        name=name, target=tendon, trntype=mujoco.mjtTrn.mjTRN_TENDON, dyntype=mujoco.mjtDyn.mjDYN_USER,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED, biastype=mujoco.mjtBias.mjBIAS_NONE,
    )  # fmt: skip
    added.gainprm[0] = gain
    if actuator is not None and actuator.limit_rad is not None:
        added.ctrllimited = mujoco.mjtLimited.mjLIMITED_FALSE
        added.ctrlrange = [-actuator.limit_rad, actuator.limit_rad]


def toe_link_of(spec: Any, corner: str) -> Any:
    """Return the toe link tendon of a rear corner."""
    for name in LINKS:
        if (tendon := spec.tendon(f"{corner}_{name}")) is not None:
            return tendon
    names = " or ".join(f"{corner}_{name}" for name in LINKS)
    raise ModelError(f"the rear suspension has no toe link for a screw: a tendon {names} is needed")


def screw_records(
    model: mujoco.MjModel, actuator: RearActuator
) -> tuple[list[NDArray[Any]], list[NDArray[Any]], dict[str, tuple[float, int]]]:
    """Return the `LINK` and `SCREW` records, and the kind and index of each actuator's record."""
    limit = known(actuator.limit_rad)
    names = [_tendon(model, corner) for corner in CORNERS]
    left = toe_link_map(model, "rl", names[0], limit)
    right = toe_link_map(model, "rr", names[1], limit)
    maps = (left, right)
    lead = known(actuator.lead_m) / (2.0 * math.pi * known(actuator.gear))
    central = actuator.arrangement == "central"
    parts = ("rear",) if central else CORNERS
    places: dict[str, tuple[float, int]] = {}
    links: list[NDArray[Any]] = []
    screws: list[NDArray[Any]] = []
    said = model.nuserdata - 1 - fb.sensor_range(model)[1]
    for index, (corner, tendon) in enumerate(zip(CORNERS, names, strict=True)):
        part = "rear" if central else corner
        places[f"{corner}_steer"] = (fb.KIND_LINK, index)
        tendon_id = model.tendon(tendon).id
        link = fb.filled(
            fb.LINK,
            tendon=tendon_id,
            rest_m=model.tendon_length0[tendon_id],
            stiffness_Npm=model.tendon_stiffness[tendon_id],
            backlash_m=known(actuator.backlash_m),
            act=_act(model, f"{corner}_steer"),
            screw_act=_act(model, part + SCREW),
            sign=-1.0 if central and corner == "rr" else 1.0,
            userdata=said + index,
            angle=maps[index].angle_of_travel,
        )
        links.append(link)
    for index, part in enumerate(parts):
        places[part + SCREW], places[part + SPEED_STATE] = (fb.KIND_SCREW, index), (fb.KIND_MOTOR, index)
        # One screw for both: it moves the left link out and the right one in.
        travel = maps[index].travel_of_angle if not central else (0.5 * (left.travel_of_angle - right.travel_of_angle))
        moved = [0, 1] if central else [index]
        screw = fb.filled(
            fb.SCREW,
            act=_act(model, part + SCREW),
            motor_act=_act(model, part + SPEED_STATE),
            command=model.actuator(f"{CORNERS[index]}_steer").id,
            lead_mprad=lead,
            stop_m=STOP_BEYOND * max(mapped.travel_m for mapped in maps),
            tolerance_m=known(actuator.position_tolerance_m),
            userdata=said + len(CORNERS) + 2 * index,
            n_links=len(moved),
            links=moved,
            travel=travel,
            **actuator.motor_numbers(),
        )
        screws.append(screw)
    return links, screws, places


def _act(model: mujoco.MjModel, actuator: str) -> int:
    return int(model.actuator_actadr[model.actuator(actuator).id])


def _tendon(model: mujoco.MjModel, corner: str) -> str:
    present = {model.tendon(index).name for index in range(model.ntendon)}
    return next(f"{corner}_{name}" for name in LINKS if f"{corner}_{name}" in present)
