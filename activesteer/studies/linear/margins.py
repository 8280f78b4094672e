"""Stability margins of the loop of controller, actuators, car and sensors, for one or many cars.

The loop runs from the demand of an actuator through the linearised car (`linearisation`: servo, suspensions, tyres),
the sensors (bandwidth, delay), the control unit (its interval, the bus) and the controller back to the demand. It is
opened at one actuator while the other stays closed, and at both at once: a bus delays both demands, and a controller
that moves both actuators tolerates less of that than either margin suggests. The controller enters with its linear form
(`controllers.linear_form`), its corrector fully active, or otherwise with its responses to small pulses
(`controllers.response`).

A sample held for N calls of the controller enters as the mean of the N held values: a delay of (N - 1) / 2 calls and
the corresponding loss of gain; so does a command held for N steps of the simulation. Samples and calls begin together,
as in a run. Aliasing from above half the sampling rate is left out.

The disk margin is alpha of the balanced disk, 1 / max |S - 1/2|, S being the sensitivity of the opened loop: the loop
stays stable for every gain from (2 - alpha) / (2 + alpha) to its inverse, for every phase within 2 atan(alpha / 2), and
for smaller changes of both at once, within the disk. 0.5 are 4.4 dB or 28 deg.

`control.stability_margins` gives gain, phase and delay margins; `control.disk_margins` accepts no frequency
response. Source: P. Seiler, A. Packard, P. Gahinet, An introduction to disk margins, IEEE Control Systems Magazine 40
(5), 2020.

A study varies the plant. Controllers keep the car of the files, except for keys under `controllers` or `single_track`
that the study varies.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from itertools import groupby
from typing import Any, Final

import numpy as np
import scipy.linalg
from markupsafe import Markup
from numpy.typing import NDArray

from activesteer.controllers import Controller, ControllerSetup, controller_spec
from activesteer.controllers.find import interval_s
from activesteer.controllers.linear_form import (
    SIGNALS,
    has_linear_form,
    linear_controller,
    pulse_responses,
    response_of,
)
from activesteer.core.conventions import GRAVITY_MPS2, Array
from activesteer.core.signals import Measurement
from activesteer.pages import Page, Section, Table, Text, failed, passed
from activesteer.plotting import Area, Curve, Panel, Picture
from activesteer.scenario import FileOrTable, Scenario, check_gains, resolve
from activesteer.sensors.parameters import Sensor
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.studies.engine.plan import Plan, task_size
from activesteer.studies.engine.study import StudyProgress
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.engine.workers import in_parallel, workers_for
from activesteer.studies.linear.linearisation import OUTPUTS, LinearCar, linear_car, straight_on

SPEEDS_KMH: Final = (60.0, 80.0, 100.0, 120.0, 140.0, 160.0)
"""Default speeds [km/h]."""
FREQUENCIES_RADPS: Final = np.geomspace(0.05, 300.0, 800)
"""Frequencies [rad/s], from a hundredth of the car's natural frequency to beyond those of its suspensions."""
LOOPS: Final = ("rear", "superposition")
"""Points at which a loop is opened, in the order of the demands."""
ASKED_DISK: Final = 0.5
"""Smallest disk margin that is required of a loop: 4.4 dB or 28 deg, or smaller changes of both at once [-]."""
BOTH: Final = "both"
"""Name of the loop in which gain, phase or delay change by the same in both demands."""

_SENSORS: Final = ("yaw_rate", "ay", "rear_steer", "superposition")
"""Sensors of `SIGNALS`."""

Response = NDArray[np.complex128]


@dataclass(frozen=True)
class Margins:
    """Margins of one loop, with nan for a margin that does not exist."""

    gain_dB: float  # smallest factor on the gain, up or down, that makes the loop marginal [dB]
    phase_rad: float  # smallest phase that makes it marginal [rad]
    delay_s: float  # smallest delay that makes it marginal [s]
    disk: float  # alpha of the balanced disk [-]; 0 if the closed loop is unstable

    @property
    def absent(self) -> str:
        """Text for a margin that does not exist: no change of this kind makes the loop marginal, or it is unstable."""
        return "no limit" if self.disk else "unstable"


