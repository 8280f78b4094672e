"""The linearised car: its discrete-time map and its modes.

Method:

1. Trim. The car rolls straight ahead; Newton's method on one step of the engine finds the state and the drive torque
   at which, at the given speed, the state without its cyclic coordinates (`LocalState`) repeats itself exactly.
2. One whole step, tyres, servos and constraints included, is differentiated by central differences of that state and
   of the demands of the actuators: x[k+1] = A x[k] + B u[k], and the recorded channels y[k] = C x[k] + D u[k].
   (`mujoco.mjd_transitionFD` would miss forces: it skips the passive callback when it perturbs activations, which
   hold the deflection of the tyres' carcass.)
3. Continuous time: the eigenvalues z of A become s = ln(z)/h, and the input matrix is inverted for an input held over a
   step, mode by mode: the result agrees with the engine's own step at every sample.
4. Reduction: modes below a cut-off frequency are kept, except those without influence from the inputs on the outputs
   (heave, pitch, speed). The static part of the faster modes is kept in D, so that the gain at rest is exact.

Validity: small motions about straight driving on a level, even road. Dampers enter with the mean slope of their curves
on both sides of rest, and the friction of their seals as the vibration of the road leaves it at small speeds. The
friction of the rack is left out: about a point of rest it would hold the rack by its elasticity, while the rack of a
steered car slides. The friction and play of screws in the toe links are left out too.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from activesteer.analysis.source import RecordingLike
from activesteer.config import Range
from activesteer.core.conventions import RUN_COLOURS, Array
from activesteer.core.signals import ActuatorCommand, DriverCommand
from activesteer.core.text_table import text_table
from activesteer.core.units import quantity_of
from activesteer.errors import ModelError, ParameterError
from activesteer.maneuver.base import MAX_SPEED_MPS
from activesteer.pages import Page, Section, Table, Text, failed, passed
from activesteer.plotting import Curve, Panel, Picture
from activesteer.scenario import FileOrTable, check_parts, resolve
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.vehicle import Vehicle
from activesteer.vehicle.linear_state import LocalState, Mode, find_modes

if TYPE_CHECKING:
    import control


INPUTS: Final = ("steering_wheel_rad", "rear_steer_rad", "superposition_rad")
"""Demands: steering wheel [rad], rear steering [rad], and superposition at the road wheel [rad]."""
OUTPUTS: Final = ("yaw_rate_radps", "ay_mps2", "roll_rad", "sideslip_rad")
"""Channels of a recording that are the outputs."""
ACTUATORS: Final = ("rear_steer_rad", "superposition_rad")
"""Channels of the positions of a controller's actuators."""

_DIFFERENCE: Final = 1e-6
"""Step of the central differences [m, rad, m/s, rad/s]: eigenvalues agree between 1e-7 and 1e-4 to four digits."""
_TORQUE_DIFFERENCE_Nm: Final = 1.0
_TRIM_ITERATIONS: Final = 10
_TRIM_TOLERANCE: Final = 1e-11
"""Largest change of a steady state over a step [m, rad, m/s, rad/s]. Rounding leaves 1e-14."""
_SOLVER_TOLERANCE: Final = 1e-14
"""Tolerance of MuJoCo's own solver, if a car needs it: an error of 1e-8 would be divided by the small difference."""


