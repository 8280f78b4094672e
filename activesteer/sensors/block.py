"""The sensors of a car: their constants, their memory, and the native step through them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import islice
from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import CORNERS
from activesteer.core.signals import Measurement, numbers_of, widths_of
from activesteer.native.compilation import inlined
from activesteer.native.memory import load_numbers, store_numbers
from activesteer.sensors.parameters import RANDOM, Sensor, Sensors
from activesteer.sensors.signal_chain import CHAIN, FILTERED, HELD, LINE, PHASE, SPEED, passed_on

MEASURED: Final = numbers_of(Measurement)[1:]
"""Outputs, in their order: the numbers of a `Measurement` without its time."""
_N_OUTPUTS: Final = len(MEASURED)
_NAMES: Final = [number.name for number in MEASURED]
AX, WHEEL_SPEEDS = _NAMES.index("ax_mps2"), _NAMES.index("fl_wheel_speed_radps")
"""Places of the longitudinal acceleration and of the first wheel's speed among the outputs."""
_N_WHEELS: Final = len(CORNERS)
_MINUTE_S: Final = 60.0


class SensorBlock:
    """The sensors of one car: `CHAIN` records, and memory from which a run continues bit-identically.

    `outputs` is a view of the memory: the members of `Measurement` without its time.
    """

    def __init__(self, sensors: Sensors, timestep_s: float) -> None:
        """Draw the random constants of a run."""
        # The speed comes from the wheels; every other number has the sensor that its field is named after.
        every = [sensors.all()[number.field.rpartition("_")[0]] for number in MEASURED[1:]]
        self.chains = np.zeros(len(every), CHAIN)
        self.bias_rms = [sensor.amount("bias") for sensor in every]
        place = len(MEASURED)
        for index, sensor in enumerate(every):
            self.chains[index] = _chain(sensor, place, sensors.seed or 0, index, timestep_s)
            place += LINE + int(self.chains[index]["ring"])
        self.memory: NDArray[np.float64] = np.zeros(place)
        self.outputs = self.memory[: len(MEASURED)]

    def reset(self, truth: Measurement) -> None:
        """Start anew, as if the truth had been constant for long."""
        self.memory[:] = 0.0
        self.say(truth)
        for chain, value in zip(self.chains, self.outputs[1:], strict=True):
            own = self.memory[chain["memory"] :][: LINE + chain["ring"]]
            own[[FILTERED, HELD, SPEED]] = value
            own[PHASE] = 0.5  # halfway between two edges
            own[LINE:] = value

    def say(self, measurement: Measurement) -> None:
        """Replace the readings until the next step, for example by those of a faulty sensor."""
        parts = (part if isinstance(part, tuple) else (part,) for part in measurement[1:])
        self.outputs[:] = [number for part in parts for number in part]

    def measurement(self, time_s: float) -> Measurement:
        """Return the current readings."""
        values = iter(self.outputs.tolist())
        parts = (next(values) if width == 1 else tuple(islice(values, width)) for width in widths_of(Measurement)[1:])
        return Measurement._make((time_s, *parts))


def speed_radii(front_fraction: float, rolling_radii_m: Sequence[float]) -> tuple[float, ...]:
    """Return the factor of each wheel's rotational speed in the speed of the car [m]."""
    counts = [
        fraction == 0.0 for fraction in (front_fraction, front_fraction, 1.0 - front_fraction, 1.0 - front_fraction)
    ]
    if not any(counts):
        counts = [True] * len(counts)
    return tuple(radius / sum(counts) if count else 0.0 for radius, count in zip(rolling_radii_m, counts, strict=True))


def _chain(sensor: Sensor, place: int, seed: int, index: int, timestep_s: float) -> tuple[float, ...]:
    """Return a record of `CHAIN`. Each sensor has its own random stream, whatever the others are."""
    period = max(1, round((sensor.sample_time_s or 0.0) / timestep_s))
    bandwidth_Hz = sensor.bandwidth_Hz or 0.0
    fraction = 1.0 - math.exp(-2.0 * math.pi * bandwidth_Hz * timestep_s) if bandwidth_Hz else 1.0
    noise, bias, drift = (sensor.amount(word) for word in RANDOM)
    stream = np.random.SeedSequence((seed, index))
    return (
        place,
        period,
        round((sensor.delay_s or 0.0) / timestep_s) + 1,
        fraction,
        noise,
        bias * np.random.default_rng(stream).standard_normal(),
        drift * math.sqrt(period * timestep_s / _MINUTE_S),
        sensor.amount("quantum"),
        sensor.amount("limit"),
        sensor.amount("teeth"),
        stream.generate_state(1, np.uint64)[0],
    )


@inlined
def measured(chains, memory, wheel_radii_m, timestep_s, truth):
    """Return the readings of the sensors after one more step."""
    outputs = truth[1:]
    store_numbers(memory.ctypes.data, outputs)
    for index in range(1, _N_OUTPUTS):
        memory[index] = passed_on(chains[index - 1], memory, memory[index], timestep_s)
    from_wheels, counted = 0.0, 0.0
    for wheel in range(_N_WHEELS):
        from_wheels += wheel_radii_m[wheel] * memory[WHEEL_SPEEDS + wheel]
        counted += wheel_radii_m[wheel]
    if counted > 0.0:
        memory[0] = from_wheels
    return truth[:1] + load_numbers(memory.ctypes.data, outputs)
