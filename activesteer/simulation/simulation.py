"""A recorded run that is driven step by step, by its blocks or by your commands."""

from __future__ import annotations

import gc
import json
import weakref
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from numbers import Integral
from pathlib import Path
from typing import Any, Final, Protocol

from activesteer.config import Range
from activesteer.config.faults import Fault
from activesteer.controllers import CONTROLLER, controller_spec
from activesteer.core.conventions import DEFAULT_TIMESTEP_S
from activesteer.core.limits import MAX_EVENT_LETTERS, MAX_EVENTS
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement, Motion, Setpoint
from activesteer.driver import DRIVER
from activesteer.errors import ManeuverError, ParameterError, RecordingError, shown
from activesteer.recording import McapWriter, Recording
from activesteer.recording.contents import Event
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable, Scenario
from activesteer.scenario.run_context import RunContext
from activesteer.simulation.closed_loop import ClosedLoop, Given, LoopState
from activesteer.simulation.copies import Copyable
from activesteer.simulation.pacing import RealtimePacer
from activesteer.simulation.preparation import prepared
from activesteer.simulation.recorder import PACED_BLOCK_INTERVAL_S, RecordedRows, Recorder
from activesteer.simulation.sampled_controller import slow_actuators

MAX_KEPT_VALUES: Final = 2**25
"""Largest number of values of a run with a file in memory: 256 MiB, about three minutes. Longer runs read the file."""
_COARSE_S: Final = 5e-4
"""Step from which longitudinal tyre forces on short obstacles are coarse [s]: they move by 10 % in a millisecond."""
_COARSE: Final = (
    "the time step is long for a short obstacle: longitudinal tyre forces may be wrong by a tenth of their range, "
    "on a stiff tyre by more; timestep_s=0.00025 is finer"
)


class Link(Protocol):
    """Another process that gives commands. Its `report` has the key `name` in the recording."""

    name: str
    report: dict[str, int]

    def connect(self, check: Callable[[Given, str], Given]) -> None:
        """Set the function that checks and completes commands."""

    def commands(self) -> Given:
        """Return the commands for the next step, with None where the run's own block decides."""
        ...

    def tell(self, step: int, measurement: Measurement, motion: Motion) -> None:
        """Send the state after a step."""

    def close(self) -> None:
        """Close the link to the other process."""


@dataclass(frozen=True)
class SavedState:
    """Saved state of a simulation for a bit-identical continuation, with the rows recorded so far."""

    metadata: dict[str, Any]
    loop: LoopState
    rows: RecordedRows
    given: dict[str, int]
    events: tuple[Event, ...]