class DiscreteTimeMap:
    """One step of the engine about a reference state, as a function of state x, inputs u and drive torque."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        vehicle.model.opt.tolerance = _SOLVER_TOLERANCE
        self.torque_Nm = 0.0
        self.local = LocalState(vehicle)
        names = [channel.name for channel in vehicle.channels.channels]
        self._columns = [names.index(name) for name in (*OUTPUTS, *ACTUATORS)]

    def __call__(self, x: Array, u: Array, more_torque_Nm: float = 0.0) -> Array:
        """Return the difference from the reference state after the step."""
        self.local.write(x)
        steering_wheel, rear, added = (float(value) for value in u)
        command = DriverCommand(steering_wheel, self.torque_Nm + more_torque_Nm)
        self.vehicle.step(command, ActuatorCommand(rear, added))
        return self.local.read()

    def trim(self, speed_mps: float) -> None:
        """Set steady straight driving, with its drive torque, as the reference."""
        size, rest = len(self.local.names), np.zeros(len(INPUTS))
        speed = self.local.names.index("d_x")
        x = np.zeros(size)
        x[speed] = speed_mps - float(self.vehicle.data.qvel[0])
        self._rebase(x)
        residual = self(np.zeros(size), rest)
        for _ in range(_TRIM_ITERATIONS):
            if np.abs(residual).max() < _TRIM_TOLERANCE:
                return
            jacobian = self.derivatives("x")[0] - np.eye(size)
            # The speed is given; the torque that holds it is the unknown in its place.
            torque = _TORQUE_DIFFERENCE_Nm
            jacobian[:, speed] = (self(np.zeros(size), rest, torque) - self(np.zeros(size), rest, -torque)) / (
                2 * torque
            )
            if not np.isfinite(jacobian).all():
                break
            move: Array = np.linalg.lstsq(jacobian, -residual, rcond=None)[0].astype(np.float64)
            self.torque_Nm += float(move[speed])
            move[speed] = 0.0
            self._rebase(move)
            residual = self(np.zeros(size), rest)
        worst = self.local.names[int(np.abs(residual).argmax())]
        raise ModelError(
            f"the car does not roll steadily straight ahead at {speed_mps:g} m/s: in a step of the engine {worst} "
            f"still changes by {np.abs(residual).max():.3g} (allowed {_TRIM_TOLERANCE:g})"
        )

    def _rebase(self, x: Array) -> None:
        self.local.write(x)
        self.local.take_reference()

    def derivatives(self, of: str) -> tuple[Array, Array]:
        """Return the derivatives of the state after the step and of the outputs before it."""
        size, rest = len(self.local.names), (np.zeros(len(self.local.names)), np.zeros(len(INPUTS)))
        count = size if of == "x" else len(INPUTS)
        following = np.empty((2 * count, size))
        rows = self.vehicle.rows.empty(2 * count)
        for row in range(2 * count):
            x, u = (part.copy() for part in rest)
            (x if of == "x" else u)[row % count] = _DIFFERENCE if row < count else -_DIFFERENCE
            following[row] = self(x, u)
            for block, live in zip(rows, self.vehicle.rows.live(), strict=True):
                block[row] = live
        outputs = self.vehicle.channels.evaluate(rows)[:, self._columns]
        return tuple((part[:count] - part[count:]).T / (2.0 * _DIFFERENCE) for part in (following, outputs))  # type: ignore[return-value]


CUT_OFF_HZ: Final = 45.0
"""Natural frequency above which a mode is replaced by its static part [Hz].

