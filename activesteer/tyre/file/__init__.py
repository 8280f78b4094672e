"""Tyre property files: reading, writing, and the meaning of their coefficients."""
