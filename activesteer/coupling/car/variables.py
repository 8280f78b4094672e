"""Variables of an exported car, and its model description."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple
from xml.sax.saxutils import quoteattr

from jinja2 import Environment, StrictUndefined

from activesteer.config.faults import ACTUATORS
from activesteer.controllers import CONTROLLER
from activesteer.core.conventions import CORNERS
from activesteer.core.signals import CORNERS_IN_WORDS, Measurement, numbers_in, numbers_of
from activesteer.core.units import find_unit
from activesteer.core.version import __version__
from activesteer.driver import DRIVER
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.vehicle.channels.native_channels import Actuator, AxialForce, Column, RawRows
from activesteer.vehicle.parameters import Factors
from activesteer.vehicle.step_bindings import CARRIED_OUT, COMMANDS

INPUT, OUTPUT, PARAMETER = "input", "output", "parameter"
FROM_RESULT, FROM_FORCE, FROM_LIMIT, FROM_MOTION, FROM_INPUT = range(17, 22)
"""Sources of a value in addition to the arrays of `RawRows`, whose places are 0 to 15; as in car.c."""
_MAX_TORQUE_NM: Final = 1e5
_MAX_PRESSURE_PA: Final = 1e8
MOTION: Final = (
    "yaw_rad", "roll_rad", "pitch_rad", "vx_mps", "vy_mps", "speed_mps", "yaw_rate_radps", "ax_mps2", "ay_mps2",
    "az_mps2", "sideslip_rad",
    *(f"{corner}_{name}" for name in ("steer_rad", "camber_rad", "travel_m") for corner in CORNERS),
    "front_steer_rad", "rear_steer_rad", "superposition_rad",
)  # fmt: skip
"""Channels that car.c computes, in its order. Those with a sine may differ from a recording in the last digit."""

PLACE_GROUPS: Final = (
    ("chassis_orientation",), ("cg_velocity",), ("cg_accelerometer",), ("cg_gyro",),
    tuple(f"{corner}_wheel_axis" for corner in CORNERS), tuple(f"{corner}_wheel_position" for corner in CORNERS),
    ("rl_steer_angle", "rr_steer_angle"), ("superposition_angle",),
)  # fmt: skip
"""Sensors of the engine that these channels are computed from."""
PLACES: Final = [name for names in PLACE_GROUPS for name in names]
"""Names of these sensors in the order of their places in car.c. The place of a position is the place of its height."""


class Variable(NamedTuple):
    """A variable of an exported car."""

    name: str
    unit: str  # unit; empty for a pure number
    meaning: str  # one line, with the sign convention where it matters
    causality: str  # `INPUT`, `OUTPUT` or `PARAMETER`
    start: float = 0.0  # start value
    low: float = -math.inf  # least value; `high` is the largest
    high: float = math.inf
    source: int = FROM_INPUT  # place of its array in `RawRows`, or another source
    column: int = 0  # place in the source


_MEANINGS: Final = {
    "steering_wheel_demand_rad": ("rad", "steering wheel angle demand, left positive"),
    "gear": ("", "1 forward, -1 reverse, 0 with the clutch open"),
}


def inputs_of(loop: ClosedLoop, road_mu: float) -> list[Variable]:
    """Return the input variables. They start with the inputs of the native step, in the order of `CARRIED_OUT`."""
    driver, actuator = loop.commands
    starts = dict(zip(COMMANDS, (*numbers_in(driver), *numbers_in(actuator)), strict=True))
    numbers = {number.name: number for command in (driver, actuator) for number in numbers_of(type(command))}
    ranges = {**CONTROLLER.ranges, **DRIVER.ranges}
    found = []
    for name in CARRIED_OUT:
        recorded = numbers[name].recorded
        unit, meaning = _MEANINGS.get(name) or (recorded.unit, recorded.meaning)  # pyright: ignore[reportOptionalMemberAccess]
        low, high = ranges.get(numbers[name].field, (-_MAX_TORQUE_NM, _MAX_TORQUE_NM))
        found.append(Variable(name, unit, meaning, INPUT, starts[name], low, high))
    forces = -_MAX_TORQUE_NM, _MAX_TORQUE_NM
    for ending, unit, words, (low, high) in (
        ("brake_pressure_request_Pa", "Pa", "brake pressure in addition to the pedal's", (0.0, _MAX_PRESSURE_PA)),
        ("drive_torque_Nm", "Nm", "drive torque if wheel_torques_set, forward positive", forces),
        ("brake_torque_Nm", "Nm", "brake torque if wheel_torques_set, against the rotation", (0.0, _MAX_TORQUE_NM)),
    ):
        found += [
            Variable(f"{corner}_{ending}", unit, f"{words}, {place}", INPUT, 0.0, low, high)
            for corner, place in CORNERS_IN_WORDS.items()
        ]
    meaning = "1 if the torques of the individual wheels replace drive torque and pedal, else 0"
    return [
        *found,
        Variable("wheel_torques_set", "", meaning, INPUT, 0.0, 0.0, 1.0),
        Variable("road_mu", "", "friction of the road outside of patches", INPUT, road_mu, 0.01, 2.0),
        *(variable for part in faulty_parts(loop) for variable in _fault_inputs(part)),
    ]


FAULT_KINDS: Final = ("works", "stuck", "runaway to the left or to the largest torque", "runaway to the right", "float",
                      "reversed", "dropout")  # fmt: skip
"""Kinds of an actuator's fault by the number that the input takes, as in car.c."""


