"""The table [sensors] of a vehicle file: what each sensor adds to the truth, by a preset and by single values.

A value that is not given is that of the preset: no error of any kind for `ideal`, those of `production` in `presets`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, ClassVar, Final, Literal

from activesteer.config import Range
from activesteer.errors import ParameterError
from activesteer.sensors.presets import PRESETS
from activesteer.sensors.sensor_kinds import (
    AccelerationSensor,
    AngleSensor,
    PressureSensor,
    RateSensor,
    Sensor,
    WheelSpeedSensor,
)

RANDOM: Final = ("noise", "bias", "drift")
"""How the keys begin whose values are drawn from the seed."""


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
    brake_pressure: PressureSensor = PressureSensor()
    """Pressure in each wheel brake."""
    speed_from_wheels: bool | None = None
    """Whether the speed is that of the wheels that are not driven (of all, where all are) times their rolling radius;
    else it is the car's own."""

    def __post_init__(self) -> None:
        """Puts in what the preset says.

        Raises:
            ParameterError: there is a seed and nothing to draw from it.
        """
        for name, preset in PRESETS[self.preset].items():
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
