"""Sensors of a present-day car.

Sources:
    SMI700: Robert Bosch GmbH, product information sheet of the SMI700, combined inertial sensor for vehicle dynamics
        control: +-300 deg/s and +-5 g, 100 LSB/(deg/s) and 5000 LSB/g, noise 0.1 deg/s and 6 mg rms, corner frequencies
        11, 18, 21 or 77 Hz, offset within 3 deg/s and 50 mg over temperature and life.
    LWS: messages of a BMW's steering angle sensor as read from its bus (ms4x.net, CAN id 0x1F5): every 10 ms, steps of
        0.04394 deg, +-1440 deg.
    Assumption: typical of the class, not checked against a source.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from activesteer.conventions import GRAVITY_MPS2
from activesteer.sensors.sensor_kinds import (
    AccelerationSensor,
    AngleSensor,
    PressureSensor,
    RateSensor,
    WheelSpeedSensor,
)

_DEG: Final = math.radians(1.0)

_ACCELERATION: Final = AccelerationSensor(
    bandwidth_Hz=21.0,  # SMI700
    sample_time_s=0.01,  # assumption: one message on the bus every 10 ms
    delay_s=0.005,  # assumption: processing and the message; the bandwidth delays by another 1 / (2 pi 21 Hz) = 8 ms
    noise_mps2=0.006 * GRAVITY_MPS2,  # SMI700
    bias_mps2=0.05,  # assumption: what is left when the stability control has learned the offset
    drift_mps2=0.005,  # assumption
    quantum_mps2=GRAVITY_MPS2 / 5000.0,  # SMI700
    limit_mps2=5.0 * GRAVITY_MPS2,  # SMI700
)
_ACTUATOR: Final = AngleSensor(
    sample_time_s=0.001,  # assumption: the motor's own control
    noise_rad=0.005 * _DEG,  # assumption
    bias_rad=0.02 * _DEG,  # assumption: learning of the middle
    quantum_rad=0.005 * _DEG,  # assumption: rotor position behind the gear
)

PRESETS: Final[Mapping[str, Mapping[str, Any]]] = {
    "ideal": {},
    "production": {
        "yaw_rate": RateSensor(
            bandwidth_Hz=21.0,  # SMI700
            sample_time_s=0.01,  # assumption, as for the accelerations
            delay_s=0.005,  # assumption, likewise
            noise_radps=0.1 * _DEG,  # SMI700
            bias_radps=0.1 * _DEG,  # assumption: what is left when the stability control has learned the offset
            drift_radps=0.01 * _DEG,  # assumption
            quantum_radps=0.01 * _DEG,  # SMI700
            limit_radps=300.0 * _DEG,  # SMI700
        ),
        "ax": _ACCELERATION,
        "ay": _ACCELERATION,
        "steering_wheel": AngleSensor(
            sample_time_s=0.01,  # LWS
            delay_s=0.005,  # assumption
            bias_rad=0.5 * _DEG,  # assumption: wheel alignment, learning of straight ahead
            quantum_rad=0.1 * _DEG,  # assumption: the usual step of the class; LWS has 0.04394 deg
            limit_rad=1440.0 * _DEG,  # LWS
        ),
        "rear_steer": _ACTUATOR,
        "superposition": _ACTUATOR,
        "wheel_speed": WheelSpeedSensor(
            sample_time_s=0.005,  # assumption: cycle of an anti-lock control, to whose unit the sensors are wired
            noise_radps=0.02,  # assumption: pitch error of the pulse wheel, 0.03 % at 80 km/h
            teeth=48,  # assumption of the class
        ),
        "brake_pressure": PressureSensor(
            bandwidth_Hz=100.0,  # assumption
            sample_time_s=0.005,  # assumption, as for the wheel speeds
            noise_Pa=2e4,  # assumption: 0.1 % of the range
            bias_Pa=1e5,  # assumption: 0.5 % of the range
            quantum_Pa=1e4,  # assumption
            limit_Pa=20e6,  # assumption: the range of the class
        ),
        "speed_from_wheels": True,
    },
}
"""Preset -> key -> default value."""
