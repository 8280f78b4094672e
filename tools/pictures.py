"""Make the pictures of the documentation that come from runs: `python tools/renew.py pictures [NAME]...`.

One for every manoeuvre and those of the pages on controllers, drivers and tyres. Without names all are made, in two
minutes and another two for each envelope; to be run again when the car, a controller or a manoeuvre has changed. What
`activesteer run MANEUVER --plot` draws is taken where it says something; driving straight and standing are shown by
other channels, and sweep and random steering as the frequency response that they are driven for.
"""

from __future__ import annotations

import io
import math
import re
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from PIL import Image

from activesteer import ActuatorCommand, Simulation, study
from activesteer.analysis.figures import BY_KIND, over_time
from activesteer.analysis.frequency_response import frequency_response
from activesteer.core.units import DisplayUnit, quantity_of
from activesteer.drawing.panels import PANELS, Line, Panel, panel_of
from activesteer.plotting import Heat, Picture, draw, new_figure
from activesteer.resources import list_maneuvers, models_dir
from activesteer.scenario import resolve
from activesteer.simulation.preparation import with_amplitude_found
from activesteer.simulation.runner import run_scenario
from activesteer.studies.engine.runs import CLAIM
from activesteer.studies.engine.study_file import read_study
from activesteer.studies.linear.driver_loop import driver_loops, driver_loops_picture
from activesteer.theory.single_track import SingleTrack
from activesteer.tyre import MagicFormula, load_tir
from tools.comparison import COMPARED, compare, comparison_figure, comparison_population_figure
from tools.population_results import read_population

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOCS: Final = Path(__file__).resolve().parents[1] / "docs"
DOTS_PER_INCH: Final = 100
COLUMN_DOTS_PER_INCH: Final = 150
"""Of a picture that is as narrow as a column. It comes out narrower than the others, with larger text."""
COLOURS: Final = 128
"""A plot has few colours and their shades: a palette makes the file a third as large."""
SYSTEMS: Final = ("none", "ars", "afs")
CORNER_WORDS: Final = {"fl": "front left", "rl": "rear left"}


def at_wheel(channel: str) -> Panel:
    """A panel of a corner with the corner in its name."""
    found = quantity_of(channel)
    named = found._replace(short=f"{found.short}\n{CORNER_WORDS[channel[:2]]}")
    return panel_of(channel)._replace(quantity=named)


LOADS: Final = (at_wheel("fl_tyre_fz_N"), at_wheel("rl_tyre_fz_N"))
DISTANCE: Final = Panel(
    "Distance",
    quantity_of("y_m")._replace(channel="x_m", short="distance", unit=DisplayUnit("mm", 1e3)),
    (Line("x_m"),),
)
RIDE: Final = (panel_of("pitch_rad"), LOADS[0])
PANELS_OF: Final[Mapping[str, Sequence[Panel]]] = {
    "straight_line": (PANELS["speed"], at_wheel("fl_drive_torque_Nm"), *LOADS),
    "standstill": (DISTANCE, *LOADS),
    "hill_hold": (DISTANCE, at_wheel("fl_brake_torque_Nm"), *LOADS),
    "drive_off_and_stop": (PANELS["speed"], panel_of("ax_mps2"), panel_of("pitch_rad"), *LOADS),
    "start_stop": (PANELS["speed"], panel_of("ax_mps2"), panel_of("pitch_rad"), *LOADS),
    **dict.fromkeys(("rough_road", "rough_road_50", "rough_road_120", "cleat", "kerb_strike"), RIDE),
    "rough_braking": (PANELS["speed"], at_wheel("fl_brake_pressure_Pa"), LOADS[0]),
    **dict.fromkeys(("rough_lane_change", "banked_curve"), (panel_of("yaw_rate_radps"), LOADS[0])),
    "straight_braking": (
        PANELS["speed"], panel_of("ax_mps2"), at_wheel("fl_brake_pressure_Pa"), at_wheel("rl_brake_pressure_Pa"),
    ),
    "parking": (
        PANELS["steering_wheel"], at_wheel("fl_steer_rad"), at_wheel("fl_tyre_mz_Nm"), at_wheel("fl_tie_rod_force_N"),
    ),
}  # fmt: skip
"""What shows a manoeuvre better than the general picture: where the car goes straight or stands, that is rounding."""

