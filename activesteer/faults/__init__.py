"""Faults of actuators and sensors, and their times. Here they are described; `vehicle.faults` activates them."""

from activesteer.faults.fault import ACTUATORS, ANGLE_SENSOR, KINDS, MOTOR, SENSORS, Fault, check_faults, fault_table

__all__ = ["ACTUATORS", "ANGLE_SENSOR", "KINDS", "MOTOR", "SENSORS", "Fault", "check_faults", "fault_table"]