def margins_of(loop: Response, frequencies_radps: Array, stable: bool = True) -> Margins:
    """Return the margins of a loop from its frequency response."""
    if not stable:
        return Margins(math.nan, math.nan, math.nan, 0.0)
    import control  # noqa: PLC0415 - takes longer to import than a run takes to start

    data = np.abs(loop), np.degrees(np.unwrap(np.angle(loop))), frequencies_radps
    gains, phases_deg, _, _, crossings_radps, _ = control.stability_margins(data, returnall=True)
    phases_rad = np.radians(phases_deg)
    delays_s = np.mod(phases_rad, 2.0 * math.pi) / crossings_radps
    sensitivity = 1.0 / (1.0 + loop)
    return Margins(
        gain_dB=_least(20.0 * np.abs(np.log10(gains))),
        phase_rad=_least(np.abs(phases_rad)),
        delay_s=_least(delays_s),
        disk=float(1.0 / np.abs(sensitivity - 0.5).max()),
    )


def weakest(margins: Sequence[Margins]) -> Margins:
    """Return the smallest value of each margin, or the margins of an unstable loop if there is one."""
    if unstable := [each for each in margins if each.disk == 0.0]:
        return unstable[0]
    return Margins(*(float(np.fmin.reduce(values)) for values in zip(*map(astuple, margins), strict=True)))


def _least(values: Array) -> float:
    return float(values.min()) if len(values) else math.nan


def round_trip(
    car: LinearCar, answer: Callable[[Array], Response], scenario: Scenario, unit_s: float, frequencies_radps: Array
) -> Response:
    """Return the return ratio M of the demands, where u = M u closes the loop."""
    h, config = car.timestep_s, scenario.car.config
    back = np.exp(-1j * frequencies_radps * h)  # one step
    states = _states(car.a, car.b[:, 1:], back.conj())
    rows = {name: car.c[index] for index, name in enumerate(OUTPUTS)}
    # The accelerometer rolls with the body. All signals but the yaw rate belong to the start of the step.
    leaning = rows["ay_mps2"] + GRAVITY_MPS2 * rows["roll_rad"]
    through = car.d[OUTPUTS.index("ay_mps2"), 1:]
    motion = np.stack([row @ states for row in (rows["yaw_rate_radps"], leaning, *car.actuators)], axis=1)
    motion[:, 1] += through
    motion[:, 1:] *= back[:, None, None]
    sensors = config.sensors.all()
    every = round(unit_s / h)
    seen = np.stack([_sensed(sensors[name], h, back, every) for name in _SENSORS], axis=1)
    bus = back ** round(config.controllers.bus_delay_s / h) * _held(every, back)
    return bus[:, None, None] * answer(frequencies_radps) @ (seen[:, :, None] * motion)


def _states(a: Array, b: Array, z: Response) -> Response:
    """Return (z I - A)^-1 B for each z. One Schur form of A serves all z, which saves a factorisation for each."""
    triangle, vectors, *_ = scipy.linalg.schur(a, output="complex")
    inputs, found = vectors.conj().T @ b, np.empty((len(a), len(z), b.shape[1]), np.complex128)
    for row in reversed(range(len(a))):
        rest = np.tensordot(triangle[row, row + 1 :], found[row + 1 :], axes=1)
        found[row] = (inputs[row] + rest) / (z - triangle[row, row])[:, None]
    return np.moveaxis(np.tensordot(vectors, found, axes=1), 0, 1)


def _held(steps: int, back: Response) -> Response:
    return sum((back**step for step in range(steps)), np.zeros_like(back)) / steps


def _calls(sensor: Sensor, unit_s: float) -> int:
    """Return the number of controller calls that use the same sample."""
    return max(1, round((sensor.sample_time_s or 0.0) / unit_s))