The compact's front wheels lean on their top mounts at 41 Hz; this mode is 3 % of its lateral acceleration at 3 Hz.
"""
MIN_SPEED_MPS: Final = 3.0
"""Lowest speed: below it the standstill behaviour of the tyres fades in [m/s]."""

_SETTLE_S: Final = 1.0
_NO_INFLUENCE: Final = 1e-8
"""Smallest fraction of a mode in any gain of the car for which the state space contains it. Symmetric modes have 1e-12,
the smallest of the lateral modes 1e-4."""


@dataclass(frozen=True)
class LinearCar:
    """The discrete-time car about straight driving.

    Attributes:
        speed_mps: Speed [m/s].
        timestep_s: Step of the engine, h [s].
        drive_torque_Nm: Drive torque that holds the speed [N m].
        states: Names of the states, n; see `LocalState`.
        a: System matrix of one step, shape (n, n).
        b: Input matrix, shape (n, len(INPUTS)).
        c: Output matrix, shape (len(OUTPUTS), n).
        d: Feed-through, shape (len(OUTPUTS), len(INPUTS)).
        actuators: Output matrix of the positions of rear steering and superposition, shape (len(ACTUATORS), n).
    """

    speed_mps: float
    timestep_s: float
    drive_torque_Nm: float
    states: tuple[str, ...]
    a: Array
    b: Array
    c: Array
    d: Array
    actuators: Array

    def modes(self) -> list[Mode]:
        """Return all modes by natural frequency, with one mode for each conjugate pair."""
        return find_modes(self.a, self.states, self.timestep_s)

    def state_space(self, cut_off_Hz: float = CUT_OFF_HZ) -> control.StateSpace:
        """Return the lateral motion in continuous time.

        Args:
            cut_off_Hz: Natural frequency above which modes are replaced by their static part [Hz].

        Returns:
            Modal state space with real coefficients, the states of a conjugate pair named `..._re`, `..._im`;
            inputs `INPUTS`, outputs `OUTPUTS`.
        """
        import control  # noqa: PLC0415 - takes longer to import than a run takes to start
        from scipy.linalg import block_diag  # noqa: PLC0415 - the same

        modes = self.modes()
        discrete = np.array([np.exp(mode.eigenvalue_1ps * self.timestep_s) for mode in modes])
        outputs = np.array([self.c @ mode.shape for mode in modes])
        inputs = np.array([mode.left @ self.b for mode in modes])
        # A conjugate pair contributes twice the real part.
        twice = np.array([2.0 if mode.eigenvalue_1ps.imag > 0.0 else 1.0 for mode in modes])
        gains = np.real(twice[:, None, None] * outputs[:, :, None] * (inputs / (1.0 - discrete)[:, None])[:, None, :])
        # If a gain nearly vanishes, as for sideslip at some speed, the largest part of a mode counts.
        fraction = (np.abs(gains) / np.abs(gains).max(axis=0)).max(axis=(1, 2))
        kept = [
            index
            for index, mode in enumerate(modes)
            if mode.natural_frequency_Hz <= cut_off_Hz and fraction[index] > _NO_INFLUENCE
        ]
        fast = [index for index, mode in enumerate(modes) if mode.natural_frequency_Hz > cut_off_Hz]
        feedthrough = self.d + gains[fast].sum(axis=0)
        blocks: list[Array] = []
        b_rows: list[Array] = []
        c_columns: list[Array] = []
        names: list[str] = []
        for index in kept:
            mode, s = modes[index], modes[index].eigenvalue_1ps
            held = s / (discrete[index] - 1.0) * inputs[index]
            name = _identifier(mode.name, names)
            if s.imag > 0.0:
                blocks.append(np.array([[s.real, -s.imag], [s.imag, s.real]]))
                b_rows += [held.real, held.imag]
                c_columns += [2.0 * outputs[index].real, -2.0 * outputs[index].imag]
                names += [f"{name}_re", f"{name}_im"]
            else:
                blocks.append(np.array([[s.real]]))
                b_rows.append(held.real)
                c_columns.append(outputs[index].real)
                names.append(name)
        return control.StateSpace(
            block_diag(*blocks),
            np.array(b_rows),
            np.array(c_columns).T,
            feedthrough,
            inputs=list(INPUTS),
            outputs=list(OUTPUTS),
            states=names,
            name=f"car_at_{self.speed_mps * 3.6:.0f}_kmh",
        )


def _identifier(name: str, taken: Sequence[str]) -> str:
    """Return a unique identifier from the name of a mode."""
    base = re.sub(r"\W+", "_", name)
    used = {re.sub(r"_(re|im)$", "", other) for other in taken}
    return next(name for name in (base, *(f"{base}_{number}" for number in range(2, 99))) if name not in used)


def linearise(
    vehicle: FileOrTable = "compact",
    speed_mps: float = 80.0 / 3.6,
    overrides: Mapping[str, Any] | None = None,
    *,
    cut_off_Hz: float = CUT_OFF_HZ,
) -> control.StateSpace:
    """Return the lateral motion of a car, linearised about straight driving.

    Args:
        vehicle: Name, path, or table of a vehicle.
        speed_mps: Speed, at least 3 m/s [m/s].
        overrides: Dotted key -> value, as for `simulate`.
        cut_off_Hz: Natural frequency above which modes are replaced by their static part [Hz].

    Returns:
        Inputs: demanded steering wheel angle, rear angle, superposition (at the road wheel) [rad], with their servos.
        Outputs: yaw rate [rad/s], lateral acceleration [m/s2], roll [rad], sideslip [rad] at the centre of gravity.

    Raises:
        ParameterError: the speed is too low, or the vehicle is not found or wrong.
        ModelError: the car cannot be built, or does not roll straight ahead at this speed.

    Examples:
        >>> from activesteer.studies.linear.linearisation import linearise
        >>> system = linearise("compact", speed_mps=25.0)
        >>> system.ninputs, system.noutputs
        (3, 4)
        >>> bool(system.poles().real.max() < 0.0)
        True
    """
    return linear_car(vehicle, speed_mps, overrides).state_space(cut_off_Hz)


def straight_on(speed_mps: float) -> dict[str, Any]:
    """Return the table of a manoeuvre at a constant speed without steering."""
    return {"kind": "open_loop", "name": "straight", "speed_mps": speed_mps, "duration_s": 1.0}


def linear_car(
    vehicle: FileOrTable = "compact",
    speed_mps: float = 80.0 / 3.6,
    overrides: Mapping[str, Any] | None = None,
    controllers: Sequence[Any] = (),
) -> LinearCar:
    """Return the car with all modes, before reduction."""
    speed_mps = float(speed_mps)
    if not MIN_SPEED_MPS <= speed_mps <= MAX_SPEED_MPS:
        raise ParameterError(
            f"is {speed_mps:g} m/s ({3.6 * speed_mps:g} km/h); allowed: {MIN_SPEED_MPS:g} to {MAX_SPEED_MPS:g} m/s "
            f"({3.6 * MIN_SPEED_MPS:g} to {3.6 * MAX_SPEED_MPS:g} km/h)",
            key="speed_mps",
            value=speed_mps,
            allowed=Range(MIN_SPEED_MPS, MAX_SPEED_MPS),
        )
    sliding = {**(overrides or {}), "vehicle.friction.rack_N": 0.0}
    settling = straight_on(speed_mps) | {"settle_s": _SETTLE_S}
    scenario = resolve(settling, vehicle, sliding, controllers=controllers)
    check_parts(overrides or {}, scenario, ("vehicle",))
    config = scenario.car.config
    smooth = replace(
        config,
        rear_actuator=config.rear_actuator.smooth(),
        superposition_actuator=config.superposition_actuator.smooth(),
    )
    step = DiscreteTimeMap(ClosedLoop(replace(scenario, car=replace(scenario.car, config=smooth))).vehicle)
    step.trim(speed_mps)
    a, c = step.derivatives("x")
    b, d = step.derivatives("u")
    count, names = len(OUTPUTS), step.local.names
    return LinearCar(speed_mps, step.vehicle.timestep_s, step.torque_Nm, names, a, b, c[:count], d[:count], c[count:])


def linear_response(recording: RecordingLike, system: control.StateSpace) -> dict[str, Array]:
    """Return the response of the linear car to the demands of a run, for comparison.

    Args:
        recording: A run at the speed of the linear car that begins straight ahead.
        system: The linear car, as from `linearise`.

    Returns:
        The channels `OUTPUTS` over the time of the recording.
    """
    demands = ("steering_wheel_demand_rad", "rear_steer_demand_rad", "superposition_demand_rad")
    return outputs_of(system, OUTPUTS, recording.time_s, [recording[name] for name in demands])


def outputs_of(
    system: control.StateSpace, names: Sequence[str], time_s: ArrayLike, inputs: Sequence[ArrayLike]
) -> dict[str, Array]:
    """Return the named outputs of a linear system over time."""
    import control  # noqa: PLC0415 - takes longer to import than a run takes to start

    given: Any = np.array(inputs, dtype=np.float64)
    found = control.forced_response(system, np.asarray(time_s, dtype=np.float64), given, squeeze=False).outputs
    return {name: np.asarray(output) for name, output in zip(names, found, strict=True)}


def eigenvalue_table(modes: Sequence[Mode], highest_Hz: float = CUT_OFF_HZ) -> str:
    """Return a table of modes as lines: name, frequency, damping ratio, eigenvalue and participating parts.

    Args:
        modes: Modes, as from `LinearCar.modes`.
        highest_Hz: Natural frequency above which modes are left out [Hz].
    """
    rows = [_MODE_COLUMNS, *_mode_rows(modes, highest_Hz)]
    for place in (1, 2):  # numbers are aligned to the right
        width = max(len(row[place]) for row in rows)
        rows = [(*row[:place], row[place].rjust(width), *row[place + 1 :]) for row in rows]
    return "\n".join(text_table(rows, text=5))


_LEAST_SHARE: Final = 0.005
"""Participation below which a table leaves a part out."""
_MODE_COLUMNS: Final = ("mode", "f0 [Hz]", "damping", "eigenvalue [1/s]", "participation")
"""Heads of the columns of modes; f0 is the natural frequency."""


def _mode_rows(modes: Sequence[Mode], highest_Hz: float) -> Iterator[tuple[str, ...]]:
    for mode in modes:
        if mode.natural_frequency_Hz > highest_Hz:
            continue
        s = mode.eigenvalue_1ps
        value = f"{s.real:.2f}" + (f" +- {s.imag:.2f}i" if s.imag else "")
        largest = list(mode.participation.items())[:3]
        parts = ", ".join(f"{part} {100.0 * fraction:.0f} %" for part, fraction in largest if fraction >= _LEAST_SHARE)
        swings = (f"{mode.natural_frequency_Hz:.2f}", f"{mode.damping_ratio:.2f}") if s.imag else ("-", "-")
        yield mode.name, *swings, value, parts


def modes_page(title: str, modes: Sequence[Mode], bode: Picture, locus: Picture) -> Page:
    """Return the page of a linear car: modes, response to the steering wheel, and poles versus speed."""
    rows = [[cell.replace("+-", "\N{PLUS-MINUS SIGN}") for cell in row] for row in _mode_rows(modes, CUT_OFF_HZ)]
    columns = ("mode", "natural frequency [Hz]", "damping ratio", *_MODE_COLUMNS[3:])
    table = Table("", columns, rows)
    sections = [
        Section("From the steering wheel to the motion", pictures=[bode._replace(title="")]),
        Section(
            "Poles over speed",
            ["Dots are poles. Grey lines join them by speed. Rays are damping ratios, arcs natural frequencies."],
            pictures=[locus],
        ),
        Section("Modes", tables=[table]),
    ]
    return Page(f"activesteer linearise: {title}", f"Linear car: {title}", _conclusion(modes), sections)


def _conclusion(modes: Sequence[Mode]) -> list[Text]:
    """Describe the stability and the least damped mode of the car, and of yaw and sideslip."""
    shown = [mode for mode in modes if mode.natural_frequency_Hz <= CUT_OFF_HZ]
    growing = ", ".join(dict.fromkeys(mode.name for mode in shown if mode.eigenvalue_1ps.real > 0.0))
    swinging = sorted((mode for mode in shown if mode.eigenvalue_1ps.imag), key=lambda mode: mode.damping_ratio)
    steered = [mode for mode in swinging if "yaw" in mode.name]
    return [
        failed(f"unstable: {growing}") if growing else passed("stable: every mode decays"),
        *(
            f"{words} with a natural frequency of {mode.natural_frequency_Hz:.2f} Hz and a damping ratio of "
            f"{mode.damping_ratio:.2f}."
            for mode, words in (
                *((mode, f"The least damped mode is {mode.name},") for mode in swinging[:1]),
                *((mode, "Yaw and sideslip oscillate") for mode in steered[:1]),
            )
        ),
    ]


BODE_RANGE_Hz: Final = (0.1, 10.0)
"""Frequencies of a Bode diagram [Hz]."""
LOCUS_LIMIT_Hz: Final = 4.5
"""Greatest natural frequency of the poles that are shown: body modes and tyre lag, without wheel hop [Hz]."""
DAMPING_RAYS: Final = (0.2, 0.4, 0.6, 0.8)
"""Damping ratios drawn as rays into a root locus."""

_LONGEST_STEP_1PS: Final = 12.0
"""Longest distance of a pole from one speed to the next [1/s]."""
_BEYOND: Final = 1.12
"""Distance of the name of a ray from the origin, relative to the greatest distance of a pole."""
_GREY: Final = "#cccccc"
_GAIN_UNITS: Final = {
    "yaw_rate_radps": "1/s", "ay_mps2": "m/s² per rad", "roll_rad": "rad/rad", "sideslip_rad": "rad/rad",
}  # fmt: skip


def bode_picture(label: str, system: control.StateSpace) -> Picture:
    """Return the Bode diagrams of a linear car, from the steering wheel to its outputs."""
    frequency_Hz = np.geomspace(*BODE_RANGE_Hz, 300)
    found = system(2j * math.pi * frequency_Hz, squeeze=False)
    panels = []
    for output in _GAIN_UNITS:
        values = found[system.output_labels.index(output), system.input_labels.index("steering_wheel_rad")]
        gain = Curve(frequency_Hz, np.abs(values), "", RUN_COLOURS[0], "-", 1.5)
        phase = Curve(frequency_Hz, np.degrees(np.unwrap(np.angle(values))), "", RUN_COLOURS[0], "-", 1.5)
        below = "frequency [Hz]" if output == "sideslip_rad" else ""
        short = quantity_of(output).short
        panels.append(Panel(below, f"{short} gain\n[{_GAIN_UNITS[output]}]", [gain], log="xy", x_range=BODE_RANGE_Hz))
        panels.append(Panel(below, f"{short}\nphase [deg]", [phase], log="x", x_range=BODE_RANGE_Hz))
    return Picture(label, panels, columns=2, width_in=7.5, height_in=9.0)


def root_locus_picture(systems: Sequence[control.StateSpace], speeds_mps: Sequence[float]) -> Picture:
    """Return the plot of the named poles versus speed, with rays of equal damping."""
    limit, angle = 2.0 * math.pi * LOCUS_LIMIT_Hz, np.linspace(math.pi / 2.0, math.pi, 60)
    curves, notes = [], []
    for frequency_Hz in range(1, math.ceil(LOCUS_LIMIT_Hz)):
        radius = 2.0 * math.pi * frequency_Hz
        curves.append(Curve(radius * np.cos(angle), radius * np.sin(angle), "", _GREY, "-", 0.7))
        notes.append((0.0, radius, f"{frequency_Hz} Hz"))
    for damping in DAMPING_RAYS:
        x, y = -limit * damping, limit * math.sqrt(1.0 - damping**2)
        curves.append(Curve([0.0, 1.05 * x], [0.0, 1.05 * y], "", _GREY, "-", 0.7))
        notes.append((_BEYOND * x, _BEYOND * y, f"{damping:g}"))
    slowest, fastest = 3.6 * min(speeds_mps), 3.6 * max(speeds_mps)
    found = [[pole for pole in _named_poles(system) if abs(pole[1]) <= limit] for system in systems]
    branches = _branches(found)
    curves += [Curve(np.real(poles), np.imag(poles), "", "#888888", "-", 0.8) for _, poles in branches]
    notes += [(poles[-1].real, poles[-1].imag, name) for name, poles in branches]
    for named, speed_mps in zip(found, speeds_mps, strict=True):
        poles = np.array([pole for _, pole in named], dtype=np.complex128)
        shade = (3.6 * speed_mps - slowest) / max(fastest - slowest, 1e-9)
        curves.append(Curve(poles.real, poles.imag, dashes="", marker="o", size=5.0, shade=shade))
    panel = Panel(
        "real part [1/s]",
        "imaginary part [1/s]",
        curves,
        notes=notes,
        x_range=(-1.2 * limit, 0.1 * limit),
        y_range=(-0.1 * limit, 1.15 * limit),
        zero=True,
        equal=True,
    )
    scale = ("speed [km/h]", slowest, fastest)
    return Picture("", [panel], width_in=7.5, height_in=5.5, scale=scale)


def _named_poles(system: control.StateSpace) -> Iterator[tuple[str, complex]]:
    """Yield the name and the pole of each mode, with the upper pole of a conjugate pair."""
    a = np.asarray(system.A)
    for row, name in enumerate(system.state_labels):
        if not name.endswith("_im"):
            imaginary = abs(a[row, row + 1]) if name.endswith("_re") else 0.0
            words = re.sub(r"(_parallel|_opposite)?(_\d+)?(_re)?$", "", name).replace("_", " ")
            yield words.replace("yaw sideslip", "yaw/sideslip"), complex(a[row, row], imaginary)


def _branches(found: Sequence[Sequence[tuple[str, complex]]]) -> list[tuple[str, list[complex]]]:
    """Connect the poles of all speeds to paths, each named by its most common free name."""
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415 - slow to import

    paths: list[list[tuple[str, complex]]] = []
    ends: list[list[tuple[str, complex]]] = []
    for named in found:
        apart = np.array([[abs(pole - path[-1][1]) for _, pole in named] for path in ends]).reshape(
            len(ends), len(named)
        )
        paired = zip(*linear_sum_assignment(apart), strict=True)
        before = {int(pole): ends[path] for path, pole in paired if apart[path, pole] < _LONGEST_STEP_1PS}
        ends = [before.get(place, []) for place in range(len(named))]
        for path, pole in zip(ends, named, strict=True):
            if not path:
                paths.append(path)
            path.append(pole)
    branches: dict[str, list[complex]] = {}
    for path in sorted(paths, key=len, reverse=True):
        names = [name for name, _ in Counter(name for name, _ in path).most_common()]
        name = next((name for name in names if name not in branches), names[0])
        branches.setdefault(name, [pole for _, pole in path])
    return list(branches.items())
