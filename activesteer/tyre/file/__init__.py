"""Tyre property files: reading, writing, and what their coefficients mean."""
