"""The table [sensors] of a vehicle file: what each sensor adds to the truth, by a preset and by single values.

A value that is not given is that of the preset: no error of any kind for `ideal`, those of `production` in `presets`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, ClassVar, Final, Literal

from activesteer.config import Range
from activesteer.errors import ParameterError

_Amount = Annotated[float, Range(0.0)]
_Delay = Annotated[float, Range(0.0, 0.1)]
_SampleTime = Annotated[float, Range(1e-4, 0.1)]
_Bandwidth = Annotated[float, Range(0.1, 1e4)]

RANDOM: Final = ("noise", "bias", "drift")
"""How the keys begin whose values are drawn from the seed."""


@dataclass(frozen=True)
class Sensor:
    """What all sensors have; the rest has the unit of what is measured.

    In this order: bias and drift are added, the sum goes through the bandwidth, is sampled, gets its noise, is limited,
    quantised, and comes out after the delay.
    """

    bandwidth_Hz: _Bandwidth | None = None
    """Corner frequency (-3 dB) of a first-order low-pass before sampling [Hz]."""
    sample_time_s: _SampleTime | None = None
    """Time between two samples, in whole steps of the simulation; the output is held between [s]."""
    delay_s: _Delay | None = None
    """From the sample to when it comes out, in whole steps of the simulation [s]."""

    @property
    def is_ideal(self) -> bool:
        """Whether what comes out is the truth."""
        return not any(getattr(self, field.name) for field in fields(self))

    def amount(self, word: str) -> float:
        """The value of the key that begins with a word and ends in the unit; 0 where it is not given."""
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
    """Where it saturates, to either side [rad/s]."""


@dataclass(frozen=True)
class WheelSpeedSensor(RateSensor):
    """A sensor of the rotational speed of a wheel; all four are alike.

    With teeth, the edges of a pulse wheel that pass between two samples are counted and their time is measured; where
    none passes, the wheel is not faster than the time since the last one allows. The sign of rotation is known.
    """

    teeth: Annotated[int, Range(0, 1000)] | None = None
    """Edges that pass in a turn; 0 for a sensor without a pulse wheel."""


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
    """Where it saturates, to either side [m/s2]."""


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
    """Where it saturates, to either side [rad]."""


@dataclass(frozen=True)
class Sensors:
    """What the car's controllers see of it; `ideal` where nothing else is given."""

    KEY_HINTS: ClassVar = {
        "noise": "each sensor has its own, as sensors.yaw_rate.noise_degps",
        "bias": "each sensor has its own, as sensors.yaw_rate.bias_degps",
        "delay_s": "each sensor has its own, as sensors.yaw_rate.delay_s; commands have controllers.bus_delay_s",
    }

    preset: Literal["ideal", "production"] = "ideal"
    """Values of all keys that are not given."""
    seed: Annotated[int, Range(0, 2**32 - 1)] | None = None
    """Decides noise, bias and drift; 0 where not given. It has no effect where no sensor has any of these."""
    yaw_rate: RateSensor = RateSensor()
    """Yaw rate."""
    ax: AccelerationSensor = AccelerationSensor()
    """Longitudinal acceleration."""
    ay: AccelerationSensor = AccelerationSensor()
    """Lateral acceleration."""
    steering_wheel: AngleSensor = AngleSensor()
    """Steering wheel angle."""
    rear_steer: AngleSensor = AngleSensor()
    """Position of the rear steering actuator, at the wheels."""
    superposition: AngleSensor = AngleSensor()
    """Position of the front superposition, at the road wheels."""
    wheel_speed: WheelSpeedSensor = WheelSpeedSensor()
    """Rotational speed of each wheel."""
    speed_from_wheels: bool | None = None
    """Whether the speed is that of the wheels that are not driven (of all, where all are) times their rolling radius;
    else it is the car's own."""

    def __post_init__(self) -> None:
        """Puts in what the preset says.

        Raises:
            ParameterError: there is a seed and nothing to draw from it.
        """
        # Here, because the presets are made of these classes.
        from activesteer.sensors.presets import PRESETS  # noqa: PLC0415

        for name, preset in PRESETS[self.preset].items():
            object.__setattr__(self, name, _filled(getattr(self, name), preset))
        random = any(sensor.amount(word) for sensor in self.all().values() for word in RANDOM)
        if random and self.seed is None:
            object.__setattr__(self, "seed", 0)
        elif self.seed is not None and not random:
            problem = f"has no effect: with preset = {self.preset!r} no sensor has noise, bias or drift"
            raise ParameterError(problem, key="seed", value=self.seed)

    def all(self) -> dict[str, Sensor]:
        """The sensors by name."""
        return {field.name: sensor for field in fields(self) if isinstance(sensor := getattr(self, field.name), Sensor)}

    @property
    def is_ideal(self) -> bool:
        """Whether what comes out is the truth."""
        return not self.speed_from_wheels and all(sensor.is_ideal for sensor in self.all().values())


def _filled(given: Any, preset: Any) -> Any:
    """The given values, those of the preset where there is none."""
    if not isinstance(preset, Sensor):
        return preset if given is None else given
    return replace(preset, **{key: value for key, value in vars(given).items() if value is not None})
