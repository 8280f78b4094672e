"""The driver of every manoeuvre: follows a path, a curvature or a steering wheel angle."""

from __future__ import annotations

from activesteer.driver.base import DriverSetup
from activesteer.driver.constant_radius import ConstantRadiusDriver
from activesteer.driver.open_loop import OpenLoopDriver
from activesteer.driver.path_preview import N_SPEEDS, SPEED_STEP_MPS, PathPreviewDriver
from activesteer.errors import SimulationDiverged
from activesteer.native_blocks import NativeBlock
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint
from activesteer.theory.single_track import SingleTrack


class HumanDriver(NativeBlock):
    """Driver that follows a path, a curvature or a steering wheel angle, and holds the speed.

    The driver file sets the skill; see `DriverParameters`.
    """

    _open_loop: OpenLoopDriver
    _constant_radius: ConstantRadiusDriver
    _path: PathPreviewDriver

    def __init__(
        self, open_loop: OpenLoopDriver, constant_radius: ConstantRadiusDriver, path: PathPreviewDriver
    ) -> None:
        """Combine three drivers: for a steering wheel angle, a curvature, and a path."""
        self._open_loop = open_loop
        self._constant_radius = constant_radius
        self._path = path

    @classmethod
    def from_vehicle(cls, setup: DriverSetup) -> HumanDriver:
        """Make the driver for a car."""
        robot, single_track = OpenLoopDriver.from_vehicle(setup), SingleTrack(setup.single_track)
        return cls(
            robot,
            ConstantRadiusDriver(robot, single_track.wheelbase_m, setup.timestep_s),
            PathPreviewDriver(robot, single_track.matrices, setup.parameters, setup.timestep_s),
        )

    def prepare(self, speed_mps: float) -> int:
        """Compute the gains on a path at a speed for compiled code, and return how many there are.

        Raises:
            SimulationDiverged: the speed is beyond all reason.
        """
        rounded = round(speed_mps / SPEED_STEP_MPS)
        if not 0 <= rounded < N_SPEEDS:
            raise SimulationDiverged(f"the car drives at {speed_mps:g} m/s", value="speed_mps")
        return self._path.gains_at(rounded).size

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """Return the command; see `Driver`."""
        if setpoint.path is not None:
            return self._path.step(setpoint, measurement, motion)
        if setpoint.curvature_demand_1pm is not None:
            return self._constant_radius.step(setpoint, measurement, motion)
        return self._open_loop.step(setpoint, measurement, motion)
