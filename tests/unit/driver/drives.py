"""An engine for drivers without a car."""

from activesteer.vehicle.parameters import Powertrain
from activesteer.vehicle.powertrain import Drive

ENGINE = Powertrain(front_share=1.0, max_torque_Nm=1900.0, max_power_W=100e3, engine_brake_torque_Nm=350.0)
DRIVE = Drive(ENGINE)
