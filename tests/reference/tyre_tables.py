"""Readers of the reference tables and coefficient tables of `data/`."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

DATA = Path(__file__).parent / "data"
INPUTS = ("Fz_N", "kappa_1", "alpha_rad", "gamma_rad", "p_Pa", "Vx_mps")


def _rows(name: str) -> list[list[str]]:
    lines = (DATA / name).read_text().splitlines()
    return list(csv.reader(line for line in lines if not line.startswith("#")))


def read_table(name: str) -> dict[str, np.ndarray]:
    """Return the numeric columns of a table by name, without the first column, the kind of case."""
    header, *rows = _rows(name)
    values = np.array([[float(cell) for cell in row[1:]] for row in rows])
    return {column: values[:, place] for place, column in enumerate(header[1:])}


def read_coefficients(name: str) -> dict[str, float]:
    """Return the coefficients of a tyre by key."""
    _, *rows = _rows(name)
    return {key: float(value) for key, value in rows}
