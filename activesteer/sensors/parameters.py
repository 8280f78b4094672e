"""The table [sensors] of a vehicle file: the errors of each sensor, by a preset and by single values.

The default of each key comes from the preset: no error of any kind for `ideal`, those of production.toml for
`production`.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal

from activesteer.config import Range, build, read_toml
from activesteer.errors import ParameterError
from activesteer.sensors.sensor_kinds import (
    AccelerationSensor,
    AngleSensor,
    PressureSensor,
    RateSensor,
    Sensor,
    WheelSpeedSensor,
)

RANDOM: Final = ("noise", "bias", "drift")
"""First words of the keys whose values are drawn from the seed."""


@dataclass(frozen=True)
class Sensors:
    """Sensors between the car and its controllers; default `ideal`."""

    KEY_HINTS: ClassVar = {
        "noise": "each sensor has its own, as sensors.yaw_rate.noise_degps",
        "bias": "each sensor has its own, as sensors.yaw_rate.bias_degps",
        "delay_s": "each sensor has its own, as sensors.yaw_rate.delay_s; commands have controllers.bus_delay_s",
    }

    preset: Literal["ideal", "production"] = "ideal"
    """Default of all keys."""
    seed: Annotated[int, Range(0, 2**32 - 1)] | None = None
    """Seed of noise, bias and drift; default 0. It has no effect if no sensor has any of these."""
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
    brake_pressure: PressureSensor = PressureSensor()
    """Pressure in each wheel brake."""
    speed_from_wheels: bool | None = None
    """Whether the speed is that of the wheels that are not driven (of all wheels if all are driven) times their rolling
    radius; else it is the car's own."""

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
        """True if the measurement is the truth."""
        return not self.speed_from_wheels and all(sensor.is_ideal for sensor in self.all().values())


@functools.cache
def _production() -> Sensors:
    return build(Sensors, *read_toml(Path(__file__).with_name("production.toml")))


def _filled(given: Any, preset: Any) -> Any:
    """Return the given values, and those of the preset for missing ones."""
    if not isinstance(preset, Sensor):
        return preset if given is None else given
    return replace(preset, **{key: value for key, value in vars(given).items() if value is not None})
