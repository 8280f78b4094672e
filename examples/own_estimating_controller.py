"""Control the sideslip angle with your own controller, which takes the angle from an estimator.

    python examples/own_estimating_controller.py
    activesteer run step_steer -c "examples/own_estimating_controller.py:SideslipDamper?gain=0.4"

Guide: docs/estimation.md.
"""

import math

import activesteer
from activesteer import ActuatorCommand


class SideslipDamper:
    """Steer the rear wheels against the sideslip angle by a fraction of it."""

    def __init__(self, setup, gain=0.5, limit_deg=3.0):
        """Make the estimator, which uses the data of the vehicle file and of the sensors' data sheets."""
        self.estimator = setup.estimator()
        self.gain, self.limit_rad = gain, math.radians(limit_deg)

    def step(self, command, measurement):
        """Advance the estimator and return the actuator command, every millisecond."""
        estimate = self.estimator.step(measurement)
        # Rear wheels steered to the right stop a car that slides to the left of its heading.
        wanted_rad = -self.gain * estimate.sideslip_rad
        if estimate.sideslip_std_rad > math.radians(1.0):
            wanted_rad = 0.0  # nobody knows where it slides
        angle_rad = min(max(wanted_rad, -self.limit_rad), self.limit_rad)
        return ActuatorCommand(rear_steer_demand_rad=angle_rad, estimate=estimate)


def compare():
    """Drive the same step steer without control and with the damper, with the sensors of a production car."""
    sensors = {"sensors.preset": "production"}
    controllers = {"none": "none", "damper": SideslipDamper}
    return {name: activesteer.simulate("step_steer", item, overrides=sensors) for name, item in controllers.items()}


if __name__ == "__main__":
    for name, recording in compare().items():
        print(f"{name:8} sideslip up to {math.degrees(abs(recording['sideslip_rad']).max()):.2f} deg")
