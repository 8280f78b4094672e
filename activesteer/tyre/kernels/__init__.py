"""Formulas of the tyre, compiled, on plain floats."""
