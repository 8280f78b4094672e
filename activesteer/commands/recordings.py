"""Commands on recordings: `info`, `report`, `compare`, `replay`, `video`, `import`."""

from __future__ import annotations

import argparse
import math
import os
import re
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from activesteer.commands import arguments, terminal
from activesteer.core.files import atomic_write, shown_path
from activesteer.errors import ParameterError, PlaybackError, RecordingError, shown

if TYPE_CHECKING:
    from activesteer.recording import Recording

command: Final = arguments.Group("recordings")
_CUTAWAY: Final = arguments.flag("--cutaway", "show the suspension through the body")
_CORNERS: Final = ("fl", "fr", "rl", "rr")
"""Names of the corners, as in `core.conventions`, which takes too long to import for `--help`."""


@command("info", "print the contents of a recording, or repair it",
    arguments.RECORDING,
    arguments.option("--recover", "OUT.mcap",
        "instead, write the readable part of a damaged or cut recording to a new file, which stays marked as "
        "incomplete", type=Path),
    arguments.JSON,
)  # fmt: skip
def _info(options: argparse.Namespace) -> None:
    from activesteer.analysis.harm import failures, kept
    from activesteer.analysis.path_following import judged_metrics
    from activesteer.analysis.tables import comparison
    from activesteer.config.faults import faults_text
    from activesteer.recording import Recording
    from activesteer.recording.contents import events_of

    recording = Recording.open(options.file, recover=True)
    metadata, time_s = recording.metadata, recording.time_s
    if options.recover is not None:
        arguments.check_effect(options, "no effect with --recover", "json")
        if options.recover.exists() and options.recover.samefile(options.file):
            raise ParameterError(f"--recover {options.recover} is the input file; choose another name")
        recording.save(options.recover)
        none = f"metadata and attachments only; no rows can be read in {shown_path(options.file)}"
        span = f"{len(time_s)} steps up to {time_s[-1]:.3f} s" if len(time_s) else none
        print(f"{options.recover}: {span}")
        return
    if options.json:
        channels = {each.name: {"unit": each.unit, "meaning": each.meaning} for each in recording.channels}
        span = {"from_s": float(time_s[0]), "to_s": float(time_s[-1])} if len(time_s) else {}
        terminal.print_json(
            {"steps": len(time_s), **span, "metadata": metadata, "metrics": recording.metrics, "channels": channels}
        )
        return
    span = f"{time_s[0]:.3f} to {time_s[-1]:.3f} s, {len(time_s)} steps" if len(time_s) else "no steps"
    print(f"{shown_path(options.file)}: {span}")
    for key in ("maneuver", "vehicle"):
        table = metadata.get(key, {})
        print(terminal.entry(f"{key}: ", f"{table.get('name', '?')} {table.get('title', '')}"))
    uses_truth = ", which uses the truth" if metadata.get("controller_uses_truth") else ""
    print(terminal.entry("controller: ", f"{metadata.get('controller', '?')}{uses_truth}"))
    sensors = metadata.get("vehicle", {}).get("sensors", {})
    if "seed" in sensors or sensors.get("preset", "ideal") != "ideal":
        print(terminal.entry("sensors: ", f"{sensors.get('preset', '?')}, seed {sensors.get('seed', 'none')}"))
    print(terminal.entry("driver: ", _driver(metadata.get("driver", "?"))))
    for key in ("overrides", "versions"):
        if metadata.get(key):
            said = (
                f"{name} {faults_text(value) if name == 'fault' else value}" for name, value in metadata[key].items()
            )
            print(terminal.entry(f"{key}: ", ", ".join(said)))
    for event in events_of(metadata):
        print(terminal.entry(f"at {event.time_s:.3f} s: ", f"{event.kind} {event.what}"))
    if not metadata.get("complete", True):
        print(terminal.entry("INCOMPLETE: ", str(metadata.get("error", "the run did not end properly"))))
    if result := [*failures(recording), *kept(judged_metrics(recording))]:
        print(terminal.entry("result: ", ", ".join(result)))
    if recording.metrics:
        print(comparison({"metrics": recording.metrics}))
    print("channels:")
    width = max((len(channel.name) for channel in recording.channels), default=0)
    for channel in recording.channels:
        head = f"  {channel.name:{width}} {channel.unit or '-':6} "
        print(terminal.entry(head, channel.meaning, len(head)))
    print(terminal.entry("attachments: ", ", ".join(recording.attachments)))


