"""The table of all channels of a car, and their values from raw rows."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import Array
from activesteer.sensors.block import MEASURED
from activesteer.vehicle.channels.actuators import actuator_signals, motor_signals
from activesteer.vehicle.channels.car_motion import MOTION_CHANNELS, MOTION_SENSORS, CarMotion
from activesteer.vehicle.channels.corners import brake_signals, corner_signals
from activesteer.vehicle.channels.links import link_signals
from activesteer.vehicle.channels.native_channels import (
    Actuator,
    AxialForce,
    axial_forces,
    copy_columns,
    record_of,
    saturations,
)
from activesteer.vehicle.channels.raw_rows import Column, RawRows, Signal, signal
from activesteer.vehicle.channels.steering import steering_signals
from activesteer.vehicle.command_row import COMMAND_CHANNELS
from activesteer.vehicle.estimate_row import ESTIMATE_CHANNELS
from activesteer.vehicle.named_parts import sensor_columns
from activesteer.vehicle.parameters import VehicleParameters


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
        self._motion_sensors = {name: sensor_columns(model, name) for name in MOTION_SENSORS}
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
        wanted = [(place, signal.values) for place, signal in enumerate(self._signals, len(MOTION_CHANNELS))]
        self._computed = [(place, values) for place, values in wanted if callable(values)]
        self._forces, self._limits = _of_kind(AxialForce, wanted), _of_kind(Actuator, wanted)
        self._copied = []
        for array in RawRows._fields:
            here = [(v.column, place) for place, v in wanted if isinstance(v, Column) and v.array == array]
            if here:
                self._copied.append((array, *np.array(here, np.intp).T.copy()))

    def evaluate(self, rows: RawRows, out: Array, last_yaw_rad: float = 0.0) -> None:
        """Values of all channels.

        Args:
            rows: Raw rows of n steps, n > 0.
            out: Where the values go, shape (n, len(channels)).
            last_yaw_rad: Yaw angle of the row before the first one, which the angle is unwrapped from [rad].
        """
        # The last rows of a run that diverged are not finite; they are to be recorded, not complained about.
        with np.errstate(invalid="ignore", over="ignore"):
            for array, columns, places in self._copied:
                copy_columns(getattr(rows, array), columns, out, places)
            laws, places = self._forces
            axial_forces(rows.ten_length, rows.ten_velocity, laws, out, places)
            laws, places = self._limits
            saturations(rows.ctrl, rows.act, rows.actuator_force, laws, out, places)
            # What follows works on whole columns, many times.
            rows = rows._replace(sensordata=np.asfortranarray(rows.sensordata))
            motion = CarMotion(rows.sensordata, self._motion_sensors, self._gravity_mps2, last_yaw_rad)
            for place, channel in enumerate(MOTION_CHANNELS):
                out[:, place] = getattr(motion, channel.name)
            for place, values in self._computed:
                out[:, place] = values(rows)


def _of_kind(kind: type[AxialForce | Actuator], wanted: list[tuple[int, Any]]) -> tuple[NDArray[Any], NDArray[np.intp]]:
    """What compiled code takes of a kind of channel: the laws, and the places of the channels."""
    here = [(values, place) for place, values in wanted if isinstance(values, kind)]
    return np.array([law for law, _ in here], record_of(kind)), np.array([place for _, place in here], np.intp)
