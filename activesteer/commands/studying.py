"""Commands for many runs and for linear models: `study`, `tune`, `fit`, `identify`, `linearise`."""

from __future__ import annotations

import argparse
import datetime
import math
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from activesteer.commands import arguments, terminal
from activesteer.core.files import make_folder
from activesteer.errors import ParameterError, StudyError
from activesteer.resources import DEFAULT_DRIVER

if TYPE_CHECKING:
    from activesteer.studies.engine.tuning import Trial, Tuning

command: Final = arguments.Group("study")
_SHOWN_FALLS: Final = 8
"""Largest number of improvements that are printed."""
_LOCUS_KMH: Final = tuple(range(40, 170, 10))
"""Speeds of the root locus [km/h]."""
_DRIVER_COLUMNS: Final = {
    "speed_kmh": "km/h",
    "controller": "controller",
    "damping": "damping",
    "damping_in_step": "in step",
    "damping_in_run": "in run",
    "step_difference_m": "apart m",
    "phase_margin_deg": "margin deg",
    "crossover_rad_s": "crossover rad/s",
}
"""Heads of the columns, by the keys of a result."""
_CONTROLLER_COLUMNS: Final = {
    "speed_kmh": "km/h",
    "controller": "controller",
    "loop": "opened at",
    "gain_margin_dB": "gain dB",
    "phase_margin_deg": "phase deg",
    "delay_margin_s": "delay s",
    "disk_margin": "disk",
}
"""Heads of the columns, by the keys of a row."""


@command("study", "drive many runs over varied parameters",
    arguments.option("study", "STUDY_OR_DIR", "a study file or its name, or the folder of a study"),
    arguments.output("DIR", "folder for the results, needed for a new study; a study found there is resumed"),
    arguments.controllers("the controllers of the study"),
    arguments.option("--vehicle", "NAME_OR_PATH", "a car instead of the study's; may be repeated", many=True),
    arguments.option("--driver", "DRIVER", "a driver instead of the study's"),
    arguments.option("--samples", "N", "number of samples instead of the study's", type=int),
    arguments.OVERRIDES, arguments.WORKERS,
    arguments.one_of(
        arguments.option("--limit", "N", "drive at most N runs now", type=int),
        arguments.flag("--status", "only print the progress of the study in DIR"),
        arguments.flag("--report", "only write DIR/report.html for the finished runs"),
    ),
    arguments.JSON,
)  # fmt: skip
def _study(options: argparse.Namespace) -> bool:
    from activesteer.studies.engine.study_file import changed_study, read_study

    if options.limit is not None and options.limit < 1:
        raise StudyError(f"--limit {options.limit}: at least 1 is needed")
    given = Path(options.study)
    changes = {
        "controllers": options.controller, "vehicles": options.vehicle, "driver": options.driver,
        "overrides": arguments.overrides_of(options), "samples": options.samples,
    }  # fmt: skip
    changes = {key: value for key, value in changes.items() if value not in (None, {})}
    if changes and given.is_dir():
        raise StudyError(f"{given} holds a study, which keeps its {' and '.join(changes)}; give a study file instead")
    if changes and (options.status or options.report):
        raise StudyError(f"--status and --report drive no runs, so they do not accept {' and '.join(changes)}")
    folder = options.output or (given if given.is_dir() else None)
    if folder is None:
        read_study(options.study)
        raise StudyError(f"-o DIR is needed: the folder for the results of {options.study}")
    if options.status:
        made = _progress_of(folder)
        terminal.tell(options, made, _status(made))
        return False
    if options.report:
        from activesteer.studies.engine.report import write_report

        path = write_report(folder)
        terminal.tell(options, {"report": str(path)}, [f"report: {path}"])
        return False
    from activesteer.studies.engine.store import RESULTS, read_environment
    from activesteer.studies.engine.study import study

    if given.is_dir():
        read_environment(given)  # refuses a folder without a study
    options.output = folder
    options.how_to_resume = f"; resume with `activesteer study {folder}`"
    with terminal.Progress("study", quiet=options.json) as progress:
        study(
            given / "study.toml" if given.is_dir() else changed_study(options.study, changes),
            output=folder,
            jobs=options.jobs,
            scheduler=options.scheduler,
            limit=options.limit,
            progress=progress.count,
        )
    result = folder / RESULTS
    made = _progress_of(folder)
    end = f"results: {result}" if result.exists() else f"not finished; resume with `activesteer study {folder}`"
    if result.exists():
        end += f"; `activesteer study {folder} --report` writes a page of them"
    terminal.tell(options, made | {"results": str(result) if result.exists() else None}, [*_status(made), end])
    return bool(made["by_status"]) and set(made["by_status"]) <= {"failed", "crashed"}


