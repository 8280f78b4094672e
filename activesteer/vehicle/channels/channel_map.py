"""The table of a car's channels, and their computation from raw rows."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import Array
from activesteer.errors import ParameterError
from activesteer.sensors.block import MEASURED
from activesteer.vehicle.channels.corners import (
    MOTION_CHANNELS,
    CarMotion,
    actuator_signals,
    brake_signals,
    corner_signals,
    electric_signals,
    link_signals,
    motion_copied,
    motion_inputs,
    motor_signals,
    steering_signals,
)
from activesteer.vehicle.channels.native_channels import (
    Actuator,
    AxialForce,
    Column,
    Computed,
    RawRows,
    Signal,
    Values,
    record_of,
    signal,
    take_rows,
    within,
)
from activesteer.vehicle.parameters import VehicleParameters
from activesteer.vehicle.step_bindings import COMMAND_CHANNELS, ESTIMATE_CHANNELS

MAX_VALUE: Final = float(np.finfo(np.float32).max)
"""Largest recorded value: files store most channels with 32 bits."""


class ChannelMap:
    """All channels of a vehicle, evaluated block by block, with their table in the order of the columns."""

    def __init__(self, model: mujoco.MjModel, parameters: VehicleParameters) -> None:
        """Look up the parts of the model by name, once."""
        self._gravity_mps2 = model.opt.gravity
        self._motion_copied, self._motion_inputs = motion_copied(model), motion_inputs(model)
        measured = () if parameters.sensors.is_ideal else MEASURED
        self._signals = [
            *steering_signals(model, parameters.steering), *corner_signals(model), *link_signals(model),
            *actuator_signals(model), *motor_signals(model),
            *(Signal(channel, Column("commands", place)) for channel, place in COMMAND_CHANNELS.items()),
            *(
                signal(
                    "measured", f"measured_{number.name}", f"{number.recorded.meaning}, measured",
                    Column("measured", place),
                )
                for place, number in enumerate(measured)
                if number.recorded is not None
            ),
            *brake_signals(),
            *electric_signals(parameters.motors),
            signal(
                "vehicle", "active_faults", "number of active faults of actuators and sensors",
                Column("userdata", model.nuserdata - 1),
            ),
        ]  # fmt: skip
        self._arrange()

    def add_estimate(self) -> None:
        """Add the channels of a controller's estimate."""
        self._signals += [Signal(channel, Column("estimate", place)) for place, channel in enumerate(ESTIMATE_CHANNELS)]
        self._arrange()

    def _arrange(self) -> None:
        """Arrange the columns: motion first, then the other signals in their order."""
        self.channels = (*MOTION_CHANNELS, *(signal.channel for signal in self._signals))
        values = [*(self._motion_copied.get(channel.name) for channel in MOTION_CHANNELS)]
        self._motion = [(place, MOTION_CHANNELS[place].name) for place, value in enumerate(values) if value is None]
        values += [signal.values for signal in self._signals]
        wanted = [(place, value) for place, value in enumerate(values) if value is not None]
        self._forces, self._limits = _of_kind(AxialForce, wanted), _of_kind(Actuator, wanted)
        self._copies = _copies([(value, place) for place, value in wanted if isinstance(value, Column)])
        computed = [(place, value) for place, value in wanted if isinstance(value, Computed)]
        inputs = dict.fromkeys((*self._motion_inputs, *(column for _, value in computed for column in value.columns)))
        self._inputs = {column: place for place, column in enumerate(inputs)}
        self._input_copies = _copies(list(self._inputs.items()))
        self._computed = [
            (place, value.law, [self._inputs[column] for column in value.columns]) for place, value in computed
        ]
        self._widths = _widths(wanted, self._inputs)
        self._late = np.array([place for place, *_ in (*self._motion, *self._computed)], np.intp)

    def signals(self) -> list[Signal]:
        """Return the channels with their rules, except the motion (see `CarMotion`)."""
        channels = (channel for channel in MOTION_CHANNELS if channel.name in self._motion_copied)
        return [*(Signal(channel, self._motion_copied[channel.name]) for channel in channels), *self._signals]

    def inputs(self, count: int) -> Array:
        """Allocate rows for the intermediate values between `take` and `compute`."""
        return np.empty((count, len(self._inputs)), order="F")

    def take(self, rows: RawRows, out: Array, inputs: Array) -> bool:
        """Compute the compiled channels. Call it for few rows, while they are in the processor's caches."""
        count = self._checked(inputs, out)
        for name, array, width in zip(RawRows._fields, rows, self._widths, strict=True):
            if not _is_matrix(array, count, width) or (width > 1 and array.strides[1] != array.itemsize):
                raise ParameterError(f"has {_form(array)}; {count} rows of {width} float64 are needed", key=name)
        return take_rows(
            tuple(rows), self._copies, self._input_copies, self._forces, self._limits, out, inputs, MAX_VALUE
        )

    def compute(self, inputs: Array, out: Array, last_yaw_rad: float = 0.0) -> bool:
        """Compute the channels of NumPy. Call it for many rows."""
        self._checked(inputs, out)
        # The last rows of a diverged run are not finite; record them without a warning.
        with np.errstate(invalid="ignore", over="ignore"):
            motion = CarMotion(inputs[:, : len(self._motion_inputs)], self._gravity_mps2, last_yaw_rad)
            for place, name in self._motion:
                out[:, place] = getattr(motion, name)
            for place, law, columns in self._computed:
                out[:, place] = law(*(inputs[:, column] for column in columns))
        return within(out, self._late, MAX_VALUE)

    def evaluate(self, rows: RawRows) -> Array:
        """Return all channels of raw rows, shape (n, channels), with the first yaw angle within half a turn."""
        count = len(rows.sensordata)
        out, inputs = np.empty((count, len(self.channels)), order="F"), self.inputs(count)
        self.take(rows, out, inputs)
        self.compute(inputs, out)
        return out

    def _checked(self, inputs: Array, out: Array) -> int:
        """Check the output arrays of `take` and `compute`, and return their number of rows."""
        count = len(out) if isinstance(out, np.ndarray) and out.ndim else 0
        for name, array, width in (("out", out, len(self.channels)), ("inputs", inputs, len(self._inputs))):
            if not _is_matrix(array, count, width) or array.shape[1] != width or array.strides[0] != array.itemsize:
                raise ParameterError(f"has {_form(array)}; ({count}, {width}) float64 by column are needed", key=name)
        return count


