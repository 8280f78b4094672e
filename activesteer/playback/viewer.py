"""Targets of a playback: a file, the viewer's window, or a browser."""

from __future__ import annotations

import importlib.util
import os
import re
import socket
import subprocess
import tempfile
import urllib.parse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import rerun as rr
import rerun.blueprint as rrb

from activesteer.core.files import atomic_write, shown_path
from activesteer.core.metric_table import recorded_metric
from activesteer.errors import PlaybackError
from activesteer.playback.car import send_car, send_ghost, send_links, send_tyre_forces
from activesteer.playback.course import send_course, send_road, send_track
from activesteer.playback.layout import LEGEND, LEGEND_OF_RUNS, SUMMARY, blueprint, send_events, send_legend
from activesteer.playback.plots import curves, pages, send_plots
from activesteer.playback.runs import ReplayedRun, Showing
from activesteer.playback.wheel_angles import send_wheel_angles


def new_stream(runs: Sequence[ReplayedRun], *, compare: bool) -> rr.RecordingStream:
    """Return a stream without a target, with an application id for its manoeuvre and runs."""
    # The viewer keeps one layout for each application id while it is open. Other runs need another layout.
    maneuver = runs[0].recording.metadata.get("maneuver", {})
    words = ["activesteer", str(maneuver.get("name", "")), *(run.name for run in runs), "compared" if compare else ""]
    # An application id may contain letters, digits, spaces, - and _ only.
    stream = rr.RecordingStream(re.sub(r"[^A-Za-z0-9_-]+", " ", " ".join(words)).strip())
    stream.send_recording_name(str(maneuver.get("title") or "activesteer"))
    return stream


def fill(stream: rr.RecordingStream, runs: Sequence[ReplayedRun], layout: rrb.Blueprint, how: Showing) -> None:
    """Send all data of the runs to a stream."""
    stream.send_blueprint(layout, make_active=True, make_default=True)
    several = len(runs) > 1
    stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    send_road(stream, runs)
    send_course(stream, runs)
    for run in runs:
        send_car(stream, run, cutaway=how.cutaway)
        send_links(stream, run)
        send_tyre_forces(stream, run, runs)
        send_wheel_angles(stream, run, runs)
        send_track(stream, run, runs.index(run))
        for other in runs:
            if other is not run:
                send_ghost(stream, run, other)
        send_plots(stream, run, alone=not several)
        for page, shown in pages(run).items():
            send_legend(stream, f"{LEGEND}/{run.name}/{page}", curves(shown, run, alone=not several))
        send_events(stream, run)
    if several:
        send_legend(stream, LEGEND_OF_RUNS, {run.label: run.colour for run in runs})
    text = rr.TextDocument(summary(runs, how.verdict), media_type=rr.MediaType.MARKDOWN)
    stream.log(SUMMARY, text, static=True)
    stream.flush()


def summary(runs: Sequence[ReplayedRun], verdict: Sequence[str] = ()) -> str:
    """Return a Markdown page with scenario, results, metrics side by side, and systems."""
    lines: list[str] = []
    for text in dict.fromkeys(_scenario(run.recording.metadata) for run in runs):
        lines += [f"**{text}**", ""]
    if verdict:
        lines += [*(f"- {_emphasised(line)}" for line in verdict), ""]
    names = list(dict.fromkeys(name for run in runs for name in run.recording.metrics))
    if names:
        lines += [f"| metric | {' | '.join(run.short for run in runs)} |", "|---" * (1 + len(runs)) + "|"]
    for name in names:
        metric = recorded_metric(name)
        found = [run.recording.metrics.get(name) for run in runs]
        values = ("" if value is None else metric.text(value) for value in found)
        lines.append(f"| {metric.label}{metric.unit_name and f' [{metric.unit_name}]'} | {' | '.join(values)} |")
    lines.append("")
    for run in runs:
        metadata = run.recording.metadata
        versions = metadata.get("versions", {})
        text = f"- **{run.label}**: controller {metadata.get('controller', '?')}, "
        text += f"vehicle {_named(metadata, 'vehicle', 'name')}, activesteer {versions.get('activesteer', '?')}"
        if metadata.get("overrides"):
            text += ", " + ", ".join(f"{key} = {value}" for key, value in metadata["overrides"].items())
        if not metadata.get("complete", True):
            text += f". **Incomplete**: {metadata.get('error', 'the run did not end properly')}"
        lines.append(text)
    return "\n".join(lines) + "\n"


def _emphasised(line: str) -> str:
    """Set the subject of a verdict in bold type."""
    about, colon, words = line.partition(":")
    return f"**{about}{colon}**{words}" if colon else line


def _scenario(metadata: Mapping[str, Any]) -> str:
    return _named(metadata, "maneuver", "title") or _named(metadata, "maneuver", "name") or "a run"


def _named(metadata: Mapping[str, Any], table: str, key: str) -> str:
    entry = metadata.get(table, {})
    return str(entry.get(key, "")) if isinstance(entry, Mapping) else ""


