"""The driver of every manoeuvre: does what is asked, be it a path, a curvature or an angle of the steering wheel."""

from __future__ import annotations

from activesteer.driver.base import DriverSetup
from activesteer.driver.constant_radius import ConstantRadiusDriver
from activesteer.driver.open_loop import OpenLoopDriver
from activesteer.driver.path_preview import PathPreviewDriver
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint
from activesteer.theory.single_track import SingleTrack


class HumanDriver:
    """Follows a path, keeps a curvature, or turns the steering wheel as asked; holds the speed in all of it.

    How well is a matter of the driver file; see `DriverParameters`.
    """

    def __init__(
        self, open_loop: OpenLoopDriver, constant_radius: ConstantRadiusDriver, path: PathPreviewDriver
    ) -> None:
        """Joins the three.

        Args:
            open_loop: Turns the steering wheel as asked.
            constant_radius: Keeps a curvature.
            path: Follows a path.
        """
        self._open_loop = open_loop
        self._constant_radius = constant_radius
        self._path = path

    @classmethod
    def from_vehicle(cls, setup: DriverSetup) -> HumanDriver:
        """Makes the driver for a car."""
        robot, single_track = OpenLoopDriver.from_vehicle(setup), SingleTrack(setup.single_track)
        return cls(
            robot,
            ConstantRadiusDriver(robot, single_track.wheelbase_m, setup.timestep_s),
            PathPreviewDriver(robot, single_track.matrices, setup.parameters, setup.timestep_s),
        )

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """What the driver does now; see `Driver`."""
        if setpoint.path is not None:
            return self._path.step(setpoint, measurement, motion)
        if setpoint.curvature_demand_1pm is not None:
            return self._constant_radius.step(setpoint, measurement, motion)
        return self._open_loop.step(setpoint, measurement, motion)