def _driver(recorded: Any) -> str:
    """Return the name and the parameters of the driver. Recordings of earlier versions hold only the name."""
    if not isinstance(recorded, dict):
        return str(recorded)
    numbers = recorded.get("parameters", recorded)
    words = (
        f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {shown(value)}"
        for key, value in numbers.items()
        if key not in ("name", "title")
    )
    said = ", ".join(words)
    return f"{recorded.get('name', '?')} {recorded.get('title', '')}".rstrip() + (f" ({said})" if said else "")


@command("report", "compare recordings on one HTML page",
    arguments.RECORDINGS,
    arguments.output("FILE.html", "the page; replaces an existing one", "report.html"),
    description="Write a page that needs no network: scorecard, plots, track, metrics, parameters, versions.",
)  # fmt: skip
def _report(options: argparse.Namespace) -> None:
    from activesteer.analysis.report import open_all, write_report

    _check_page(options.output)
    print(f"report: {write_report(open_all(options.files), options.output)}")


def _check_page(file: Path) -> None:
    if file.suffix.lower() not in {".html", ".htm"}:
        raise ParameterError(f"-o {file}: the name of a page ends in .html")


@command("compare", "compare measured runs with a simulated one",
    arguments.option("files", "FILE.mcap",
        "recordings: measured ones, whose mean is compared, and the simulated one last; or a folder with a "
        "validation.toml, or bmw_m8 or tesla_model_s", nargs="*", type=Path),
    arguments.option("--new", "FOLDER",
        "make a folder with an example, to be replaced by your measured runs", type=Path),
    arguments.option("--standard", ("iso19364", "iso19365"),
        "iso19364: cross plots versus lateral acceleration, for steady-state driving; iso19365: over time (default)"),
    arguments.option("--filter", ("iso15037", "fmvss126", "none"),
        "zero-phase Butterworth filter of both sides: iso15037 (8 poles, 10.1 Hz; default), fmvss126 (12 poles, 6 Hz, "
        "steering wheel 10 Hz), or none"),
    arguments.option("--noise", ("estimate", "none"),
        "widen the corridor by the noise of the measurement, estimated from it (default), or not"),
    arguments.output("FILE.html", "the page (default: no page)"),
    arguments.option("--samples", "N",
        "with a measured circle: number of samples of the values that vary from lap to lap (default: 200)",
        type=int),
    arguments.WORKERS, arguments.JSON,
    description="Find the time shift, and print the share of the measurement inside the tolerance corridor of the "
    "simulation. With a folder of measured runs, or of a measured circle, predict the measurement first. The exit "
    "status is 1 if a quantity is outside.",
)  # fmt: skip
def _compare(options: argparse.Namespace) -> bool:
    if options.new is not None:
        from activesteer.measured.folder_file import write_template

        if options.files:
            raise ParameterError("makes a new folder and compares nothing; leave the files out", key="--new")
        for file in write_template(options.new):
            print(file)
        print(f"next: activesteer fit {options.new} -o {options.new}/page; then replace the lines marked with <-")
        return False
    if options.output is not None:
        _check_page(options.output)
    if len(options.files) == 1 and options.files[0].suffix != ".mcap":
        from activesteer.commands.studying import judge

        arguments.check_effect(options, "no effect with a folder", "standard", "filter", "noise")
        return judge(str(options.files[0]), options, page=options.output)
    from activesteer.measured.comparison import assumptions, compare
    from activesteer.measured.pages import comparison_page
    from activesteer.pages import write_page
    from activesteer.recording import Recording

    arguments.check_effect(options, "no effect with recordings", "samples", "jobs", "scheduler")
    if len(options.files) < 2:
        raise ParameterError("at least two recordings are needed: measured ones, and the simulated one last")
    *measured, simulated = (Recording.open(file, recover=True) for file in options.files)
    terminal.print_notes(_other_maneuvers(options.files, measured, simulated))
    found = compare(
        measured, simulated, options.standard or "iso19365", filtered=options.filter or "iso15037",
        noise=options.noise != "none",
    )  # fmt: skip
    names = [file.stem for file in options.files]
    page = comparison_page(found, names[:-1], names[-1])
    written = [] if options.output is None else [write_page(page, options.output)]
    shifts = []
    for name, shift_s in zip(names[:-1], found.shifts_s, strict=True):
        later = "unknown (nothing moves)" if math.isnan(shift_s) else f"{1e3 * shift_s:+z.1f} ms"
        shifts.append(f"time shift of {name}: {later}")
    terminal.tell(options, found.to_json(), (*page.lines(), *shifts, *assumptions(found)), written, "page")
    return not found.inside