def _progress_of(folder: Path) -> dict[str, Any]:
    from activesteer.studies.engine.store import Store

    return {"folder": str(folder), **Store(folder, ()).progress().to_json()}


def _status(progress: dict[str, Any]) -> Iterator[str]:
    counts = ", ".join(f"{number} {status}" for status, number in progress["by_status"].items()) or "none"
    at_work = "; a process is working on it" if progress["running"] else ""
    yield f"{progress['done']} of {progress['total']} runs are done: {counts}{at_work}"
    yield from (f"{number:6}  {terminal.printable(error)}" for error, number in progress["errors"].items())
    yield from (f"without effect: {key} changes no metric of any run" for key in progress["without_effect"])


@command("tune", "minimise objectives, satisfy statements or violate a requirement",
    arguments.option("study", "STUDY", "a study file with a table [tune], or its name"),
    arguments.output("DIR", "folder of the search; a search found there is resumed", "tuning"),
    arguments.controllers("with the goal violate, the controllers of the file"),
    arguments.option("-m --maneuver", "MANEUVER",
        "a manoeuvre of the file; may be repeated (default: with the goal violate, all of the file)", many=True),
    arguments.one_of(
        arguments.option("--trials", "N", "total number of sets of each search (default: from the file)", type=int),
        arguments.option("--runs", "N", "the same limit as a number of runs; a set needs several runs", type=int),
    ),
    arguments.WORKERS, arguments.JSON,
    description="Search the ranges of the factors of a study for values that minimise objectives, satisfy as many "
    "statements as possible, or violate a requirement. The exit status is 1 if the requirement is violated.",
)  # fmt: skip
def _tune(options: argparse.Namespace) -> bool:
    from activesteer.studies.engine.report import draw_tuning
    from activesteer.studies.engine.tuning import Goal, tune

    options.how_to_resume = "; the same command resumes it"
    with terminal.Progress("tune", quiet=options.json) as bar:
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
    violated = any(one.violations for one in found)
    if found[0].goal is Goal.VIOLATE:
        values = {"violated": violated, "searches": [one.to_json() for one in found]}
    else:
        values = found[0].to_json()
    figures: list[Path] = []
    with suppress(ParameterError):  # matplotlib is not installed
        figures = [path for one in found for path in draw_tuning(one, options.output)]
    values |= {"figures": [str(path) for path in figures]}
    terminal.tell(
        options, values, (line for one in found for line in (_worst if one.requirement else _lines)(one)), figures
    )
    return violated


def _lines(found: Tuning) -> Iterator[str]:
    yield f"{found.done} sets tried, {found.failed} with a failed run; the best:"
    for trial in found.front:
        fails = [name for name in trial.margins if name not in trial.holding]
        about = f"{len(trial.holding)} of {len(trial.margins)} hold, implausibility {trial.implausibility:.2f}"
        about += f", set {trial.number}{'; fails: ' * bool(fails)}{' '.join(fails)}"
        yield "  ".join(f"{name} {value:.3g}" for name, value in trial.objectives.items()) or about
        if found.plausibility is None or trial is found.front[0]:
            yield from _values(trial)
    if pairs := found.never_together:
        yield f"hold separately, but never together: {', '.join(map('+'.join, pairs))}"
    yield from (f"without effect: {key} changes no metric of any run" for key in found.without_effect)