_MARGIN: Final = "margin between the sides of the car and the edges of the lane"
ENVELOPES: Final = {
    "slalom": ("Slalom", "largest distance of the path from the row of cones"),
    "double_lane_change": ("Double lane change", _MARGIN),
    "double_lane_change_low_mu": ("Slippery double lane change", _MARGIN),
}
"""Manoeuvre with a map of speed and line -> its title, and what varies over the rows."""


def draw_pictures(names: Sequence[str]) -> None:
    """Draw the pictures with these names, or all."""
    pictures: dict[str, Callable[[], Mapping[str, Figure]]] = {
        name: lambda name=name: {f"manoeuvre_{name}": _manoeuvre(name)} for name in list_maneuvers()
    }
    pictures |= {
        "controller": _controller,
        "driver": _driver,
        "stepping": _stepping,
        "rear_steer_gains": _rear_steer_gains,
        "reference_and_band": _reference_and_band,
        "sensors": _sensors,
        "tyres": _tyres,
        "brakes": _brakes,
        "comparison": _comparison,
        "comparison_population": _comparison_population,
    }
    pictures |= {f"envelope_{name}": lambda name=name: {f"envelope_{name}": _envelope(name)} for name in ENVELOPES}
    for name in names or pictures:
        if name not in pictures:
            sys.exit(f"there is no picture {name}; there are: {', '.join(pictures)}")
        for file, figure in pictures[name]().items():
            _save(figure, DOCS / "pictures" / f"{file}.png")


def _manoeuvre(name: str) -> Figure:
    scenario = with_amplitude_found(resolve(name))
    kind = scenario.maneuver.kind
    # In those of PANELS_OF no system has anything to do.
    runs = {system: run_scenario(scenario, system) for system in (("none",) if name in PANELS_OF else SYSTEMS)}
    if kind in {"sine_sweep", "random_steer"}:
        return _frequency_responses(runs)
    if name not in PANELS_OF:
        return _draw(kind, runs)
    figure = over_time.time_figure(runs, PANELS_OF[name])
    for axis in figure.get_axes():
        axis.ticklabel_format(useOffset=False)
    return figure


def _frequency_responses(runs: Mapping[str, Any]) -> Figure:
    """Gain and phase of the yaw rate, and gain of the lateral acceleration, over the steering wheel angle."""
    figure = new_figure(7.5, 6.0)
    axes = figure.subplots(3, 1, sharex=True)
    frequencies_Hz = np.geomspace(0.2, 4.0, 120)
    for curve in over_time.drawn_runs(runs):
        yaw, lateral = (
            frequency_response(curve.recording, name, frequencies_Hz) for name in ("yaw_rate_radps", "ay_mps2")
        )
        phase_deg = np.degrees(np.unwrap(np.angle(yaw.response)))
        shown = (np.abs(yaw.response), phase_deg, np.radians(np.abs(lateral.response)))
        for axis, values in zip(axes, shown, strict=True):
            axis.semilogx(
                yaw.frequency_Hz, values, color=curve.look.colour, linestyle=curve.linestyle, label=curve.look.label
            )
    titles = ("yaw rate gain\n[1/s]", "yaw rate phase\n[deg]", "lateral acc. gain\n[m/s² per deg]")
    for axis, title in zip(axes, titles, strict=True):
        over_time.plain(axis, title)
    ticks = (0.2, 0.5, 1, 2, 4)
    axes[-1].set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes[-1].minorticks_off()
    axes[-1].set_xlabel("frequency [Hz]")
    figure.align_ylabels(list(axes))
    over_time.name_curves(figure, axes[0])
    return figure


