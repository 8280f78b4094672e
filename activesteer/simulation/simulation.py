"""A run that is driven step by step, by the blocks of the loop or by commands from outside, and recorded."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from numbers import Integral
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.analysis.metrics import metrics
from activesteer.controllers import CONTROLLER, find_controller
from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.driver import DRIVER
from activesteer.errors import ManeuverError, ParameterError, RecordingError, shown
from activesteer.recording import McapWriter, Recording
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable, Scenario, resolve
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement, Motion, Setpoint
from activesteer.simulation.closed_loop import ClosedLoop, LoopState
from activesteer.simulation.preparation import prepared
from activesteer.simulation.recorder import RecordedRows, Recorder
from activesteer.simulation.run_context import RunContext

MAX_KEPT_VALUES: Final = 2**25
"""Values of a run that stay in memory beside its file, 256 MiB: some three minutes. Those of a longer run are read from
the file where they are needed, so that its memory does not grow with its length."""
_SAID: Final = "Simulation.step was given"


class SavedState(NamedTuple):
    """Everything that a simulation continues from, and what it had recorded."""

    loop: LoopState
    rows: RecordedRows
    given: dict[str, int]
    metadata: dict[str, Any]


class _Given(NamedTuple):
    """A driver or controller that repeats one command."""

    command: Any

    def step(self, *_: Any, **__: Any) -> Any:
        return self.command


class Simulation:
    """A manoeuvre that is driven as far as one asks: `simulate`, step by step.

    Attributes:
        scenario: Manoeuvre, car and driver.
        loop: The blocks: `loop.driver`, `loop.controller`, `loop.vehicle`, and what they may know of the car.
        context: What its recording holds beside the rows.

    Example:
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
    ) -> None:
        """Builds the car and lets it settle, as `simulate` does; the arguments are the same.

        Args:
            maneuver: Name, path, or table of a manoeuvre; or a `Scenario`, which holds vehicle, driver and overrides
                already.
            controller: Name of a controller, or a user's own.
            vehicle: Name, path, or table of a vehicle.
            overrides: Dotted key -> value.
            driver: Name, path or table of a driver, or a user's own code.
            timestep_s: Step of engine, driver and controller [s].

        Raises:
            ActiveSteerError: an input is wrong, or the car does not settle.
        """
        controller = find_controller(controller)
        if not isinstance(maneuver, Scenario):
            maneuver = resolve(maneuver, vehicle, overrides, driver)
        elif overrides or vehicle != "compact" or driver != DEFAULT_DRIVER:
            raise ParameterError(
                "a Scenario has its vehicle, driver and overrides already", key="vehicle, overrides, driver"
            )
        # Does nothing where everything is known already.
        self.scenario = prepared(maneuver, timestep_s)
        self.loop = ClosedLoop(self.scenario, controller, timestep_s)
        self.context = RunContext.of(self.scenario, self.loop.vehicle, controller)
        self._given: dict[str, int] = {}
        self._failure: BaseException | None = None
        self._writer: McapWriter | None = None

    @cached_property
    def _recorder(self) -> Recorder:
        return Recorder(self.loop.vehicle, self.steps)

    @property
    def steps(self) -> int:
        """Number of steps of the manoeuvre."""
        return self.loop.steps

    @property
    def time_s(self) -> float:
        """The present instant, from the start of the recording [s]."""
        return self.loop.step_count * self.loop.vehicle.timestep_s

    @property
    def done(self) -> bool:
        """Whether the manoeuvre was driven to its end."""
        return self.loop.step_count >= self.steps

    @property
    def setpoint(self) -> Setpoint:
        """What the manoeuvre now asks of the driver."""
        return self.scenario.maneuver.setpoint(self.time_s)

    @property
    def measurement(self) -> Measurement:
        """What the sensors say: all that a controller gets to see."""
        return self.loop.measurement

    @property
    def motion(self) -> Motion:
        """Where the car is and how it moves, as a driver sees it."""
        return self.loop.motion

    @property
    def truth(self) -> dict[str, float]:
        """Every recorded channel at the present instant, by name.

        It is what the next row of the recording will hold, but for what depends on the commands of the next step; these
        are the last ones. It is worked out whenever it is asked for, which takes as long as some ten steps.
        """
        return self._recorder.present(*self.loop.commands)

    def step(
        self, driver_command: DriverCommand | None = None, actuator_command: ActuatorCommand | None = None
    ) -> Measurement:
        """Drives one step; see `advance`."""
        return self.advance(1, driver_command, actuator_command)

    def advance(
        self, steps: int, driver_command: DriverCommand | None = None, actuator_command: ActuatorCommand | None = None
    ) -> Measurement:
        """Drives on for some steps.

        Args:
            steps: How many, at most to the end of the manoeuvre.
            driver_command: What the driver does in all of them. The driver is then not asked, and his state stands
                still until he is.
            actuator_command: What the controller asks for, likewise.

        Returns:
            What the sensors say afterwards.

        Raises:
            ManeuverError: the manoeuvre ends before; nothing was driven.
            DriverError: the driver command is none, or the driver returned nonsense.
            ControllerError: the same of the actuator command and the controller.
            SimulationDiverged: the state became non-finite, or the engine raised a warning.
        """
        loop, left = self.loop, self.steps - self.loop.step_count
        if self._failure is not None:
            problem = f"the run failed ({type(self._failure).__name__}); it goes on from a saved state only"
            raise ManeuverError(f"{problem}: {self._failure}") from self._failure
        if isinstance(steps, bool) or not isinstance(steps, Integral) or steps < 0:
            raise ParameterError(f"is {shown(steps)}; a whole number of steps, 0 or more, is needed", key="steps")
        if steps > left:
            end = f"{self.scenario.maneuver.name} ends at {self.scenario.maneuver.duration_s:g} s (duration_s)"
            raise ManeuverError(f"{end}; {steps} more steps are asked for, {left} are left", value=steps, allowed=left)
        driver = controller = None
        if driver_command is not None:
            driver = _Given(DRIVER.checked(driver_command, "", loop.driver_setup, _SAID))
        if actuator_command is not None:
            controller = _Given(CONTROLLER.checked(actuator_command, "", loop.controller_setup, _SAID))
        rows = self._recorder.rows
        with self._watched():
            try:
                loop.advance(int(steps), self._recorder, driver=driver, controller=controller)
            finally:
                for word, given in (("driver", driver), ("controller", controller)):
                    if given is not None:
                        self._given[word] = self._given.get(word, 0) + self._recorder.rows - rows
            if self.done:
                self._recorder.flush()
        return loop.measurement

    def run(self) -> None:
        """Drives the manoeuvre to its end; see `advance`."""
        self.advance(self.steps - self.loop.step_count)

    def save_state(self) -> SavedState:
        """Everything that the simulation continues from, and what was recorded so far.

        Raises:
            SimulationDiverged: something recorded is not finite.
        """
        with self._watched():
            rows = self._recorder.save_state()
        return SavedState(self.loop.save_state(), rows, dict(self._given), self.context.metadata)

    def restore_state(self, state: SavedState) -> None:
        """Goes back to a saved state; what follows is bit-identical to what followed then.

        The recording goes back too: it then holds what led to this state. Recordings taken before stay as they are.

        Args:
            state: A state of this simulation, or of another one that was made with the same inputs.

        Raises:
            ParameterError: it is the state of a simulation of something else.
        """
        if state.metadata is not self.context.metadata and state.metadata != self.context.metadata:
            raise ParameterError("was saved by a simulation with other inputs", key="state")
        self.loop.restore_state(state.loop)
        self._recorder.restore_state(state.rows)
        self._given, self._failure = dict(state.given), None

    def recording(self) -> Recording:
        """What was driven so far.

        Returns:
            The recording; at the end of the manoeuvre that of `simulate`. Before, and after a failure, it has no
            metrics, `complete` is false, and `error` says why. Where commands came from outside, `commands_given` has
            the number of these steps by `driver` and `controller`.

        Raises:
            SimulationDiverged: something recorded is not finite; calling it again returns the recording.
        """
        recorder, failure = self._recorder, self._failure
        if failure is None:
            with self._watched():
                recorder.flush()
        if recorder.keeps_all or self._writer is None:
            recording = self.context.recording(recorder)
        else:
            recording = Recording.open(self._writer.flush())
        recording.metadata["complete"] = failure is None and self.done
        if self._given:
            recording.metadata["commands_given"] = dict(self._given)
        if failure is not None:
            recording.metadata["error"] = f"{type(failure).__name__}: {failure}"
        elif not self.done:
            recording.metadata["error"] = f"driven to {self.time_s:g} of {self.scenario.maneuver.duration_s:g} s"
        else:
            try:
                recording.metrics.update(metrics(recording))
            except RecordingError as error:
                recording.metadata["metrics_error"] = str(error)
        return recording

    @contextmanager
    def recorded_to(self, path: Path) -> Iterator[None]:
        """While this lasts, a file is written as the run goes on; it has to begin before the first step.

        Args:
            path: MCAP file to write. It is ended in every case, marked as incomplete after an exception.

        Raises:
            RecordingError: the file cannot be written.
        """
        assert self.loop.step_count == 0
        with self.context.writer(path) as self._writer:
            keep = self.steps * len(self.context.channels) <= MAX_KEPT_VALUES
            self._recorder = Recorder(self.loop.vehicle, self.steps, self._writer, keep=keep)
            yield

    def end_file(self, recording: Recording) -> None:
        """Writes how the run ended and its metrics behind the rows of its file, if there is one."""
        if self._writer is not None:
            known = self.context.metadata
            outcome = {key: value for key, value in recording.metadata.items() if key not in known}
            self._writer.close(outcome | {"metrics": recording.metrics})

    @contextmanager
    def _watched(self) -> Iterator[None]:
        """Notes a failure, after which the blocks do not agree on where they are; what was recorded is kept."""
        try:
            yield
        except BaseException as failure:
            self._failure = failure
            self._recorder.flush(checked=False)
            raise
