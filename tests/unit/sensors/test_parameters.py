"""The table [sensors]: presets, single values, and refused values."""

from __future__ import annotations

import math

import pytest

from activesteer.config import Source, build, to_table
from activesteer.core.signals import Measurement
from activesteer.errors import ParameterError
from activesteer.scenario import load_car
from activesteer.sensors import Sensors
from activesteer.sensors.block import speed_radii
from activesteer.sensors.parameters import AccelerationSensor, AngleSensor, PressureSensor, RateSensor, WheelSpeedSensor
from tests.raising import raises


def test_ideal_is_the_default_and_production_is_not():
    assert Sensors().is_ideal
    assert Sensors(preset="ideal") == Sensors()
    assert not Sensors(preset="production").is_ideal


def test_a_single_value_stands_beside_those_of_the_preset():
    plain = load_car(overrides={"sensors.preset": "production"}).config.sensors
    changed = load_car(
        overrides={"sensors.preset": "production", "sensors.yaw_rate.noise_degps": 0.3, "sensors.wheel_speed.teeth": 96}
    ).config.sensors
    assert changed.yaw_rate.amount("noise") == pytest.approx(math.radians(0.3))
    assert changed.yaw_rate.delay_s == plain.yaw_rate.delay_s
    assert changed.wheel_speed.amount("teeth") == 96
    assert changed.ay == plain.ay
    alone = load_car(overrides={"sensors.yaw_rate.noise_degps": 0.3}).config.sensors
    assert (alone.is_ideal, alone.seed, alone.ay) == (False, 0, Sensors().ay)


def test_a_recorded_table_gives_the_same_sensors_again():
    for sensors in (Sensors(), Sensors(preset="production", seed=7)):
        assert build(Sensors, to_table(sensors), Source("recorded")) == sensors
    assert to_table(Sensors(preset="production"))["seed"] == 0


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("sensors.seed", 7),
        ("sensors.preset", "perfect"),
        ("sensors.yaw_rate.noise_degps", -0.1),
        ("sensors.ay.delay_s", 0.5),
        ("sensors.wheel_speed.teeth", 1.5),
    ],
)
def test_value_that_cannot_be_is_refused_with_its_key(key, value):
    with raises(ParameterError, key=key, value=value):
        load_car(overrides={key: value})


def test_seed_below_zero_is_refused():
    with raises(ParameterError, key="sensors.seed", value=-1):
        load_car(overrides={"sensors.seed": -1, "sensors.preset": "production"})


@pytest.mark.parametrize(
    ("key", "known"),
    [
        ("sensors.yaw_rate.noise", "noise_degps"),
        ("sensors.noise", "sensors.yaw_rate.noise_degps"),
        ("sensors.yaw_rate.teeth", "noise_degps"),
    ],
)
def test_key_that_does_not_exist_is_answered_with_those_that_do(key, known):
    with raises(ParameterError, key=key) as refused:
        load_car(overrides={key: 1})
    assert known in refused.value.problem


def test_speed_comes_from_the_wheels_that_are_not_driven():
    radii_m = (0.30, 0.30, 0.32, 0.32)
    assert speed_radii(1.0, radii_m) == (0.0, 0.0, 0.16, 0.16)
    assert speed_radii(0.0, radii_m) == (0.15, 0.15, 0.0, 0.0)
    assert speed_radii(0.4, radii_m) == (0.075, 0.075, 0.08, 0.08)


def test_each_signal_but_time_and_speed_has_a_sensor_in_its_unit():
    sensors = Sensors().all()
    ends = {"radps": RateSensor, "mps2": AccelerationSensor, "rad": AngleSensor, "Pa": PressureSensor}
    assert [*sensors] == [field.rpartition("_")[0] for field in Measurement._fields[2:]]
    for field, sensor in zip(Measurement._fields[2:], sensors.values(), strict=True):
        assert isinstance(sensor, ends[field.rpartition("_")[2]]), field
    assert isinstance(sensors["wheel_speed"], WheelSpeedSensor)
    assert not isinstance(sensors["yaw_rate"], WheelSpeedSensor)
