"""Targets of a playback: a file, the viewer's window, or a browser."""

from __future__ import annotations

import importlib.util
import os
import re
import socket
import subprocess
import tempfile
import urllib.parse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from activesteer.errors import PlaybackError
from activesteer.files import atomic_write, shown_path
from activesteer.playback.layout import blueprint
from activesteer.playback.runs import Run
from activesteer.playback.showing import Showing
from activesteer.playback.stream import fill, new_stream

_ELSEWHERE: Final = "--web shows it in a browser, --save out.rrd writes a file for a viewer elsewhere"
_HOST: Final = "127.0.0.1"
"""Address of the web server: reachable from this machine alone."""
_PLAIN: Final = Showing()
_FOOTER: Final = b"RRF2FOOT"
_FOOTER_BYTES: Final = 64
"""A complete file has this word among its last bytes."""


def save(runs: Sequence[Run], path: Path, how: Showing = _PLAIN) -> None:
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


def show(runs: Sequence[Run], how: Showing = _PLAIN) -> None:
    """Open the viewer's window and return when it is closed.

    Args:
        runs: The runs.
        how: Display options.

    Raises:
        PlaybackError: there is no viewer, or it fails, as it does without a display.
    """
    _run_viewer(["--port", "auto"], runs, how)


def serve(
    runs: Sequence[Run],
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
    runs: Sequence[Run],
    how: Showing,
    *,
    ready: Callable[[], object] | None = None,
    port: int | None = None,
) -> None:
    """Run the viewer on a temporary file; call `ready` once the viewer answers at the port."""
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
    """Return the viewer that rerun-sdk installs; the command `rerun` may be another version or not be on the path.

    Raises:
        PlaybackError: the viewer is missing.
    """
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
    """Return the last error message of a viewer, without colour codes."""
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
