"""Single parts of the estimator: knowledge of car and sensors, wheels, brush model, stated errors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.estimation import advance
from activesteer.estimation.kalman_filter import begin, correct, predict
from activesteer.estimation.records import (
    AY_OFFSET,
    BANK,
    FRICTION,
    FRONT_SLIP,
    FRONT_STIFFNESS,
    LATERAL_SPEED,
    MEMORY,
    N_STATES,
    RATE_OFFSET,
    REAR_RATIO,
    REAR_SLIP,
    REAR_STIFFNESS,
    SAID,
    YAW_RATE,
    known_of,
)
from activesteer.estimation.setup import GRID
from activesteer.estimation.speed_filter import brush_slip, read_wheels
from activesteer.estimation.two_track_model import follow, follow_roll, forces_of, slip_angles
from activesteer.scenario import resolve
from tests.unit.estimation.drives import estimates, rolling

MOTION = np.ix_([LATERAL_SPEED, YAW_RATE], [LATERAL_SPEED, YAW_RATE])


@pytest.fixture(scope="module")
def setup():
    return resolve("straight_line", overrides={"sensors.preset": "production"}).controller_setup(0.001)


@pytest.fixture(scope="module")
def known(setup):
    return known_of(setup.estimation, setup.gains.estimator, setup.timestep_s)[0]


@pytest.fixture
def memory(known):
    found = np.zeros(1, MEMORY)[0]
    begin(known, found)
    return found


def test_lateral_load_transfer_of_both_axles_balances_the_roll_moment(setup, known):
    car, more = setup.single_track, setup.estimation.two_track
    moment_kgm = known.front_load_kg * more.front_track_m + known.rear_load_kg * more.rear_track_m
    assert moment_kgm == pytest.approx(car.mass_kg * more.load_height_m)
    front = known.front_load_kg * more.front_track_m / moment_kgm
    assert front == pytest.approx(more.front_load_transfer_fraction)
    pitch_kgm = 2.0 * known.along_load_kg * (car.cg_to_front_m + car.cg_to_rear_m)
    assert pitch_kgm == pytest.approx(car.mass_kg * more.load_height_m)


def test_the_body_rolls_as_a_damped_oscillator_whose_springs_and_dampers_load_the_wheels(known, memory):
    speed, damping, ay_mps2 = known.roll_speed_radps, known.roll_damping, 4.0
    assert damping < 1.0
    free = speed * math.sqrt(1.0 - damping**2)
    end_rad = known.roll_gradient_radpmps2 * ay_mps2
    steps, dt = 400, 0.001
    for step in range(1, steps + 1):
        follow_roll(known, memory, ay_mps2, dt)
        fading = math.exp(-damping * speed * step * dt)
        phase = free * step * dt
        expected = end_rad * (1.0 - fading * (math.cos(phase) + damping * speed / free * math.sin(phase)))
        # The step is 0.001 s of an oscillation of about half a second.
        assert memory.roll_rad == pytest.approx(expected, abs=0.03 * end_rad)
        rate = end_rad * fading * speed**2 / free * math.sin(phase)
        loading = (expected + 2.0 * damping / speed * rate) / known.roll_gradient_radpmps2
        assert memory.loading_mps2 == pytest.approx(loading, abs=0.03 * ay_mps2)
        assert memory.roll_rate_radps == pytest.approx(rate, abs=0.03 * speed * end_rad)


def test_a_rolling_body_moves_each_axle_by_its_own_arm(known, memory):
    different, speed_mps = known.copy(), 20.0
    different.front_roll_arm_m, different.rear_roll_arm_m = -0.1, 0.4
    resting = slip_angles(different, memory, memory.state, speed_mps)
    memory.roll_rate_radps = 0.2
    front_rad, rear_rad = slip_angles(different, memory, memory.state, speed_mps)
    assert front_rad - resting[0] == pytest.approx(0.1 * 0.2 / speed_mps)
    assert rear_rad - resting[1] == pytest.approx(-0.4 * 0.2 / speed_mps)


def test_a_steady_turn_has_the_identified_stiffness_with_any_roll_steer(setup):
    ay_mps2 = 0.5
    taken_rad = []
    for roll_steer in (0.0, 0.3):
        parameters = replace(setup.gains.estimator, front_roll_steer=roll_steer, rear_roll_steer=-roll_steer)
        known = known_of(setup.estimation, parameters, setup.timestep_s)[0]
        rolled_rad = known.roll_gradient_radpmps2 * ay_mps2
        front_N, rear_N = (2.0 * load_N / GRAVITY_MPS2 * ay_mps2 for load_N in (known.front_load_N, known.rear_load_N))
        front_rad = known.front_compliance_radpN * front_N + known.front_roll_steer * rolled_rad
        rear_rad = known.rear_compliance_radpN * rear_N + known.rear_roll_steer * rolled_rad
        taken_rad.append((front_rad, rear_rad))
    assert taken_rad[1] == pytest.approx(taken_rad[0])


@pytest.mark.parametrize(
    ("place", "least", "largest"),
    [(FRICTION, 0.05, 1.5), (FRONT_STIFFNESS, 0.3, 2.0), (REAR_STIFFNESS, 0.3, 2.0), (REAR_RATIO, 0.5, 1.5)],
)
def test_friction_and_stiffness_beyond_their_bounds_count_as_the_bounds(setup, known, place, least, largest):
    tyres, memory = np.array([tyre.force_N for tyre in setup.estimation.tyres]), np.zeros(1, MEMORY)[0]
    state = np.zeros(N_STATES)
    state[[FRONT_SLIP, REAR_SLIP]] = 0.06
    state[[FRICTION, FRONT_STIFFNESS, REAR_STIFFNESS, REAR_RATIO]] = 1.0

    def force(value: float) -> float:
        state[place] = value
        return float(sum(forces_of(known, tyres, memory, state)))

    assert force(0.5 * least) == force(least) < force(1.01 * least)
    assert force(2.0 * largest) == force(largest) != force(0.99 * largest)


def test_the_front_axle_of_a_rolled_car_has_less_slip_angle(setup):
    parameters = replace(setup.gains.estimator, front_roll_steer=0.3, rear_roll_steer=-0.1)
    known = known_of(setup.estimation, parameters, setup.timestep_s)[0]
    tyres = np.zeros((2, *GRID))  # without force no compliance
    found = np.zeros(1, MEMORY)[0]
    begin(known, found)
    found.speed_mps, found.roll_rad = 20.0, 0.02
    # Long enough for the relaxation.
    follow(known, tyres, found, found.state, 1.0, found.now)
    assert found.now[FRONT_SLIP] == pytest.approx(-0.3 * 0.02, rel=1e-6)
    assert found.now[REAR_SLIP] == pytest.approx(0.1 * 0.02, rel=1e-6)


def test_wheels_stand_at_their_corners(setup, known):
    car, more = setup.single_track, setup.estimation.two_track
    half_m = 0.5 * np.repeat([more.front_track_m, more.rear_track_m], 2)
    assert known.left_m == pytest.approx(half_m * (1, -1, 1, -1))
    assert known.half_track_m == pytest.approx(half_m)
    assert known.to_axle_m == pytest.approx([car.cg_to_front_m] * 2 + [-car.cg_to_rear_m] * 2)


def test_samples_are_as_old_as_delay_and_low_pass_of_their_sensors(setup):
    sensors = setup.estimation.sensors
    changed = replace(
        sensors,
        yaw_rate=replace(sensors.yaw_rate, delay_s=0.02, bandwidth_Hz=10.0),
        ay=replace(sensors.ay, delay_s=0.004, bandwidth_Hz=None),
        steering_wheel=replace(sensors.steering_wheel, delay_s=0.005, bandwidth_Hz=None),
        rear_steer=replace(sensors.rear_steer, delay_s=None, bandwidth_Hz=None),
        wheel_speed=replace(sensors.wheel_speed, delay_s=0.002, sample_time_s=0.012, bandwidth_Hz=None),
    )
    estimation = replace(setup.estimation, sensors=changed)
    age_s = 0.02 + 1.0 / (2.0 * math.pi * 10.0)
    for timestep_s in (0.001, 0.004):
        known = known_of(estimation, setup.gains.estimator, timestep_s)[0]
        # A slower controller sees a sample half an interval later in the mean.
        seen_s = age_s + 0.5 * (timestep_s - 0.001)
        assert known.age_s == pytest.approx(seen_s)
        assert known.steering_age == round((seen_s - 0.005) / timestep_s)
        assert known.actuator_age == round(seen_s / timestep_s)
        assert known.wheel_age == round((seen_s - 0.002 - 0.5 * (0.012 - timestep_s)) / timestep_s)


def test_noise_and_its_floors_add_as_variances(setup):
    sensors = setup.estimation.sensors
    changed = replace(
        sensors,
        yaw_rate=replace(sensors.yaw_rate, noise_radps=0.003, bias_radps=0.004, drift_radps=0.06),
        ay=replace(sensors.ay, noise_mps2=0.04, bias_mps2=0.5),
        ax=replace(sensors.ax, bias_mps2=0.4),
        wheel_speed=replace(sensors.wheel_speed, noise_radps=0.1),
    )
    p = setup.gains.estimator
    known = known_of(replace(setup.estimation, sensors=changed), p, 0.001)[0]
    assert known.rate_variance_rad2ps2 == pytest.approx(0.003**2 + math.radians(0.02) ** 2)
    assert known.ay_variance_m2ps4 == pytest.approx(0.04**2 + 0.03**2)
    assert known.rate_offset_std_radps == pytest.approx(0.004)
    assert known.rate_walk_rad2ps3 * 60.0 == pytest.approx(0.06**2)
    assert known.ay_offset_std_mps2 == pytest.approx(math.hypot(0.5, 0.03))
    assert known.ax_offset_std_mps2 == pytest.approx(math.hypot(0.4, p.slope_std_mps2))
    radius_m = setup.estimation.tyres[0].rolling_radius_m
    assert known.wheel_variance_m2ps2 == pytest.approx((0.1 * radius_m) ** 2 + p.wheel_std_mps**2)


def test_wheels_carry_the_car_and_shift_load_to_the_front_in_braking_and_out_of_the_turn(setup, known, memory):
    memory["ax_mps2"], memory["loading_mps2"], memory["speed_mps"] = -4.0, 3.0, 20.0
    said = np.zeros(len(SAID))
    said[SAID.index("fl_spin_radps") :][:4] = 20.0 / known.rolling_radius_m
    memory["last_spin_radps"] = said[SAID.index("fl_spin_radps") :][:4]
    pressure_Pa = 20e5
    said[SAID.index("fl_pressure_Pa") :][:4] = pressure_Pa
    tyres = np.array([tyre.force_N for tyre in setup.estimation.tyres])
    read_wheels(known, tyres, memory, said, 0.01)
    car, more = setup.single_track, setup.estimation.two_track
    fl_N, fr_N, rl_N, rr_N = memory.load_N
    assert memory.load_N.sum() == pytest.approx(car.mass_kg * GRAVITY_MPS2)
    # Moments of the loads about the centre of gravity hold those of the accelerations.
    pitch_Nm = car.cg_to_front_m * (fl_N + fr_N) - car.cg_to_rear_m * (rl_N + rr_N)
    assert pitch_Nm == pytest.approx(4.0 * car.mass_kg * more.load_height_m)
    roll_Nm = 0.5 * more.front_track_m * (fr_N - fl_N) + 0.5 * more.rear_track_m * (rr_N - rl_N)
    assert roll_Nm == pytest.approx(3.0 * car.mass_kg * more.load_height_m)
    brakes_N = known.torque_per_pressure_NmpPa * pressure_Pa / known.rolling_radius_m
    assert -memory.along_N == pytest.approx(brakes_N)
    assert memory.front_along_N == pytest.approx(-brakes_N[:2].sum())
    assert memory.moment_Nm == pytest.approx(0.0, abs=1e-9)
    assert memory.by_wheel_mps == pytest.approx([20.0] * 4)


def test_driven_wheels_also_carry_the_drag_of_the_steered_wheels(setup, known, memory):
    """In a steady turn the lateral force of the front wheels points backwards by the sine of their angle."""
    memory["speed_mps"], memory["front_angle_rad"] = 20.0, 0.15
    memory.state[FRONT_SLIP], memory.state[FRICTION] = 0.1, 0.9
    memory.state[[FRONT_STIFFNESS, REAR_STIFFNESS, REAR_RATIO]] = 1.0
    tyres = np.array([tyre.force_N for tyre in setup.estimation.tyres])
    said = np.zeros(len(SAID))
    said[SAID.index("fl_spin_radps") :][:4] = memory["last_spin_radps"] = 20.0 / known.rolling_radius_m
    read_wheels(known, tyres, memory, said, 0.01)
    front_N, rear_N = forces_of(known, tyres, memory, memory.state)
    assert front_N > 5000.0
    assert rear_N == 0.0
    # The front wheels drive, and their forces lower the friction that is left a little.
    assert memory.along_N.sum() == pytest.approx(front_N * math.sin(0.15) + known.drag_kgpm * 400.0, rel=0.02)


def test_brush_model_gives_slip_and_slope_that_belong_together():
    friction, load_N, stiffness = 0.8, 4000.0, 20.0

    def slip(used):
        return brush_slip.py_func(used * friction * load_N, load_N, friction, stiffness)

    for used in (0.1, 0.5, 0.9):
        value, slope, found = slip(used)
        assert found == pytest.approx(used)
        assert value == pytest.approx(3.0 * friction / stiffness * (1.0 - (1.0 - used) ** (1.0 / 3.0)))
        assert slope == pytest.approx((slip(used + 1e-6)[0] - slip(used - 1e-6)[0]) / 2e-6, rel=1e-6)
        assert slip(-used) == pytest.approx((-value, slope, used))
    # Small forces: the slip stiffness. Beyond the friction the slip stays finite.
    assert slip(1e-6)[0] == pytest.approx(1e-6 * friction * load_N / (stiffness * load_N))
    assert slip(2.0) == pytest.approx((slip(0.98)[0], slip(0.98)[1], 1.0))


def test_motion_of_a_standing_car_is_uncertain_by_its_creeping_alone(known, memory, setup):
    tyres = np.array([tyre.force_N for tyre in setup.estimation.tyres])
    memory["covariance"] = 0.0
    predict(known, tyres, memory, 0.01)
    assert memory.covariance[MOTION] == pytest.approx(np.diag([0.05**2, 0.05 * 0.01]))


def test_said_errors_are_those_of_the_filters_and_of_the_way_to_the_present(known):
    memory = np.zeros(1, MEMORY)[0]
    memory["speed_mps"], memory["ax_mps2"], memory["loading_mps2"] = 20.0, -3.0, 5.0
    memory["now"][[LATERAL_SPEED, YAW_RATE, FRICTION, FRONT_STIFFNESS, REAR_STIFFNESS]] = 0.6, 0.25, 0.8, 1.1, 0.7
    memory["now"][REAR_RATIO] = 1.2  # the front axle is the weaker one
    memory["speed_variance"], memory["waited_s"] = 0.04, 0.003
    memory["covariance"] = np.diag(0.001 * np.arange(1.0, N_STATES + 1.0))
    advance._write_estimate(known, memory)
    lateral, rate, friction, front, rear = (
        0.001 * (place + 1) for place in (LATERAL_SPEED, YAW_RATE, FRICTION, FRONT_STIFFNESS, REAR_STIFFNESS)
    )
    ahead_s = known.age_s + 0.003
    speed_mps = 20.0 + ahead_s * (-3.0 + 0.25 * 0.6)
    wrong_N = known.force_std_N + known.force_fraction * known.mass_kg * 5.0
    lateral_std = math.hypot(math.sqrt(lateral), wrong_N / known.mass_kg * ahead_s)
    half_wheelbase_m = 0.5 * (known.cg_to_front_m + known.cg_to_rear_m)
    turned = half_wheelbase_m * wrong_N / known.yaw_inertia_kgm2 * ahead_s
    assert memory.estimate == pytest.approx([
        speed_mps, 0.6, math.atan2(0.6, speed_mps), 0.25, 0.8, math.hypot(0.2, known.radius_std * speed_mps),
        lateral_std, math.atan2(lateral_std, speed_mps), math.hypot(math.sqrt(rate), turned),
        math.hypot(math.sqrt(friction), known.friction_fraction * 0.8),
        1.1, 0.7, math.sqrt(front), math.sqrt(rear),
    ])  # fmt: skip


def test_braking_shows_how_much_friction_there_is_at_least(make, known):
    slippery = make(**{"controllers.estimator.friction": 0.3, "controllers.estimator.friction_std": 0.001})
    # The body pitches, and its accelerometer feels a part of gravity.
    felt_mps2 = 6.0 * (1.0 + known.pitch_gain)
    braking = [rolling(30.0 - 0.006 * step, ax_mps2=-felt_mps2, brake_pressure_Pa=(30e5,) * 4) for step in range(1500)]
    friction = estimates(slippery, [rolling(30.0)] * 500 + braking)["friction"]
    assert friction[499] == pytest.approx(0.3, abs=0.01)
    # 85 % of what is used, which is smoothed over 0.2 s; the filter takes a part of it for a slope.
    assert friction[-1] == pytest.approx(0.85 * 6.0 / GRAVITY_MPS2, rel=0.04)
    risen = friction[500 + 400] / friction[-1]
    assert risen == pytest.approx(1.0 - math.exp(-2.0), abs=0.05)


@pytest.mark.parametrize("calls", [0, 1, 5, 9])
def test_the_way_to_the_present_is_as_long_as_the_sample_is_old(known, memory, setup, calls):
    tyres, old = np.array([tyre.force_N for tyre in setup.estimation.tyres]), known.copy()
    old["age_s"] = calls * old.call_s
    memory["speed_mps"], memory["state"][[LATERAL_SPEED, YAW_RATE]] = 20.0, (0.5, 0.2)
    advance._predict_present(old, tyres, memory, np.zeros((calls + 2, len(SAID))))
    whole = np.empty(N_STATES)
    follow(old, tyres, memory, memory.state, calls * old.call_s, whole)
    moved, expected = (states[LATERAL_SPEED] - memory.state[LATERAL_SPEED] for states in (memory.now, whole))
    # In steps of 4 ms at most, which differ little from a single one.
    assert moved == pytest.approx(expected, rel=0.05, abs=1e-9)
    assert (calls > 0) == (abs(moved) > 1e-3)


@pytest.mark.parametrize(("ay_mps2", "learns"), [(0.1, True), (2.0, False)])
def test_lateral_acceleration_shows_the_offset_of_its_own_sensor_unless_it_is_a_surprise(
    known, memory, setup, ay_mps2, learns
):
    """An offset does not jump: at the edge of snow, a single sample moved it by six standard deviations."""
    tyres, deaf = np.array([tyre.force_N for tyre in setup.estimation.tyres]), known.copy()
    deaf["rate_variance_rad2ps2"] = 1e12
    memory["speed_mps"] = 20.0
    memory["covariance"][AY_OFFSET, AY_OFFSET] = known.ay_offset_std_mps2**2
    before = memory.covariance[AY_OFFSET, AY_OFFSET]
    correct(deaf, tyres, memory, 0.0, ay_mps2, 0.01)
    assert (memory.state[AY_OFFSET] > 1e-4) == learns
    assert (memory.covariance[AY_OFFSET, AY_OFFSET] < before) == learns
    assert memory.state[RATE_OFFSET] == pytest.approx(0.0, abs=1e-12)


def test_a_surprising_acceleration_moves_the_car_and_the_road_by_a_limited_amount(known, memory, setup):
    """In a slalom on snow, one sample tilted the road by 0.3 m/s2, and the lateral speed followed."""
    tyres, deaf = np.array([tyre.force_N for tyre in setup.estimation.tyres]), known.copy()
    deaf["rate_variance_rad2ps2"] = 1e12
    memory["speed_mps"] = 20.0
    memory["state"][FRICTION], memory["covariance"][FRICTION, FRICTION] = 0.3, 0.02**2
    memory["state"][[FRONT_SLIP, REAR_SLIP]] = math.radians(2.0)
    predict(known, tyres, memory, 0.01)  # correlates all states
    front_N, rear_N = forces_of(known, tyres, memory, memory.state)

    def moved(error_mps2):
        copy = memory.copy()
        of_both, _ = correct(deaf, tyres, copy, 0.0, (front_N + rear_N) / known.mass_kg - error_mps2, 0.01)
        assert np.linalg.eigvalsh(copy.covariance).min() > -1e-12
        return of_both, copy.state - memory.state

    places = [LATERAL_SPEED, BANK]
    (ordinary, small), (surprise, large), (_, largest) = moved(0.1), moved(3.0), moved(6.0)
    assert ordinary < 4.0 < surprise
    assert np.abs(small[places]).min() > 0.0
    # As an error of two standard deviations, however large it is. The noise grows a little with the acceleration.
    assert large[places] == pytest.approx(small[places] * math.sqrt(4.0 / ordinary), rel=0.05)
    assert largest[places] == pytest.approx(large[places], rel=0.05)
    # The forces follow it.
    assert largest[FRONT_SLIP] == pytest.approx(2.0 * large[FRONT_SLIP], rel=0.05)
    assert large[FRICTION] < small[FRICTION] < 0.0


@pytest.mark.parametrize(("mean_innovation", "counts"), [(1.0, True), (20.0, False)])
def test_friction_not_learned_under_large_longitudinal_forces_is_noise_unless_a_sensor_fails(
    known, memory, setup, mean_innovation, counts
):
    """A car that drives off on snow, and believes in ice, has an error that is no error of its motion."""
    tyres = np.array([tyre.force_N for tyre in setup.estimation.tyres])
    memory["speed_mps"], memory["mean_innovation"] = 20.0, mean_innovation
    memory["state"][FRICTION] = 0.15
    memory["state"][[FRONT_SLIP, REAR_SLIP]] = math.radians(4.0)
    memory["along_N"][:2], memory["front_along_N"] = 800.0, 1600.0
    predict(known, tyres, memory, 0.01)
    front_N, rear_N = forces_of(known, tyres, memory, memory.state)
    sure = memory.copy()
    sure["covariance"][FRICTION, FRICTION] = 1e-8
    # A tenth more friction than believed.
    felt_mps2 = (front_N + rear_N) / known.mass_kg + 0.1 * GRAVITY_MPS2
    before = memory.state.copy()
    (unsure_of_road, _), (sure_of_road, _) = (
        correct(known, tyres, each, 0.0, felt_mps2, 0.01) for each in (memory, sure)
    )
    assert (memory.state[FRICTION:] == before[FRICTION:]).all()
    assert sure_of_road > 4.0
    if counts:
        assert unsure_of_road < 1.0
    else:
        assert unsure_of_road == pytest.approx(sure_of_road, rel=0.01)


def test_what_happens_under_longitudinal_forces_does_not_show_the_friction_afterwards(known, memory, setup):
    """The lateral speed follows the friction as long as the forces last, and without a sensor that fails."""
    tyres = np.array([tyre.force_N for tyre in setup.estimation.tyres])
    memory["speed_mps"] = 20.0
    memory["state"][[FRONT_SLIP, REAR_SLIP]] = math.radians(8.0)
    followed = []
    for along_N, mean_innovation in ((-4000.0, 1.0), (-4000.0, 1.0), (0.0, 1.0), (-4000.0, 20.0)):
        memory["along_N"][:2], memory["front_along_N"] = 0.5 * along_N, along_N
        memory["mean_innovation"] = mean_innovation
        predict(known, tyres, memory, 0.01)
        followed.append(memory["covariance"][LATERAL_SPEED, FRICTION])
    first, second, released, failed = followed
    assert second > 1.5 * first > 0.0
    assert released == failed == 0.0


def test_gravity_across_an_inclined_road_moves_the_car_and_the_accelerometer_does_not_feel_it(known, memory, setup):
    tyres = np.array([tyre.force_N for tyre in setup.estimation.tyres])
    memory["speed_mps"], memory["state"][BANK] = 20.0, 0.5
    moved = np.empty(N_STATES)
    follow(known, tyres, memory, memory.state, 0.001, moved)
    assert moved[LATERAL_SPEED] == pytest.approx(0.001 * 0.5)
    correct(known, tyres, memory, 0.0, 0.0, 0.01)
    assert memory.state[BANK] == 0.5
    assert memory.state[AY_OFFSET] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("slip_deg", "learns"), [(0.2, False), (0.4, True)])
def test_a_stiffness_without_a_slip_angle_is_not_learned_and_its_uncertainty_counts(
    known, memory, setup, slip_deg, learns
):
    tyres = np.array([tyre.force_N for tyre in setup.estimation.tyres])
    memory["speed_mps"] = 20.0
    memory["state"][[FRONT_SLIP, REAR_SLIP]] = np.radians(slip_deg)
    memory["covariance"][FRONT_STIFFNESS, FRONT_STIFFNESS] = 0.04
    sure = memory.copy()
    sure["covariance"][FRONT_STIFFNESS, FRONT_STIFFNESS] = 0.0
    (learning, of_rate), (certain, _) = (correct(known, tyres, each, 0.0, 3.0, 0.01) for each in (memory, sure))
    assert learning < certain
    assert of_rate == 0.0  # the yaw rate is as expected
    assert (memory.state[FRONT_STIFFNESS] > 1.0) == learns
    assert (memory.covariance[FRONT_STIFFNESS, FRONT_STIFFNESS] < 0.04) == learns
