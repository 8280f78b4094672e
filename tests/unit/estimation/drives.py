"""Drives with their measurements, for the tests of this folder."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

import activesteer
from activesteer.controllers import load_controller
from activesteer.core.signals import Estimate, Measurement
from activesteer.estimation.estimator import Estimator
from activesteer.recording import Recording


class Drive(NamedTuple):
    """A drive.

    Attributes:
        recording: The recording.
        said: Measurements of each step, including the settling before the recording.
    """

    recording: Recording
    said: list[Measurement]


def drive(maneuver: str, vehicle: str = "compact", **overrides: Any) -> Drive:
    """Drive the compact or another car with production sensors and an observer."""
    said: list[Measurement] = []

    class Listening:
        def __init__(self, setup):
            self.inner = load_controller("observer", setup)

        def step(self, command, measurement):
            said.append(measurement)
            return self.inner.step(command, measurement)

    changes = {"sensors.preset": "production", **overrides}
    return Drive(activesteer.simulate(maneuver, Listening, vehicle, changes), said)


def estimates(estimator: Estimator, said: Iterable[Measurement]) -> dict[str, np.ndarray]:
    """Estimates for measurements, by field of `Estimate`."""
    rows = np.array([estimator.step(measurement) for measurement in said])
    return dict(zip(Estimate._fields, rows.T, strict=True))


def rolling(speed_mps: float, spins: Iterable[float] | None = None, **others: Any) -> Measurement:
    """Measurement of a car that rolls straight ahead on wheels of 0.3077 m radius."""
    spin = speed_mps / 0.3077
    zero = {name: 0.0 for name in Measurement._fields[:8]}
    wheels = tuple(spins) if spins is not None else (spin, spin, spin, spin)
    return Measurement(**{**zero, "speed_mps": speed_mps, "wheel_speed_radps": wheels, **others})
