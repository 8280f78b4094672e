"""Commands that drive: `list`, `run`, `explore`."""

from __future__ import annotations

import argparse
import math
import sys
import webbrowser
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from activesteer.commands import arguments, terminal
from activesteer.core.files import make_folder
from activesteer.errors import ActiveSteerError, ParameterError, shown

if TYPE_CHECKING:
    from activesteer.plugins import Plugin
    from activesteer.scenario import Scenario

command: Final = arguments.Group("drive")
_WIDTH: Final = 25
"""Width of the column of names."""
_OTHER_FILES: Final = frozenset((".mp4", ".gif", ".rrd", ".csv", ".mat", ".parquet", ".json", ".html", ".png", ".pdf"))
"""Endings of files that other commands write. A folder whose name has such an ending is a mistake."""


@command("list", "list manoeuvres, controllers, drivers, cars, studies, standards", arguments.JSON)
def _list(options: argparse.Namespace) -> None:
    from activesteer import resources
    from activesteer.controllers import CONTROLLERS, read_variant
    from activesteer.standards.catalogue import STANDARDS

    controllers = {name: (made_from.__doc__ or "").splitlines()[0] for name, made_from in CONTROLLERS.items()}
    controllers |= {name: read_variant(name).title for name in resources.list_controller_variants()}
    found = {
        "manoeuvres": _titles(resources.list_maneuvers(), resources.find_maneuver),
        "controllers": controllers,
        "drivers": _titles(resources.list_drivers(), resources.find_driver_file),
        "vehicles": dict.fromkeys(resources.list_vehicles(), ""),
        "studies": _titles(resources.list_studies(), resources.find_study),
        "standards": {name: standard.title for name, standard in STANDARDS.items()},
    }
    if options.json:
        terminal.print_json(found)
        return
    found["controllers"]["my_file.py:MyController"] = "your own: step(self, command, measurement)"
    found["drivers"]["my_file.py:MyDriver"] = "your own: step(self, setpoint, measurement, motion)"
    for kind, titles in found.items():
        print(f"{kind}:")
        for name, title in titles.items():
            print(terminal.entry(f"  {name:{_WIDTH}} ", title, _WIDTH + 3))


def _titles(names: Iterable[str], find: Callable[[str], Path]) -> dict[str, str]:
    from activesteer.config import read_toml

    return {name: read_toml(find(name))[0].get("title", "") for name in names}


class _Failures(dict[str, str]):
    """Error messages, by the label of the failed controller."""

    @contextmanager
    def caught(self, label: str, *, alone: bool) -> Iterator[None]:
        """Report an error of a controller, and end the command if no other controller is left."""
        try:
            yield
        except ActiveSteerError as error:
            if alone:
                raise
            self[label] = str(error)
            print("\n".join([f"activesteer: {label}: {error}", *getattr(error, "__notes__", [])]), file=sys.stderr)


