"""Commands of many runs and of linear models: `study`, `tune`, `fit`, `identify`, `linearise`."""

from __future__ import annotations

import argparse
import datetime
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from activesteer.commands.options import (
    CAR,
    JSON,
    OVERRIDES,
    WORKERS,
    Group,
    OneOf,
    controllers,
    driver,
    flag,
    numbers,
    option,
    output,
    overrides_of,
)
from activesteer.commands.terminal import (
    BAD,
    GOOD,
    ProgressBar,
    RunCounter,
    painted,
    print_notes,
    printable,
    table_lines,
    tell,
    tell_files,
)
from activesteer.errors import ParameterError, StudyError
from activesteer.files import make_folder
from activesteer.resources import DEFAULT_DRIVER
from activesteer.text_table import text_table

if TYPE_CHECKING:
    from activesteer.measured.fit_result import Fit
    from activesteer.measured.fitting import FitProgress
    from activesteer.studies.engine.tuning import Trial, Tuning
    from activesteer.studies.linear.margins import LoopMargins

command: Final = Group("study")
_SHOWN_FALLS: Final = 8
"""Number of improvements that are printed."""
_LOCUS_KMH: Final = (40.0, 60.0, 80.0, 100.0, 120.0, 140.0, 160.0)
"""Speeds of the root locus [km/h]."""
_DRIVER_COLUMNS: Final = {
    "speed_kmh": "km/h",
    "controller": "controller",
    "damping": "damping",
    "damping_in_step": "in a step",
    "damping_in_run": "in a run",
    "step_difference_m": "apart m",
    "phase_margin_deg": "margin deg",
    "crossover_rad_s": "crossover rad/s",
}
"""Key of a result -> head of its column."""
_CONTROLLER_COLUMNS: Final = {
    "speed_kmh": "km/h",
    "controller": "controller",
    "loop": "opened at",
    "gain_margin_dB": "gain dB",
    "phase_margin_deg": "phase deg",
    "delay_margin_s": "delay s",
    "disk_margin": "disk",
}
"""Key of a row -> head of its column."""


@command("study", "drive many runs over varied parameters",
    option("study", "STUDY_OR_DIR", "a study file or its name, or the folder of a study"),
    output("DIR", "folder for the results, needed for a new study; a study found there is resumed"),
    controllers("those of the study"),
    option("--vehicle", "NAME_OR_PATH", "a car instead of the study's; may be repeated", many=True),
    option("--driver", "DRIVER", "a driver instead of the study's"),
    option("--samples", "N", "number of samples instead of the study's", type=int),
    OVERRIDES, WORKERS,
    OneOf((
        option("--limit", "N", "drive at most N runs now", type=int),
        flag("--status", "only print the progress of the study in DIR"),
        flag("--report", "only write DIR/report.html for the finished runs"),
    )),
    JSON,
)  # fmt: skip
def _study(options: argparse.Namespace) -> int:
    if options.limit is not None and options.limit < 1:
        raise StudyError(f"--limit {options.limit}: at least 1 is needed")
    from activesteer.studies.engine.study_file import changed_study, read_study

    given = Path(options.study)
    changes = {
        "controllers": options.controller, "vehicles": options.vehicle, "driver": options.driver,
        "overrides": overrides_of(options), "samples": options.samples,
    }  # fmt: skip
    changes = {key: value for key, value in changes.items() if value not in (None, {})}
    if changes and given.is_dir():
        raise StudyError(f"{given} holds a study, which keeps its {' and '.join(changes)}; give a study file instead")
    if changes and (options.status or options.report):
        raise StudyError(f"--status and --report drive nothing, so they take no {' and '.join(changes)}")
    folder = options.output or (given if given.is_dir() else None)
    if folder is None:
        read_study(options.study)
        raise StudyError(f"-o DIR is needed: the folder for the results of {options.study}")
    if options.status:
        progress = _progress_of(folder)
        tell(options, progress, _status(progress))
        return 0
    if options.report:
        from activesteer.studies.engine.report import write_report

        path = write_report(folder)
        tell(options, {"report": str(path)}, [f"report: {path}"])
        return 0
    from activesteer.studies.engine.store import RESULTS, read_environment
    from activesteer.studies.engine.study import study

    if given.is_dir():
        read_environment(given)  # refuses a folder without a study
    options.output = folder
    options.how_to_resume = f"; resume with `activesteer study {folder}`"
    with RunCounter("study", quiet=options.json) as counter:
        study(
            given / "study.toml" if given.is_dir() else changed_study(options.study, changes),
            output=folder,
            jobs=options.jobs,
            scheduler=options.scheduler,
            limit=options.limit,
            progress=counter,
        )
    result = folder / RESULTS
    made = _progress_of(folder)
    end = f"results: {result}" if result.exists() else f"not finished; resume with `activesteer study {folder}`"
    tell(options, made | {"results": str(result) if result.exists() else None}, [*_status(made), end])
    return 1 if made["by_status"] and set(made["by_status"]) <= {"failed", "crashed"} else 0


