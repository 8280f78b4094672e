"""Test rigs: one part of the car on its own, moved as on a bench."""

from __future__ import annotations