@command("run", "drive a manoeuvre and record it",
    arguments.option("maneuver", "MANEUVER",
        "a name from `activesteer list`, a TOML file, or a recording, whose inputs are driven again"),
    arguments.CAR, arguments.driver(),
    arguments.option("--fault", "PART:KIND[=SIZE]@START[-END]",
        "make an actuator or a sensor fail, such as rear:stuck@2.0 or yaw_rate_sensor:offset=2degps@1-3; replaces the "
        "faults of the manoeuvre", many=True, dest="faults"),
    arguments.controllers(),
    arguments.output("FILE_OR_DIR", "a file *.mcap, or a folder for MANEUVER-CONTROLLER.mcap (default: runs)"),
    arguments.flag("--replace", "replace recordings made with other settings"),
    arguments.flag("--all", "print all metrics, not only the key metrics of the manoeuvre"),
    arguments.option("--isolate", "SECONDS",
        "run each FMU in a separate process, where it may crash, or hang for this time (default: 5 s)",
        type=float, nargs="?", const=5.0),
    arguments.option("--realtime", "FACTOR", "pace the steps to the clock; 2 is twice as fast (default: 1)", type=float,
        nargs="?", const=1.0),
    arguments.option("--udp", "[HOST:]PORT", "take commands from another process, on this machine by default"),
    arguments.option("--udp-timeout", "SECONDS", "longest time without a command", 0.1),
    arguments.option("--udp-reaction", ("release", "hold", "stop"),
        "then use the run's own driver and controller, hold the last command, or end the run", "release"),
    arguments.flag("--plot", "also draw the runs: PNG and PDF"),
    arguments.flag("--watch",
        "instead, show one controller in a window of MuJoCo at the pace of --realtime, without a recording"),
    arguments.flag("--cutaway", "with --watch: show the suspension through the body"), arguments.JSON,
)  # fmt: skip
def _run(options: argparse.Namespace) -> bool:
    from activesteer.controllers import controller_spec
    from activesteer.core.conventions import DEFAULT_TIMESTEP_S
    from activesteer.coupling.fmu import isolated

    if options.watch:
        _watch(options)
        return False
    arguments.check_effect(options, "an effect with --watch only", "cutaway")
    options.output = options.output or Path("runs")
    names = options.controller or ["none"]
    if options.isolate is not None:
        options.driver, *names = (isolated(given, options.isolate) for given in (options.driver, *names))
    controllers = [controller_spec(name) for name in names]
    _check_names(options)
    # These compile native code at the first start. A wrong name is answered before.
    from activesteer.scenario import check_gains
    from activesteer.simulation.preparation import with_amplitude_found

    scenario, failures, alone = _scenario(options), _Failures(), len(controllers) == 1
    check_gains(scenario.overrides, controllers)
    # Check all controllers before the first run.
    for controller in controllers:
        with failures.caught(controller.label, alone=alone):
            controller.make(scenario.controller_setup(DEFAULT_TIMESTEP_S))
    paths = _output_paths(options.output, scenario.maneuver.name, controllers)
    driving = list(zip(controllers, paths, strict=True))
    scenario = with_amplitude_found(scenario)
    if not options.replace:
        for controller, path in driving:
            _check_settings(path, scenario, controller)
    recordings = {}
    for controller, path in driving:
        if (label := controller.label) not in failures:
            with failures.caught(label, alone=alone):
                recordings[label] = _driven(scenario, controller, path, options)
    if options.json:
        runs = [
            {"controller": controller.name, "file": str(path) if path.is_file() else None}
            | ({"metrics": recordings[label].metrics} if (label := controller.label) in recordings else {})
            | ({"error": failures[label]} if label in failures else {})
            for controller, path in driving
        ]
        terminal.print_json({"maneuver": scenario.maneuver.name, "vehicle": scenario.car.name, "runs": runs})
    elif any(recording.metrics for recording in recordings.values()):
        _print_table(recordings, every=options.all)
    figures = _plot(recordings, paths[0].parent, scenario) if options.plot and recordings else ()
    for figure in figures:
        if not options.json:
            print(f"figure: {figure}")
    return bool(failures)


def _check_names(options: argparse.Namespace) -> None:
    """Check the names of manoeuvre and car. A file, which may be a recording, is checked when it is read."""
    from activesteer.resources import find_maneuver, find_vehicle

    for find, name in ((find_maneuver, options.maneuver), (find_vehicle, options.vehicle)):
        if not Path(name).suffix:
            find(name)


def _scenario(options: argparse.Namespace) -> Scenario:
    from activesteer.scenario import resolve

    faults = {"fault": " ".join(options.faults)} if options.faults else {}
    overrides = arguments.overrides_of(options, faults)
    return resolve(options.maneuver, options.vehicle, overrides, options.driver, options.controller or ())


def _watch(options: argparse.Namespace) -> None:
    from activesteer.scenario import check_gains
    from activesteer.simulation.live_view import check_display, watch
    from activesteer.simulation.preparation import with_amplitude_found

    unused = ("output", "replace", "all", "isolate", "udp", "plot", "json")
    arguments.check_effect(options, "no effect with --watch: nothing is recorded", *unused)
    if len(options.controller or ["none"]) > 1:
        raise ParameterError("give one controller with --watch", key="-c", value=" ".join(options.controller))
    pace, controller = options.realtime or 1.0, (options.controller or ["none"])[0]
    if not 0.01 <= pace <= 100.0:
        raise ParameterError(f"--realtime: is {pace:g}, must be 0.01 to 100 with --watch")
    # Check the manoeuvre first, with or without a display.
    scenario = _scenario(options)
    check_gains(scenario.overrides, [controller])
    check_display()
    watch(with_amplitude_found(scenario), controller, pace, cutaway=options.cutaway)


