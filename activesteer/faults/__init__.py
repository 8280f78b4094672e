"""What may go wrong with actuators and sensors of a car, and when: the description; `vehicle.faults` lets it act."""

from activesteer.faults.fault import ACTUATORS, ANGLE_SENSOR, KINDS, SENSORS, Fault, check_faults
from activesteer.faults.text import fault_table

__all__ = ["ACTUATORS", "ANGLE_SENSOR", "KINDS", "SENSORS", "Fault", "check_faults", "fault_table"]