def _progress_of(folder: Path) -> dict[str, Any]:
    from activesteer.studies.engine.store import Store

    return {"folder": str(folder), **Store(folder, ()).progress().to_json()}


def _status(progress: dict[str, Any]) -> Iterator[str]:
    counts = ", ".join(f"{number} {status}" for status, number in progress["by_status"].items()) or "none"
    at_work = "; a process is at work" if progress["running"] else ""
    yield f"{progress['done']} of {progress['total']} runs are done: {counts}{at_work}"
    yield from (f"{number:6}  {printable(error)}" for error, number in progress["errors"].items())
    yield from (f"without effect: {key} changes no metric of any run" for key in progress["without_effect"])


@command("tune", "minimise objectives, satisfy statements or violate a requirement",
    option("study", "STUDY", "a study file with a table [tune], or its name"),
    output("DIR", "folder of the search; a search found there is resumed", "tuning"),
    controllers("with the goal violate, those of the file"),
    option("-m --maneuver", "MANEUVER",
        "one of the file; may be repeated (default: with the goal violate, all of the file)", many=True),
    OneOf((
        option("--trials", "N", "total number of sets of each search (default: that of the file)", type=int),
        option("--runs", "N", "the same as a budget of runs, of which a set needs several", type=int),
    )),
    WORKERS, JSON,
    description="Search the ranges of the factors of a study for values that minimise objectives, satisfy as many "
    "statements as possible, or violate a requirement. The exit status is 1 if the requirement is violated.",
)  # fmt: skip
def _tune(options: argparse.Namespace) -> int:
    from activesteer.studies.engine.tuning import Goal, tune

    options.how_to_resume = "; the same command resumes it"
    with ProgressBar("tune", quiet=options.json) as bar:
        found = tune(
            options.study,
            options.output,
            controllers=options.controller,
            maneuvers=options.maneuver,
            trials=options.trials,
            runs=options.runs,
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=lambda what, done, total: bar(done / total, f"{what} {done}/{total} sets".lstrip()),
        )
    if found[0].goal is not Goal.VIOLATE:
        tell(options, found[0].to_json(), _lines(found[0]), _draw(found, options.output))
        return 0
    violated = any(one.violations for one in found)
    values = {"violated": violated, "searches": [one.to_json() for one in found]}
    tell(options, values, (line for one in found for line in _worst(one)), _draw(found, options.output))
    return int(violated)


def _lines(found: Tuning) -> Iterator[str]:
    yield f"{found.done} sets tried, {found.failed} with a failed run; the best:"
    for trial in found.front:
        yield "  ".join(f"{name} {value:.6g}" for name, value in trial.objectives.items()) or _held(trial)
        if found.plausibility is None or trial is found.front[0]:
            yield from _values(trial)
    if pairs := found.never_together:
        yield f"hold alone and never together: {', '.join(map('+'.join, pairs))}"
    yield from (f"without effect: {key} changes no metric of any run" for key in found.without_effect)


def _held(trial: Trial) -> str:
    fails = [name for name in trial.margins if name not in trial.holding]
    about = f"{len(trial.holding)} of {len(trial.margins)} hold, implausibility {trial.implausibility:.2f}"
    return f"{about}, set {trial.number}{'; fails: ' * bool(fails)}{' '.join(fails)}"