def _controller() -> dict[str, Figure]:
    """The controller of the page on controllers, which is cut out of that page."""
    page = (DOCS / "controller.md").read_text(encoding="utf-8")
    found = re.search(r"```python\n(# yaw_damper\.py\n.*?)```", page, re.DOTALL)
    if found is None:
        sys.exit("docs/controller.md has no block that begins with `# yaw_damper.py`")
    scenario = with_amplitude_found(resolve("sine_with_dwell"))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "yaw_damper.py")
        file.write_text(found[1], encoding="utf-8")
        runs = {"none": run_scenario(scenario), "YawDamper": run_scenario(scenario, f"{file}:YawDamper")}
    return {"controller_sine_with_dwell": _draw(scenario.maneuver.kind, runs)}


def _sensors() -> dict[str, Figure]:
    """True and measured yaw rate and lateral acceleration at the start of a sine with dwell."""
    run = run_scenario(
        with_amplitude_found(resolve("sine_with_dwell", overrides={"sensors.preset": "production"})), "ars"
    )
    begin = run.metrics["steer_begin_time_s"] - 0.1
    shown = (run.time_s >= begin) & (run.time_s < begin + 0.8)
    figure = new_figure(7.5, 4.5)
    axes = figure.subplots(2, 1, sharex=True)
    for axis, channel in zip(axes, ("yaw_rate_radps", "ay_mps2"), strict=True):
        quantity = quantity_of(channel)
        for name, colour, label in ((channel, "#222222", "true"), (f"measured_{channel}", "#d55e00", "measured")):
            values = run[name][shown] * quantity.factor
            axis.step(run.time_s[shown], values, where="post", color=colour, linewidth=1.2, label=label)
        over_time.plain(axis, quantity.axis_title)
    axes[-1].set_xlabel("time [s]")
    axes[0].legend(frameon=False)
    figure.align_ylabels(list(axes))
    return {"sensors": figure}


def _stepping() -> dict[str, Figure]:
    """Sideslip angle of a step steer that continues from one saved state with three rear angles."""
    simulation = Simulation("step_steer", overrides={"duration_s": 3.0})
    simulation.advance(700)
    now = simulation.save_state()
    figure = new_figure(6.0, 3.0)
    axis = figure.subplots()
    for rear_deg, colour in ((-1.0, "#0072b2"), (0.0, "#222222"), (1.0, "#d55e00")):
        simulation.restore_state(now)
        simulation.advance(500, actuator_command=ActuatorCommand(math.radians(rear_deg)))
        run = simulation.recording()
        axis.plot(run.time_s, np.degrees(run["sideslip_rad"]), color=colour, label=f"rear angle {rear_deg:+.0f} deg")
    axis.axvline(0.7, color="#888888", linewidth=0.8, linestyle=":")
    axis.set_xlabel("time [s]")
    over_time.plain(axis, "sideslip angle [deg]")
    axis.legend(frameon=False)
    return {"stepping": figure}


def _driver() -> dict[str, Figure]:
    """The loop of the typical driver and the compact: Bode diagrams, a step of the path, and damping versus speed."""
    loops = driver_loops()
    return {"driver_loop": draw(driver_loops_picture(loops, [loop.to_json() for loop in loops]))}


