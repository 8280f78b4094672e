"""Byte offsets of MuJoCo's arrays inside mjModel and mjData, and parts of a compiled model by their names.

A native callback receives bare pointers to both structs. Their layout is not part of MuJoCo's Python interface and
changes between versions, so it is measured: the words of a struct are compared with the addresses of the bindings'
numpy views, and with distinctive values in a small model. A second model confirms every result.
"""

from __future__ import annotations

import ctypes
import functools
from typing import Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.errors import ModelError, nearest_names

_WORD_BYTES: Final = 8
_MODEL_BYTES: Final = 8192
"""Bytes of mjModel to search: its members are sizes, options and pointers, a few kilobytes."""
_DATA_BYTES: Final = 262_144
"""Bytes of mjData to search: solver statistics lie before the pointers (160 KB in MuJoCo 4.0)."""


class EngineLayout(NamedTuple):
    """Byte offsets inside mjModel (`m_`) and mjData (`d_`): pointers to arrays, except the first two and the last."""

    m_nnumericdata: int
    m_timestep: int
    m_numeric_data: int
    d_qvel: int
    d_act: int
    d_ctrl: int
    d_userdata: int
    d_xpos: int
    d_xmat: int
    d_subtree_com: int
    d_cdof: int
    d_ten_J: int
    d_ten_velocity: int
    d_cvel: int
    d_qfrc_passive: int
    d_ten_length: int
    d_sensordata: int
    d_qpos: int
    d_time: int


_DATA_ARRAYS: Final = [name[2:] for name in EngineLayout._fields[3:-1]]


def _probe(numbers: int, timestep_s: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return a small model that has every array in question, a known count of custom numbers and a known time step."""
    xml = f"""
    <mujoco>
      <option timestep="{timestep_s!r}"/>
      <size nuserdata="3"/>
      <custom><numeric name="probe" size="{numbers}" data="1"/></custom>
      <worldbody>
        <site name="a"/>
        <body pos="0 0 1"><joint name="j" type="slide" axis="0 0 1"/><geom size="0.1"/><site name="b"/></body>
      </worldbody>
      <tendon><spatial><site site="a"/><site site="b"/></spatial></tendon>
      <actuator><general joint="j" dyntype="user"/></actuator>
      <sensor><jointpos joint="j"/></sensor>
    </mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    return model, mujoco.MjData(model)


def _words(address: int, size_bytes: int) -> NDArray[np.uint64]:
    # A view, not a copy: _find reads it block by block and stops at the match.
    return np.ctypeslib.as_array((ctypes.c_uint64 * (size_bytes // _WORD_BYTES)).from_address(address))


def _find(address: int, wanted: int, limit_bytes: int, what: str) -> int:
    """Return the byte offset of the only word that equals `wanted`. The forward scan stops at the first match."""
    words = _words(address, limit_bytes)
    block = 256
    for start in range(0, len(words), block):
        hits = np.flatnonzero(words[start : start + block] == np.uint64(wanted))
        if hits.size:
            return (start + int(hits[0])) * _WORD_BYTES
    raise ModelError(
        f"MuJoCo {mujoco.__version__}: cannot locate {what} in its structures; this version is not supported",
        value=what,
    )


def _measure(model: mujoco.MjModel, data: mujoco.MjData, numbers: int) -> EngineLayout:
    m, d = model._address, data._address
    data.time = 7.0 / model.opt.timestep
    step_bits, time_bits = (int(np.float64(value).view(np.uint64)) for value in (model.opt.timestep, data.time))
    return EngineLayout(
        _find(m, numbers, _MODEL_BYTES, "mjModel.nnumericdata"),
        _find(m, step_bits, _MODEL_BYTES, "mjModel.opt.timestep"),
        _find(m, model.numeric_data.ctypes.data, _MODEL_BYTES, "mjModel.numeric_data"),
        *(_find(d, getattr(data, name).ctypes.data, _DATA_BYTES, f"mjData.{name}") for name in _DATA_ARRAYS),
        d_time=_find(d, time_bits, _DATA_BYTES, "mjData.time"),
    )


@functools.cache
def engine_layout() -> EngineLayout:
    """Return the offsets, measured once per process (see `measure_engine_layout`)."""
    return measure_engine_layout()


def measure_engine_layout() -> EngineLayout:
    """Measure the offsets and confirm them on a second, different model."""
    first = _measure(*_probe(7919, 0.00123456789), 7919)
    second = _measure(*_probe(6421, 0.00098765432), 6421)
    if first != second:
        raise ModelError(
            f"MuJoCo {mujoco.__version__}: two models give different struct layouts ({first}, {second})",
            value=(first, second),
        )
    return first


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
    """Return the change of length per coordinate for each joint of a fixed tendon, or empty without the tendon.

    The units are those of the joints: m/rad for a hinge, 1 for a slide.
    """
    tendon = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, name)
    if tendon < 0:
        return {}
    parts = range(int(model.tendon_adr[tendon]), int(model.tendon_adr[tendon] + model.tendon_num[tendon]))
    return {model.joint(int(model.wrap_objid[part])).name: float(model.wrap_prm[part]) for part in parts}
