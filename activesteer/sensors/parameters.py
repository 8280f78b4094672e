"""The table [sensors] of a vehicle file: kinds of sensors, and their errors.

The default of each key comes from the preset: no error of any kind for `ideal`, the errors of production.toml for
`production`.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, Literal, TypeVar, dataclass_transform

from activesteer.config import Range, build, read_toml
from activesteer.core.conventions import CORNERS
from activesteer.core.signals import Measurement, widths_of
from activesteer.errors import ParameterError

_Class = TypeVar("_Class")
_Amount = Annotated[float, Range(0.0)]
_Delay = Annotated[float, Range(0.0, 0.1)]
_SampleTime = Annotated[float, Range(1e-4, 0.1)]
_Bandwidth = Annotated[float, Range(0.1, 1e4)]


@dataclass(frozen=True)
class Sensor:
    """Keys of all sensors, except keys in the unit of the measured quantity.

    `noise`: white noise of the samples, rms. `bias`: offset of a run, drawn from the seed, rms over seeds. `drift`:
    random walk of the offset, rms of its change within a minute. `quantum`: step of quantisation. `limit`: saturation
    to either side.

    The order is: bias and drift are added; the sum is low-pass filtered, sampled, given its noise, limited and
    quantised; the result appears after the delay.
    """

    bandwidth_Hz: _Bandwidth | None = None
    """Corner frequency (-3 dB) of a first-order low-pass before sampling [Hz]."""
    sample_time_s: _SampleTime | None = None
    """Time between two samples, in whole steps of the simulation. The output is held in between [s]."""
    delay_s: _Delay | None = None
    """Delay from the sample to the output, in whole steps of the simulation [s]."""

    @property
    def is_ideal(self) -> bool:
        """True if the sensor is ideal."""
        return not any(getattr(self, field.name) for field in fields(self))

    def amount(self, word: str) -> float:
        """Return the value of the key that starts with `word`, in the unit of the sensor, or 0 if not given."""
        return next((getattr(self, field.name) for field in fields(self) if field.name.startswith(word)), None) or 0.0


@dataclass(frozen=True)
class RateSensor(Sensor):
    """A sensor of an angular rate."""

    noise_radps: _Amount | None = None
    bias_radps: _Amount | None = None
    drift_radps: _Amount | None = None
    quantum_radps: _Amount | None = None
    limit_radps: _Amount | None = None


@dataclass(frozen=True)
class WheelSpeedSensor(RateSensor):
    """A sensor of the rotational speed of a wheel.

    All four sensors are alike.

    With teeth, the sensor counts the edges of a pulse wheel that pass between two samples and measures their time. If
    no edge passes, the reading is at most the speed that the time since the last edge allows. The sign of rotation is
    known, and an edge that passes again in the other direction does not count.
    """

    teeth: Annotated[int, Range(0, 1000)] | None = None
    """Edges per turn, or 0 for a sensor without a pulse wheel."""


@dataclass(frozen=True)
class AccelerationSensor(Sensor):
    """A sensor of an acceleration."""

    noise_mps2: _Amount | None = None
    bias_mps2: _Amount | None = None
    drift_mps2: _Amount | None = None
    quantum_mps2: _Amount | None = None
    limit_mps2: _Amount | None = None


@dataclass(frozen=True)
class PressureSensor(Sensor):
    """A sensor of a hydraulic pressure."""

    noise_Pa: _Amount | None = None
    bias_Pa: _Amount | None = None
    drift_Pa: _Amount | None = None
    quantum_Pa: _Amount | None = None
    limit_Pa: _Amount | None = None


@dataclass(frozen=True)
class AngleSensor(Sensor):
    """A sensor of an angle."""

    noise_rad: _Amount | None = None
    bias_rad: _Amount | None = None
    drift_rad: _Amount | None = None
    quantum_rad: _Amount | None = None
    limit_rad: _Amount | None = None


RANDOM: Final = ("noise", "bias", "drift")
"""First words of the keys whose values are drawn from the seed."""
_KINDS: Final = {"radps": RateSensor, "mps2": AccelerationSensor, "rad": AngleSensor, "Pa": PressureSensor}
"""Kind of sensor for each unit of a field of `Measurement`."""


@dataclass_transform(frozen_default=True)
def _with_sensors(cls: type[_Class]) -> type[_Class]:
    """Convert a class into a frozen dataclass with an ideal sensor in each field, as a decorator."""
    for field, width in zip(Measurement._fields, widths_of(Measurement), strict=True):
        name, _, unit = field.rpartition("_")
        if unit in _KINDS:  # time and speed have none
            kind = WheelSpeedSensor if width == len(CORNERS) and unit == "radps" else _KINDS[unit]
            cls.__annotations__[name] = kind
            setattr(cls, name, kind())
    return dataclass(frozen=True)(cls)


@_with_sensors
class Sensors:
    """Sensors of a car, ideal by default.

    Each signal of a `Measurement` but time and speed has a sensor, whose table has the name of the signal without its
    unit: `yaw_rate`, `ay`, `wheel_speed`. The wheels share one table.
    """

    KEY_HINTS: ClassVar = {
        "noise": "each sensor has its own, as sensors.yaw_rate.noise_degps",
        "bias": "each sensor has its own, as sensors.yaw_rate.bias_degps",
        "delay_s": "each sensor has its own, as sensors.yaw_rate.delay_s; commands have controllers.bus_delay_s",
    }

    preset: Literal["ideal", "production"] = "ideal"
    """Default of all keys."""
    seed: Annotated[int, Range(0, 2**32 - 1)] | None = None
    """Seed of noise, bias and drift. Default 0. It has no effect if no sensor has any of these."""
    speed_from_wheels: bool | None = None
    """True if the speed comes from the undriven wheels (from all wheels if all are driven) times their rolling radius.
    Otherwise it is the car's true speed."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Sensor:
            """Return a sensor."""
            ...

    def __post_init__(self) -> None:
        """Fill in the values of the preset."""
        for name, preset in (vars(_production()) if self.preset == "production" else {}).items():
            if name not in ("preset", "seed"):
                object.__setattr__(self, name, _filled(getattr(self, name), preset))
        random = any(sensor.amount(word) for sensor in self.all().values() for word in RANDOM)
        if random and self.seed is None:
            object.__setattr__(self, "seed", 0)
        elif self.seed is not None and not random:
            raise ParameterError(
                f"has no effect: with preset = {self.preset!r} no sensor has noise, bias or drift",
                key="seed",
                value=self.seed,
            )

    def all(self) -> dict[str, Sensor]:
        """Return the sensors by name."""
        return {field.name: sensor for field in fields(self) if isinstance(sensor := getattr(self, field.name), Sensor)}

    @property
    def is_ideal(self) -> bool:
        """True if all sensors are ideal."""
        return not self.speed_from_wheels and all(sensor.is_ideal for sensor in self.all().values())


@functools.cache
def _production() -> Sensors:
    return build(Sensors, *read_toml(Path(__file__).with_name("production.toml")))


def _filled(given: Any, preset: Any) -> Any:
    """Return the given values, completed by the values of the preset."""
    if not isinstance(preset, Sensor):
        return preset if given is None else given
    return replace(preset, **{key: value for key, value in vars(given).items() if value is not None})
