"""Drive a car in your own loop with your own commands: from 10 to 15 m/s, and into a left turn of 50 m radius.

    python examples/own_loop.py

Guide: docs/stepping.md.
"""

import activesteer
from activesteer import ActuatorCommand, DriverCommand


def drive(radius_m=50.0, speed_mps=15.0):
    """Command the car every 10 ms until the manoeuvre ends, and return the simulation."""
    simulation = activesteer.Simulation("straight_line", overrides={"duration_s": 8.0, "speed_mps": 10.0})
    measurement, wheel_rad = simulation.measurement, 0.0
    while not simulation.done:
        wheel_rad += 0.05 * (measurement.speed_mps / radius_m - measurement.yaw_rate_radps)
        torque_Nm = min(1500.0 * (speed_mps - measurement.speed_mps), 1200.0)
        rear = ActuatorCommand(rear_steer_demand_rad=0.005 * wheel_rad)  # with the front wheels
        measurement = simulation.advance(10, DriverCommand(wheel_rad, torque_Nm), rear)
    return simulation


if __name__ == "__main__":
    simulation = drive()
    truth = simulation.truth
    print(f"{simulation.recording()}")
    print(f"{truth['speed_mps']:.2f} m/s, {truth['speed_mps'] / truth['yaw_rate_radps']:.1f} m radius")