_ELSEWHERE: Final = "--web shows it in a browser, --save out.rrd writes a file for a viewer elsewhere"
_HOST: Final = "127.0.0.1"
"""Address of the web server: reachable only from this machine."""
_PLAIN: Final = Showing()
_FOOTER: Final = b"RRF2FOOT"
_FOOTER_BYTES: Final = 64
"""Word among the last bytes of a complete file."""


def save(runs: Sequence[ReplayedRun], path: Path, how: Showing = _PLAIN) -> None:
    """Write a .rrd file with its layout.

    Args:
        runs: The runs.
        path: The file; an existing one is replaced.
        how: Display options.

    Raises:
        PlaybackError: the name does not end in .rrd, or the file cannot be written.
    """
    if path.suffix.lower() != ".rrd":
        raise PlaybackError(f"{shown_path(path)}: the name of a file for the viewer must end in .rrd", value=path)
    with atomic_write(path, PlaybackError) as part:
        part.touch()
        stream = new_stream(runs, compare=how.compare)
        # The stream writes in a thread of its own, which only logs errors.
        stream.save(part)
        try:
            fill(stream, runs, blueprint(runs, compare=how.compare), how)
            stream.disconnect()
            with part.open("rb") as file:
                file.seek(-min(_FOOTER_BYTES, part.stat().st_size), os.SEEK_END)
                whole = _FOOTER in file.read()
        except RuntimeError:
            whole = False
        if not whole:
            raise PlaybackError(f"cannot write {shown_path(path)}: not all of it could be written; is the disk full?")


def show(runs: Sequence[ReplayedRun], how: Showing = _PLAIN) -> None:
    """Open the viewer's window and return when it is closed.

    Args:
        runs: The runs.
        how: Display options.

    Raises:
        PlaybackError: there is no viewer, or it fails, as it does without a display.
    """
    _run_viewer(["--port", "auto"], runs, how)


def serve(
    runs: Sequence[ReplayedRun],
    announce: Callable[[str], object],
    how: Showing = _PLAIN,
) -> None:
    """Serve the viewer to browsers of this machine until it is interrupted.

    Args:
        runs: The runs.
        announce: Called with the address to open as soon as the server answers.
        how: Display options.

    Raises:
        PlaybackError: there is no viewer, or it fails.
    """
    data, page = _free_port(), _free_port()
    proxy = urllib.parse.quote(f"rerun+http://{_HOST}:{data}/proxy", safe="")
    arguments = ["--serve-web", "--bind", _HOST, "--port", str(data), "--web-viewer-port", str(page)]
    url = f"http://{_HOST}:{page}/?url={proxy}"
    _run_viewer(arguments, runs, how, ready=lambda: announce(url), port=page)


def _run_viewer(
    arguments: Sequence[str],
    runs: Sequence[ReplayedRun],
    how: Showing,
    *,
    ready: Callable[[], object] | None = None,
    port: int | None = None,
) -> None:
    """Run the viewer on a temporary file, and call `ready` once it answers at the port."""
    binary = viewer_binary()
    with tempfile.TemporaryDirectory(prefix="activesteer-") as folder:
        file, log = Path(folder) / "runs.rrd", Path(folder) / "viewer.log"
        save(runs, file, how)
        try:
            with log.open("w") as output:
                process = subprocess.Popen([str(binary), *arguments, str(file)], stdout=output, stderr=output)
        except OSError as error:
            raise PlaybackError(
                f"the viewer {binary} does not start: {error.strerror or error}; {_ELSEWHERE}", value=binary
            ) from error
        try:
            while ready is not None and port is not None and process.poll() is None:
                if _answers(port):
                    ready()
                    break
            status = process.wait()
        finally:
            if process.poll() is None:
                process.terminate()
                process.wait()
        if status != 0:
            reason = f"signal {-status}" if status < 0 else _reason(log.read_text(errors="replace"))
            raise PlaybackError(f"the viewer failed: {reason}; {_ELSEWHERE}")


def viewer_binary() -> Path:
    """Return the viewer of the package rerun-sdk, regardless of any command `rerun` on the path."""
    spec = importlib.util.find_spec("rerun_cli")
    if spec is not None and spec.origin is not None:
        binary = Path(spec.origin).with_name("rerun.exe" if os.name == "nt" else "rerun")
        if binary.is_file():
            return binary
    raise PlaybackError(
        f"the rerun viewer is missing; reinstall the package rerun-sdk, which contains it, or use --save; {_ELSEWHERE}",
        value="rerun-sdk",
    )


def _reason(log: str) -> str:
    """Return the last error message of a viewer without colour codes."""
    lines = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", log).splitlines() if line.strip()]
    if any("DISPLAY is set" in line or "connection to X server" in line for line in lines):
        return "there is no display"
    reported = [line for line in lines if "error" in line.lower() or "panic" in line.lower()] or lines
    return reported[-1] if reported else "it printed no message"


def _free_port() -> int:
    with socket.socket() as free:
        free.bind((_HOST, 0))
        return free.getsockname()[1]


def _answers(port: int) -> bool:
    try:
        with socket.create_connection((_HOST, port), timeout=0.2):
            return True
    except OSError:
        return False