def faulty_parts(loop: ClosedLoop) -> list[str]:
    """Return the steering actuators and brakes that can fail (see `faults.ACTUATORS`)."""
    rear = ("rear",) if loop.vehicle.parameters.rear_actuator.is_central else ("rear_left", "rear_right")
    return [*rear, "superposition", *(f"{corner}_brake" for corner in CORNERS)]


def _fault_inputs(part: str) -> list[Variable]:
    """Return the input variables for the faults of a part: kind, and offset of its demand."""
    unit, name = ACTUATORS[part].unit, part.replace("_", " ")
    kinds = [f"{number} {kind}" for number, kind in enumerate(FAULT_KINDS)
             if unit != "Nm" or kind not in ("float", "runaway to the right")]  # fmt: skip
    most = _MAX_TORQUE_NM if unit == "Nm" else math.pi
    return [
        Variable(f"{part}_fault", "", f"fault of {name}: {', '.join(kinds)}", INPUT, 0.0, 0.0, len(FAULT_KINDS) - 1.0),
        Variable(
            f"{part}_offset_{unit}", unit, f"offset of the demand of {name} while it works", INPUT, 0.0, -most, most
        ),
    ]


def outputs_of(loop: ClosedLoop, taken: set[str]) -> tuple[list[Variable], list[AxialForce], list[Actuator]]:
    """Return the output variables: measurement, motion and recorded channels."""
    found = [
        Variable(f"measured_{number.name}", number.recorded.unit, f"{number.recorded.meaning}, measured", OUTPUT,
                 source=FROM_RESULT, column=1 + place)
        for place, number in enumerate(numbers_of(Measurement))
        if number.recorded is not None
    ]  # fmt: skip
    about = {channel.name: channel for channel in loop.vehicle.channels.channels}
    found += [
        Variable(name, about[name].unit, about[name].meaning.replace("unwrapped", "within half a turn"), OUTPUT,
                 source=FROM_MOTION, column=place)
        for place, name in enumerate(MOTION)
    ]  # fmt: skip
    forces: list[AxialForce] = []
    limits: list[Actuator] = []
    names = taken | {variable.name for variable in found}
    for channel, values in loop.vehicle.channels.signals():
        if channel.name in names or (isinstance(values, Column) and values.array == "commands"):
            continue
        if isinstance(values, Column):
            source, column = RawRows._fields.index(values.array), values.column
        elif isinstance(values, AxialForce):
            source, column = FROM_FORCE, len(forces)
            forces.append(values)
        elif isinstance(values, Actuator):
            source, column = FROM_LIMIT, len(limits)
            limits.append(values)
        else:
            continue
        found.append(Variable(channel.name, channel.unit, channel.meaning, OUTPUT, source=source, column=column))
    return found, forces, limits


_FACTORS: Final = ("tyre_friction", "tyre_cornering_stiffness", "front_cornering_stiffness", "rear_cornering_stiffness",
                   "tyre_slip_stiffness")  # fmt: skip
_FACTOR_RANGE: Final = (0.2, 3.0)
SEEDS: Final = 256
"""Number of sensor seeds that an exported car knows."""


def parameters_of(speed_mps: float, seed: int) -> list[Variable]:
    """Return the parameters, in the order of car.c."""
    given: tuple[tuple[str, str, str, float, float, float], ...] = (
        ("start_speed_mps", "m/s", "speed at the start", speed_mps, 1.0, 100.0),
        ("added_mass_kg", "kg", "mass fixed to the chassis", 0.0, -300.0, 2000.0),
        ("added_mass_x_m", "m", "its place along the car, in the axes of the model", 0.0, -10.0, 10.0),
        ("added_mass_y_m", "m", "its place left of the middle", 0.0, -3.0, 3.0),
        ("added_mass_z_m", "m", "its height over the road in the design position", 0.5, -1.0, 5.0),
        ("cg_forward_change_m", "m", "shift of the car's centre of gravity forward", 0.0, -0.5, 0.5),
        ("cg_height_change_m", "m", "shift of the car's centre of gravity upward", 0.0, -0.3, 0.5),
        *((f"{name}_factor", "", f"factor on the {name.replace('_', ' ')}", 1.0, *_FACTOR_RANGE) for name in _FACTORS),
        (
            "sensor_seed",
            "",
            f"seed of noise and offsets of the sensors, 0 to {SEEDS - 1}",
            float(seed),
            0.0,
            SEEDS - 1.0,
        ),
    )
    return [Variable(name, unit, words, PARAMETER, start, low, high) for name, unit, words, start, low, high in given]


assert {*_FACTORS} <= {*Factors.__dataclass_fields__}


def model_description(
    variables: Sequence[Variable], identifier: str, token: str, version: int, timestep_s: float
) -> str:
    """Return the content of modelDescription.xml, from the template of that name."""
    units = dict.fromkeys(variable.unit for variable in variables if variable.unit)
    known = {name: unit.dimension if (unit := find_unit(name)) else () for name in units}
    bases = {name: dict(zip(("kg", "m", "s", "rad"), exponents, strict=False)) for name, exponents in known.items()}
    environment = Environment(
        undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    environment.filters |= {"attribute": quoteattr, "number": lambda value: repr(float(value))}
    template = (Path(__file__).parent / "modelDescription.xml").read_text("utf-8")
    return environment.from_string(template).render(
        variables=variables, identifier=identifier, token=token, version=version, timestep_s=timestep_s, units=bases,
        release=__version__, outputs=[place for place, each in enumerate(variables) if each.causality == OUTPUT],
        isfinite=math.isfinite,
    )  # fmt: skip