def _worst(found: Tuning) -> Iterator[str]:
    verdict = painted("VIOLATED", BAD) if found.violations else painted("not violated", GOOD)
    failed = f", {found.failed} sets not judged" if found.failed else ""
    yield f"{found.controller}, {found.maneuver}: {found.requirement}"
    if not found.front:
        yield f"  no set could be judged in {found.runs} runs{failed}"
        return
    yield f"  {verdict} in {found.violations} of {len(found.trials)} sets ({found.runs} runs{failed})"
    falls = found.fall
    yield f"  least margin {falls[-1][1]:.6g}"
    shown = falls if len(falls) <= _SHOWN_FALLS else [*falls[:1], *falls[1 - _SHOWN_FALLS :]]
    yield "  fell: " + ", ".join(f"{value:.4g} after {runs} runs" for runs, value in shown)
    yield from _values(found.front[0], "    ")
    yield from (f"  {command}" for command in found.commands.values())


def _values(trial: Trial, indent: str = "  ") -> Iterator[str]:
    yield from (f"{indent}{key} = {value!r}" for key, value in trial.values.items())


def _draw(found: list[Tuning], folder: Path) -> list[Path]:
    """Draw each search, or nothing without matplotlib."""
    from activesteer.errors import ParameterError
    from activesteer.studies.engine.report import draw_tuning

    try:
        return [path for one in found for path in draw_tuning(one, folder)]
    except ParameterError:
        return []


@command("fit", "fit parameters of a car to recordings, with intervals",
    option("study", "STUDY",
        "a study file (or its name) with recordings as manoeuvres and a table [fit]; or a folder of measured runs "
        "with a validation.toml, or bmw_m8: fitted in one window, judged in another"),
    output("DIR", "folder for fit.json, fit.html and overrides.toml, or for page.html (default: none)"),
    WORKERS, JSON,
    description="Drive the inputs of recordings again, and find by least squares the values of the factors of a study "
    "for which the car matches the recordings best.",
)  # fmt: skip
def _fit(options: argparse.Namespace) -> int:
    from activesteer.measured.folder_file import is_measured

    if options.output is not None:  # a fit takes minutes, and a folder that cannot be made is no surprise after it
        make_folder(options.output, ParameterError)
    if is_measured(options.study):
        page = None if options.output is None else options.output / "page.html"
        return judge(options.study, options, page=page, fitted=True)
    from activesteer.measured.fitting import fit

    with ProgressBar("fit", quiet=options.json) as bar:

        def progress(here: FitProgress) -> None:
            so_far = "" if math.isnan(here.misfit) else f", differences {here.misfit:.3g} times the noise"
            bar(here.done / here.total, f"round {here.round}, {here.done}/{here.total} runs{so_far}")

        found = fit(options.study, jobs=options.jobs, scheduler=options.scheduler, progress=progress)
    files = []
    if options.output is not None:
        from activesteer.measured.fit_result import write_fit

        files = write_fit(found, Path(options.study).stem, options.output)
    print_notes(found.notes)
    tell(options, found.to_json(), [*_fit_lines(found), *map(str, files)])
    return 0


def _fit_lines(found: Fit) -> Iterator[str]:
    from activesteer.measured.fit_result import rests_on

    width = max(len(one.key) for one in found.parameters)
    yield from (f"{one.key:{width}}  {one.words}" for one in found.parameters)
    yield from (f"correlation {value:+.2f}  {one}, {other}" for one, other, value in found.pairs(0.5))
    rows = [["", "", "noise", "rms", "fitted", "independent"]]
    for recording, label, noise, before, after, samples, independent in (each.words() for each in found.compared):
        values = (text.partition(" ")[0] for text in (noise, before, after))
        rows.append([recording, f"{label}, {noise.partition(' ')[2]}", *values, f"{independent} of {samples}"])
    yield from text_table(rows, text=2, repeat=2, marks=["  "] * len(rows))
    yield f"{found.rounds} rounds, {found.runs} runs; the remaining difference is {found.misfit:.3g} times the noise"
    yield from rests_on(found)[:1]


