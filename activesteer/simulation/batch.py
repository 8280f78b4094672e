"""Batch of many cars with individual parameters, driven by one native call without Python's lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from activesteer.config.faults import Fault
from activesteer.controllers import CONTROLLER, controller_spec
from activesteer.core.conventions import DEFAULT_TIMESTEP_S, Array
from activesteer.core.signals import (
    ActuatorCommand,
    DriverCommand,
    Measurement,
    Motion,
    arrays_of,
    numbers_of,
)
from activesteer.driver import DRIVER
from activesteer.driver.human import SharedTables
from activesteer.errors import ActiveSteerError, ParameterError, SimulationDiverged, shown
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable, Scenario
from activesteer.scenario.overrides import each_overrides
from activesteer.simulation.closed_loop import ClosedLoop, LoopState, NonReentrantLock, drive_together
from activesteer.simulation.copies import Copyable
from activesteer.simulation.native_loop import CAR, MESSAGES, PYTHON, STEP_ADDRESS, drive_cars
from activesteer.simulation.preparation import prepared
from activesteer.vehicle import engine_warnings_held

MAX_CARS: Final = 100_000
"""Largest number of cars in a batch."""
_LEAST_STEPS: Final = 40
"""Car-steps below which a second thread costs more than it saves."""
_MOST_STEPS: Final = 2**40
_WHEEL, _FRONT = (
    [number.name for number in numbers_of(DriverCommand)].index(name)
    for name in ("steering_wheel_demand_rad", "front_steer_demand_rad")
)
_WHEEL_TORQUES: Final = [
    place for place, number in enumerate(numbers_of(ActuatorCommand)) if number.field == "wheel_torque_demand_Nm"
]


class Batch(Copyable):
    """N independent cars in one manoeuvre, with individual overrides.

    All inputs and outputs are arrays whose first axis is the car. Each trajectory is bit-identical to the
    trajectory of a `Simulation` with the same inputs, for any number of cars and threads.

    The package's driver, held commands, and the controllers `none`, `ars`, `afs` and `lqr` run in native code on all
    threads. Every other driver or controller is called in Python, car by car.

    Attributes:
        scenarios: Manoeuvre, car and driver of each car.
        loops: The closed loops.
        threads: Number of threads.
        failures: Number of each car that has diverged -> its error. The car stands still until it is reset.

    Examples:
        >>> import numpy as np
        >>> import activesteer
        >>> batch = activesteer.Batch("sine_with_dwell", 3, overrides={"road.mu": np.array([0.6, 0.8, 1.0])})
        >>> measurement = batch.advance(1500)
        >>> measurement.yaw_rate_radps.shape
        (3,)
        >>> measurement = batch.advance(10, actuator_command=activesteer.ActuatorCommand(
        ...     rear_steer_demand_rad=-0.1 * measurement.yaw_rate_radps))
    """

    scenarios: list[Scenario]
    loops: list[ClosedLoop]
    failures: dict[int, SimulationDiverged]

    def __init__(
        self,
        maneuver: FileOrTable | Scenario,
        n: int,
        controller: Any = "none",
        vehicle: FileOrTable = "compact",
        overrides: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None,
        *,
        driver: Any = DEFAULT_DRIVER,
        timestep_s: float = DEFAULT_TIMESTEP_S,
        threads: int | None = None,
    ) -> None:
        """Build the cars and let them settle.

        Cars with the same inputs settle once.

        Args:
            maneuver: Name, path, or table of a manoeuvre; or a `Scenario`, which includes vehicle and driver.
            n: Number of cars.
            controller: Name of a controller, or your own.
            vehicle: Name, path, or table of a vehicle.
            overrides: Dotted key -> value, or array with a value for each car; or a list with overrides of each car.
            driver: Name, path or table of a driver, or your own code.
            timestep_s: Step of engine, driver and controller [s].
            threads: Number of threads; by default as many as there are processors.

        Raises:
            ActiveSteerError: an input is wrong, or a car does not settle; a note names the car.
        """
        if isinstance(n, bool) or not isinstance(n, int) or not 1 <= n <= MAX_CARS:
            raise ParameterError(f"is {shown(n)}; a number of cars from 1 to {MAX_CARS} is needed", key="n", value=n)
        if threads is not None and (isinstance(threads, bool) or not isinstance(threads, int) or threads < 1):
            raise ParameterError(f"is {shown(threads)}; at least 1 is needed", key="threads", value=threads)
        self.threads = threads or os.cpu_count() or 1
        self._controller, self._timestep_s = controller_spec(controller), timestep_s
        every = each_overrides(overrides, n)

        def of(car: int) -> Scenario:
            return prepared(maneuver, self._controller, vehicle, every[car], driver, timestep_s)

        keys = [repr(sorted(changes.items())) for changes in every]
        known = self._of_different_cars(of, keys)
        self.scenarios = [known[key] for key in keys]
        self._build()

    def _of_different_cars(self, function: Callable[[int], Any], keys: Sequence[Any]) -> dict[Any, Any]:
        """Call a function with the first car of each key on all threads, and return the results by key."""

        def call(car: int) -> Any:
            with _named(car):
                return function(car)

        first = {key: car for car, key in reversed([*enumerate(keys)])}
        with engine_warnings_held(), ThreadPoolExecutor(self.threads) as pool:
            return dict(zip(first, pool.map(call, first.values()), strict=True))

    def _build(self) -> None:
        """Create the loops. Only the first car of each scenario settles."""

        def settled(car: int) -> ClosedLoop:
            return ClosedLoop(self.scenarios[car], self._controller, self._timestep_s)

        first = self._of_different_cars(settled, [id(scenario) for scenario in self.scenarios])
        self._starts = {key: loop.save_state() for key, loop in first.items()}
        self.loops = []
        for scenario in self.scenarios:
            loop = first.pop(id(scenario), None)
            start = self._starts[id(scenario)]
            self.loops.append(loop or ClosedLoop(scenario, self._controller, self._timestep_s, settled=start))
        self.failures = {}
        self._in_use = NonReentrantLock()
        self._pool = ThreadPoolExecutor(max(1, self.threads - 1))
        self._records, tables = np.zeros(len(self), CAR), SharedTables()
        for car, loop in enumerate(self.loops):
            loop.join(self._records, car, tables)
        self._last = np.array([loop.steps for loop in self.loops])
        self._ratios = np.array([loop.driver_setup.steering_ratio for loop in self.loops])

    def __len__(self) -> int:
        """Return the number of cars."""
        return len(self.scenarios)

    @property
    def steps(self) -> NDArray[np.intp]:
        """Number of steps of each car's manoeuvre."""
        return self._last.copy()

    @property
    def step_count(self) -> NDArray[np.intp]:
        """Number of steps that each car has driven."""
        return self._records["step"].copy()

    @property
    def time_s(self) -> Array:
        """Current time of each car, from the start of the manoeuvre [s]."""
        return self._records["step"] * self._timestep_s

    @property
    def done(self) -> NDArray[np.bool_]:
        """True for each car that has finished its manoeuvre or diverged."""
        done = self._records["step"] >= self._last
        done[list(self.failures)] = True
        return done

    @property
    def measurement(self) -> Any:
        """Current signals of the sensors, a `Measurement` with fields of shape (n,), or (n, 4) for the wheels."""
        return arrays_of(Measurement, self.rows(Measurement))

    @property
    def motion(self) -> Any:
        """Current positions and motions as the drivers see them, a `Motion` with fields of shape (n,)."""
        return arrays_of(Motion, self.rows(Motion))

    @property
    def driver_command(self) -> Any:
        """Last commands of the drivers, a `DriverCommand` with fields of shape (n,)."""
        return arrays_of(DriverCommand, self.rows(DriverCommand))

    @property
    def actuator_command(self) -> Any:
        """Last commands of the controllers, an `ActuatorCommand` with fields of shape (n,), for the wheels (n, 4)."""
        return arrays_of(ActuatorCommand, self.rows(ActuatorCommand))

    def rows(self, kind: type[Any], cars: NDArray[np.intp] | slice = slice(None)) -> Array:
        """Return a copy of the numbers of current messages, shape (cars, numbers) (see `signals.arrays_of`).

        Args:
            kind: `Measurement`, `Motion`, `DriverCommand` or `ActuatorCommand`.
            cars: Numbers of the cars; by default all.
        """
        field = next(name for name, message in MESSAGES.items() if message is kind)
        return self._records[field][cars].copy()

    def advance(
        self,
        steps: int | ArrayLike = 1,
        driver_command: DriverCommand | None = None,
        actuator_command: ActuatorCommand | None = None,
        cars: ArrayLike | None = None,
    ) -> Any:
        """Drive some steps, each car at most to the end of its manoeuvre.

        If you supply a command, the block it replaces is not called and its state is frozen.

        Args:
            steps: Number of steps, or one for each car.
            driver_command: Commands that replace the drivers; each field is a number, or an array of shape (n,).
            actuator_command: Commands that replace the controllers; each field is a number, or an array of shape (n,),
                for the wheels (n, 4).
            cars: Numbers of the cars to drive, or a mask; by default all.

        Returns:
            The measurement of all cars.

        Raises:
            ParameterError: an argument is wrong; nothing was driven.
            ActiveSteerError: your own driver or controller failed. A car that diverges raises nothing: see `failures`.
        """
        left = _steps(steps, len(self))
        drivers = None if driver_command is None else DRIVER.rows(driver_command, len(self))
        if drivers is not None:
            drivers[:, _FRONT] = drivers[:, _WHEEL] / self._ratios
        controllers = None if actuator_command is None else CONTROLLER.rows(actuator_command, len(self))
        if controllers is not None:
            for car in np.flatnonzero(controllers[:, _WHEEL_TORQUES].any(axis=1)).tolist():
                with _named(car):
                    self.loops[car].vehicle.wheels.check_driven(controllers[car, _WHEEL_TORQUES].tolist())
        with self._in_use, engine_warnings_held():
            left = np.minimum(left, self._last - self._records["step"])
            left[~self._mask(cars) | self.done] = 0
            records, moving = self._records, left > 0
            records["driver_given"][moving] = drivers is not None
            records["controller_given"][moving] = controllers is not None
            if drivers is not None:
                records["driver_command"][moving] = drivers[moving]
                records["torques_set"][moving] = False
            if controllers is not None:
                records["actuator_command"][moving] = controllers[moving]
            records["left"] = left
            self.failures |= drive_together(self.loops, records, self._call)
        return self.measurement

    def _call(self, records: NDArray[Any]) -> None:
        """Drive all cars natively, with equal shares of the cars for all threads."""
        in_python = np.zeros(len(records), dtype=bool)
        for block in ("driver", "controller"):
            in_python |= (records[f"{block}_kind"] == PYTHON) & (records[f"{block}_given"] == 0)
        done = np.cumsum(np.where(in_python, np.minimum(records["left"], 1), records["left"]))
        parts = self.threads if done[-1] >= _LEAST_STEPS else 1
        ends = [*np.searchsorted(done, done[-1] * np.arange(1, parts) / parts).tolist(), len(records)]
        futures: list[Future[None]] = []
        for first, last in pairwise([0, *ends]):
            if last == len(records):
                drive_cars(records, first, last, STEP_ADDRESS)
            else:
                futures.append(self._pool.submit(drive_cars, records, first, last, STEP_ADDRESS))
        for future in futures:
            future.result()

    def set(self, key: str, value: Any, cars: ArrayLike | None = None) -> None:
        """Change a key of some cars from the next step on (see `Simulation.set`).

        Args:
            key: Dotted key, as in `overrides`.
            value: New value in the unit of the key; or an array, with a value for each of all cars.
            cars: Numbers of the cars, or a mask; by default all.

        Raises:
            ParameterError: there is no such key, it cannot change during a run, or an array has another length.
            ManeuverError: a value of the manoeuvre is wrong or has no effect. A note names the car; those before it
                are changed.
        """
        values = [changes[key] for changes in each_overrides({key: value}, len(self))]
        with self._in_use:
            for car in np.flatnonzero(self._mask(cars)).tolist():
                with _named(car):
                    self.loops[car].change(key, values[car])

    def fail(self, fault: str | Fault, cars: ArrayLike | None = None) -> None:
        """Set a fault in some cars, in addition to the active faults (see `Simulation.fail`).

        Args:
            fault: As on the command line: `rear:stuck` from the next step on, or `rear:offset=1deg@2.5-3` later.
            cars: Numbers of the cars, or a mask; by default all.

        Raises:
            ParameterError: the text is not such a fault.
            ManeuverError: a car has no such part, the part has a fault at this time, or the time is past.
        """
        with self._in_use:
            for car in np.flatnonzero(self._mask(cars)).tolist():
                with _named(car):
                    self.loops[car].add_fault(fault)

    def save_state(self, cars: ArrayLike | None = None) -> list[LoopState]:
        """Return the states of some cars for a bit-identical continuation.

        Args:
            cars: Numbers of the cars, or a mask; by default all.
        """
        with self._in_use:
            return [self.loops[car].save_state() for car in np.flatnonzero(self._mask(cars)).tolist()]

    def restore_state(self, states: Sequence[LoopState], cars: ArrayLike | None = None) -> None:
        """Restore saved states of some cars, or of cars with the same inputs.

        Args:
            states: A state for each of these cars, in the order of their numbers.
            cars: Numbers of the cars, or a mask; by default all.

        Raises:
            ParameterError: the number of states is wrong, or a state belongs to another car.
        """
        chosen = np.flatnonzero(self._mask(cars)).tolist()
        if len(states) != len(chosen):
            raise ParameterError(f"are {len(states)}; one for each of {len(chosen)} cars is needed", key="states")
        with self._in_use:
            for car, state in zip(chosen, states, strict=True):
                with _named(car):
                    self.loops[car].restore_state(state)
                self.failures.pop(car, None)

    def reset(self, cars: ArrayLike | None = None) -> Any:
        """Reset some cars to the start of their manoeuvre, and return the measurement of all.

        Args:
            cars: Numbers of the cars, or a mask; by default all.
        """
        chosen = np.flatnonzero(self._mask(cars)).tolist()
        self.restore_state([self._starts[id(self.scenarios[car])] for car in chosen], chosen)
        return self.measurement

    def _portable(self) -> Any:
        loops = self.loops
        inputs = self.scenarios, self._controller, self._timestep_s, self.threads
        return inputs, self.save_state(), [loop.vehicle.model for loop in loops], dict(self.failures)

    def _rebuild(self, portable: Any) -> None:
        (self.scenarios, self._controller, self._timestep_s, self.threads), states, models, failures = portable
        self._build()
        for loop, model in zip(self.loops, models, strict=True):
            loop.vehicle.adopt_model(model)
        self.restore_state(states)
        self.failures = failures

    def _mask(self, cars: ArrayLike | None) -> NDArray[np.bool_]:
        """Return the mask of given cars."""
        chosen = np.zeros(len(self), dtype=bool)
        try:
            chosen[slice(None) if cars is None else np.asarray(cars, dtype=None if np.size(cars) else np.intp)] = True
        except (IndexError, TypeError, ValueError) as reason:
            needed = f"numbers from 0 to {len(self) - 1}, or a mask of {len(self)}, are needed"
            raise ParameterError(f"is {shown(cars)}; {needed}", key="cars", value=cars) from reason
        return chosen


def _steps(steps: Any, n: int) -> NDArray[np.intp]:
    """Return the number of steps of each car, after checking it."""
    with suppress(ValueError, OverflowError):
        given = np.asarray(steps)
        if np.issubdtype(given.dtype, np.integer) and given.ndim < 2 and (given >= 0).all():
            return np.broadcast_to(np.minimum(given, _MOST_STEPS).astype(np.intp), n)
    raise ParameterError(
        f"is {shown(steps)}; expected one whole number of 0 or more, or {n} such numbers", key="steps", value=steps
    )


@contextmanager
def _named(car: int) -> Iterator[None]:
    """Add the number of the car to an error."""
    try:
        yield
    except ActiveSteerError as error:
        listed = error.overridden and isinstance(error.value, (list, tuple))
        rule = "; an array has a value for each car, a list is one for all" * listed
        error.add_note(f"car {car} of the batch{rule}")
        raise
