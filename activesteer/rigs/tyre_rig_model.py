"""The model of the tyre rig: a wheel on joints for every motion, with its tyre in the block of the native forces."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.loading import SLIP_RATES, chain_to

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