def _rear_steer_gains() -> dict[str, Figure]:
    """Settled rear angle and sideslip of the step steer over the gains of active rear steering."""
    keys = ("prediction_gain", "corrector.proportional_gain_s", "corrector.deadband_end_degps")
    prediction, gain, band = (f"controllers.ars.{key}" for key in keys)
    rows = study("rear_steer_gains", jobs=2).to_pylist()
    figure = new_figure(6.5, 5.5)
    axes = figure.subplots(2, 1, sharex=True)
    for place, name in enumerate(("rear_steer_steady_state_rad", "sideslip_steady_state_rad")):
        free = next(math.degrees(row[name]) for row in rows if row["controller"] == "none")
        axes[place].axhline(free, color="#333333", linewidth=0.8, label="none")
        for (strength, band_end_degps), colour in zip(
            sorted({(row[gain], row[band]) for row in rows}),
            ("#d55e00", "#e69f00", "#0072b2", "#56b4e9", "#009e73", "#88cc88"),
            strict=True,
        ):
            own = [
                row for row in rows if (row["controller"], row[gain], row[band]) == ("ars", strength, band_end_degps)
            ]
            label = f"corrector {strength:g} s, full at {band_end_degps:g} deg/s"
            axes[place].plot(
                [row[prediction] for row in own], [math.degrees(row[name]) for row in own],
                "o-", ms=3.0, color=colour, linewidth=1.2, label=label,
            )  # fmt: skip
    over_time.plain(axes[0], "settled rear angle\n[deg]")
    over_time.plain(axes[1], "settled sideslip [deg]")
    axes[1].set_xlabel("prediction gain [-]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, frameon=False)
    return {"rear_steer_gains": figure}


def _reference_and_band() -> dict[str, Figure]:
    """Statements of the step steer and the sine with dwell that hold, over reference error and tolerance band."""
    speed, band = "single_track.characteristic_speed_kmh", "controllers.ars.corrector.deadband_start_degps"
    rows = [row for row in study("reference_and_band", jobs=2).to_pylist() if row["controller"] == "none"]
    bands, speeds = (sorted({row[key] for row in rows}) for key in (band, speed))
    held: dict[tuple[float, float], list[str]] = {(b, v): [] for b in bands for v in speeds}
    errors: dict[float, float] = {}
    for row in rows:
        held[row[band], row[speed]] += [key[6:] for key, value in row.items() if key[:6] == CLAIM and value == 1.0]
        if row["maneuver"] == "step_steer":
            car = resolve("step_steer", overrides={speed: row[speed]})
            gain = SingleTrack(car.car.config.single_track).yaw_rate_gain(car.maneuver.speed_mps)
            wheel = row["steering_wheel_steady_state_rad"] / car.car.config.steering.ratio
            errors[row[speed]] = gain * wheel / row["yaw_rate_steady_state_radps"] - 1.0
    panels = []
    for letter, what in (("S", "step steer: of 5 statements hold"), ("D", "sine with dwell: of 5 statements hold")):
        counts = [[sum(claim[0] == letter for claim in held[b, v]) for v in speeds] for b in bands]
        texts = [[str(count) for count in row] for row in counts]
        columns = [f"{100.0 * errors[v]:+.0f} %" for v in speeds]
        names = [f"{b:g} deg/s" for b in bands]
        panels.append(Heat(counts, texts, columns, names, (0.0, 5.0), ("#f4f4f4", "#5b9fd0"), what, "reference error"))
    return {"reference_and_band": draw(Picture("", panels, None, 2, 9.0, 2.8))}


def _tyres() -> dict[str, Figure]:
    """Side force of the summer and of the winter tyre versus slip angle, at three loads."""
    figure = new_figure(6.0, 3.2)
    axis = figure.subplots()
    alpha_deg = np.linspace(0.0, 15.0, 151)
    for file, colour in (("compact_205_55R16", "#333333"), ("winter_205_55R16", "#0072b2")):
        tyre = MagicFormula(load_tir(models_dir() / "tyres" / f"{file}.tir"))
        for load_N in (2000.0, 4000.0, 6000.0):
            forces = tyre.evaluate(np.full_like(alpha_deg, load_N), 0.0, np.radians(alpha_deg))
            label = file if load_N == 4000.0 else "_hidden"
            axis.plot(alpha_deg, forces.fy_N / 1000.0, color=colour, label=label)
    axis.set(xlabel="slip angle [deg]", xlim=(0.0, 15.0))
    over_time.plain(axis, "side force [kN]")
    axis.legend(frameon=False)
    return {"tyres_side_force": figure}


def _brakes() -> dict[str, Figure]:
    """Speeds, slip and pressures of a left front and a left rear wheel in a stop with the anti-lock system."""
    figure = new_figure(7.5, 6.5)
    recording = run_scenario(resolve("straight_braking"))
    time_s, speed_kmh = recording.time_s, 3.6 * recording["speed_mps"]
    axes = figure.subplots(3, 1, sharex=True)
    axes[0].plot(time_s, speed_kmh, color="#333333", label="car")
    axes[0].plot(time_s, 3.6 * recording["abs_speed_mps"], color="#333333", linestyle=":", label="car, estimated")
    for corner, colour in (("fl", "#0072b2"), ("rl", "#d55e00")):
        spin, words = recording[f"{corner}_wheel_speed_radps"], CORNER_WORDS[corner]
        wheel_kmh = speed_kmh[0] / spin[0] * spin
        axes[0].plot(time_s, wheel_kmh, color=colour, linewidth=1.0, label=words)
        moving = speed_kmh > 7.0
        slip = 100.0 * (1.0 - wheel_kmh[moving] / speed_kmh[moving])
        axes[1].plot(time_s[moving], slip, color=colour, linewidth=1.0)
        axes[2].plot(time_s, 1e-5 * recording[f"{corner}_brake_pressure_Pa"], color=colour, linewidth=1.0)
    for axis, title in zip(axes, ("speed\n[km/h]", "slip above 7 km/h\n[%]", "brake pressure\n[bar]"), strict=True):
        over_time.plain(axis, title)
    axes[0].legend(frameon=False)
    axes[-1].set(xlabel="time [s]", xlim=(0.4, 4.2))
    figure.align_ylabels(list(axes))
    return {"brakes_stop": figure}


def _comparison() -> dict[str, Figure]:
    """All built-in controllers side by side."""
    with tempfile.TemporaryDirectory() as folder:
        return {"comparison": comparison_figure(compare(COMPARED, folder))}


def _comparison_population() -> dict[str, Figure]:
    """The comparison over a population that belongs to the package."""
    found = read_population("comparison")
    return {} if found is None else {"comparison_population": comparison_population_figure(found)}


def _envelope(name: str) -> Figure:
    """Map of the systems that get through a course, with the typical driver."""
    planned = read_study("envelope_slalom" if name == "slalom" else "envelope")
    (speed, speeds), (line, lines) = ((factor.key, factor.values) for factor in planned.factors)
    passes: dict[tuple[float, float], list[str]] = {(x, y): [] for x in lines for y in speeds}
    for row in study(replace(planned, maneuvers=(name,))).to_pylist():
        stays = row.get("stays_in_lanes") == 1.0 or (row.get("cones_hit"), row.get("cones_missed")) == (0.0, 0.0)
        if stays:
            passes[row[line], row[speed]].append(row["controller"])
    counts = np.array([[float(len(passes[x, y])) for y in speeds] for x in lines])
    words = {"none": "no control"}
    texts = [
        [
            "" if len(found := passes[x, y]) == len(SYSTEMS) else ", ".join(words.get(one, one) for one in found)
            for y in speeds
        ]
        for x in lines
    ]
    names = [f"{value:g}" for value in speeds], [f"{value:g} m" for value in lines]
    heat = Heat(
        counts, texts, *names, (0.0, float(len(SYSTEMS))), ("#e6b8af", "#fff2cc", "#d9ead3"), x_label="speed [km/h]"
    )
    legend = [("all three cars complete it", "#d9ead3"), ("no car completes it", "#e6b8af")]
    title, rows = ENVELOPES[name]
    return draw(Picture(f"{title}; rows: {rows}", [heat], None, 1, 9.0, 3.6, legend))


def _draw(kind: str, runs: Mapping[str, Any]) -> Figure:
    return BY_KIND.get(kind, over_time.time_figure)(runs)


def _save(figure: Figure, path: Path) -> None:
    with io.BytesIO() as stream:
        narrow = figure.get_figwidth() <= over_time.COLUMN_IN
        figure.savefig(stream, dpi=COLUMN_DOTS_PER_INCH if narrow else DOTS_PER_INCH, format="png")
        picture = Image.open(stream).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    picture.save(path, optimize=True)
    print(f"{path.relative_to(DOCS.parent)}: {path.stat().st_size / 1000:.0f} kB")
