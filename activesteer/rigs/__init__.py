"""Test rigs: one part of the car alone, moved as on a test bench.

In: a tyre or a car, and the motion or force that the rig imposes.
Out: forces, displacements and their slopes.
"""

from activesteer.rigs.kc import KcResult, kinematics_compliance
from activesteer.rigs.tyre_rig import TyreRig

__all__ = ["KcResult", "TyreRig", "kinematics_compliance"]
