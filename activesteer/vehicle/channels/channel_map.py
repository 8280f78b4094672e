"""The table of all channels of a car, and their values from raw rows."""

from __future__ import annotations

from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import Array
from activesteer.sensors.block import MEASURED
from activesteer.vehicle.channels.actuators import actuator_signals, motor_signals
from activesteer.vehicle.channels.car_motion import MOTION_CHANNELS, CarMotion, motion_copied, motion_inputs
from activesteer.vehicle.channels.corners import brake_signals, corner_signals
from activesteer.vehicle.channels.links import link_signals
from activesteer.vehicle.channels.native_channels import record_of, take_rows, within
from activesteer.vehicle.channels.raw_rows import Actuator, AxialForce, Column, Computed, RawRows, Signal, signal
from activesteer.vehicle.channels.steering import steering_signals
from activesteer.vehicle.command_row import COMMAND_CHANNELS
from activesteer.vehicle.estimate_row import ESTIMATE_CHANNELS
from activesteer.vehicle.parameters import VehicleParameters

MAX_VALUE: Final = float(np.finfo(np.float32).max)
"""Most that a recorded value may be: files keep most channels to 32 bit."""


class ChannelMap:
    """All channels of a vehicle, evaluated block by block.

    Attributes:
        channels: Their table, in the order of the columns.
    """

    def __init__(self, model: mujoco.MjModel, parameters: VehicleParameters) -> None:
        """Looks up everything by name, once.

        Args:
            model: The car.
            parameters: Its parameters.

        Raises:
            ModelError: a sensor, tendon or actuator is missing.
        """
        self._gravity_mps2 = model.opt.gravity
        self._motion_copied, self._motion_inputs = motion_copied(model), motion_inputs(model)
        measured = () if parameters.sensors.is_ideal else MEASURED
        self._signals = [
            *steering_signals(model, parameters.steering), *corner_signals(model), *link_signals(model),
            *actuator_signals(model), *motor_signals(model),
            *(Signal(channel, Column("commands", place)) for channel, place in COMMAND_CHANNELS.items()),
            *(
                signal(
                    "measured", f"measured_{name}", unit, f"{meaning} as the sensors say it", Column("measured", place)
                )
                for place, (name, unit, meaning) in enumerate(measured)
            ),
            *brake_signals(),
            signal(
                "vehicle", "active_faults", "", "how many faults of actuators and sensors act",
                Column("userdata", model.nuserdata - 1),
            ),
        ]  # fmt: skip
        self._arrange()

    def add_estimate(self) -> None:
        """Adds the channels of what a controller estimates."""
        self._signals += [Signal(channel, Column("estimate", place)) for place, channel in enumerate(ESTIMATE_CHANNELS)]
        self._arrange()

    def _arrange(self) -> None:
        """The motion comes first, behind it the signals in their order."""
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
        self._late = np.array([place for place, *_ in (*self._motion, *self._computed)], np.intp)

    def inputs(self, count: int) -> Array:
        """Room for what `take` leaves for `compute`, of `count` rows."""
        return np.empty((count, len(self._inputs)), order="F")

    def take(self, rows: RawRows, out: Array, inputs: Array) -> bool:
        """Everything that compiled code does; cheap for few rows at a time, while they are in the processor's caches.

        Args:
            rows: Raw rows of n steps, n > 0.
            out: Where the values of channels go, shape (n, len(channels)), by column.
            inputs: Where what `compute` needs goes, n rows of `inputs`.

        Returns:
            Whether no value is larger than `MAX_VALUE`, and all are finite.
        """
        return take_rows(
            tuple(rows), self._copies, self._input_copies, self._forces, self._limits, out, inputs, MAX_VALUE
        )

    def compute(self, inputs: Array, out: Array, last_yaw_rad: float = 0.0) -> bool:
        """Everything that numpy does; best for many rows at a time.

        Args:
            inputs: What `take` left, n rows.
            out: Where the values of channels go, shape (n, len(channels)).
            last_yaw_rad: Yaw angle of the row before the first one, which the angle is unwrapped from [rad].

        Returns:
            As `take`.
        """
        # The last rows of a run that diverged are not finite; they are to be recorded, not complained about.
        with np.errstate(invalid="ignore", over="ignore"):
            motion = CarMotion(inputs[:, : len(self._motion_inputs)], self._gravity_mps2, last_yaw_rad)
            for place, name in self._motion:
                out[:, place] = getattr(motion, name)
            for place, law, columns in self._computed:
                out[:, place] = law(*(inputs[:, column] for column in columns))
        return within(out, self._late, MAX_VALUE)

    def evaluate(self, rows: RawRows) -> Array:
        """Values of all channels of n raw rows, shape (n, len(channels)); the first yaw angle is within half a turn."""
        count = len(rows.sensordata)
        out, inputs = np.empty((count, len(self.channels)), order="F"), self.inputs(count)
        self.take(rows, out, inputs)
        self.compute(inputs, out)
        return out


def _copies(wanted: list[tuple[Column, int]]) -> tuple[NDArray[np.intp], ...]:
    """What compiled code takes of what is copied: where each array's part ends, columns, places; see `take_rows`."""
    order = sorted((RawRows._fields.index(array), column, place) for (array, column), place in wanted)
    arrays, columns, places = np.array(order, np.intp).reshape(-1, 3).T.copy()
    return np.searchsorted(arrays, np.arange(len(RawRows._fields)), side="right"), columns, places


def _of_kind(kind: type[AxialForce | Actuator], wanted: list[tuple[int, Any]]) -> tuple[NDArray[Any], NDArray[np.intp]]:
    """What compiled code takes of a kind of channel: the laws, and the places of the channels."""
    here = [(values, place) for place, values in wanted if isinstance(values, kind)]
    return np.array([law for law, _ in here], record_of(kind)), np.array([place for _, place in here], np.intp)