def _driven(scenario: Any, controller: Plugin, path: Path, options: argparse.Namespace) -> Any:
    """Drive and record one controller, and return the recording."""
    from activesteer.coupling.udp import UdpLink, UdpPort
    from activesteer.recording.contents import events_of
    from activesteer.simulation.runner import run_scenario

    name, quiet = f"{scenario.maneuver.name} {controller.label}", options.json
    link = None
    if options.udp is not None:
        link = UdpLink(UdpPort.read(options.udp, options.udp_timeout, options.udp_reaction))
    with terminal.Progress(name, quiet=quiet) as progress:
        recording = run_scenario(
            scenario, controller, path=path, progress=progress, realtime=options.realtime or False, link=link
        )  # fmt: skip
    lines, metadata = [], recording.metadata
    if (paced := metadata.get("realtime")) is not None:
        late = ", ".join(f"{word} {1e3 * paced[f'jitter_{word}_s']:.3g} ms" for word in ("p50", "p99", "max"))
        missed = f"{paced['missed_deadlines']} of {paced['steps']} deadlines missed; steps begin late by {late}"
        lines.append(f"{missed}; {100.0 * paced['late_share']:.3g} % later than 0.2 ms")
    if (told := metadata.get("udp")) is not None:
        lines.append("UDP messages: " + ", ".join(f"{number} {word}" for word, number in told.items()))
    lines = [] if quiet else [*lines, str(path)]
    if problem := metadata.get("metrics_error"):
        lines.append(f"no metrics: {problem}")
    if not quiet:
        lines += [event.what for event in events_of(metadata) if event.kind == "note"]
    for line in lines:
        print(f"{name}: {line}", file=sys.stderr)
    return recording


def _print_table(recordings: Mapping[str, Any], *, every: bool) -> None:
    """Print the key metrics of all runs next to each other, or every metric."""
    from activesteer.analysis.metrics import KEY_METRICS, evaluated_kind
    from activesteer.analysis.tables import comparison

    metrics = {label: recording.metrics for label, recording in recordings.items()}
    known = {name for found in metrics.values() for name, value in found.items() if not math.isnan(value)}
    names = [name for name in KEY_METRICS[evaluated_kind(next(iter(recordings.values())))] if name in known]
    chosen = {run: {name: found[name] for name in names if name in found} for run, found in metrics.items()}
    print(comparison(metrics if every else chosen, partial(_paint, metrics)))
    _print_outcomes(recordings)
    total = len({name for found in metrics.values() for name in found})
    if not every and total > len(names):
        print(f"{len(names)} of {total} metrics; --all prints all")


def _paint(
    metrics: Mapping[str, Mapping[str, float]], run: str, name: str, value: float, first: float, text: str
) -> str:
    """Format a value: green if better than in the first run, red if worse, plain if a run lost control."""
    from activesteer.analysis.harm import is_controlled
    from activesteer.analysis.tables import Change, significance

    if not (is_controlled(metrics[run]) and is_controlled(next(iter(metrics.values())))):
        return text
    colour = {Change.BETTER: terminal.GOOD, Change.WORSE: terminal.BAD}.get(significance(name, value, first))
    return text if colour is None else terminal.painted(text, colour)


def _print_outcomes(recordings: Mapping[str, Any]) -> None:
    """Print for each run whether the car lost control or kept its lane."""
    from activesteer.analysis.harm import failures, kept

    for label, recording in recordings.items():
        for words, colour in ((failures(recording), terminal.BAD), (kept(recording.metrics), terminal.GOOD)):
            if text := ", ".join(words):
                print(f"{label}: {terminal.painted(text, colour)}")