def _other_maneuvers(files: Sequence[Path], measured: Sequence[Recording], simulated: Recording) -> Iterator[str]:
    """Yield a note on each run of another manoeuvre. An import has none, and that of a recording has its name."""
    last = simulated.metadata.get("maneuver", {}).get("name")
    for file, run in zip(files, measured, strict=False):
        name = run.metadata.get("maneuver", {}).get("name")
        if "measured" not in run.metadata and last not in (name, file.stem):
            yield f"different manoeuvres: {file} is {name}, {files[-1]} is {last}"


def _named(files: Sequence[Path]) -> dict[str, Recording]:
    """Open recordings, and give each run a name."""
    from activesteer.analysis.report import open_all
    from activesteer.recording.recording import run_names

    opened = list(open_all(files).values())
    return dict(zip(run_names(files, opened), opened, strict=True))


@command("replay", "show recordings in 3D, with signals and metrics",
    arguments.RECORDINGS,
    arguments.option("-o --output --save", "OUT.rrd",
        "write a file for the viewer instead of opening a window", type=Path),
    arguments.flag("--web", "serve a page for a browser until Ctrl-C"),
    arguments.flag("--compare", "show only the page that compares several files side by side"),
    _CUTAWAY,
    description="Open recordings in the rerun viewer, several in one window.",
)  # fmt: skip
def _replay(options: argparse.Namespace) -> None:
    # Threads of rerun would repeat our messages on the terminal.
    os.environ.setdefault("RUST_LOG", "warn,re_log_encoding=off,re_sdk=off")
    try:
        from activesteer.playback import Showing, runs_of, save, serve, show
    except ImportError as error:
        raise PlaybackError("replay needs the viewer rerun: pip install rerun-sdk") from error
    from activesteer.analysis.report.groups import verdict

    if options.compare and len(options.files) < 2:
        raise ParameterError(f"--compare needs at least two files; only {options.files[0]} is given")
    named = _named(options.files)
    runs, how = runs_of(named), Showing(options.compare, options.cutaway, tuple(verdict(named)))
    if options.output is not None:
        save(runs, options.output, how)
        print(f"{options.output}: open it with `rerun {options.output}`", file=sys.stderr)
    if options.web:
        serve(runs, _announce, how)
    elif options.output is None:
        show(runs, how)


def _announce(url: str) -> None:
    import webbrowser

    print(url, flush=True)
    print("Ctrl-C ends the server", file=sys.stderr, flush=True)
    webbrowser.open(url)


def _size(text: str) -> tuple[int, int]:
    """Parse the size of a film, such as `1280x720`."""
    found = re.fullmatch(r"(\d{1,6})[x*](\d{1,6})", text.strip().lower())
    if found is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 1280x720")
    return int(found[1]), int(found[2])


