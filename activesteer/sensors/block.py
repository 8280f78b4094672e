"""The sensors of a car: constants, memory, and native step.

A sensor has bias, drift, bandwidth, sampling, noise, limit and quantisation. Noise is a function of the seed and of the
number of the sample, so there is no generator whose state has to be kept.

Sources:
    Steele, Lea, Flood 2014, Fast splittable pseudorandom number generators (SplitMix64); Box and Muller 1958.
"""

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
from activesteer.sensors.parameters import RANDOM, Sensor, Sensors

CHAIN: Final = np.dtype(
    (
        np.record,
        [
            *((name, np.intp) for name in ("memory", "period", "ring")),
            *((name, np.float64) for name in ("fraction", "noise", "bias", "wander", "quantum", "limit", "teeth")),
            ("key", np.uint64),
        ],
    )
)
"""Constants of a sensor: place of its memory, steps between samples, length of its delay line. Fraction of the low-pass
filter per step, rms of the noise, offset, rms of the drift per sample, quantisation step and limit (0 for none), teeth
(0 for none), key of its random numbers."""

FILTERED, DRIFT, HELD, STEPS, SAMPLES, PHASE, EDGES, SIDE, AGE, SPAN, SPEED, LINE = range(12)
"""Places in a sensor's memory: low-pass filter, drifted offset, last sample, steps and samples so far. For the pulse
wheel: angle since an edge in teeth, teeth turned since the last sample, direction of the last edge, time since it, time
since the last edge of the sample before, last speed. Then the delay line."""

_GOLDEN: Final = np.uint64(0x9E3779B97F4A7C15)
_FIRST: Final = np.uint64(0xBF58476D1CE4E5B9)
_SECOND: Final = np.uint64(0x94D049BB133111EB)
_S27, _S30, _S31, _S11 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(11)
_TWO: Final = np.uint64(2)
_ONE: Final = np.uint64(1)
_UNIT: Final = 2.0**-53


@inlined
def _uniform(key, number):
    """Return a uniform random number in (0, 1] for a key and a counter."""
    x = key + (number + _ONE) * _GOLDEN
    x = (x ^ (x >> _S30)) * _FIRST
    x = (x ^ (x >> _S27)) * _SECOND
    return (float((x ^ (x >> _S31)) >> _S11) + 1.0) * _UNIT


@inlined
def normals(key, number):
    """Return two independent standard normal random numbers for a key and a counter."""
    first = np.uint64(number) * _TWO
    size = math.sqrt(-2.0 * math.log(_uniform(key, first)))
    angle = 2.0 * math.pi * _uniform(key, first + _ONE)
    return size * math.cos(angle), size * math.sin(angle)


@inlined
def _pass_teeth(chain, memory, speed_radps, timestep_s):
    """Advance the pulse wheel by one step (see `WheelSpeedSensor`)."""
    at = chain.memory
    turned = speed_radps * timestep_s * chain.teeth / (2.0 * math.pi)
    phase = memory[at + PHASE] + turned
    passed = math.floor(phase)
    phase -= passed
    memory[at + PHASE] = phase
    memory[at + SPAN] += timestep_s
    if passed == 0.0:
        memory[at + AGE] += timestep_s
    else:
        # A wheel that turns back passes the same edge once more, and has not turned by a tooth in between.
        direction = math.copysign(1.0, passed)
        again = direction if memory[at + SIDE] == -direction else 0.0
        memory[at + EDGES] += passed - again
        memory[at + SIDE] = direction
        # Edges are at whole teeth. Forwards, the phase is the angle since the last edge; backwards, the rest to one.
        memory[at + AGE] = (phase if turned > 0.0 else 1.0 - phase) / abs(turned) * timestep_s


