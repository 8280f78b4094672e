"""The actuators' records in the block of the native forces (`force_block`): where they stand, and what they say."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.vehicle import force_block as fb
from activesteer.vehicle.toe_link_screws import SCREW


class ActuatorRecords:
    """Views of the records of a compiled car: what is written into them acts from the next step on."""

    def __init__(self, model: mujoco.MjModel, rear: tuple[int, int]) -> None:
        """Finds the block.

        Args:
            model: The car, compiled and with its block.
            rear: Actuators of the left and the right rear wheel.
        """
        self._model = model
        self._block = model.numeric_data[int(model.numeric_data[-fb.TRAILER_SIZE]) :]
        self._rear = rear

    def of(self, actuator: int) -> NDArray[np.float64]:
        """The record of an actuator, shape (ACTUATOR_SIZE,)."""
        start = int(self._block[fb.ACTUATORS_START]) + actuator * fb.ACTUATOR_SIZE
        return self._block[start : start + fb.ACTUATOR_SIZE]

    def screw(self, actuator: int) -> tuple[NDArray[np.float64], ...]:
        """The records of link and screw of an actuator, that of its motor alone where no link follows, or nothing."""
        record = self.of(actuator)
        if record[fb.A_KIND] == fb.KIND_SCREW:
            return (self._part(record, fb.SCREW_SIZE),)
        if record[fb.A_KIND] != fb.KIND_LINK:
            return ()
        names = {self._model.actuator(index).name for index in range(self._model.nu)}
        own = self._model.actuator(actuator).name[:2] + SCREW
        screw = self._model.actuator(own if own in names else f"rear{SCREW}").id
        return self._part(record, fb.LINK_SIZE), self._part(self.of(screw), fb.SCREW_SIZE)

    def rear_screws(self) -> Iterator[tuple[NDArray[np.float64], ...]]:
        """Records of link and screw of every rear wheel that has a screw."""
        for actuator in self._rear:
            if records := self.screw(actuator):
                yield records

    def rear_states_at(self, angle_rad: float) -> dict[int, float]:
        """Activations of the rear steering actuators that have arrived at an angle [rad], by their addresses."""
        states: dict[int, float] = {}
        for actuator in self._rear:
            address = int(self._model.actuator_actadr[actuator])
            if records := self.screw(actuator):
                link, screw = records
                powers = angle_rad ** np.arange(1, fb.POWERS + 1)
                travel = float(screw[fb.S_TRAVEL : fb.S_TRAVEL + fb.POWERS] @ powers)
                states[int(screw[fb.S_ACT])] = travel
                states[address] = float(link[fb.L_SIGN]) * travel
            else:
                states[address] = angle_rad
        return states

    def _part(self, record: NDArray[np.float64], size: int) -> NDArray[np.float64]:
        start = int(self._block[fb.SCREWS_START]) + int(record[fb.A_FIRST])
        return self._block[start : start + size]