def _worst(found: Tuning) -> Iterator[str]:
    word, colour = ("VIOLATED", terminal.BAD) if found.violations else ("not violated", terminal.GOOD)
    failed = f", {found.failed} sets not judged" if found.failed else ""
    yield f"{found.controller}, {found.maneuver}: {found.requirement}"
    if not found.front:
        yield f"  no set could be judged in {found.runs} runs{failed}"
        return
    sets = f"{found.violations} of {len(found.trials)} sets"
    yield f"  {terminal.painted(word, colour)} in {sets} ({found.runs} runs{failed})"
    falls = found.fall
    yield f"  least margin {falls[-1][1]:.6g}"
    shown = falls if len(falls) <= _SHOWN_FALLS else [*falls[:1], *falls[1 - _SHOWN_FALLS :]]
    yield "  fell: " + ", ".join(f"{value:.4g} after {runs} runs" for runs, value in shown)
    yield from _values(found.front[0], "    ")
    yield from (f"  {command}" for command in found.commands.values())


def _values(trial: Trial, indent: str = "  ") -> Iterator[str]:
    for key, value in trial.values.items():
        yield f"{indent}{key} = {f'{value:.3g}' if isinstance(value, float) else repr(value)}"


@command("fit", "fit parameters of a car to recordings, with intervals",
    arguments.option("study", "STUDY",
        "a study file (or its name) with recordings as manoeuvres and a table [fit]; or a folder of measured runs "
        "with a validation.toml, or bmw_m8: fitted in one window, judged in another"),
    arguments.output("DIR", "folder for fit.json, fit.html and overrides.toml, or for page.html (default: none)"),
    arguments.WORKERS, arguments.JSON,
    description="Drive the inputs of recordings again, and find by least squares the values of the factors of a study "
    "for which the car matches the recordings best.",
)  # fmt: skip
def _fit(options: argparse.Namespace) -> bool:
    from activesteer.measured.fitting import fit
    from activesteer.measured.folder_file import is_measured
    from activesteer.measured.pages import fit_page, write_fit

    # A fit takes minutes: a folder that cannot be made is an error before it.
    if options.output is not None:
        make_folder(options.output, ParameterError)
    if is_measured(options.study):
        page = None if options.output is None else options.output / "page.html"
        return judge(options.study, options, page=page, fitted=True)

    with terminal.Progress("fit", quiet=options.json) as bar:

        def progress(number: int, done: int, total: int, misfit: float) -> None:
            so_far = "" if math.isnan(misfit) else f", differences {misfit:.3g} times the noise"
            bar(done / total, f"round {number}, {done}/{total} runs{so_far}")

        found = fit(options.study, jobs=options.jobs, scheduler=options.scheduler, progress=progress)
    name = Path(options.study).stem
    files = [] if options.output is None else write_fit(found, name, options.output)
    terminal.tell(options, found.to_json(), fit_page(found, name).lines(), files, "written")
    return False


def judge(name: str, options: argparse.Namespace, *, page: Path | None, fitted: bool = False) -> bool:
    """Predict a measurement and print the verdict. With `fitted`, also fit the factors of the folder."""
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
        raise ParameterError(
            f"has an effect only with a measured circle, and {name} has no table [circle]", key="--samples"
        )
    with terminal.Progress("fit" if fitted else "compare", quiet=options.json) as bar:
        if is_circle:
            result = validate_circle(file, samples or SAMPLES, jobs, scheduler=scheduler, progress=bar)
        else:
            result = validate_measured(file, jobs, fitted=fitted, scheduler=scheduler, progress=bar)
            terminal.print_notes(result.notes)
    told = measured_page(result)
    pages = [] if page is None else [write_page(told, page)]
    terminal.tell(options, result.to_json(), (*told.lines(), "inside" if result.inside else "outside"), pages, "page")
    return not result.inside


