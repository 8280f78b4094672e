"""Test rigs, which move parts of the car as on a test bench.

In: a car, and the motion or force that the rig imposes.
Out: forces, displacements and their slopes.
"""
