"""Channels of the axial forces in links, springs, anti-roll bars and stops."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from activesteer.conventions import Array
from activesteer.vehicle.channels.raw_rows import AxialForce, Column, Computed, Signal, Values, signal
from activesteer.vehicle.curve_axles import HOLDING_TENDON


def link_signals(model: mujoco.MjModel) -> Iterator[Signal]:
    """Yield the axial forces of all tendons with a stiffness, tension positive."""
    for index in range(model.ntendon):
        if model.tendon_stiffness[index] == 0.0 and not model.tendon_stiffnesspoly[index].any():
            continue
        if model.tendon(index).name.endswith(HOLDING_TENDON):
            # Five springs replace all links of a wheel; they are not parts of the car.
            continue
        # The stiffness of a damper's tendon represents the stops at both ends of its travel.
        name = model.tendon(index).name.replace("_damper", "_stop")
        yield signal("links", f"{name}_force_N", "N", f"axial force of {name}, tension positive", _force(model, index))


def axial_force(model: mujoco.MjModel, tendon: int) -> AxialForce:
    """Return the law of a tendon's stiffness."""
    stiffness = model.tendon_stiffness[tendon], *model.tendon_stiffnesspoly[tendon]
    return AxialForce._make((tendon, *stiffness, model.tendon_damping[tendon], *model.tendon_lengthspring[tendon]))


def _force(model: mujoco.MjModel, tendon: int) -> Values:
    """Return the axial force of a tendon; a screw in the link adds the force of its actuator."""
    law = axial_force(model, tendon)
    along = model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON)
    screws = np.flatnonzero(along & (model.actuator_trnid[:, 0] == tendon) & (model.actuator_gainprm[:, 0] > 0.0))
    if not screws.size:
        return law

    def force(length_m: Array, velocity_mps: Array, added_N: Array) -> Array:
        passive = law.stiffness_Npm * (length_m - law.low_m) + law.damping_Nspm * velocity_mps
        return passive - added_N

    places = (("ten_length", tendon), ("ten_velocity", tendon), ("actuator_force", int(screws[0])))
    return Computed(force, tuple(Column(*place) for place in places))