@command("identify", "understeer, limits and controller models of a vehicle (ISO 4138)",
    arguments.CAR,
    arguments.flag("--write", "also write [single_track] and [two_track] of the vehicle file"),
    arguments.JSON,
)  # fmt: skip
def _identify(options: argparse.Namespace) -> None:
    from activesteer.resources import check_own, find_vehicle
    from activesteer.studies.linear.identification import identify, write_identified

    def progress(test: str) -> None:
        if not options.json:
            print(f"{test} ...", file=sys.stderr)

    file, overrides = find_vehicle(options.vehicle), arguments.overrides_of(options)
    if options.write:
        if overrides:
            raise ParameterError("writes into the vehicle file, so leave out --set and --overrides", key="--write")
        check_own(file)
        options.output = file
    result = identify(options.vehicle, overrides, progress)
    lines = [result.table()]
    if options.write:
        vehicle = f" --vehicle {options.vehicle}" if options.vehicle != "compact" else ""
        command = f"activesteer identify{vehicle} --write"
        write_identified(file, result, command, datetime.date.today().isoformat())
        lines.append(f"written to {file}")
    terminal.tell(options, result.to_json(), lines)


@command("linearise", "modes of the full car, and stability of its loops",
    arguments.CAR,
    arguments.option("--loop", ("driver", "controller"), "instead of the modes, stability of a loop"),
    arguments.controllers("with --loop ars and afs, with --loop driver also none"),
    arguments.driver(f"{DEFAULT_DRIVER}; with --loop driver"),
    arguments.option("--speed-kmh", "V,V",
        "speeds, separated by commas (default: 80; with --loop driver 60, 80 ... 140; with --loop controller 60, 80 "
        "... 160)", type=arguments.numbers, action="extend", dest="speeds_kmh"),
    arguments.option("--study", "STUDY",
        "with --loop controller: smallest margins over the samples of a study (file or name); controllers are "
        "designed for the car without the factors of the study"),
    arguments.WORKERS,
    arguments.output("DIR", "folder for a page and figures (default: none)"),
    arguments.JSON,
    description="Print the modes of the full car at a speed. With --loop driver, print crossover frequency, phase "
    "margin and damping of the loop of driver, controller and car, and the damping after a small step of the path, "
    "for the same loop and for a run. With --loop controller, print margins of the loop of controller, control unit, "
    "actuators, car and sensors, opened at the rear actuator and at the superposition; --set "
    "sensors.preset=production takes real sensors.",
)  # fmt: skip
def _linearise(options: argparse.Namespace) -> None:
    if options.loop is None:
        arguments.check_effect(options, "an effect with --loop driver or controller only", "controller")
    if options.loop != "driver":
        arguments.check_effect(options, "an effect with --loop driver only", "driver")
    if options.loop != "controller":
        arguments.check_effect(options, "an effect with --loop controller only", "study")
    if options.study is None:
        arguments.check_effect(options, "an effect with --study only", "jobs", "scheduler")
    if options.output is not None:
        make_folder(options.output, ParameterError)
    {None: _modes, "driver": _driver_loop, "controller": _controller_loop}[options.loop](options)


