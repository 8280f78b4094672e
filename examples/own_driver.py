"""Drive the double lane change with your own driver, who steers towards one point ahead (pure pursuit).

    python examples/own_driver.py
    activesteer run double_lane_change --driver "examples/own_driver.py:PurePursuit?preview_s=0.5"

Guide: docs/driver.md.
"""

import math

import numpy as np

import activesteer
from activesteer.driver import OpenLoopDriver
from activesteer.road.native_path import PathSearch


class PurePursuit:
    """Steer along the arc from the car to a point on the path (Coulter 1992)."""

    def __init__(self, setup, preview_s=0.6):
        """Take the car's data from `setup`: steering ratio, single-track model, engine, and more."""
        self.robot = OpenLoopDriver.from_vehicle(setup)  # turns the steering wheel, holds the speed
        self.steering_ratio = setup.steering_ratio
        self.wheelbase_m = setup.single_track.cg_to_front_m + setup.single_track.cg_to_rear_m
        self.preview_s = preview_s
        self.travelled_m = 0.0

    def step(self, setpoint, measurement, motion):
        """Return the driver's command for setpoint, measurement and motion of the car, every millisecond."""
        if setpoint.path is None:  # the car still settles, or the manoeuvre gives the steering wheel angle itself
            return self.robot.step(setpoint, measurement, motion)
        search = PathSearch(setpoint.path)
        self.travelled_m = search.nearest(motion.x_m, motion.y_m, self.travelled_m, 5.0)
        (x_m,), (y_m,) = search.at(np.array([self.travelled_m + self.preview_s * motion.speed_mps]))
        bearing_rad = math.atan2(y_m - motion.y_m, x_m - motion.x_m) - motion.yaw_rad
        distance_m = math.hypot(x_m - motion.x_m, y_m - motion.y_m)
        curvature_1pm = 2.0 * math.sin(bearing_rad) / distance_m
        angle_rad = self.steering_ratio * math.atan(self.wheelbase_m * curvature_1pm)
        return self.robot.steer_to(angle_rad, setpoint, measurement)


def compare(speed_kmh=60.0):
    """Drive the double lane change with the typical driver and with this driver."""
    drivers = {"typical": "typical", "pure pursuit": PurePursuit}
    overrides = {"speed_kmh": speed_kmh, "duration_s": 13.0}
    return {
        name: activesteer.simulate("double_lane_change", driver=driver, overrides=overrides)
        for name, driver in drivers.items()
    }


if __name__ == "__main__":
    for name, recording in compare().items():
        steering_deg = math.degrees(recording.metrics["steering_wheel_peak_abs_rad"])
        deviation_m = recording.metrics["track_deviation_max_m"]
        print(f"{name:12}  {deviation_m:.2f} m off the path at most, steering wheel {steering_deg:.0f} deg")
