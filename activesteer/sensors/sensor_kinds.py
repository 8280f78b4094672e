"""The kinds of sensors and the keys of their errors."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated

from activesteer.config import Range

_Amount = Annotated[float, Range(0.0)]
_Delay = Annotated[float, Range(0.0, 0.1)]
_SampleTime = Annotated[float, Range(1e-4, 0.1)]
_Bandwidth = Annotated[float, Range(0.1, 1e4)]


@dataclass(frozen=True)
class Sensor:
    """Keys that all sensors have; the other keys carry the unit of the measured quantity.

    The order is: bias and drift are added; the sum is low-pass filtered, sampled, given its noise, limited and
    quantised; the result appears after the delay.
    """

    bandwidth_Hz: _Bandwidth | None = None
    """Corner frequency (-3 dB) of a first-order low-pass before sampling [Hz]."""
    sample_time_s: _SampleTime | None = None
    """Time between two samples, in whole steps of the simulation; the output is held between [s]."""
    delay_s: _Delay | None = None
    """Delay from the sample to the output, in whole steps of the simulation [s]."""

    @property
    def is_ideal(self) -> bool:
        """True if the output is the truth."""
        return not any(getattr(self, field.name) for field in fields(self))

    def amount(self, word: str) -> float:
        """Return the value of the key that begins with a word and ends in the unit; 0 if it is not given."""
        return next((getattr(self, field.name) for field in fields(self) if field.name.startswith(word)), None) or 0.0


@dataclass(frozen=True)
class RateSensor(Sensor):
    """A sensor of an angular rate."""

    noise_radps: _Amount | None = None
    """White noise of the samples, rms [rad/s]."""
    bias_radps: _Amount | None = None
    """Offset of a run, drawn from the seed: rms over seeds [rad/s]."""
    drift_radps: _Amount | None = None
    """Random walk of the offset: rms of its change within a minute [rad/s]."""
    quantum_radps: _Amount | None = None
    """Step of quantisation [rad/s]."""
    limit_radps: _Amount | None = None
    """Saturation to either side [rad/s]."""


@dataclass(frozen=True)
class WheelSpeedSensor(RateSensor):
    """A sensor of the rotational speed of a wheel; all four are alike.

    With teeth, the sensor counts the edges of a pulse wheel that pass between two samples and measures their time. If
    no edge passes, the reading is at most the speed that the time since the last edge allows. The sign of rotation is
    known.
    """

    teeth: Annotated[int, Range(0, 1000)] | None = None
    """Edges per turn; 0 for a sensor without a pulse wheel."""


@dataclass(frozen=True)
class AccelerationSensor(Sensor):
    """A sensor of an acceleration."""

    noise_mps2: _Amount | None = None
    """White noise of the samples, rms [m/s2]."""
    bias_mps2: _Amount | None = None
    """Offset of a run, drawn from the seed: rms over seeds [m/s2]."""
    drift_mps2: _Amount | None = None
    """Random walk of the offset: rms of its change within a minute [m/s2]."""
    quantum_mps2: _Amount | None = None
    """Step of quantisation [m/s2]."""
    limit_mps2: _Amount | None = None
    """Saturation to either side [m/s2]."""


@dataclass(frozen=True)
class PressureSensor(Sensor):
    """A sensor of a hydraulic pressure."""

    noise_Pa: _Amount | None = None
    """White noise of the samples, rms [Pa]."""
    bias_Pa: _Amount | None = None
    """Offset of a run, drawn from the seed: rms over seeds [Pa]."""
    drift_Pa: _Amount | None = None
    """Random walk of the offset: rms of its change within a minute [Pa]."""
    quantum_Pa: _Amount | None = None
    """Step of quantisation [Pa]."""
    limit_Pa: _Amount | None = None
    """Saturation to either side [Pa]."""


@dataclass(frozen=True)
class AngleSensor(Sensor):
    """A sensor of an angle."""

    noise_rad: _Amount | None = None
    """White noise of the samples, rms [rad]."""
    bias_rad: _Amount | None = None
    """Offset of a run, drawn from the seed: rms over seeds [rad]."""
    drift_rad: _Amount | None = None
    """Random walk of the offset: rms of its change within a minute [rad]."""
    quantum_rad: _Amount | None = None
    """Step of quantisation [rad]."""
    limit_rad: _Amount | None = None
    """Saturation to either side [rad]."""