def _modes(options: argparse.Namespace) -> None:
    from activesteer.scenario import check_gains
    from activesteer.studies.linear.linearisation import eigenvalue_table, linear_car

    speeds_kmh = options.speeds_kmh or [80.0]
    if len(speeds_kmh) > 1:
        raise ParameterError("give one speed for the modes", key="--speed-kmh", value=speeds_kmh)
    overrides = arguments.overrides_of(options)
    check_gains(overrides, ())
    car = linear_car(options.vehicle, speeds_kmh[0] / 3.6, overrides)
    modes, figures = car.modes(), []
    label = f"{speeds_kmh[0]:g} km/h"
    if options.output is not None:
        from activesteer.pages import write_page
        from activesteer.plotting import draw, save
        from activesteer.studies.linear.linearisation import bode_picture, modes_page, root_locus_picture

        speeds = [speed / 3.6 for speed in _LOCUS_KMH]
        systems = [linear_car(options.vehicle, speed, overrides).state_space() for speed in speeds]
        of = f"{options.vehicle} at {label}: answer to the steering wheel angle"
        pictures = {"bode": bode_picture(of, car.state_space()), "root_locus": root_locus_picture(systems, speeds)}
        page = modes_page(f"{options.vehicle} at {label}", modes, *pictures.values())
        figures = [
            *(save(draw(picture), options.output / f"{name}.png") for name, picture in pictures.items()),
            write_page(page, options.output / "modes.html"),
        ]
    values = {
        "speed_mps": car.speed_mps,
        "modes": [mode.to_json() for mode in modes],
        "figures": list(map(str, figures)),
    }
    terminal.tell(options, values, [f"{options.vehicle} at {label}", eigenvalue_table(modes)], figures)


def _driver_loop(options: argparse.Namespace) -> None:
    from activesteer.studies.linear.driver_loop import SPEEDS_KMH, driver_loops

    driver = options.driver or DEFAULT_DRIVER
    loops = driver_loops(
        driver,
        options.vehicle,
        options.controller or ("none", "ars", "afs"),
        options.speeds_kmh or SPEEDS_KMH,
        arguments.overrides_of(options),
    )
    rows = [loop.to_json() for loop in loops]
    title, figures = f"{driver} in {options.vehicle}", []
    if options.output is not None:
        from activesteer.pages import write_page
        from activesteer.plotting import draw, save
        from activesteer.studies.linear.driver_loop import driver_loops_picture, driver_page

        picture = driver_loops_picture(loops, rows)
        page = driver_page(title, rows, picture)
        figures = [save(draw(picture), options.output / "driver.png"), write_page(page, options.output / "driver.html")]
    terminal.tell(options, rows, [title, *terminal.table_lines(rows, _DRIVER_COLUMNS)], figures)


def _controller_loop(options: argparse.Namespace) -> None:
    from activesteer.pages import write_page
    from activesteer.studies.linear.margins import SPEEDS_KMH, loop_margins, margins_page, worst_margins

    speeds_kmh, overrides = options.speeds_kmh or SPEEDS_KMH, arguments.overrides_of(options)
    loops = options.controller or ("ars", "afs"), options.vehicle, speeds_kmh, overrides
    if options.study is None:
        found = loop_margins(*loops)
    else:
        with terminal.Progress("margins", quiet=options.json) as progress:
            workers = {"jobs": options.jobs, "scheduler": options.scheduler}
            found = worst_margins(options.study, *loops, progress.count, **workers)
    rows = [margins.to_json() for margins in found]
    if not rows:
        raise ParameterError("none of these controllers uses a measurement, so there is no loop", key="-c")
    shown = [
        {key: each.margins.absent if isinstance(value, float) and math.isnan(value) else value
         for key, value in row.items()}
        for each, row in zip(found, rows, strict=True)
    ]  # fmt: skip
    lines = [*terminal.table_lines(shown, _CONTROLLER_COLUMNS)]
    if options.study:
        least = min(rows, key=lambda row: row["disk_margin"])
        words = {key: value if isinstance(value, str) else f"{value:.3g}" for key, value in least["factors"].items()}
        changed = ", ".join(f"{key} = {value}" for key, value in words.items())
        where = f"{least['controller']}, {least['loop']}, {least['speed_kmh']:.0f} km/h"
        lines.append(f"smallest disk margin {least['disk_margin']:.3g}: {where}, with {changed}")
    pages = []
    if options.output is not None:
        pages = [write_page(margins_page(found, str(options.vehicle)), options.output / "margins.html")]
    terminal.tell(options, rows, lines, pages, "page")