def _is_matrix(array: object, rows: int, columns: int) -> bool:
    """Return whether an array is writable float64 with enough rows and columns."""
    return (
        isinstance(array, np.ndarray)
        and array.dtype == np.float64
        and array.ndim == 2
        and len(array) == rows
        and array.shape[1] >= columns
        and array.flags.behaved
    )


def _form(array: object) -> str:
    return f"shape {array.shape} of {array.dtype}" if isinstance(array, np.ndarray) else f"type {type(array).__name__}"


def _widths(wanted: list[tuple[int, Values]], inputs: Iterable[Column]) -> list[int]:
    """Return the number of columns of each array of `RawRows` that compiled code reads."""
    columns = [*inputs, *(value for _, value in wanted if isinstance(value, Column))]
    for _, value in wanted:
        if isinstance(value, AxialForce):
            columns += [Column(name, value.tendon) for name in ("ten_length", "ten_velocity")]
        elif isinstance(value, Actuator):
            columns += [Column(name, value.control) for name in ("ctrl", "actuator_force")]
            columns.append(Column("act", value.activation))
    return [max((c.column + 1 for c in columns if c.array == name), default=0) for name in RawRows._fields]


def _copies(wanted: list[tuple[Column, int]]) -> tuple[NDArray[np.intp], ...]:
    """Return the tables of the copied columns for `take_rows`: array ends, columns and target columns."""
    order = sorted((RawRows._fields.index(array), column, place) for (array, column), place in wanted)
    arrays, columns, places = np.array(order, np.intp).reshape(-1, 3).T.copy()
    return np.searchsorted(arrays, np.arange(len(RawRows._fields)), side="right"), columns, places


def _of_kind(kind: type[AxialForce | Actuator], wanted: list[tuple[int, Any]]) -> tuple[NDArray[Any], NDArray[np.intp]]:
    """Return the tables of a kind of channel for `take_rows`: laws, and target columns."""
    laws = [(values, place) for place, values in wanted if isinstance(values, kind)]
    return np.array([law for law, _ in laws], record_of(kind)), np.array([place for _, place in laws], np.intp)
