"""Copies of a simulation are independent and continue bit-identically."""

from __future__ import annotations

import copy
import pickle
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest

import activesteer
from activesteer.config.faults import Fault
from activesteer.core.signals import ActuatorCommand, DriverCommand
from activesteer.errors import ActiveSteerError, ManeuverError, ParameterError, RecordingError
from activesteer.simulation.recorder import Recorder
from activesteer.simulation.simulation import Simulation
from tests.raising import raises

Copied = Callable[[Simulation], Simulation]
COPIED = {
    "copy": Simulation.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda simulation: pickle.loads(pickle.dumps(simulation)),
}
BRAKING = {"settle_s": 0.2, "duration_s": 2.0}
KEYS = {**BRAKING, "steer.steering_wheel_deg": 30.0}
RUNS = {
    "steering": ("step_steer", "ars", KEYS),
    "brakes": ("split_mu_braking", "integrated", BRAKING),
    "estimator and sensors": ("step_steer", "lqr", KEYS | {"sensors.preset": "production"}),
}
OWN = """
from beside import GAIN

class Mine:
    def __init__(self, setup, gain=1.0):
        self.setup, self.gain, self.calls = setup, gain, 0

    def step(self, command, measurement):
        self.calls += 1
        from activesteer import ActuatorCommand
        return ActuatorCommand(rear_steer_demand_rad=1e-5 * GAIN * self.gain * self.calls)
"""


def driven(run: str = "steering", steps: int = 1200, **more: Any) -> Simulation:
    maneuver, controller, keys = RUNS[run]
    if controller == "integrated":
        pytest.importorskip("daqp")
    simulation = Simulation(maneuver, controller, overrides=keys, **more)
    simulation.advance(steps)
    return simulation


def assert_same_end(first: Simulation, second: Simulation) -> None:
    """Both runs continue identically to their ends."""
    for simulation in (first, second):
        simulation.run()
    recordings = first.recording(), second.recording()
    for channel in recordings[0].channels:
        one, other = (recording[channel.name] for recording in recordings)
        assert one.tobytes() == other.tobytes(), channel.name
    assert recordings[0].metrics == recordings[1].metrics


@pytest.mark.parametrize("copied", COPIED.values(), ids=COPIED)
@pytest.mark.parametrize("run", RUNS)
def test_a_copy_continues_bit_identically(run: str, copied: Copied) -> None:
    original = driven(run)
    other = copied(original)
    assert repr(other.truth) == repr(original.truth)
    assert_same_end(original, other)


@pytest.mark.parametrize("copied", COPIED.values(), ids=COPIED)
def test_a_copy_and_its_original_do_not_touch_each_other(copied: Copied) -> None:
    original = driven()
    before = original.truth
    other = copied(original)
    other.advance(500)
    assert repr(original.truth) == repr(before)
    alone = copied(original)
    del original
    assert_same_end(alone, copied(alone))


@pytest.mark.parametrize("copied", COPIED.values(), ids=COPIED)
def test_a_copy_has_what_was_changed_on_the_way(copied: Copied) -> None:
    original = driven(steps=300)
    model = original.loop.vehicle.model
    model.body_mass[1] *= 1.2
    model.opt.gravity[2] *= 0.9
    original.loop.fail([Fault("rear", "stuck", start_s=0.8)])
    original.advance(700, DriverCommand(0.3), ActuatorCommand(0.01))
    other = copied(original)
    assert other.loop.vehicle.model.body_mass[1] == model.body_mass[1]
    assert_same_end(original, other)
    assert original.recording().metadata["commands_given"] == other.recording().metadata["commands_given"]
    assert original.recording()["active_faults"][-1] == 1.0


