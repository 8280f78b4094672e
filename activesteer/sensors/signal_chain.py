"""One step of one sensor as native code: bias, drift, bandwidth, sampling, noise, limit, quantisation.

Noise is a function of the seed and of the number of the sample, so there is no generator whose state has to be kept.

Sources:
    Steele, Lea, Flood 2014, Fast splittable pseudorandom number generators (SplitMix64); Box and Muller 1958.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.native.compilation import inlined

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

FILTERED, DRIFT, HELD, STEPS, SAMPLES, PHASE, EDGES, AGE, SPAN, SPEED, LINE = range(11)
"""Places in a sensor's memory: low-pass filter, drifted offset, last sample, steps and samples so far. For the pulse
wheel: angle since an edge in teeth, edges since the last sample, time since the last edge, time since the last edge of
the sample before, last speed. Then the delay line."""

_GOLDEN: Final = np.uint64(0x9E3779B97F4A7C15)
_FIRST: Final = np.uint64(0xBF58476D1CE4E5B9)
_SECOND: Final = np.uint64(0x94D049BB133111EB)
_S27, _S30, _S31, _S11 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(11)
_TWO: Final = np.uint64(2)
_ONE: Final = np.uint64(1)
_UNIT: Final = 2.0**-53


@inlined
def _uniform(key, number):
    """Return a random number in (0, 1] for a key and a running number."""
    x = key + (number + _ONE) * _GOLDEN
    x = (x ^ (x >> _S30)) * _FIRST
    x = (x ^ (x >> _S27)) * _SECOND
    return (float((x ^ (x >> _S31)) >> _S11) + 1.0) * _UNIT


@inlined
def normals(key, number):
    """Return two independent random numbers of the normal distribution for a key and a running number."""
    first = np.uint64(number) * _TWO
    size = math.sqrt(-2.0 * math.log(_uniform(key, first)))
    angle = 2.0 * math.pi * _uniform(key, first + _ONE)
    return size * math.cos(angle), size * math.sin(angle)


@inlined
def _pass_teeth(chain, memory, speed_radps, timestep_s):
    """Turn the pulse wheel by one step (see `WheelSpeedSensor`)."""
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
        memory[at + EDGES] += passed
        # Edges lie at whole teeth. Forwards, the phase is the angle since the last edge; backwards, the rest to one.
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
    """Return the reading of a sensor after one more step."""
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
