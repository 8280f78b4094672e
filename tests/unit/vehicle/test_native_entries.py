"""Entries into native code refuse all arguments that would cause an invalid read or write."""

from __future__ import annotations

import copy
import pickle
import random
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from activesteer.core.signals import NO_BRAKES, ActuatorCommand, DriverCommand, Estimate, WheelTorques, new_message
from activesteer.errors import ActiveSteerError, ControllerError, DriverError, ParameterError
from activesteer.simulation.simulation import Simulation
from activesteer.vehicle import Vehicle
from activesteer.vehicle.channels import RawRows
from tests.unit.vehicle.cars import standing

COUNT = 2500
NUMBERS = (0.0, 1, True, -0.5, np.float64(0.1), np.float32(0.1), np.int64(0))
WRONG = (
    None, "left", b"1", 1j, [], [0.0], {}, (), (0.0,), ((0.0,),), object(), 10**400, np.zeros(4), np.zeros((2, 2)),
    float, (None,) * 4, ("a", "b", "c", "d"), (0.0, 0.0, 0.0), (0.0,) * 5, DriverCommand(), ActuatorCommand(),
)  # fmt: skip


class Sub(ActuatorCommand):
    """A user's class that inherits from a message."""


@cache
def rolling() -> Vehicle:
    vehicle = standing()
    vehicle.start(20.0)
    vehicle.record_estimate(Estimate(*[0.0] * 10))
    return vehicle


def of_any_length(rng: random.Random, kind: type[Any]) -> Any:
    """Return a tuple that claims to be a message, mostly with a wrong length or wrong fields."""
    members: list[Any] = list(kind(*[0.0] * len(kind._fields)) if kind is Estimate else kind())
    for _ in range(rng.randint(0, 3)):
        members[rng.randrange(len(members))] = rng.choice((*WRONG, *NUMBERS))
    length = rng.choice((len(members), len(members), rng.randrange(16)))
    return new_message(kind, (members * 2)[:length])


def command(rng: random.Random, kind: type[Any]) -> Any:
    choice = rng.random()
    if choice < 0.1:
        return rng.choice(WRONG)
    message = of_any_length(rng, kind)
    if choice < 0.2:
        return tuple(message)
    if choice < 0.3 and kind is ActuatorCommand:
        return new_message(Sub, message)
    return message


def test_malformed_commands_are_refused_or_carried_out() -> None:
    rng, vehicle = random.Random(26), rolling()
    state, refused = vehicle.save_state(), 0
    for _ in range(COUNT):
        driver, actuator = command(rng, DriverCommand), command(rng, ActuatorCommand)
        if type(driver) is DriverCommand and len(driver) == 8 and rng.random() < 0.3:
            torques = rng.choice((WheelTorques(NO_BRAKES, NO_BRAKES), of_any_length(rng, Estimate), rng.choice(WRONG)))
            driver = driver._replace(wheel_torques=torques)
        if type(actuator) is ActuatorCommand and len(actuator) == len(ActuatorCommand._fields) and rng.random() < 0.3:
            actuator = actuator._replace(estimate=of_any_length(rng, Estimate))
        try:
            vehicle.step(driver, actuator)
        except ActiveSteerError:
            refused += 1
            vehicle.restore_state(state)
    assert COUNT // 2 < refused < COUNT
    vehicle.restore_state(state)
    assert vehicle.step(DriverCommand(), ActuatorCommand())[0].speed_mps == pytest.approx(20.0, abs=0.1)


def test_malformed_commands_of_a_simulation_are_refused_and_change_nothing() -> None:
    rng, simulation = random.Random(27), Simulation("step_steer", "observer", overrides={"settle_s": 0.2})
    given = 0
    while given < COUNT // 5:
        driver, actuator = rng.choice(
            ((command(rng, DriverCommand), None), (None, command(rng, ActuatorCommand)), (None, wrong_estimate(rng)))
        )
        before = simulation.loop.step_count
        try:
            simulation.step(driver, actuator)
        except (DriverError, ControllerError):
            given += 1
            assert simulation.loop.step_count == before
    assert simulation.truth["speed_mps"] == pytest.approx(80.0 / 3.6, abs=1.0)
    simulation.recording()


