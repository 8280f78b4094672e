"""Screws in the toe links of a car whose model has hinges: changes of the model, and records for the callbacks.

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
from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.errors import ModelError
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.electric_actuator import STOP_BEYOND, known
from activesteer.vehicle.rear_actuator import RearActuator
from activesteer.vehicle.superposition_actuator import MOTOR
from activesteer.vehicle.toe_link_kinematics import toe_link_map

CORNERS: Final = ("rl", "rr")
LINKS: Final = ("toe_link", "tie_rod")
"""Names of a rear toe link after its corner."""
SCREW: Final = "_screw"
"""Suffix of the state beside an actuator that is its screw's position: one per side, or `rear_screw` in the middle."""


def fit_screws(spec: mujoco.MjSpec, actuator: RearActuator) -> None:
    """Replace the hinges of a model by actuators along its rear toe links.

    Raises:
        ModelError: the rear suspension has no toe link whose stiffness is one number, or no hinge.
    """
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
        spec.add_sensor(name=part + MOTOR, type=mujoco.mjtSensor.mjSENS_USER, dim=2)
        spec.nuserdata += 2
        for state in (SCREW, MOTOR):
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
    """Return the tendon that is the toe link of a rear corner.

    Raises:
        ModelError: there is none.
    """
    for name in LINKS:
        if (tendon := spec.tendon(f"{corner}_{name}")) is not None:
            return tendon
    names = " or ".join(f"{corner}_{name}" for name in LINKS)
    raise ModelError(f"the rear suspension has no toe link for a screw: a tendon {names} is needed")


@dataclass(frozen=True)
class Screws:
    """The records of a car's screws, and their places for its actuators.

    Attributes:
        links: A `LINK` record for each rear wheel.
        screws: A `SCREW` record for each screw.
        places: Name of an actuator -> kind and place of its record among these.
    """

    links: list[NDArray[Any]]
    screws: list[NDArray[Any]]
    places: dict[str, tuple[float, int]]


def screw_records(model: mujoco.MjModel, actuator: RearActuator) -> Screws:
    """Solve the kinematics and build the records for the callbacks.

    Raises:
        ModelError: the toe links do not steer the wheels so far.
    """
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
    said = model.nuserdata - 1 - sensor_range(model)[1]
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
        places[part + SCREW], places[part + MOTOR] = (fb.KIND_SCREW, index), (fb.KIND_MOTOR, index)
        # One screw for both: it moves the left link out and the right one in.
        travel = maps[index].travel_of_angle if not central else (0.5 * (left.travel_of_angle - right.travel_of_angle))
        moved = [0, 1] if central else [index]
        screw = fb.filled(
            fb.SCREW,
            act=_act(model, part + SCREW),
            motor_act=_act(model, part + MOTOR),
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
    return Screws(links, screws, places)


def sensor_range(model: mujoco.MjModel) -> tuple[int, int]:
    """Return the first place in `sensordata` of the sensors that a callback fills, and the number of their values.

    Their values, and then the number of active faults, are the end of `userdata`.
    """
    ours = np.flatnonzero(model.sensor_type == int(mujoco.mjtSensor.mjSENS_USER))
    return (int(model.sensor_adr[ours[0]]), int(model.sensor_dim[ours].sum())) if ours.size else (0, 0)


def _act(model: mujoco.MjModel, actuator: str) -> int:
    return int(model.actuator_actadr[model.actuator(actuator).id])


def _tendon(model: mujoco.MjModel, corner: str) -> str:
    present = {model.tendon(index).name for index in range(model.ntendon)}
    return next(f"{corner}_{name}" for name in LINKS if f"{corner}_{name}" in present)