@inlined
def _pulse_speed(chain, memory):
    """Return the speed from the edges since the last sample [rad/s]."""
    at = chain.memory
    pitch = 2.0 * math.pi / chain.teeth
    edges = memory[at + EDGES]
    # If the wheel turns back within a tooth, it passes the same edge twice, perhaps at once.
    if edges != 0.0 and memory[at + SPAN] > memory[at + AGE]:
        memory[at + SPEED] = pitch * edges / (memory[at + SPAN] - memory[at + AGE])
        memory[at + SPAN], memory[at + EDGES] = memory[at + AGE], 0.0
    else:
        fastest = pitch / memory[at + SPAN]
        memory[at + SPEED] = min(max(memory[at + SPEED], -fastest), fastest)
    return memory[at + SPEED]


@inlined
def passed_on(chain, memory, truth, timestep_s):
    """Return the reading of a sensor one step later."""
    at = chain.memory
    if chain.teeth > 0.0:
        _pass_teeth(chain, memory, truth, timestep_s)
    elif chain.fraction < 1.0:
        memory[at + FILTERED] += chain.fraction * (truth - memory[at + FILTERED])
    else:
        memory[at + FILTERED] = truth
    steps = int(memory[at + STEPS])
    if steps % chain.period == 0:
        value = _pulse_speed(chain, memory) if chain.teeth > 0.0 else memory[at + FILTERED]
        if chain.noise > 0.0 or chain.wander > 0.0:
            noise, wander = normals(chain.key, memory[at + SAMPLES])
            memory[at + SAMPLES] += 1.0
            memory[at + DRIFT] += chain.wander * wander
            value += chain.noise * noise
        value += chain.bias + memory[at + DRIFT]
        if chain.limit > 0.0:
            value = min(max(value, -chain.limit), chain.limit)
        if chain.quantum > 0.0:
            value = chain.quantum * np.rint(value / chain.quantum)
        memory[at + HELD] = value
    memory[at + LINE + steps % chain.ring] = memory[at + HELD]
    memory[at + STEPS] += 1.0
    return memory[at + LINE + (steps + 1) % chain.ring]


MEASURED: Final = numbers_of(Measurement)[1:]
"""Outputs, in their order: the numbers of a `Measurement` without its time."""
_N_OUTPUTS: Final = len(MEASURED)
_NAMES: Final = [number.name for number in MEASURED]
AX, WHEEL_SPEEDS = _NAMES.index("ax_mps2"), _NAMES.index("fl_wheel_speed_radps")
"""Places of the longitudinal acceleration and of the first wheel's speed among the outputs."""
_N_WHEELS: Final = len(CORNERS)
_MINUTE_S: Final = 60.0


class SensorBlock:
    """The sensors of one car: `CHAIN` records, and memory for a bit-identical continuation."""

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
        """Reset the sensors to a true motion that has long been constant."""
        self.memory[:] = 0.0
        self.say(truth)
        for chain, value in zip(self.chains, self.outputs[1:], strict=True):
            own = self.memory[chain["memory"] :][: LINE + chain["ring"]]
            own[[FILTERED, HELD, SPEED]] = value
            own[PHASE] = 0.5  # halfway between two edges
            own[LINE:] = value

    def say(self, measurement: Measurement) -> None:
        """Replace the readings until the next step, for example with the readings of a faulty sensor."""
        parts = (part if isinstance(part, tuple) else (part,) for part in measurement[1:])
        self.outputs[:] = [number for part in parts for number in part]

    def measurement(self, time_s: float) -> Measurement:
        """Return the current readings as a `Measurement`."""
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
    """Return the `CHAIN` record of a sensor, with its own random stream."""
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
def measure(chains, memory, wheel_radii_m, timestep_s):
    """Replace the true values in the memory by the readings one step later."""
    for index in range(1, _N_OUTPUTS):
        memory[index] = passed_on(chains[index - 1], memory, memory[index], timestep_s)
    from_wheels, counted = 0.0, 0.0
    for wheel in range(_N_WHEELS):
        from_wheels += wheel_radii_m[wheel] * memory[WHEEL_SPEEDS + wheel]
        counted += wheel_radii_m[wheel]
    if counted > 0.0:
        memory[0] = from_wheels
