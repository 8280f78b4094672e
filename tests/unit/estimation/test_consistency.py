"""The errors of the filter match its covariance: exactly in its own model, nearly in the multibody car.

Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.4 (NEES,
NIS and their bounds by the chi-square distribution).
"""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from activesteer import simulate
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.estimation.kalman_filter import begin, correct, predict
from activesteer.estimation.records import (
    AY_OFFSET,
    BANK,
    FRICTION,
    FRONT_ERROR,
    FRONT_SLIP,
    FRONT_STIFFNESS,
    LATERAL_SPEED,
    MEMORY,
    N_STATES,
    RATE_OFFSET,
    REAR_ERROR,
    REAR_RATIO,
    REAR_SLIP,
    REAR_STIFFNESS,
    YAW_RATE,
    known_of,
)
from activesteer.estimation.setup import EstimatorParameters
from activesteer.estimation.two_track_model import follow, follow_roll, forces_of, slip_angles
from activesteer.scenario import resolve

MOTION = [LATERAL_SPEED, YAW_RATE]
RUNS, STEPS, INTERVAL_S, SPEED_MPS = 100, 150, 0.01, 25.0


def bounds(freedom: int, samples: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the interval of the mean of `samples` squared errors."""
    low, high = chi2.ppf([0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence], freedom * samples) / samples
    return low, high


@pytest.fixture(scope="module")
def known_and_tyres():
    setup = resolve("straight_line", overrides={"sensors.preset": "production"}).controller_setup(0.001)
    assert setup.estimation is not None
    known = known_of(setup.estimation, setup.gains.estimator, setup.timestep_s)[0]
    return known, np.array([tyre.force_N for tyre in setup.estimation.tyres])


def drift(known, memory, state, duration_s, rng):
    """Draw the unknowns of the filter, as described in `kalman_filter`."""
    front_rad, rear_rad = slip_angles.py_func(known, memory, state, SPEED_MPS)
    for place, mean, size, time_s in (
        (FRONT_ERROR, 0.0, known.slip_angle_std_rad + known.slip_angle_fraction * abs(front_rad), known.slip_angle_s),
        (REAR_ERROR, 0.0, known.slip_angle_std_rad + known.slip_angle_fraction * abs(rear_rad), known.slip_angle_s),
        (AY_OFFSET, 0.0, known.ay_offset_std_mps2, known.ay_offset_s),
        (BANK, 0.0, known.bank_std_mps2, known.bank_s),
        (FRICTION, known.friction, known.friction_std, known.friction_s),
        (FRONT_STIFFNESS, 1.0, known.stiffness_std, known.stiffness_s),
        (REAR_STIFFNESS, 1.0, known.stiffness_std, known.stiffness_s),
        (REAR_RATIO, 1.0, known.rear_ratio_std, known.stiffness_s),
    ):
        kept = math.exp(-duration_s / time_s)
        state[place] = mean + kept * (state[place] - mean) + size * math.sqrt(1.0 - kept**2) * rng.standard_normal()
    state[RATE_OFFSET] += math.sqrt(known.rate_walk_rad2ps3 * duration_s) * rng.standard_normal()
    state[LATERAL_SPEED] += math.sqrt(known.lateral_density_m2ps3 * duration_s) * rng.standard_normal()
    state[YAW_RATE] += math.sqrt(known.yaw_density_rad2ps3 * duration_s) * rng.standard_normal()


def force_stds_N(known, forces_N):
    """Standard deviations of the force errors of both axles [N]."""
    return known.force_std_N + known.force_fraction * np.abs(forces_N)


def white(known, rng):
    """Yield relative errors over a step [s] and at its end [-] in turn, as the filter assumes them: white, with the
    power of lasting errors."""
    while True:
        yield math.sqrt(2.0 * known.force_s * INTERVAL_S) * rng.standard_normal(2)
        yield math.sqrt(1.0 + 2.0 * known.force_s / INTERVAL_S) * rng.standard_normal(2)


def lasting(known, rng):
    """Yield the same errors as intended: each lasts for `force_s`, in motion and measurement alike."""
    error, kept = rng.standard_normal(2), math.exp(-INTERVAL_S / known.force_s)
    while True:
        yield INTERVAL_S * error
        error = kept * error + math.sqrt(1.0 - kept**2) * rng.standard_normal(2)
        yield error


def one_run(record, tyres, rng: np.random.Generator, kind, front_along_N=0.0):
    """Return the final NEES of the motion and the mean NIS, for a car that is the filter's model with errors of a
    kind. A longitudinal force of the front axle acts in the second half of the run."""
    # Python reads a namespace twenty times as fast as a record.
    known = SimpleNamespace(**{name: record[name] for name in record.dtype.names})
    true, memory = np.zeros(1, MEMORY)[0], np.zeros(1, MEMORY)[0]
    true["speed_mps"] = memory["speed_mps"] = SPEED_MPS
    begin(record, memory)
    state = memory.state + np.linalg.cholesky(memory.covariance + 1e-16 * np.eye(N_STATES)) @ rng.standard_normal(
        N_STATES
    )
    squared, errors = [], kind(known, rng)
    for step in range(STEPS):
        angle_rad = 0.03 * math.sin(math.pi * step * INTERVAL_S)
        if 2 * step >= STEPS:
            for each in (true, memory):
                each["along_N"][:2], each["front_along_N"] = 0.5 * front_along_N, front_along_N
        true["front_angle_rad"] = memory["front_angle_rad"] = angle_rad
        predict(record, tyres, memory, INTERVAL_S)
        errors_Ns = force_stds_N(known, forces_of(record, tyres, true, state)) * next(errors)
        follow(record, tyres, true, state, INTERVAL_S, state)
        state[LATERAL_SPEED] += errors_Ns.sum() / known.mass_kg
        state[YAW_RATE] += errors_Ns @ (known.cg_to_front_m, -known.cg_to_rear_m) / known.yaw_inertia_kgm2
        drift(known, true, state, INTERVAL_S, rng)
        front_N, rear_N = forces_of(record, tyres, true, state)
        ay_mps2 = (front_N * math.cos(angle_rad) + rear_N) / known.mass_kg
        follow_roll(record, true, ay_mps2, INTERVAL_S)
        for name in ("roll_rad", "loading_mps2", "roll_rate_radps"):
            memory[name] = true[name]
        front_N, rear_N = forces_of(record, tyres, true, state)
        ay_mps2 = (front_N * math.cos(angle_rad) + rear_N) / known.mass_kg
        ay_mps2 += force_stds_N(known, (front_N, rear_N)) @ next(errors) / known.mass_kg
        rate = state[YAW_RATE] + state[RATE_OFFSET]
        rate += math.hypot(math.sqrt(known.rate_variance_rad2ps2), known.rate_fraction * rate) * rng.standard_normal()
        felt = ay_mps2 + GRAVITY_MPS2 * true.roll_rad + state[AY_OFFSET]
        felt += math.hypot(math.sqrt(known.ay_variance_m2ps4), known.ay_fraction * felt) * rng.standard_normal()
        squared.append(correct(record, tyres, memory, rate, felt, INTERVAL_S)[0])
    error = (state - memory.state)[MOTION]
    return error @ np.linalg.solve(memory.covariance[np.ix_(MOTION, MOTION)], error), np.mean(squared)


def test_errors_in_its_own_model_are_those_of_its_covariance(known_and_tyres, rng):
    known, tyres = known_and_tyres
    nees, nis = np.mean([one_run(known, tyres, rng, white) for _ in range(RUNS)], axis=0)
    # Every change of the model draws anew: 95 % would fail one time in twenty.
    low, high = bounds(len(MOTION), RUNS, 0.999)
    assert low < nees < high
    low, high = bounds(2, RUNS * STEPS, 0.999)
    assert low < nis < high


def test_forces_that_stay_wrong_make_the_motion_as_wrong_and_single_measurements_less(known_and_tyres, rng):
    known, tyres = known_and_tyres
    nees, nis = np.mean([one_run(known, tyres, rng, lasting) for _ in range(RUNS)], axis=0)
    low, high = bounds(len(MOTION), RUNS)
    assert low < nees < high
    # What is wrong all the time is taken for less again and again: one measurement is nearer than the filter expects.
    assert nis < bounds(2, RUNS * STEPS)[0]


@pytest.mark.parametrize("front_along_N", [-3000.0, 3000.0])
def test_errors_under_large_longitudinal_forces_are_those_of_its_covariance(known_and_tyres, rng, front_along_N):
    """The filter then does not learn the friction, but knows how much it moves the car."""
    known, tyres = known_and_tyres
    exact = known.copy()
    exact["along_fraction"] = 0.0  # the forces are known
    nees = [one_run(exact, tyres, rng, white, front_along_N)[0] for _ in range(RUNS)]
    low, high = bounds(len(MOTION), RUNS, 0.999)
    assert low < np.mean(nees) < high


@pytest.mark.parametrize(("slip", "sign"), [(FRONT_SLIP, 1.0), (REAR_SLIP, -1.0)])
def test_wrong_force_of_one_axle_moves_lateral_speed_and_yaw_rate_together(known_and_tyres, slip, sign):
    """A front force that is too large pushes and turns the car to the same side, a rear one to opposite sides."""
    known, tyres = known_and_tyres
    alone, memory = known.copy(), np.zeros(1, MEMORY)[0]
    for other_noise in ("force_std_N", "along_fraction", "lateral_density_m2ps3", "yaw_density_rad2ps3"):
        alone[other_noise] = 0.0
    begin(alone, memory)
    memory["covariance"] = 0.0
    memory["speed_mps"], memory["state"][slip] = SPEED_MPS, 0.03
    predict(alone, tyres, memory, INTERVAL_S)
    (lateral, both), (_, yaw) = memory["covariance"][np.ix_(MOTION, MOTION)]
    assert both / math.sqrt(lateral * yaw) == pytest.approx(sign)


@pytest.fixture(scope="module")
def squared_errors() -> list[float]:
    """Mean squared sideslip errors relative to their deviation, of cars drawn as the filter assumes them.

    Each run has its own tyres of each axle, road, mass and sensors.
    """
    rng, squared = np.random.default_rng(20121121), []
    for seed in range(12):
        run = simulate(
            "slalom",
            "observer",
            overrides={
                "sensors.preset": "production",
                "sensors.seed": seed,
                "factors.mass": rng.normal(1.0, 0.05),
                "factors.front_cornering_stiffness": rng.normal(1.0, EstimatorParameters.stiffness_std),
                "factors.rear_cornering_stiffness": rng.normal(1.0, EstimatorParameters.stiffness_std),
                "road.mu": np.clip(rng.normal(0.9, EstimatorParameters.friction_std), 0.3, 1.3),
            },
        )
        error = run["estimated_sideslip_rad"] - run["sideslip_rad"]
        squared.append(float(np.mean((error / run["estimated_sideslip_std_rad"]) ** 2)))
    return squared


@pytest.mark.slow
def test_errors_in_cars_drawn_from_its_prior_are_no_larger_than_its_covariance(squared_errors):
    assert np.mean(squared_errors) < bounds(1, len(squared_errors))[1]


@pytest.mark.slow
@pytest.mark.xfail(reason="the deviation of the sideslip angle is twice its error: 0.24 where 0.37 is the bound")
def test_errors_in_cars_drawn_from_its_prior_are_no_smaller_than_its_covariance(squared_errors):
    assert np.mean(squared_errors) > bounds(1, len(squared_errors))[0]
