"""The loop of driver and car: linear analysis, and run with a small step of the path.

The loop consists of the linearised car (`linearisation`), the controller's linear form with its corrector fully active
(`controllers.linear_form`), and the driver. The driver has a control law about a straight path, decided every 10 ms, a
known reaction delay of whole decisions, and the lag of the arms. One period of 10 ms, ten steps of the engine, becomes
one matrix. The only approximation is that the motion is small.

The loop is opened at the steering wheel, between the driver's arms and the car, for the crossover frequency and the
phase margin. The damping belongs to the oscillation after a small step of the path.

Source: D. T. McRuer and E. S. Krendel, Mathematical Models of Human Pilot Behavior, AGARDograph 188 (1974).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from activesteer.analysis.source import RecordingLike
from activesteer.controllers.linear_form import LinearController, linear_controller
from activesteer.core.conventions import DEFAULT_TIMESTEP_S, RUN_COLOURS, Array, run_looks
from activesteer.driver import DriverParameters
from activesteer.driver.path_preview import PREVIEW_INTERVAL_S, SteeringGains, steering_gains
from activesteer.errors import DriverError
from activesteer.pages import Page, Section, Table, Text, failed, passed
from activesteer.plotting import Curve, Panel, Picture
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable, check_gains, resolve
from activesteer.simulation.runner import simulate
from activesteer.studies.linear.linearisation import OUTPUTS, LinearCar, linear_car
from activesteer.theory.single_track import SingleTrack

# It needs about 1.6 m/s2 of lateral acceleration, where tyres are linear, and moves the steering wheel further than the
# friction of the rack can hide.
STEP_M: Final = 0.5
"""Offset of the path from the car [m]."""
_CLOSE_M: Final = 0.1 * STEP_M
"""Distance from the path that may remain at the end [m]; the friction of the rack hides some."""
DURATION_S: Final = 7.0
"""Length of the run [s]."""
_SPACING_M: Final = 15.0
_FIT_INTERVAL_S: Final = 0.01
"""Sampling interval of the fit [s]."""


def small_step(
    speed_mps: float,
    controller: Any = "none",
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    driver: Any = DEFAULT_DRIVER,
) -> RecordingLike:
    """Return the run for the damping: a straight path that begins `STEP_M` to the left of the car."""
    x_m = np.arange(0.0, speed_mps * (DURATION_S + 6.0), _SPACING_M)
    path = {"x_m": x_m.tolist(), "y_m": [STEP_M] * len(x_m)}
    table = {
        "kind": "follow_path",
        "name": "small_step",
        "speed_mps": speed_mps,
        "duration_s": DURATION_S,
        "path": path,
    }
    return simulate(table, controller, vehicle, overrides, driver=driver)


def damping_of(time_s: Array, y_m: Array) -> tuple[float, float]:
    """Return damping ratio and natural frequency of the best fitting decay about the path, after its first crossing."""
    # The fit equals the logarithmic decrement if all decrements are alike; the friction of the rack makes those of
    # small amplitudes smaller. The damping ratio is 1 if the car does not cross the path, even if it stops short of it.
    from scipy.optimize import least_squares  # noqa: PLC0415 - slow to import

    off = np.asarray(y_m, dtype=np.float64) / STEP_M - 1.0
    beyond = np.flatnonzero(off > 0.0)
    if not beyond.size:
        return 1.0, math.nan
    every = max(1, round(_FIT_INTERVAL_S / float(time_s[1] - time_s[0])))
    time_s, off = np.asarray(time_s, dtype=np.float64)[beyond[0] :: every], off[beyond[0] :: every]
    time_s = time_s - time_s[0]

    def residual(p: np.ndarray) -> np.ndarray:
        ratio, natural, sine, cosine, rest = p
        swing = natural * math.sqrt(1.0 - ratio * ratio) * time_s
        return np.exp(-ratio * natural * time_s) * (sine * np.sin(swing) + cosine * np.cos(swing)) + rest - off

    bounds = [-0.5, 0.3, -10.0, -10.0, -1.0], [0.999, 15.0, 10.0, 10.0, 1.0]
    starts = [[ratio, natural, 0.3, 0.0, 0.0] for ratio in (0.1, 0.5) for natural in (1.5, 3.0, 5.0)]
    fits = [least_squares(residual, start, bounds=bounds) for start in starts]
    ratio, natural, *_ = min(fits, key=lambda fit: fit.cost).x
    return float(ratio), float(natural)


SPEEDS_KMH: Final = (60.0, 80.0, 100.0, 120.0, 140.0)
"""Default speeds [km/h]."""
LEAST_DAMPING: Final = 0.25
"""Smallest damping ratio that is required of a loop."""
DAMPED_KMH: Final = 80.0, 100.0
"""Lowest and highest speed at which this damping is required [km/h]."""
LEAST_PHASE_MARGIN_DEG: Final = 30.0
"""Least phase margin of humans, as McRuer and Krendel measured it [deg]."""
FREQUENCIES_RADPS: Final = np.geomspace(0.2, 60.0, 300)
"""Frequencies of the response [rad/s]."""
_NOTICED: Final = 0.05
"""Smallest amplitude of a visible oscillation in a step, as a fraction of the largest part."""


@dataclass(frozen=True)
class DriverLoop:
    """Loop of driver and car over one period of the driver.

    Opened at the steering wheel: x[k+1] = A x[k] + B w, where w are the car's steering wheel angles in the steps of the
    period; the angles from the driver are C x[k]. The driver's knowledge of the earlier decisions stays in A.
    """

    a: Array  # system matrix of the open loop, shape (n, n)
    b: Array  # input matrix of the angle in each step, shape (n, m) with m steps in a period
    c: Array  # output matrix of the angle in each step, shape (m, n)
    closed: Array  # system matrix of the closed loop, shape (n, n)
    offset: int  # index of the lateral offset from the path in the state
    timestep_s: float  # time between two steps [s]

    @cached_property
    def response(self) -> NDArray[np.complexfloating]:
        """Return the complex return ratio at `FREQUENCIES_RADPS`, where -1 is the limit of stability."""
        from scipy.linalg import schur, solve_triangular  # noqa: PLC0415 - slow to import

        steps = len(self.c)
        z = np.exp(1j * self.timestep_s * np.outer(FREQUENCIES_RADPS, np.arange(steps + 1)))
        # In triangular form, the system is solved at once for each frequency.
        found: Any = schur(self.a, output="complex")
        triangle, turned = found
        forced, seen = z[:, :steps] @ (turned.conj().T @ self.b).T, self.c @ turned
        unit = np.eye(len(self.a))
        answers = [
            seen @ solve_triangular(at[-1] * unit - triangle, force) for at, force in zip(z, forced, strict=True)
        ]
        # Take the part of the angle within a period that is at the frequency itself.
        return np.asarray(-np.mean(z[:, :steps].conj() * answers, axis=1), dtype=np.complex128)

    def crossover(self) -> tuple[float, float]:
        """Return crossover frequency [rad/s] and smallest phase margin [rad]; nan if the gain never crosses 1."""
        gain, phase = np.log(np.abs(self.response)), np.unwrap(np.angle(self.response))
        # With integrators and a delay, the phase begins between -pi and -2 pi, as close to -pi as possible.
        phase -= 2.0 * math.pi * round((phase[0] + math.pi) / (2.0 * math.pi))
        found = []
        for place in np.flatnonzero((gain[:-1] > 0.0) & (gain[1:] <= 0.0)):
            share = gain[place] / (gain[place] - gain[place + 1])
            frequency = FREQUENCIES_RADPS[place] ** (1.0 - share) * FREQUENCIES_RADPS[place + 1] ** share
            margin = math.pi + phase[place] + share * (phase[place + 1] - phase[place])
            found.append((margin, frequency))
        margin, frequency = min(found, default=(math.nan, math.nan))
        return float(frequency), float(margin)

    def damping(self) -> tuple[float, float]:
        """Return damping ratio [-] and natural frequency [rad/s] of the largest oscillation in a small step."""
        # If no oscillation is visible, the result is 1 and the natural frequency of the largest part.
        from scipy.linalg import eig  # noqa: PLC0415 - slow to import

        found: Any = eig(self.closed, left=True)
        values, left, right = found
        share = np.abs(right[self.offset] * left[self.offset].conj() / np.sum(left.conj() * right, axis=0))
        swings = share * (values.imag > 0.0)
        mode = int(np.argmax(swings if swings.max() > _NOTICED * share.max() else share))
        s = np.log(complex(values[mode])) / (len(self.c) * self.timestep_s)
        return float(-s.real / abs(s)), float(abs(s))

    def step(self) -> tuple[Array, Array]:
        """Return time [s] and lateral position [m] at each decision, after a step of the path by `STEP_M`."""
        state = np.zeros(len(self.closed))
        state[self.offset] = -STEP_M
        period_s = len(self.c) * self.timestep_s
        places = np.empty(round(DURATION_S / period_s))
        for row in range(len(places)):
            places[row] = state[self.offset] + STEP_M
            state = self.closed @ state
        return np.arange(len(places), dtype=np.float64) * period_s, places


def driver_loop(
    car: LinearCar, controller: LinearController, driver: DriverParameters, gains: SteeringGains, steering_ratio: float
) -> DriverLoop:
    """Assemble the linear loop of car, controller and driver at one speed."""
    steps = round(PREVIEW_INTERVAL_S / car.timestep_s)
    waiting = round(driver.reaction_delay_s / PREVIEW_INTERVAL_S)
    n, states = len(car.a), len(controller.a)
    heading, offset, wheel = n, n + 1, n + 2
    first = n + 3  # of the controller's states; behind them the decisions that wait, the newest first
    newest, size = first + states, first + states + waiting + 1
    yaw_rate, sideslip = (
        np.pad(car.c[OUTPUTS.index(name)], (0, size - n)) for name in ("yaw_rate_radps", "sideslip_rad")
    )
    # The arms act first in a step, because the driver comes before controller and car.
    arms = np.eye(size)
    lag_s = driver.neuromuscular_lag_s
    moved = -math.expm1(-car.timestep_s / lag_s) if lag_s > 0.0 else 1.0
    arms[wheel, wheel], arms[wheel, newest + waiting] = 1.0 - moved, moved
    rest = np.eye(size)
    inputs = np.zeros((2, size))
    inputs[0, wheel] = 1.0 / steering_ratio
    inputs[1] = yaw_rate
    own = slice(first, newest)
    demands = controller.d @ inputs
    demands[:, own] += controller.c
    rest[own] = controller.b @ inputs
    rest[own, own] += controller.a
    rest[:n] = car.b[:, 1:] @ demands
    rest[:n, :n] += car.a
    rest[:n, wheel] += car.b[:, 0]
    rest[heading] += car.timestep_s * yaw_rate
    rest[offset] += car.timestep_s * car.speed_mps * sideslip
    rest[offset, heading] += car.timestep_s * car.speed_mps
    # The decisions move up by one; the new one enters at the start of the period.
    decides = np.eye(size)
    decides[newest:] = np.eye(size, k=-1)[newest:]
    ahead_s = PREVIEW_INTERVAL_S * np.arange(len(gains.per_path_radpm))
    decided = gains.per_yaw_rate_s * yaw_rate + gains.per_sideslip * sideslip
    decided[wheel], decided[newest : newest + waiting] = gains.per_angle, gains.per_waiting
    decided[offset] = -gains.per_path_radpm.sum()
    decided[heading] = -car.speed_mps * (gains.per_path_radpm @ ahead_s)
    decides[newest] = decided
    closed = np.linalg.matrix_power(rest @ arms, steps) @ decides
    # In the open loop, the car has the angle w instead of that of the arms.
    given = rest[:, wheel].copy()
    given[wheel] = 0.0
    rest[:, wheel] -= given
    step = rest @ arms
    powers = [np.linalg.matrix_power(step, count) for count in range(steps + 1)]
    b = np.stack([power @ given for power in powers[steps - 1 :: -1]], axis=1)
    c = np.stack([power[wheel] @ decides for power in powers[1:]])
    return DriverLoop(powers[steps] @ decides, b, c, closed, offset, car.timestep_s)


@dataclass(frozen=True)
class LoopAtSpeed:
    """Loop with one controller at one speed, and the corresponding run of the full car."""

    speed_kmh: float
    controller: str
    loop: DriverLoop
    run: RecordingLike  # a run with a small step of the path, including the friction of the rack and the tolerance band

    @property
    def damping_in_run(self) -> float:
        """Damping ratio in the run after the small step."""
        return damping_of(self.run.time_s, self.run["y_m"])[0]

    @property
    def step_difference_m(self) -> float:
        """Largest distance between the linear car and the full car after the small step [m]."""
        time_s, y_m = self.loop.step()
        return float(np.abs(np.interp(time_s, self.run.time_s, self.run["y_m"]) - y_m).max())

    def to_json(self) -> dict[str, Any]:
        """Return the values of the loop."""
        crossover_radps, margin_rad = self.loop.crossover()
        damping, natural_radps = self.loop.damping()
        return {
            "speed_kmh": self.speed_kmh,
            "controller": self.controller,
            "damping": damping,
            "natural_frequency_rad_s": natural_radps,
            "phase_margin_deg": math.degrees(margin_rad),
            "crossover_rad_s": crossover_radps,
            "damping_in_step": damping_of(*self.loop.step())[0],
            "damping_in_run": self.damping_in_run,
            "step_difference_m": self.step_difference_m,
            "rest_in_run_m": abs(STEP_M - float(self.run["y_m"][-1])),
        }


def driver_loops(
    driver: Any = DEFAULT_DRIVER,
    vehicle: FileOrTable = "compact",
    controllers: Sequence[str] = ("none", "ars", "afs"),
    speeds_kmh: Sequence[float] = SPEEDS_KMH,
    overrides: Mapping[str, Any] | None = None,
) -> list[LoopAtSpeed]:
    """Return the loops of every controller at every speed."""
    scenario = resolve("straight_line", vehicle, overrides, driver, controllers)
    check_gains(overrides or {}, controllers)
    if not scenario.driver.plugin.is_builtin:
        raise DriverError(f"{scenario.driver.plugin.name} is code; only a driver file has a linear form", value=driver)
    setup, who = scenario.controller_setup(DEFAULT_TIMESTEP_S), scenario.driver.parameters
    known = SingleTrack(setup.single_track)
    found = []
    of_car = {key: value for key, value in (overrides or {}).items() if not key.startswith("driver.")}
    for speed_kmh in speeds_kmh:
        car = linear_car(vehicle, speed_kmh / 3.6, of_car)
        gains = steering_gains(car.speed_mps, known.matrices, who, setup.steering_ratio)
        for name in controllers:
            linear = linear_controller(name, setup, car.speed_mps)
            loop = driver_loop(car, linear, who, gains, setup.steering_ratio)
            run = small_step(car.speed_mps, name, vehicle, overrides, driver)
            found.append(LoopAtSpeed(3.6 * car.speed_mps, name, loop, run))
    return found


def conclusion(rows: Sequence[Mapping[str, Any]]) -> list[Text]:
    """Describe the smallest phase margin and the smallest damping, compared with the requirements."""
    found: list[Text] = []
    slowest, fastest = DAMPED_KMH
    damped = f" from {slowest:g} to {fastest:g} km/h"
    for key, words, unit, asked, digits, speeds in (
        ("phase_margin_deg", "phase margin", " deg", LEAST_PHASE_MARGIN_DEG, 0, ""),
        ("damping", "damping ratio of the linear loop", "", LEAST_DAMPING, 2, damped),
        ("damping_in_run", "damping ratio in a run", "", LEAST_DAMPING, 2, damped),
    ):
        if key == "damping_in_run" and all(row[key] == 1.0 for row in rows):
            rest_m = max(row["rest_in_run_m"] for row in rows)
            far = f"at most {rest_m:.2f} m from it after {DURATION_S:g} s"
            kept = f"After a step of the path by {STEP_M:g} m, no run crosses the path. The cars end "
            found.append(Markup("{}{}.").format(kept, (passed if rest_m <= _CLOSE_M else failed)(far)))
            continue
        counts = (row for row in rows if not speeds or slowest <= row["speed_kmh"] <= fastest)
        judged = [row for row in counts if math.isfinite(row[key])]
        if not judged:
            continue
        row = min(judged, key=lambda row: row[key])
        value = (passed if row[key] >= asked else failed)(f"{row[key]:.{digits}f}{unit}")
        where = f" with {row['controller']} at {row['speed_kmh']:g} km/h; "
        where += f"the typical driver must reach {asked:g}{unit}."
        found.append(Markup("The smallest {}{} is ").format(words, speeds) + value + where)
    return found


_HEADS: Final = {
    "damping": "damping [-]",
    "damping_in_step": "damping after a step of the path [-]",
    "damping_in_run": "damping in a run [-]",
    "step_difference_m": "largest difference from the run [m]",
    "rest_in_run_m": "distance from the path at the end of the run [m]",
    "phase_margin_deg": "phase margin [deg]",
    "crossover_rad_s": "crossover [rad/s]",
}
"""Heads of the columns on a page, by key of a result."""
_FROM_RUNS: Final = ("damping_in_step", "damping_in_run")


def driver_page(title: str, rows: Sequence[Mapping[str, Any]], picture: Picture) -> Page:
    """Return the page of the loops."""
    heads = {key: head for key, head in _HEADS.items() if key not in _FROM_RUNS or any(row[key] < 1.0 for row in rows)}
    cells = [
        [
            f"{row['controller']}, {row['speed_kmh']:.3g} km/h",
            *(
                "\N{EN DASH}" if key in _FROM_RUNS and row[key] == 1.0 else f"{row[key]:#.3g}".rstrip(".")
                for key in heads
            ),
        ]
        for row in rows
    ]
    note = "\N{EN DASH}: the car does not cross the path." if set(heads) & set(_FROM_RUNS) else ""
    sections = [
        Section(pictures=[picture]),
        Section("Numbers", tables=[Table("", ["loop", *heads.values()], cells, note=note)]),
    ]
    return Page(f"activesteer linearise: {title}", f"Loop of driver and car: {title}", conclusion(rows), sections)


def driver_loops_picture(loops: Sequence[LoopAtSpeed], rows: Sequence[Mapping[str, Any]]) -> Picture:
    """Return the figures: Bode diagrams and a step of the path at the middle speed, and damping versus speed."""
    speeds = sorted({row["speed_kmh"] for row in rows})
    middle = speeds[len(speeds) // 2]
    controllers = list(dict.fromkeys(row["controller"] for row in rows))
    x_range = (FREQUENCIES_RADPS[0], 20.0)
    gain, phase = ([Curve(x_range, [level] * 2, "", RUN_COLOURS[0], "-", 0.6)] for level in (1.0, -180.0))
    damping, step = [], []
    for place, (controller, look) in enumerate(run_looks(controllers).items()):
        own = [row for row in rows if row["controller"] == controller]
        shown, loop = next(
            (row, loop)
            for row, loop in zip(rows, loops, strict=True)
            if (row["controller"], row["speed_kmh"]) == (controller, middle)
        )
        response = loop.loop.response
        crossover_radps, margin_deg = shown["crossover_rad_s"], shown["phase_margin_deg"]
        label = f"{controller}: {crossover_radps:.1f} rad/s, margin {margin_deg:.0f} deg"
        angle = np.degrees(np.unwrap(np.angle(response)))
        angle -= 360.0 * round((angle[0] + 180.0) / 360.0)
        for curves, values, low, high in ((gain, np.abs(response), 0.05, 50.0), (phase, angle, -360.0, -90.0)):
            curves.append(Curve(FREQUENCIES_RADPS, values, label, look.colour, "-", 1.5))
            curves.append(Curve([crossover_radps, crossover_radps], [low, high], "", look.colour, ":", 0.8))
        step.append(Curve(loop.run.time_s, loop.run["y_m"], label, look.colour, "-", 1.5))
        step.append(Curve(*loop.loop.step(), "", look.colour, ":", 1.2))
        damping.append(
            Curve([row["speed_kmh"] for row in own], [row["damping"] for row in own], label, look.colour, "-", 1.5)
        )
        # A run that does not cross the path does not oscillate and has no dot. Dots at one place are nested.
        swings = [(row["speed_kmh"], row["damping_in_run"]) for row in own if row["damping_in_run"] < 1.0]
        if swings:
            (x, y), size = zip(*swings, strict=True), max(3.0, 9.0 - 3.0 * place)
            damping.append(Curve(x, y, "", look.colour, "", marker="o", size=size))
    damping.append(Curve(DAMPED_KMH, [LEAST_DAMPING] * 2, "", "#b3261e", "--", 1.2))
    lowest = min(0.0, *(row["damping_in_run"] for row in rows))
    dots = "; dots: runs" if any(curve.marker for curve in damping) else ""
    at = f"at {middle:.0f} km/h{' only' if len(speeds) > 1 else ''}"
    below, after = "frequency [rad/s]", "after a step of the path [s]"
    panels = [
        Panel(below, "gain [-]", gain, f"Bode diagram {at}", log="xy", x_range=x_range, y_range=(0.05, 50.0)),
        Panel(below, "phase [deg]", phase, f"Bode diagram {at}", log="x", x_range=x_range, y_range=(-360.0, -90.0)),
        Panel(after, "lateral position [m],\ndotted: linear loop", step, f"Step of the path {at}"),
        Panel(
            "speed [km/h]", f"damping of the linear loop [-],\ndashed: required{dots}", damping,
            "Damping over speed", y_range=(lowest, 1.1), legend=None,
        ),
    ]  # fmt: skip
    return Picture("", panels, columns=2, width_in=9.0, height_in=7.0)