def judge(name: str, options: argparse.Namespace, *, page: Path | None, fitted: bool = False) -> int:
    """Predict a measurement, with `fitted` also fit the factors of the folder, and print the verdict."""
    from activesteer.measured.circle import SAMPLES, validate_circle
    from activesteer.measured.folder import validate_measured
    from activesteer.measured.folder_file import measured_folder, read_measured
    from activesteer.measured.pages import measured_page
    from activesteer.pages import write_page

    file = read_measured(measured_folder(name))
    jobs, scheduler, is_circle = options.jobs, options.scheduler, file.table.circle is not None
    if fitted and (is_circle or not file.factors):
        raise ParameterError(f"{name} has nothing to fit; activesteer compare {name} predicts it", value=name)
    samples = getattr(options, "samples", None)
    if samples is not None and not is_circle:
        raise ParameterError(f"has an effect with a measured circle only, and {name} is none", key="--samples")
    with ProgressBar("fit" if fitted else "compare", quiet=options.json) as bar:
        if is_circle:
            result = validate_circle(file, samples or SAMPLES, jobs, scheduler=scheduler, progress=bar)
        else:
            result = validate_measured(file, jobs, fitted=fitted, scheduler=scheduler, progress=bar)
            print_notes(result.notes)
    told = measured_page(result)
    tell(options, result.to_json(), (*told.lines(), "inside" if result.inside else "outside"))
    if page is not None:
        tell_files(options, [write_page(told, page)], "page")
    return 0 if result.inside else 1


@command("identify", "understeer, limits and controller models of a vehicle (ISO 4138)",
    CAR,
    flag("--write", "also write [single_track] and [two_track] of the vehicle file"),
    JSON,
)  # fmt: skip
def _identify(options: argparse.Namespace) -> int:
    from activesteer.resources import check_own, find_vehicle
    from activesteer.studies.linear.identification import identify, write_identified

    def progress(test: str) -> None:
        if not options.json:
            print(f"{test} ...", file=sys.stderr)

    file, overrides = find_vehicle(options.vehicle), overrides_of(options)
    if options.write:
        if overrides:
            raise ParameterError("writes into the vehicle file, so leave out --set and --overrides", key="--write")
        check_own(file)
        options.output = file
    result = identify(options.vehicle, overrides, progress)
    tell(options, result.to_json(), [result.table()])
    if options.write:
        vehicle = f" --vehicle {options.vehicle}" if options.vehicle != "compact" else ""
        command = f"activesteer identify{vehicle} --write"
        write_identified(file, result, command, datetime.date.today().isoformat())
        if not options.json:
            print(f"written to {file}")
    return 0


@command("linearise", "modes of the full car, and stability of its loops",
    CAR,
    option("--loop", ("driver", "controller"), "instead of the modes, stability of a loop"),
    controllers("with --loop ars and afs, with --loop driver also none"),
    driver(f"{DEFAULT_DRIVER}; with --loop driver"),
    option("--speed-kmh", "V,V",
        "speeds, separated by commas (default: 80; with --loop driver 60, 80 ... 140; with --loop controller 60, 80 "
        "... 160)", type=numbers, action="extend", dest="speeds_kmh"),
    option("--study", "STUDY",
        "with --loop controller: smallest margins over the samples of a study (file or name); controllers are "
        "designed for the car without the factors of the study"),
    WORKERS,
    output("DIR", "folder for figures, with --loop controller for a page (default: none)"),
    JSON,
    description="Print the modes of the full car at a speed. With --loop driver, print crossover frequency, phase "
    "margin and damping of the loop of driver, controller and car, and the damping after a small step of the path, "
    "for the same loop and for a run. With --loop controller, print margins of the loop of controller, control unit, "
    "actuators, car and sensors, opened at the rear actuator and at the superposition; --set "
    "sensors.preset=production takes real sensors.",
)  # fmt: skip
def _linearise(options: argparse.Namespace) -> int:
    effects = {"controller": ("driver", "controller"), "driver": ("driver",), "study": ("controller",)}
    for name, loops in effects.items():
        if getattr(options, name) is not None and options.loop not in loops:
            raise ParameterError(f"has an effect with --loop {' or '.join(loops)} only", key=f"--{name}")
    for name in ("jobs", "scheduler"):
        if getattr(options, name) is not None and options.study is None:
            raise ParameterError("has an effect with --study only", key=f"--{name}", value=getattr(options, name))
    if options.output is not None:
        make_folder(options.output, ParameterError)
    return {None: _modes, "driver": _driver_loop, "controller": _controller_loop}[options.loop](options)


