"""An engine for drivers without a car."""

from dataclasses import replace

from activesteer.driver import DriverParameters
from activesteer.vehicle.parameters import Powertrain, PowertrainLimits

ENGINE = Powertrain(front_fraction=1.0, max_torque_Nm=1900.0, max_power_W=100e3, engine_brake_torque_Nm=350.0)
DRIVE = PowertrainLimits(ENGINE)


def parameters(**changed: float) -> DriverParameters:
    """Parameters of a driver, in round numbers."""
    round_numbers = DriverParameters(
        preview_s=1.3,
        reaction_delay_s=0.2,
        neuromuscular_lag_s=0.1,
        return_time_s=1.0,
        steering_rate_per_metre_radps=4.0,
        steering_rate_limit_radps=15.0,
    )
    return replace(round_numbers, **changed)