def _sensed(sensor: Sensor, step_s: float, back: Response, every: int) -> Response:
    """Return the frequency response of a sensor: bandwidth, samples, delay (see `sensors.block`)."""
    share = -math.expm1(-2.0 * math.pi * sensor.bandwidth_Hz * step_s) if sensor.bandwidth_Hz else 1.0
    samples = _held(_calls(sensor, every * step_s), back**every)
    return share / (1.0 - (1.0 - share) * back) * samples * back ** round((sensor.delay_s or 0.0) / step_s)


def opened(returned: Response, loop: str) -> Response:
    """Return the loop gain with the loop open at one demand and closed at the other. Stability is lost at 1 + L = 0."""
    own = LOOPS.index(loop)
    other = 1 - own
    through = returned[:, own, other] * returned[:, other, own] / (1.0 - returned[:, other, other])
    return -(returned[:, own, own] + through)


def opened_at_both(returned: Response) -> tuple[Response, Response]:
    """Return the loop gains of a common factor on both demands. Stability is lost at 1 + f L = 0."""
    values: Response = np.asarray(np.linalg.eigvals(returned), dtype=np.complex128)
    for before, here in itertools.pairwise(values):
        if np.abs(here - before).sum() > np.abs(here[::-1] - before).sum():
            here[:] = here[::-1].copy()
    return -values[:, 0], -values[:, 1]


def is_stable(returned: Response) -> bool:
    """Return whether the closed loops are stable, for stable blocks (Nyquist: no encirclement of 0 by det(1 - M))."""
    determinant = np.linalg.det(np.eye(2) - returned)
    turned = np.unwrap(np.angle(determinant))
    # From the lowest frequency to the highest, an unstable real pole turns it by half a revolution, a pair by a whole
    # one, and an integrator in a stable loop by a quarter.
    return bool(abs(turned[-1] - turned[0]) < 0.75 * math.pi)


@dataclass(frozen=True)
class LoopMargins:
    """Margins of one loop of a controller at one speed."""

    controller: str
    loop: str  # point at which the loop is opened: one of `LOOPS`, or `BOTH`
    speed_kmh: float
    margins: Margins
    # Factors of the car with the smallest disk margin, if there are many cars: key -> value
    factors: Mapping[str, Any] = field(default_factory=dict)
    # Loop gains at `FREQUENCIES_RADPS`; empty for many cars
    curves: tuple[Response, ...] = field(default=(), compare=False, repr=False)

    def to_json(self) -> dict[str, Any]:
        """Return the values of the margins."""
        return {
            "controller": self.controller,
            "loop": self.loop,
            "speed_kmh": self.speed_kmh,
            "gain_margin_dB": self.margins.gain_dB,
            "phase_margin_deg": math.degrees(self.margins.phase_rad),
            "delay_margin_s": self.margins.delay_s,
            "disk_margin": self.margins.disk,
            **({"factors": dict(self.factors)} if self.factors else {}),
        }


def loop_margins(
    controllers: Sequence[Any] = ("ars", "afs"),
    vehicle: FileOrTable = "compact",
    speeds_kmh: Sequence[float] = SPEEDS_KMH,
    overrides: Mapping[str, Any] | None = None,
) -> list[LoopMargins]:
    """Return the margins of every loop of every controller at every speed.

    An unused actuator has none.

    If a controller uses both actuators, the margins of both together come last.
    """
    check_gains(overrides or {}, controllers)
    return _margins(controllers, vehicle, speeds_kmh, [overrides or {}], keep_curves=True)[0]