def wrong_estimate(rng: random.Random) -> ActuatorCommand:
    return ActuatorCommand(estimate=of_any_length(rng, Estimate))


@pytest.mark.parametrize("kind", [DriverCommand, ActuatorCommand])
def test_a_message_of_any_other_length_is_refused(kind: type[Any]) -> None:
    for length in range(16):
        if length != len(kind._fields):
            given = {DriverCommand: DriverCommand(), ActuatorCommand: ActuatorCommand()}
            given[kind] = new_message(kind, [*kind(), *kind()][:length])
            with pytest.raises(ParameterError, match=kind.__name__):
                rolling().step(given[DriverCommand], given[ActuatorCommand])


@pytest.mark.parametrize("gear", [2, -7, 0.5, np.nan, "1", (1,)])
def test_a_gear_that_does_not_exist_is_refused(gear: Any) -> None:
    with pytest.raises(ParameterError, match="gear"):
        rolling().step(DriverCommand(gear=gear), ActuatorCommand())


@pytest.mark.parametrize(
    "estimate", [None, (0.0,) * 9, new_message(Estimate, (0.0,) * 9), new_message(Estimate, "0123456789"[:9] + "a")]
)
def test_an_estimate_of_another_form_is_not_recorded(estimate: Any) -> None:
    with pytest.raises(ParameterError):
        standing().record_estimate(estimate)


def arrays_but(own: Any) -> list[Any]:
    """Return arrays of almost the needed form, and other objects."""
    rows, columns = own.shape
    return [
        None, 3, "inputs", own.tolist(), own[0], own[:, :0], own.astype(np.float32), own.astype(complex),
        own.astype(">f8"), np.zeros((rows, 2 * columns))[:, ::2], np.zeros((rows, columns, 1)),
        own.view(np.uint8)[:, :columns],
    ]  # fmt: skip


def test_inputs_of_another_form_are_not_played_back() -> None:
    vehicle = rolling()
    inputs = np.zeros((3, vehicle.model.nu))
    for wrong in [*arrays_but(inputs), inputs[:, 1:], np.asfortranarray(inputs)]:
        with pytest.raises(ParameterError):
            vehicle.replay(wrong)
    vehicle.replay(inputs[:0])


def test_rows_of_another_form_are_not_taken() -> None:
    channels, rows = rolling().channels, rolling().rows.empty(5)
    out, inputs = np.zeros((5, len(channels.channels)), order="F"), channels.inputs(5)
    for array in (*rows, inputs):  # none of them is cleared when it is made
        array[:] = 0.0
    for name in set(RawRows._fields) - {"measured", "electric"}:  # empty with ideal sensors, without motors
        own = getattr(rows, name)
        for wrong in [*arrays_but(own), own[1:]]:
            with pytest.raises(ParameterError):
                channels.take(rows._replace(**{name: wrong}), out, inputs)
    wrong: Any
    for wrong in (out[1:], out[:, 1:], np.ascontiguousarray(out), out.astype(np.float32), None):
        with pytest.raises(ParameterError):
            channels.take(rows, wrong, inputs)
    for wrong in (inputs[:4], inputs[:, 1:], np.ascontiguousarray(inputs), inputs.astype(np.float32), None):
        with pytest.raises(ParameterError):
            channels.take(rows, out, wrong)
        with pytest.raises(ParameterError):
            channels.compute(wrong, out)


@pytest.mark.parametrize("tape", [0, 12345, np.zeros(1), np.zeros(7, np.intp), "tape"])
def test_steps_are_recorded_on_a_tape_alone(tape: Any) -> None:
    with pytest.raises(ParameterError):
        rolling().record_on(tape)


def test_a_state_of_another_form_is_not_restored() -> None:
    vehicle = rolling()
    state = vehicle.save_state()
    for wrong in (
        None,
        1,
        "state",
        state.tolist(),
        state[:-1],
        np.append(state, 0.0),
        state.astype(np.float32),
        state[None],
    ):
        with pytest.raises(ParameterError):
            vehicle.restore_state(wrong)  # type: ignore[arg-type]
    assert np.array_equal(vehicle.save_state(), state)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps])
def test_a_car_alone_cannot_be_copied(copied: Callable[[Any], Any]) -> None:
    with pytest.raises(ParameterError, match="Vehicle"):
        copied(rolling())
