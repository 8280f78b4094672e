"""Top mounts of struts and dampers: slides between chassis and rod, and the tendons that act as their bushings.

The engine's step is implicit in the stiffness of tendons, so the bushings are tendons along the slides, like all other
springs of a car.
"""

from __future__ import annotations

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ParameterError
from activesteer.vehicle_builder.axle_kinds import AxleKind
from activesteer.vehicle_builder.design import Log, Solid, TopMount
from activesteer.vehicle_builder.levers import Mount
from activesteer.vehicle_builder.table import TopMountTable

_RADIAL_NPM, _AXIAL_NPM = 3e5, 1.2e6
_DAMPING_S = 1e-3
"""Damping per stiffness: a loss factor of 0.09 at the 15 Hz of a wheel, as rubber has."""
_ROD_KG = 1.2
_ROD_INERTIA_KGM2 = (0.008, 0.008, 0.0006)
_BELOW_MOUNT_M = 0.07


def top_mount(
    axle: str, table: TopMountTable | None, kind: AxleKind, points: dict[str, Array], damper: Mount, log: Log
) -> TopMount | None:
    """Complete the top mount of an axle; None if it is rigid."""
    if table is None and not kind.strut:
        return None
    key, table = f"{axle}.top_mount", table or TopMountTable()
    if kind.strut:
        upper, lower = points["strut_top"], points["strut_bottom"]
    elif damper.start_m is None or damper.lever != 1.0:
        raise ParameterError(f"a damper on {damper.carrier} has no rod in the model; leave the key out", key=key)
    else:
        upper, lower = points["damper_inner"], points["damper_outer"]
    along = (upper - lower) / np.linalg.norm(upper - lower)
    axial = log.take(f"{key}.axial_Npm", table.axial_Npm, _AXIAL_NPM, "as in the compact", "N/m")
    directions, stiffness, rod = {"z": along}, {"z": axial}, None
    if kind.strut:
        if table.rod_mass_kg is not None:
            raise ParameterError(f"a strut has {axle}.strut_mass_kg instead", key=f"{key}.rod_mass_kg")
        radial = log.take(f"{key}.radial_Npm", table.radial_Npm, _RADIAL_NPM, "as in the compact", "N/m")
        forward = np.array([1.0, 0.0, 0.0]) - along[0] * along
        forward /= np.linalg.norm(forward)
        directions = {"x": forward, "y": np.cross(along, forward), "z": along}
        stiffness = {"x": radial, "y": radial, "z": axial}
    else:
        for name in ("radial_Npm", "radial_damping_Nspm"):
            if getattr(table, name) is not None:
                raise ParameterError("a damper between two joints has no force across its axis", key=f"{key}.{name}")
        kg = log.take(f"{key}.rod_mass_kg", table.rod_mass_kg, _ROD_KG, "piston and rod", "kg")
        rod = Solid(kg, upper - _BELOW_MOUNT_M * along, np.array(_ROD_INERTIA_KGM2) * kg / _ROD_KG)
    damping = {}
    for name, value in stiffness.items():
        given = table.axial_damping_Nspm if name == "z" else table.radial_damping_Nspm
        damping[name] = _DAMPING_S * value if given is None else given
    return TopMount(directions, stiffness, damping, rod)