def _margins(
    controllers: Sequence[Any],
    vehicle: FileOrTable,
    speeds_kmh: Sequence[float],
    cars: Iterable[Mapping[str, Any]],
    *,
    keep_curves: bool = False,
) -> list[list[LoopMargins]]:
    """Return the margins of several cars, given by overrides; with `keep_curves`, also the loop gains."""
    plugins = [controller_spec(given) for given in controllers]
    answers: dict[tuple[Any, ...], Callable[[Array], Response]] = {}
    every: list[list[LoopMargins]] = []
    for overrides in cars:
        found: list[LoopMargins] = []
        for speed_kmh in speeds_kmh:
            car = linear_car(vehicle, speed_kmh / 3.6, overrides, controllers)
            scenario = resolve(straight_on(car.speed_mps), vehicle, overrides, controllers=controllers)
            for number, plugin in enumerate(plugins):
                unit_s = interval_s(plugin, scenario.car.config.controllers, car.timestep_s)
                setup = _fully_active(scenario.controller_setup(unit_s))
                key = number, car.speed_mps, setup, scenario.car.config.sensors
                if key not in answers:
                    answers[key] = _answer(controllers[number], plugin.label, scenario, setup, plugin.make(setup))
                returned = round_trip(car, answers[key], scenario, unit_s, FREQUENCIES_RADPS)
                loops = _of_loops(plugin.label, 3.6 * car.speed_mps, returned)
                found += loops if keep_curves else [replace(loop, curves=()) for loop in loops]
        every.append(found)
    return every


def _of_loops(controller: str, speed_kmh: float, returned: Response) -> list[LoopMargins]:
    stable = is_stable(returned)
    loops: dict[str, tuple[Response, ...]] = {
        loop: (opened(returned, loop),) for index, loop in enumerate(LOOPS) if np.abs(returned[:, index]).max() > 0.0
    }
    if len(loops) == len(LOOPS):
        loops[BOTH] = opened_at_both(returned)
    return [
        LoopMargins(
            controller,
            loop,
            speed_kmh,
            weakest([margins_of(part, FREQUENCIES_RADPS, stable) for part in parts]),
            curves=parts,
        )
        for loop, parts in loops.items()
    ]


def _rolling(scenario: Scenario) -> Measurement:
    """Return the measurement of ideal sensors for straight rolling."""
    config = scenario.car.config
    ideal = replace(config, sensors=type(config.sensors)())
    rolling = ClosedLoop(replace(scenario, car=replace(scenario.car, config=ideal))).measurement
    left, right = rolling.wheel_speed_radps[::2], rolling.wheel_speed_radps[1::2]
    front, rear = (0.5 * (a + b) for a, b in zip(left, right, strict=True))
    still = dict.fromkeys((*SIGNALS, "steering_wheel_rad"), 0.0)
    return rolling._replace(**still, ax_mps2=0.0, wheel_speed_radps=(front, front, rear, rear))


def _fully_active(setup: ControllerSetup) -> ControllerSetup:
    """Return the setup without the dead bands of the correctors."""
    gains = setup.gains
    acting = {
        name: replace(system, corrector=replace(system.corrector, deadband_start_radps=0.0, deadband_end_radps=0.0))
        for name, system in (("ars", gains.ars), ("afs", gains.afs))
    }
    return replace(setup, gains=replace(gains, **acting))


def _answer(
    given: Any, name: str, scenario: Scenario, setup: ControllerSetup, made: Controller
) -> Callable[[Array], Response]:
    """Return the frequency response of a controller, demands per measurement."""
    rolling = _rolling(scenario)
    if not has_linear_form(given):
        return _answer_to_samples(scenario.car.config.sensors.all(), made, rolling, setup.timestep_s, name)
    form = linear_controller(given, setup, rolling.speed_mps)

    def response(frequencies_radps: Array) -> Response:
        z = np.exp(1j * frequencies_radps * setup.timestep_s)
        answer = np.zeros((len(z), len(LOOPS), len(SIGNALS)), np.complex128)
        answer[:, :, :1] = form.c @ _states(form.a, form.b[:, 1:], z) + form.d[:, 1:]
        return answer

    return response


def _answer_to_samples(
    sensors: Mapping[str, Sensor], made: Controller, rolling: Measurement, unit_s: float, name: str
) -> Callable[[Array], Response]:
    """Return the frequency response of a controller from its responses to samples."""
    calls = [_calls(sensors[sensor], unit_s) for sensor in _SENSORS]
    ages = [math.ceil((sensors[sensor].delay_s or 0.0) / unit_s - 1e-9) for sensor in _SENSORS]
    held = {signal: (count, age % count) for signal, count, age in zip(SIGNALS, calls, ages, strict=True)}
    to_samples = response_of(pulse_responses(made, rolling, unit_s, name, held), unit_s)

    def response(frequencies_radps: Array) -> Response:
        back = np.exp(-1j * frequencies_radps * unit_s)
        # In a response to held samples, the effect of the hold already belongs to the sensor.
        holds = np.stack([count * _held(count, back) for count in calls], axis=1)
        return to_samples(frequencies_radps) / holds[:, None, :]

    return response