@pytest.mark.parametrize("name", ["copy", "deepcopy", "pickle"])
def test_a_controller_of_the_user_s_own_is_copied_with_its_state(name: str, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(OWN)
    (tmp_path / "beside.py").write_text("GAIN = 2.0\n")
    given = f"{tmp_path / 'mine.py'}:Mine?gain=1.5"
    original = Simulation("step_steer", given, overrides=KEYS)
    original.advance(400)
    Simulation("step_steer", given, overrides=KEYS)  # which loads the file once more
    other = COPIED[name](original)
    own, copied = (cast(Any, simulation.loop.controller).inner for simulation in (original, other))
    assert copied.calls == own.calls
    assert copied is not own
    assert_same_end(original, other)


def test_a_controller_that_uses_the_truth_gets_that_of_its_own_car() -> None:
    class Watching:
        uses_truth = True

        def step(self, command: Any, measurement: Any, motion: Any) -> ActuatorCommand:
            return ActuatorCommand(rear_steer_demand_rad=-0.1 * motion.lateral_speed_mps / 20.0)

    original = Simulation("step_steer", Watching, overrides=KEYS)
    original.advance(800)
    other = original.copy()
    original.advance(400, DriverCommand(-1.0))
    third = Simulation("step_steer", Watching, overrides=KEYS)
    third.restore_state(other.save_state())
    assert_same_end(other, third)


@pytest.mark.parametrize("copied", COPIED.values(), ids=COPIED)
def test_a_run_that_is_written_or_has_failed_cannot_be_copied(copied: Copied, tmp_path: Path) -> None:
    written = Simulation("step_steer", overrides=KEYS)
    with written.recorded_to(tmp_path / "run.mcap"), pytest.raises(RecordingError, match="neither copied nor pickled"):
        copied(written)
    failed = driven(steps=1)
    failed._failure = ManeuverError("gone")
    with pytest.raises(ManeuverError, match="gone"):
        copied(failed)


def test_what_cannot_be_pickled_is_said_in_one_error() -> None:
    class Local:
        def step(self, command: Any, measurement: Any) -> ActuatorCommand:
            return ActuatorCommand()

    with pytest.raises(ParameterError, match="Local"):
        pickle.dumps(Simulation("step_steer", Local, overrides=KEYS))


@pytest.mark.parametrize("part", ["vehicle", "loop", "recorder"])
@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps])
def test_parts_with_native_memory_cannot_be_copied(part: str, copied: Callable[[Any], Any]) -> None:
    simulation = driven(steps=1)
    parts = {
        "vehicle": simulation.loop.vehicle,
        "loop": simulation.loop,
        "recorder": Recorder(simulation.loop.vehicle, 5),
    }
    with pytest.raises(ParameterError, match="cannot be copied"):
        copied(parts[part])


def test_two_threads_in_one_simulation_are_noticed() -> None:
    class Waits:
        def __init__(self) -> None:
            self.inside, self.go_on = threading.Event(), threading.Event()
            self.go_on.set()

        def __deepcopy__(self, memo: Any) -> Any:
            return self

        def step(self, command: Any, measurement: Any) -> ActuatorCommand:
            self.inside.set()
            assert self.go_on.wait(20.0)
            return ActuatorCommand()

    waits = Waits()
    simulation, alone = (Simulation("step_steer", waits, overrides=KEYS) for _ in range(2))
    alone.advance(3)
    waits.inside.clear()
    waits.go_on.clear()
    thread = threading.Thread(target=simulation.advance, args=(3,))
    thread.start()
    assert waits.inside.wait(20.0)
    uses = (
        simulation.step, simulation.save_state, simulation.copy, simulation.recording, lambda: simulation.truth,
        lambda: simulation.loop.advance(1), lambda: simulation.restore_state(alone.save_state()),
    )  # fmt: skip
    for use in uses:
        with pytest.raises(ManeuverError, match="already being driven"):
            use()
    waits.go_on.set()
    thread.join()
    assert_same_end(simulation, alone)


def test_a_block_cannot_drive_its_own_simulation() -> None:
    class Drives:
        simulation: Simulation | None = None

        def __deepcopy__(self, memo: Any) -> Any:
            return self

        def step(self, command: Any, measurement: Any) -> ActuatorCommand:
            if self.simulation is not None:
                self.simulation.step()
            return ActuatorCommand()

    drives = Drives()
    drives.simulation = simulation = Simulation("step_steer", drives, overrides=KEYS)
    with pytest.raises(ActiveSteerError, match="already being driven"):
        simulation.step()


def test_a_state_of_anything_else_is_refused_and_changes_nothing() -> None:
    simulation = driven(steps=100)
    state = simulation.save_state()
    others = [
        Simulation("step_steer", controller, overrides={**KEYS, **keys}, timestep_s=timestep_s).save_state()
        for controller, keys, timestep_s in (
            ("afs", {}, 1e-3), ("ars", {"controllers.bus_delay_s": 0.002}, 1e-3), ("ars", {}, 5e-4),
        )
    ]  # fmt: skip
    older = replace(state.loop, inputs=(*state.loop.inputs[:-1], "0.0.1"))
    both = [None, 1, "state", (), object(), {}, state.rows]
    before = simulation.truth
    for restore, wrong in (
        (simulation.restore_state, [*both, *others, state.loop]),
        (simulation.loop.restore_state, [*both, *(other.loop for other in others), state, older]),
    ):
        for given in wrong:
            with raises(ParameterError, key="state"):
                restore(given)
            assert repr(simulation.truth) == repr(before), given
    simulation.restore_state(state)
    assert_same_end(simulation, driven(steps=100))


def test_a_damaged_pickle_is_one_error() -> None:
    rebuild, (kind, content) = driven(steps=1).__reduce_ex__(5)
    scenario, *_ = pickle.loads(content)
    for damaged in (content[:-100], b"", pickle.dumps(None), pickle.dumps((scenario, "ars", 1e-3, None, None))):
        with pytest.raises(ParameterError, match=r"cannot be unpickled"):
            rebuild(kind, damaged)


def test_the_public_name_is_the_same_class() -> None:
    assert activesteer.Simulation is Simulation
