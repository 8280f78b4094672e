"""Parts of a compiled model by their names."""

from __future__ import annotations

import mujoco

from activesteer.errors import ModelError, nearest_names


def find(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    """Return the index of a named object."""
    index = mujoco.mj_name2id(model, kind, name)
    if index < 0:
        word = kind.name.removeprefix("mjOBJ_").lower()
        count = {
            mujoco.mjtObj.mjOBJ_BODY: model.nbody,
            mujoco.mjtObj.mjOBJ_JOINT: model.njnt,
            mujoco.mjtObj.mjOBJ_SENSOR: model.nsensor,
            mujoco.mjtObj.mjOBJ_TENDON: model.ntendon,
            mujoco.mjtObj.mjOBJ_ACTUATOR: model.nu,
        }[kind]
        names = [mujoco.mj_id2name(model, kind, number) or "" for number in range(count)]
        raise ModelError(f"the model has no {word} {name!r}; {nearest_names(name, names)}", value=name, allowed=names)
    return index


def is_there(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> bool:
    """Return True if an object has this name."""
    return mujoco.mj_name2id(model, kind, name) >= 0


def sensor_columns(model: mujoco.MjModel, name: str) -> slice:
    """Return the places of a sensor's values in `sensordata`."""
    index = find(model, mujoco.mjtObj.mjOBJ_SENSOR, name)
    start = int(model.sensor_adr[index])
    return slice(start, start + int(model.sensor_dim[index]))


def tendon_arms(model: mujoco.MjModel, name: str) -> dict[str, float]:
    """Return, for each joint of a fixed tendon, the change of length per coordinate; empty if there is no such tendon.

    The units are those of the joints: m/rad for a hinge, 1 for a slide.
    """
    tendon = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, name)
    if tendon < 0:
        return {}
    parts = range(int(model.tendon_adr[tendon]), int(model.tendon_adr[tendon] + model.tendon_num[tendon]))
    return {model.joint(int(model.wrap_objid[part])).name: float(model.wrap_prm[part]) for part in parts}