class Simulation(Copyable):
    """A run of the car that you drive step by step.

    `copy()`, `copy.deepcopy` and `pickle` return an independent simulation that continues bit-identically. One thread
    at a time can drive a simulation.

    Attributes:
        scenario: Manoeuvre, car and driver, as at the start.
        loop: The blocks: `loop.driver`, `loop.controller`, `loop.vehicle`, and the properties of the car they may know.
        context: Contents of the recording apart from its rows.
        events: Changes during the run; see `set` and `fail`.

    Examples:
        >>> import activesteer
        >>> simulation = activesteer.Simulation("straight_line", overrides={"duration_s": 1.0})
        >>> while not simulation.done:
        ...     measurement = simulation.step()
        >>> len(simulation.recording())
        1000
    """

    def __init__(
        self,
        maneuver: FileOrTable | Scenario,
        controller: Any = "none",
        vehicle: FileOrTable = "compact",
        overrides: Mapping[str, Any] | None = None,
        *,
        driver: Any = DEFAULT_DRIVER,
        timestep_s: float = DEFAULT_TIMESTEP_S,
        realtime: bool | float = False,
        link: Link | None = None,
    ) -> None:
        """Build the car and let it settle, with the arguments of `simulate`.

        Args:
            maneuver: Name, path, or table of a manoeuvre; or a `Scenario`, which includes the three other inputs.
            controller: Name of a controller, or your own.
            vehicle: Name, path, or table of a vehicle.
            overrides: Dotted key -> value.
            driver: Name, path or table of a driver, or your own code.
            timestep_s: Step of engine, driver and controller [s].
            realtime: Whether each step begins at its time by the clock; a number is the pace, 2 for twice as fast.
            link: Link to another process that gives commands, such as `activesteer.coupling.udp.UdpLink(5005)`.

        Raises:
            ActiveSteerError: an input is wrong, or the car does not settle.
        """
        self._controller = controller = controller_spec(controller)
        self.scenario = prepared(maneuver, controller, vehicle, overrides, driver, timestep_s)
        self.loop = ClosedLoop(self.scenario, controller, timestep_s)
        self.context = RunContext.of(self.scenario, self.loop.vehicle, controller)
        self._given: dict[str, int] = {}
        self.events: tuple[Event, ...] = ()
        self._pacer = None if realtime is False else RealtimePacer(1.0 if realtime is True else realtime, timestep_s)
        self._link = link
        if link is not None:
            link.connect(partial(_checked, self.loop))  # not a method, which would keep the run alive
            weakref.finalize(self, link.close)
        self._failure: BaseException | None = None
        self._writer: McapWriter | None = None
        if timestep_s >= _COARSE_S and self.scenario.maneuver.ground.is_steep:
            self._note("note", _COARSE)
        if slow := slow_actuators(controller, self.scenario, self.loop.vehicle):
            self._note("note", slow)

    @cached_property
    def _recorder(self) -> Recorder:
        return Recorder(self.loop.vehicle, self.steps, interval_s=self._block_s)

    @property
    def _block_s(self) -> float | None:
        return None if self._pacer is None and self._link is None else PACED_BLOCK_INTERVAL_S

    @property
    def steps(self) -> int:
        """Number of steps of the manoeuvre."""
        return self.loop.steps

    @property
    def time_s(self) -> float:
        """Current time, from the start of the recording [s]."""
        return self.loop.step_count * self.loop.vehicle.timestep_s

    @property
    def done(self) -> bool:
        """True at the end of the manoeuvre."""
        return self.loop.step_count >= self.steps

    @property
    def setpoint(self) -> Setpoint:
        """Current demand of the manoeuvre on the driver."""
        sequence = self.loop.sequence
        return self.loop.maneuver.setpoint(self.time_s) if sequence is None else sequence.present

    @property
    def measurement(self) -> Measurement:
        """Current signals of the sensors: everything that a controller sees."""
        return self.loop.measurement

    @property
    def motion(self) -> Motion:
        """Current position and motion of the car, as a driver sees them."""
        return self.loop.motion

    @property
    def truth(self) -> dict[str, float]:
        """Current values of all recorded channels, by name.

        Quantities that depend on the next command (demands, torques of servos and drive, accelerations) are not yet
        updated. Each access computes all channels again, which takes as long as about ten steps.
        """
        with self.loop.in_use:
            return self._recorder.present(*self.loop.commands)

    def step(
        self, driver_command: DriverCommand | None = None, actuator_command: ActuatorCommand | None = None
    ) -> Measurement:
        """Drive one step (see `advance`)."""
        return self.advance(1, driver_command, actuator_command)

    def advance(
        self, steps: int, driver_command: DriverCommand | None = None, actuator_command: ActuatorCommand | None = None
    ) -> Measurement:
        """Drive a number of steps, by the blocks or by given commands.

        If you supply a command, the block it replaces is not called and its state is frozen.

        Args:
            steps: Number of steps, at most to the end of the manoeuvre.
            driver_command: Command that replaces the driver in all of these steps.
            actuator_command: Command that replaces the controller in all of these steps.

        Returns:
            The measurement after these steps.

        Raises:
            ManeuverError: fewer steps are left, or the simulation is already being driven; nothing was driven.
            DriverError: the driver command is invalid, or the driver failed.
            ControllerError: the actuator command is invalid, or the controller failed.
            SimulationDiverged: the state became non-finite, or the engine raised a warning.
        """
        loop = self.loop
        with loop.in_use:
            self._check_going_on()
            if isinstance(steps, bool) or not isinstance(steps, Integral) or steps < 0:
                raise ParameterError(f"is {shown(steps)}; a whole number of steps, 0 or more, is needed", key="steps")
            if steps > (left := self.steps - loop.step_count):
                end = f"{self.scenario.maneuver.name} ends at {self.scenario.maneuver.duration_s:g} s (duration_s)"
                problem = f"{end}; {steps} more steps were requested, {left} are left"
                raise ManeuverError(problem, value=steps, allowed=left)
            given = _checked(loop, (driver_command, actuator_command), "Simulation.step was given")
            with self._watched():
                if self._pacer is None and self._link is None:
                    self._drive(int(steps), given)
                else:
                    self._drive_by_the_clock(int(steps), given)
                if self.done:
                    self._recorder.flush()
            return loop.measurement

    def _drive(self, steps: int, given: Given) -> None:
        rows = self._recorder.rows
        try:
            self.loop.drive(steps, self._recorder, given)
        finally:
            self._note_phases()
            for word, command in zip(("driver", "controller"), given, strict=True):
                if command is not None:
                    self._given[word] = self._given.get(word, 0) + self._recorder.rows - rows

    def _drive_by_the_clock(self, steps: int, given: Given) -> None:
        """Drive single steps, each at its time by the clock, with the commands that have arrived."""
        pacer, link, loop = self._pacer, self._link, self.loop
        collects = gc.isenabled()
        gc.disable()  # a collection takes longer than a step
        try:
            for _ in range(steps):
                if pacer is not None:
                    pacer.await_step()
                if link is None:
                    self._drive(1, given)
                    continue
                heard = link.commands()
                self._drive(1, (given[0] or heard[0], given[1] or heard[1]))
                link.tell(loop.step_count, loop.measurement, loop.motion)
        finally:
            if collects:
                gc.enable()

    def set(self, key: str, value: Any) -> None:
        """Change a key from the next step on.

        The recording keeps the change as an event.

        The frictions of the road, the speed and the inputs of the manoeuvre, and the parameters of controller and
        driver can change. Controller and driver keep their memory.

        Args:
            key: Dotted key, as in `overrides`: `road.mu`, `speed_kmh`, `controllers.lqr.sideslip_scale_deg`.
            value: New value, in the unit of the key.

        Raises:
            ParameterError: there is no such key, it cannot change during a run, or nothing reads it.
            ManeuverError: a value of the manoeuvre is wrong or has no effect, or the simulation is being driven.

        Examples:
            >>> import activesteer
            >>> simulation = activesteer.Simulation("straight_line", overrides={"duration_s": 1.0})
            >>> _ = simulation.advance(500)
            >>> simulation.set("road.mu", 0.3)
            >>> simulation.run()
            >>> simulation.recording()["fl_mu"][[499, 501]].tolist()
            [1.0, 0.3]
        """
        with self.loop.in_use:
            self._check_going_on()
            self.loop.change(key, value)
            self._note("set", f"{key} = {json.dumps(value, default=str)}")

    def fail(self, fault: str | Fault) -> None:
        """Set a fault, in addition to the active faults.

        The recording keeps it as an event.

        Args:
            fault: As on the command line: `rear:stuck` from the next step on, or `rear:offset=1deg@2.5-3` later.

        Raises:
            ParameterError: the text is not such a fault.
            ManeuverError: the car has no such part, the part has a fault at this time, or the time is past.

        Examples:
            >>> import activesteer
            >>> simulation = activesteer.Simulation("step_steer", "ars", overrides={"duration_s": 2.0})
            >>> _ = simulation.advance(800)
            >>> simulation.fail("rear:stuck")
            >>> simulation.run()
            >>> simulation.recording().metadata["events"]
            [{'time_s': 0.8, 'kind': 'fail', 'what': 'rear:stuck'}]
        """
        with self.loop.in_use:
            self._check_going_on()
            self._note("fail", self.loop.add_fault(fault))

    def note(self, what: str) -> None:
        """Record a remark as an event at the current time.

        Raises:
            ParameterError: the remark is empty or too long.
            ManeuverError: the simulation is being driven.
        """
        if not 0 < len(what) <= MAX_EVENT_LETTERS:
            raise ParameterError(
                f"has {len(what)} characters; 1 to {MAX_EVENT_LETTERS} are allowed",
                key="what",
                allowed=Range(1, MAX_EVENT_LETTERS),
            )
        with self.loop.in_use:
            self._check_going_on()
            self._note("note", what)

    def _note(self, kind: str, what: str, time_s: float | None = None) -> None:
        if len(self.events) >= MAX_EVENTS:
            raise RecordingError(f"a recording has at most {MAX_EVENTS} events", allowed=MAX_EVENTS)
        self.events = (*self.events, Event(self.time_s if time_s is None else time_s, kind, what))
        if self._writer is not None:
            self._writer.write_events(self.events[-1:])

    def _note_phases(self) -> None:
        """Record the phases that have begun since the last call."""
        known = sum(event.kind == "phase" for event in self.events)
        for time_s, name in self.loop.sequence.began[known:] if self.loop.sequence is not None else ():
            self._note("phase", name, time_s)

    def _check_going_on(self) -> None:
        if self._failure is not None:
            problem = f"the run failed ({type(self._failure).__name__}); it can continue only from a saved state"
            raise ManeuverError(f"{problem}: {self._failure}") from self._failure

    def run(self) -> None:
        """Drive the manoeuvre to its end (see `advance`)."""
        self.advance(self.steps - self.loop.step_count)

    def save_state(self) -> SavedState:
        """Return the state for a bit-identical continuation of the simulation, with the rows recorded so far.

        Raises:
            SimulationDiverged: a recorded value is not finite.
            ManeuverError: the simulation is being driven.
        """
        with self.loop.in_use:
            with self._watched():
                rows = self._recorder.save_state()
            return SavedState(self.context.metadata, self.loop.save_state(), rows, dict(self._given), self.events)

    def restore_state(self, state: SavedState) -> None:
        """Go back to a saved state for a bit-identical continuation of the simulation.

        The recording then holds the rows that led to this state. Recordings taken before are not changed.

        Args:
            state: A state of this simulation, or of another one with the same inputs.

        Raises:
            ParameterError: `state` is something else.
            RecordingError: the run is being written to a file.
            ManeuverError: the simulation is being driven.
        """
        if not isinstance(state, SavedState):
            raise ParameterError(f"is {shown(state)}; a state of this simulation is needed", key="state", value=state)
        if state.metadata is not self.context.metadata and state.metadata != self.context.metadata:
            raise ParameterError("was saved by a simulation with other inputs", key="state")
        with self.loop.in_use:
            self._recorder.check_state(state.rows)
            self.loop.restore_state(state.loop)
            self._recorder.restore_state(state.rows)
            self._given, self.events, self._failure = dict(state.given), state.events, None

    def _portable(self) -> Any:
        if self._writer is not None:
            raise RecordingError("a run that is being written to a file can be neither copied nor pickled")
        if self._failure is not None:
            raise ManeuverError(f"a run that failed can be neither copied nor pickled: {self._failure}")
        vehicle = self.loop.vehicle
        return self.scenario, self._controller, vehicle.timestep_s, self.save_state(), vehicle.model

    def _rebuild(self, portable: Any) -> None:
        scenario, controller, timestep_s, state, model = portable
        Simulation.__init__(self, scenario, controller, timestep_s=timestep_s)
        self.loop.vehicle.adopt_model(model)
        self.restore_state(state)

    def recording(self) -> Recording:
        """Return the recording of the steps driven so far.

        At the end of the manoeuvre it equals the recording of `simulate`. Before the end, and after a failure, it has
        no metrics, its metadata `complete` is false, and `error` gives the reason. If you supplied commands,
        `commands_given` holds the number of these steps by `driver` and `controller`.

        Raises:
            SimulationDiverged: a recorded value is not finite; a second call returns the recording.
            ManeuverError: the simulation is being driven.
        """
        with self.loop.in_use:
            return self._recording()

    def _recording(self) -> Recording:
        recorder, failure = self._recorder, self._failure
        if failure is None:
            with self._watched():
                recorder.flush()
        if recorder.keeps_all or self._writer is None:
            recording = self.context.recording(*recorder.result())
        else:
            recording = Recording.open(self._writer.flush())
        recording.metadata["complete"] = failure is None and self.done
        if self._given:
            recording.metadata["commands_given"] = dict(self._given)
        if self._pacer is not None:
            recording.metadata["realtime"] = self._pacer.report()
        if self._link is not None:
            recording.metadata[self._link.name] = dict(self._link.report)
        if failure is not None:
            recording.metadata["error"] = f"{type(failure).__name__}: {failure}"
        elif not self.done:
            recording.metadata["error"] = f"driven to {self.time_s:g} of {self.scenario.maneuver.duration_s:g} s"
        else:
            # A car that is only stepped needs no evaluation.
            from activesteer.analysis.metrics import metrics, speed_note  # noqa: PLC0415

            try:
                recording.metrics.update(metrics(recording))
                if (note := speed_note(recording)) and all(event.what != note for event in self.events):
                    self._note("note", note)
            except RecordingError as error:
                recording.metadata["metrics_error"] = str(error)
        if self.events:
            recording.metadata["events"] = [event._asdict() for event in self.events]
        return recording

    @contextmanager
    def recorded_to(self, path: Path) -> Iterator[None]:
        """Context that writes the run to a file while it proceeds.

        Enter the context before the first step.

        Args:
            path: MCAP file to write. It is completed in every case, and marked as incomplete after an exception.

        Raises:
            RecordingError: the file cannot be written.
        """
        if self.loop.step_count or self._writer is not None:
            raise RecordingError(
                "a run can be recorded to one file only, and only from its first step", key="path", value=path
            )
        with self.context.writer(path) as self._writer:
            if self.events:
                self._writer.write_events(self.events)
            keep = self.steps * len(self.context.channels) <= MAX_KEPT_VALUES
            recorder = Recorder(self.loop.vehicle, self.steps, self._writer, keep=keep, interval_s=self._block_s)
            self._recorder = recorder
            yield

    def end_file(self, recording: Recording) -> None:
        """Write outcome and metrics of the run at the end of its file, if any."""
        if self._writer is not None:
            known = self.context.metadata
            outcome = {key: value for key, value in recording.metadata.items() if key not in known}
            self._writer.close(outcome | {"metrics": recording.metrics})

    @contextmanager
    def _watched(self) -> Iterator[None]:
        """Context that records a failure and keeps the rows recorded before it."""
        try:
            yield
        except BaseException as failure:
            self._failure = failure
            self._recorder.flush(checked=False)
            raise


def _checked(loop: ClosedLoop, given: Given, said: str) -> Given:
    """Check and complete given commands."""
    driver_command, actuator_command = given
    if driver_command is not None:
        driver_command = DRIVER.checked(driver_command, "", loop.driver_setup, said)
    if actuator_command is not None:
        actuator_command = CONTROLLER.checked(actuator_command, "", loop.controller_setup, said)
    return driver_command, actuator_command
