"""Common parts of all electric actuators: a motor with its supply and control loops, and a gear with friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, Final, Self

from activesteer.config import Range, build, read_toml
from activesteer.errors import ParameterError

Positive = Annotated[float, Range(1e-9)]
STOP_BEYOND: Final = 1.03
"""Position of the end stops over the travel at the limit: an assumption."""


@dataclass(frozen=True)
class ElectricActuator:
    """A motor behind a gear; defaults come from the preset."""

    gear: Annotated[float, Range(0.1, 200.0)] | None = None
    """Turns of the motor per turn of the driven part."""
    friction_torque_Nm: Annotated[float, Range(0.0, 10.0)] | None = None
    """Dry friction at the motor without load: bearings, seals, brush [N m]."""
    load_friction: Annotated[float, Range(0.0, 20.0)] | None = None
    """Friction over the load's torque at the motor. For a thread: tan(friction angle) / tan(lead angle); at 1 and more
    it is self-locking."""
    rotor_inertia_kgm2: Annotated[float, Range(1e-7, 1e-2)] | None = None
    """Inertia of everything that turns with the motor [kg m2]."""
    peak_torque_Nm: Positive | None = None
    """Highest torque of the motor, by its current limit [N m]."""
    stall_torque_Nm: Positive | None = None
    """Torque at rest without that limit, at nominal voltage [N m]."""
    no_load_speed_radps: Positive | None = None
    """Speed at which no torque is left, at nominal voltage [rad/s]."""
    speed_limit_radps: Positive | None = None
    """Highest speed demand of its controller [rad/s]."""
    nominal_voltage_V: Positive | None = None
    """Voltage of these values [V]."""
    supply_voltage_V: Annotated[float, Range(0.0, 1000.0)] | None = None
    """Supply voltage; 0: unpowered [V]."""
    supply_power_W: Annotated[float, Range(0.0, 1e5)] | None = None
    """Highest mechanical power that the supply allows the motor [W]."""
    position_gain_1ps: Annotated[float, Range(1.0, 300.0)] | None = None
    """Position loop: speed demand per position error [1/s]."""
    speed_gain_1ps: Annotated[float, Range(5.0, 700.0)] | None = None
    """Speed loop: rate at which a speed error decays, if the motor is strong enough [1/s]."""

    def refuse_keys(self, problem: str) -> None:
        """Refuse keys of a motor for an actuator without one.

        Raises:
            ParameterError: a key other than `preset` is given.
        """
        for item in fields(self):
            if item.name != "preset" and (value := getattr(self, item.name)) is not None:
                raise ParameterError(problem, key=item.name, value=value)

    def filled(self, preset: Mapping[str, Any]) -> Self:
        """Return it with the preset's value for every missing key."""
        return replace(self, **{key: value for key, value in preset.items() if getattr(self, key) is None})

    @property
    def voltage_ratio(self) -> float:
        """Supply over nominal voltage [-]."""
        return known(self.supply_voltage_V) / known(self.nominal_voltage_V)

    def motor_numbers(self) -> dict[str, float]:
        """Fields of a `SCREW` record that follow from these."""
        ratio = self.voltage_ratio
        return {
            "inertia_kgm2": known(self.rotor_inertia_kgm2),
            "position_gain_1ps": known(self.position_gain_1ps),
            "speed_gain_1ps": known(self.speed_gain_1ps),
            "speed_limit_radps": known(self.speed_limit_radps),
            "peak_Nm": known(self.peak_torque_Nm) if ratio > 0.0 else 0.0,
            "stall_Nm": known(self.stall_torque_Nm) * ratio,
            "slope_Nmsprad": known(self.stall_torque_Nm) / known(self.no_load_speed_radps),
            "power_W": known(self.supply_power_W),
            "friction_Nm": known(self.friction_torque_Nm),
            "load_friction": known(self.load_friction),
        }


def presets_of(kind: type[ElectricActuator], table: str) -> dict[str, dict[str, Any]]:
    """Return the presets of a kind of actuator: name -> key -> value in SI."""
    given, source = read_toml(Path(__file__).with_name("actuator_presets.toml"))
    built = {name: build(kind, {"preset": name, **keys}, source, (table, name)) for name, keys in given[table].items()}
    return {name: {key: value for key, value in vars(preset).items() if value is not None and key != "preset"}
            for name, preset in built.items()}  # fmt: skip


def known(value: float | None) -> float:
    """Return a value that the preset has filled in."""
    assert value is not None
    return value