@command("video", "make a film of a recording",
    arguments.RECORDING,
    arguments.output("OUT.mp4", "the film (default: FILE.mp4 next to the recording)"),
    arguments.option("--camera", ("chase", "top", "wheel"), "camera position", "chase"),
    arguments.option("--corner", _CORNERS, "wheel for the camera `wheel` (default: fl)"),
    arguments.option("--compare", "OTHER.mcap",
        "also show the car of another recording; may be repeated", many=True, type=Path),
    arguments.option("--layout", ("overlay", "side-by-side"),
        "transparent cars in one view, or one view for each car",
        "overlay"),
    arguments.option("--gauges", ("full", "sideslip"), "all gauges, or one large sideslip angle for each car", "full"),
    arguments.option("--size", "WxH", "pixels", "1280x720", type=_size),
    arguments.option("--fps", "FPS", "frames per second", 30.0),
    arguments.option("--speed", "FACTOR", "pace: 0.25 is slow motion, 4 is fast", 1.0),
    _CUTAWAY,
    description="Draw a recording without a window, and write an MP4.",
)  # fmt: skip
def _video(options: argparse.Namespace) -> None:
    from activesteer.video import Settings, make_film

    if options.corner and options.camera != "wheel":
        raise ParameterError("has an effect only with --camera wheel", key="--corner", value=options.corner)
    if options.layout == "side-by-side" and not options.compare:
        raise ParameterError("--layout side-by-side needs --compare OTHER.mcap")
    named = _named([options.file, *(options.compare or ())])
    output = options.output or options.file.with_suffix(".mp4")
    settings = Settings(
        options.camera,
        options.corner or _CORNERS[0],
        options.size,
        options.fps,
        options.speed,
        options.layout,
        gauges=options.gauges,
        cutaway=options.cutaway,
    )
    started = time.monotonic()
    with terminal.Progress(f"{output}", quiet=False) as progress:
        frames = make_film(named, output, settings, progress)
    took = time.monotonic() - started
    print(
        f"{output}: {frames} frames, {frames / options.fps:.1f} s at {options.fps:g} fps, made in {took:.1f} s",
        file=sys.stderr,
    )


@command("import", "convert measured data to a recording",
    arguments.option("files", "FILE",
        "a .csv, .txt, .mat, .parquet or .mf4 file, or several of one run, each with its own times", nargs="+",
        type=Path),
    arguments.option("--map", "MAP.toml", "column and unit of each channel", type=Path),
    arguments.VEHICLE,
    arguments.output("OUT.mcap", "the recording (default: FILE.mcap)"),
    arguments.JSON,
    description="Read CSV, MAT, Parquet or MDF files of one run. Columns become channels in SI units with the signs "
    "of ISO 8855 on a uniform time. Without a map, columns are recognised by the names that exporters write.",
)  # fmt: skip
def _import(options: argparse.Namespace) -> None:
    from activesteer.measured.importing import import_file
    from activesteer.recording import check_target

    if options.output is not None and options.output.suffix != ".mcap":
        raise ParameterError(f"-o {options.output}: the name of a recording ends in .mcap")
    recording = import_file(options.files, options.map, options.vehicle)
    output = options.output or options.files[0].with_suffix(".mcap")
    measured = recording.metadata["measured"]
    check_target(output)
    with atomic_write(output, RecordingError) as part:
        try:
            recording.save(part)
        except RecordingError as error:
            raise RecordingError(error.problem.replace(str(part), str(output))) from error
    terminal.print_notes(measured["notes"])
    step_s = float(recording.time_s[1] - recording.time_s[0])
    about = {"rows": len(recording), "step_s": step_s, "channels": measured["columns"], "notes": measured["notes"]}
    head = f"{output}: {len(recording)} rows, {recording.time_s[0]:.3f} to {recording.time_s[-1]:.3f} s"
    columns = (f"  {name:24} {terminal.printable(column)}" for name, column in measured["columns"].items())
    terminal.tell(options, {"file": str(output), **about}, [head, *columns])
