"""Tyre property files: reading, writing, and the meaning of their coefficients.

In: .tir files.
Out: coefficients in SI units and ISO-W signs.
"""