_SHOWN: Final = (-3.2, 1.6), (-2.4, 2.4)
"""Range of the real and of the imaginary part in a plot."""
_LEAD: Final = (
    "Each curve is the loop gain L over frequency, from 0.008 to 48 Hz, with its mirror image left out. The loop is "
    "marginal where L = \N{MINUS SIGN}1 (cross). The red disk has the smallest disk margin alpha of all speeds: the "
    "curve of that speed touches it. Gain and phase may then change together by any complex factor f with "
    "|f\N{MINUS SIGN}1| / |f+1| < alpha / 2, such as gains from (2 \N{MINUS SIGN} alpha) / (2 + alpha) to "
    "(2 + alpha) / (2 \N{MINUS SIGN} alpha)."
)


def margins_page(found: Sequence[LoopMargins], vehicle: str) -> Page:
    """Return the page of the margins."""
    loops = sorted(found, key=_name)  # the speeds of a loop stay in their order
    drawn = [each for each in loops if each.curves]
    sections = [Section(tables=[_table(loops)], pictures=[_picture(drawn)] if drawn else [])]
    title = f"Stability margins: {vehicle}"
    least = min(found, key=lambda each: each.margins.disk)
    value = (passed if least.margins.disk >= ASKED_DISK else failed)(f"{least.margins.disk:.2f}")
    where = f" with {_name(least)}, at {least.speed_kmh:g} km/h; at least {ASKED_DISK:g} is required"
    lead: list[Text] = [
        Markup("The smallest disk margin is ") + value + where + " (a gain of 4.4 dB or a phase of 28 deg)."
    ]
    if drawn:
        lead.append(_LEAD)
    return Page(f"activesteer linearise: {vehicle}", title, lead, sections)


def disk(alpha: float) -> tuple[float, float]:
    """Return centre and radius of the disk that the loop gain avoids, for a balanced disk margin from 0 to 2 [-].

    It holds all L with |1 + L| < alpha / 2 |1 - L|, on whose edge a factor of the size alpha makes the loop marginal.
    At 2 the disk is a half-plane.

    Source: P. Seiler, A. Packard, P. Gahinet, An Introduction to Disk Margins, 2020, section IV.
    """
    half = 0.5 * alpha
    near, far = -(1.0 - half) / (1.0 + half), -(1.0 + half) / (1.0 - half)
    return 0.5 * (near + far), 0.5 * (near - far)


def _name(found: LoopMargins) -> str:
    return f"{found.controller}, opened at {found.loop}"


def _picture(found: Sequence[LoopMargins]) -> Picture:
    speeds = [each.speed_kmh for each in found]
    low, high = min(speeds), max(speeds)
    panels = [_panel(name, list(loops), low, high) for name, loops in groupby(found, _name)]
    return Picture("", panels, scale=("speed [km/h]", low, high) if high > low else None, columns=2)


def _panel(name: str, loops: Sequence[LoopMargins], low: float, high: float) -> Panel:
    """Return the plot of a loop's Nyquist curves at all speeds, with the smallest disk margin."""
    curves = [
        Curve(part.real, part.imag, shade=(each.speed_kmh - low) / (high - low) if high > low else 0.5)
        for each in loops
        for part in each.curves
    ]
    curves.append(Curve([-1.0], [0.0], "", "#b3261e", "", marker="x", size=7.0, width=1.6))
    alpha = min(each.margins.disk for each in loops)
    areas = []
    if 0.0 < alpha < 2.0:
        centre, radius = disk(alpha)
        angle = np.linspace(0.0, math.pi, 181)
        x, y = centre + radius * np.cos(angle), radius * np.sin(angle)
        areas.append(Area(x, -y, y, "disk of the smallest disk margin", "#d9534f", 0.25, "#b3261e"))
    return Panel(
        "real part of L [-]", "imaginary part of L [-]", curves, f"{name}: disk margin {alpha:.2f}", areas,
        x_range=_SHOWN[0], y_range=_SHOWN[1], zero=True, equal=True,
    )  # fmt: skip