def _modes(options: argparse.Namespace) -> int:
    from activesteer.scenario import check_gains
    from activesteer.studies.linear.linearisation import eigenvalue_table, linear_car, linear_cars

    speeds_kmh = options.speeds_kmh or [80.0]
    if len(speeds_kmh) > 1:
        raise ParameterError("give one speed for the modes", key="--speed-kmh", value=speeds_kmh)
    overrides = overrides_of(options)
    check_gains(overrides, ())
    car = linear_car(options.vehicle, speeds_kmh[0] / 3.6, overrides)
    modes, figures = car.modes(), []
    label = f"{speeds_kmh[0]:g} km/h"
    if options.output is not None:
        from activesteer.analysis.linear_plots import draw_bode, draw_root_locus

        speeds = [speed / 3.6 for speed in _LOCUS_KMH]
        systems = [each.state_space() for each in linear_cars(options.vehicle, speeds, overrides)]
        figures = [
            draw_bode({label: car.state_space()}, options.output / "bode.png"),
            draw_root_locus(systems, speeds, options.output / "root_locus.png"),
        ]
    values = {"speed_mps": car.speed_mps, "modes": [mode.to_json() for mode in modes]}
    tell(options, values, [f"{options.vehicle} at {label}", eigenvalue_table(modes)], figures)
    return 0


def _driver_loop(options: argparse.Namespace) -> int:
    from activesteer.studies.linear.driver_loop import FREQUENCIES_RADPS, SPEEDS_KMH, driver_loops

    driver = options.driver or DEFAULT_DRIVER
    loops = driver_loops(
        driver,
        options.vehicle,
        options.controller or ("none", "ars", "afs"),
        options.speeds_kmh or SPEEDS_KMH,
        overrides_of(options),
    )
    rows = [loop.to_json() for loop in loops]
    tell(options, rows, [f"{driver} in {options.vehicle}", *table_lines(rows, _DRIVER_COLUMNS)])
    if options.output is not None:
        from activesteer.analysis.linear_plots import driver_loops_figure
        from activesteer.plotting import save

        figure = driver_loops_figure(rows, FREQUENCIES_RADPS, [loop.loop.response for loop in loops])
        tell_files(options, [save(figure, options.output / "driver.png")])
    return 0


def _controller_loop(options: argparse.Namespace) -> int:
    found = _margins(options)
    rows = [margins.to_json() for margins in found]
    if not rows:
        raise ParameterError("none of these controllers uses a measurement, so there is no loop", key="-c")
    lines = [*table_lines(rows, _CONTROLLER_COLUMNS)]
    if options.study:
        least = min(rows, key=lambda row: row["disk_margin"])
        changed = ", ".join(f"{key} = {value:.3g}" for key, value in least["factors"].items())
        where = f"{least['controller']}, {least['loop']}, {least['speed_kmh']:.0f} km/h"
        lines.append(f"smallest disk margin {least['disk_margin']:.3g}: {where}, with {changed}")
    tell(options, rows, lines)
    if options.output is not None:
        from activesteer.studies.linear.margins import write_margins_page

        tell_files(options, [write_margins_page(found, str(options.vehicle), options.output)], "page")
    return 0


def _margins(options: argparse.Namespace) -> list[LoopMargins]:
    from activesteer.studies.linear.margins import SPEEDS_KMH, loop_margins

    speeds_kmh, overrides = options.speeds_kmh or SPEEDS_KMH, overrides_of(options)
    controllers = options.controller or ("ars", "afs")
    if options.study is None:
        return loop_margins(controllers, options.vehicle, speeds_kmh, overrides)
    from activesteer.studies.linear.margins import worst_margins

    with RunCounter("margins", quiet=options.json) as counter:
        return worst_margins(
            options.study, controllers, options.vehicle, speeds_kmh, overrides, counter,
            jobs=options.jobs, scheduler=options.scheduler,
        )  # fmt: skip
