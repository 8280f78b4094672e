"""Compare your own controller, a yaw damper for the rear wheels, with no control and the built-in rear steering.

    python examples/own_controller.py
    activesteer run sine_with_dwell -c none -c "examples/own_controller.py:YawDamper?gain_s=0.05"

Guide: docs/controller.md.
"""

import math

import activesteer
from activesteer import ActuatorCommand


class YawDamper:
    """Steer the rear wheels in the direction of every fast change of the yaw rate, but not of a steady yaw rate."""

    def __init__(self, setup, gain_s=0.05, washout_s=0.3):
        """Take the car's data from `setup`, and your own parameters from the other arguments."""
        self.gain_s = gain_s
        self.fraction = setup.timestep_s / washout_s  # of a first-order low-pass filter, per step
        self.limit_rad = math.radians(3.0)  # stop of the rear steering hinge
        self.lasting_radps = 0.0

    def step(self, command, measurement):
        """Return the actuator command for the driver's command and the measurement, every millisecond."""
        quick_radps = measurement.yaw_rate_radps - self.lasting_radps
        self.lasting_radps += self.fraction * quick_radps
        wanted_rad = self.gain_s * quick_radps
        angle_rad = min(max(wanted_rad, -self.limit_rad), self.limit_rad)
        # Left is positive: rear wheels steered to the left push the rear end left, so the car turns left more slowly.
        return ActuatorCommand(rear_steer_demand_rad=angle_rad, saturated=angle_rad != wanted_rad)


def compare():
    """Drive the same sine with dwell without control, with the built-in rear steering, and with the damper."""
    controllers = {"none": "none", "ars": "ars", "yaw damper": YawDamper}
    return {name: activesteer.simulate("sine_with_dwell", item) for name, item in controllers.items()}


if __name__ == "__main__":
    for name, recording in compare().items():
        sideslip_deg = math.degrees(recording.metrics["sideslip_peak_abs_rad"])
        print(f"{name:10}  sideslip {sideslip_deg:5.1f} deg, {recording.metrics['lateral_displacement_m']:.2f} m aside")