def _output_paths(output: Path, maneuver: str, controllers: Sequence[Plugin]) -> list[Path]:
    from activesteer.recording import check_target

    labels, names = zip(*((controller.label, controller.name) for controller in controllers), strict=True)
    if len(set(labels)) != len(labels):
        raise ParameterError(f"-c {' -c '.join(names)}: controller names must be unique; two have the same name")
    if output.suffix == ".mcap":
        if len(controllers) > 1:
            raise ParameterError(f"-o {output}: {len(controllers)} controllers need a folder, not one file")
        folder, paths = output.parent, [output]
    elif output.suffix in _OTHER_FILES and not output.is_dir():
        raise ParameterError(f"-o {output}: a recording ends in .mcap; any other name is a folder", value=output)
    else:
        folder, paths = output, [output / f"{maneuver}-{label}.mcap" for label in labels]
    make_folder(folder, ParameterError)
    for path in paths:
        check_target(path)
    return paths


def _check_settings(path: Path, scenario: Any, controller: Plugin) -> None:
    """Reject the replacement of a recording that was made with other settings."""
    from activesteer.config import leaves
    from activesteer.errors import RecordingError
    from activesteer.recording import Recording
    from activesteer.scenario import describe

    if not path.is_file():
        return
    try:
        before = leaves(Recording.open(path, recover=True).metadata)
    except RecordingError:  # there is no recording
        return
    own = {"controller": controller.name, "controller_parameters": controller.parameters_with(scenario.user_parameters)}
    now = leaves({key: value for key, value in (describe(scenario) | own).items() if key != "overrides"})
    as_stored = {key: list(value) if isinstance(value, tuple) else value for key, value in now.items()}
    other = sorted(key for key, value in as_stored.items() if before.get(key, value) != value)
    if other:
        some = ", ".join(f"{'.'.join(key)} {shown(before[key])}" for key in other[:3])
        some += " ..." if len(other) > 3 else ""
        raise ParameterError(
            f"{path} was made with other settings ({some}); --replace replaces it, or choose another -o"
        )


def _plot(recordings: Mapping[str, Any], folder: Path, scenario: Any) -> list[Path]:
    """Draw all runs in one figure. For a step steer, also draw the car without control and its linear models."""
    from activesteer.analysis.figures import figure_2, figure_for
    from activesteer.studies.reproduction import models_beside

    name, kind = scenario.maneuver.name, scenario.maneuver.kind
    figures = [figure_for(kind)(recordings, folder / f"{name}{ending}") for ending in (".png", ".pdf")]
    if kind == "step_steer" and (run := recordings.get("none")):
        models = models_beside(run)
        figures += [figure_2(run, folder / f"{name}-models{ending}", models) for ending in (".png", ".pdf")]
    return figures


@command("explore", "change a run with sliders, or drive by hand, in a local page",
    arguments.option("--port", "N", "port on 127.0.0.1 (default: a free one)", type=int),
    arguments.flag("--no-browser", "print the address and open no browser"),
    arguments.output("DIR", "folder of your own controllers and manoeuvres, and of saved recordings", "."),
    arguments.JSON,
    description="Open a page in the browser that only this computer can reach; Ctrl-C ends it.",
)  # fmt: skip
def _explore(options: argparse.Namespace) -> None:
    port = options.port or 0
    if not 0 <= port <= 65535:
        raise ParameterError(f"--port: is {port}, must be 0 to 65535")
    folder = make_folder(options.output, ParameterError)
    try:
        from activesteer.explore.server import ExploreServer
    except ModuleNotFoundError as error:
        raise ParameterError(
            f"explore needs {error.name}, which is not installed: pip install 'activesteer[explore]'"
        ) from error
    server = ExploreServer(folder, port)
    options.saved = server.saved  # other programs may write into the same folder

    def listening() -> None:
        if options.json:
            terminal.print_json({"url": server.url, "port": server.port}, one_line=True)
        else:
            print(server.url, flush=True)
            print("Ctrl-C ends the page", file=sys.stderr)
        if not (options.no_browser or options.json):
            webbrowser.open(server.url)

    server.serve(listening)