def _table(loops: Sequence[LoopMargins]) -> Table:
    heads = ["loop, speed", "gain margin [dB]", "phase margin [deg]", "delay margin [ms]", "disk margin [-]"]
    heads += ["changed"] if any(each.factors for each in loops) else []
    rows = []
    for each in loops:
        margins = each.margins
        values = (margins.gain_dB, math.degrees(margins.phase_rad), 1e3 * margins.delay_s, margins.disk)
        numbers = [f"{value:.{digits}f}" if math.isfinite(value) else margins.absent
                   for value, digits in zip(values, (1, 1, 1, 2), strict=True)]  # fmt: skip
        changed = ", ".join(f"{key} = {value}" for key, value in each.factors.items())
        rows.append([f"{_name(each)}, {each.speed_kmh:g} km/h", *numbers, changed][: len(heads)])
    outside = frozenset(number for number, each in enumerate(loops) if each.margins.disk < ASKED_DISK)
    return Table("", heads, rows, outside)


def worst_margins(
    study_file: FileOrTable | StudyFile,
    controllers: Sequence[Any] = ("lqr",),
    vehicle: FileOrTable = "compact",
    speeds_kmh: Sequence[float] = SPEEDS_KMH,
    overrides: Mapping[str, Any] | None = None,
    progress: Callable[[StudyProgress], None] = lambda _: None,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
) -> list[LoopMargins]:
    """Return the smallest margins of every loop at every speed over the cars of a study.

    Factors for single manoeuvres are left out; manoeuvres, cars and controllers of the study have no effect. Overrides
    may not set a key that the study varies. With more than one process, controllers must be picklable. `factors` belong
    to the smallest disk margin; each margin is the smallest over all samples.
    """
    given, changed = read_study(study_file), dict(overrides or {})
    for key in changed:
        if key in given.keys:
            raise given.source.fail(("factors", key), "is varied by the study, so it cannot also be given")
    names = tuple(name for name in controllers if isinstance(name, str))
    study = replace(
        given, maneuvers=(straight_on(speeds_kmh[0] / 3.6),), vehicles=(vehicle,), controllers=names or ("none",),
        overrides=given.overrides | changed, factors=tuple(each for each in given.factors if not each.maneuvers),
        claims=False, curves=(),
    )  # fmt: skip
    check_gains(changed, controllers)
    plan = Plan(study)
    requests = plan.requests(range(0, len(plan), len(study.controllers)))
    with workers_for(jobs, scheduler=scheduler) as workers:
        # Cars that are evaluated together share the controller's response.
        cars, size = [request.overrides for request in requests], task_size(len(requests), 1, workers.in_flight)
        parts = [cars[start : start + size] for start in range(0, len(cars), size)]
        looked_at = 0

        def report(place: int, _: int) -> None:
            nonlocal looked_at
            looked_at += len(parts[place])
            progress(StudyProgress(looked_at, len(requests), 0, looked_at))

        look = functools.partial(_margins, controllers, vehicle, speeds_kmh)
        found = in_parallel(look, [(part,) for part in parts], report=report, workers=workers)
    # A car whose controller does not use an actuator lacks its loop.
    cars_of: dict[tuple[str, str, float], list[LoopMargins]] = {}
    for request, loops in zip(requests, itertools.chain.from_iterable(found), strict=True):
        for each in loops:
            own = replace(each, factors=request.factors)
            cars_of.setdefault((each.controller, each.loop, each.speed_kmh), []).append(own)
    return [
        replace(min(every, key=lambda each: each.margins.disk), margins=weakest([each.margins for each in every]))
        for every in cars_of.values()
    ]
