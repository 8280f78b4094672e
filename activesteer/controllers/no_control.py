"""Controllers without actuator commands: no control, and an observer that records the estimate."""

from __future__ import annotations

from activesteer.controllers.corrector import DesiredYawRate, desired_yaw_rate
from activesteer.controllers.parameters import ControllerSetup
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement, steering
from activesteer.native.records import NativeBlock
from activesteer.native.shared_laws import law_of
from activesteer.theory.single_track import SingleTrack


class NoControl(NativeBlock):
    """The car without active steering."""

    reads = ("desired_yaw_rate",)
    _desired: DesiredYawRate

    def __init__(self, setup: ControllerSetup) -> None:
        """Create the controller of one run."""
        self._desired = DesiredYawRate(SingleTrack(setup.single_track), setup.gains.desired_yaw_rate, setup.timestep_s)

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return no steering angles, and the desired yaw rate for the recording."""
        return steering(no_control(self, command, measurement))


@law_of(NoControl)
def no_control(
    block: NoControl, command: DriverCommand, measurement: Measurement
) -> tuple[float, float, float, float, float, bool]:
    """Return the first fields of an `ActuatorCommand` by the law of `NoControl.step`."""
    desired = desired_yaw_rate(block._desired, command.front_steer_demand_rad, measurement.speed_mps)
    return 0.0, 0.0, desired, 0.0, 0.0, False


class Observer:
    """No control, with an estimator that records speed, sideslip, yaw rate and friction."""

    reads = ("estimator",)

    def __init__(self, setup: ControllerSetup) -> None:
        """Create the controller of one run."""
        self._estimator = setup.estimator()

    def step(self, _command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return no steering angles, and the estimate for the recording."""
        return ActuatorCommand(estimate=self._estimator.step(measurement))
