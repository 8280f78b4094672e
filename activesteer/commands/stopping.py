"""Ctrl-C and SIGTERM: a command ends within a second, says what is saved, and leaves no traceback.

The signal first raises KeyboardInterrupt in the command, so that files are closed and processes ended in order. Where
that takes too long, because native code runs or somebody swallowed the exception, a thread ends the process.

This module is imported before all others, and imports next to nothing, so that signals are watched for from the start.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
import time

TYPE_CHECKING = False
if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator
    from pathlib import Path
    from types import FrameType
    from typing import Final

_IN_ORDER_S: Final = 0.7
"""How long a command may take to end in order [s]."""
_CLOCK_STEP_NS: Final = 20_000_000
"""How far the time of a file may lag behind the clock [ns]: a tick of the kernel is 10 ms at most."""
_MAX_NAMED: Final = 3
_MCAP_END: Final = b"\x89MCAP0\r\n"


class StopSignals:
    """What was asked of this process by a signal, and how it ends then.

    Attributes:
        number: The signal that has come; None where none has.
        options: What the command was called with; its `output` is the file or folder that it writes, and
            `how_to_resume`, where it has one, is said behind what is saved.
        finished: Whether the command is done, and only the interpreter still has to end.
    """

    def __init__(self) -> None:
        """Before any signal has arrived."""
        self.number: int | None = None
        self.options: argparse.Namespace | None = None
        self.finished = False
        self._begun_ns = time.time_ns() - _CLOCK_STEP_NS
        self._watching = self._raised = False
        self._ending = threading.Lock()

    def watch(self) -> None:
        """Watches for signals from now on, until the process ends."""
        self._watching = True
        # Where processes are cut off, one of multiprocessing's own clears up behind them; that is no news to a user.
        sys.warnoptions.append("ignore:resource_tracker:UserWarning")
        read, write = os.pipe()
        os.set_blocking(write, False)
        # Python runs its handlers between its own instructions only; this byte is written at once, whatever runs.
        signal.set_wakeup_fd(write, warn_on_full_buffer=False)
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not signal.SIG_IGN:  # as under nohup
                signal.signal(number, self._interrupt)
        threading.Thread(target=self._end_in_time, args=(read,), daemon=True).start()
        # First in, last out: when all else has ended the status stands, and Python would take its handlers away.
        atexit.register(self._ignore)

    def _ignore(self) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)

    def _interrupt(self, number: int, _frame: FrameType | None) -> None:
        self.number = number
        if self._raised or self.finished:
            self.end()
        self._raised = True
        self._hush()
        raise KeyboardInterrupt

    def _hush(self) -> None:
        """From now on nobody prints a traceback: native code that is being imported or called back, a thread."""
        sys.unraisablehook = threading.excepthook = lambda _: None
        sys.excepthook = lambda *_: None

    def _end_in_time(self, signals: int) -> None:
        self.number = os.read(signals, 1)[0]
        self._hush()
        if "multiprocessing" in sys.modules:
            import multiprocessing

            for process in multiprocessing.active_children():
                process.terminate()
        time.sleep(_IN_ORDER_S)
        self.end(in_order=False)

    def end(self, *, in_order: bool = True) -> int:
        """Says what is saved, and ends the process where it is the program's own.

        Args:
            in_order: Whether the command has come to its end; else it is cut off.

        Returns:
            The exit status, 128 and the signal's number.
        """
        number = self.number or signal.SIGINT
        with self._ending:  # kept for good by the first: who comes second waits for the end
            if in_order and self._watching:
                try:
                    sys.stdout.flush()
                except Exception:
                    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            try:
                saved = self._saved(in_order=in_order)
            except Exception:
                saved = "what was saved cannot be told"
            name = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name
            line = f"activesteer: stopped by {name}; {saved}{getattr(self.options, 'how_to_resume', '')}"
            if "activesteer.files" in sys.modules:
                sys.modules["activesteer.files"].delete_passing()
            if not self._watching:
                print(line, file=sys.stderr)
                return 128 + number
            try:
                start = "" if in_order or not os.isatty(2) else "\n"  # a bar of progress may stand in the line
                os.write(2, f"{start}{line}\n".encode(errors="backslashreplace"))
            except OSError:
                pass
            os._exit(128 + number)

    def _saved(self, *, in_order: bool) -> str:
        """What the command has written, as it is on the disk now."""
        output: Path | None = getattr(self.options, "output", None)
        files = [path for path in _files(output) if path.stat().st_mtime_ns >= self._begun_ns]
        if not files:
            return "nothing was saved"
        parts = {path: _part(path, in_order=in_order) for path in files}
        words = [str(path) for path, part in parts.items() if not part]
        if len(words) > _MAX_NAMED:
            words = [f"{len(words)} files in {output}"]
        words += [f"{path} ({part})" for path, part in parts.items() if part]
        return f"saved: {', '.join(words)}"


def _files(output: Path | None) -> Iterator[Path]:
    """The file, or those of a folder and of the folders in it, without what is hidden."""
    if output is None or not output.exists():
        return
    if not output.is_dir():
        yield output
        return
    for path in sorted(output.iterdir()):
        if not path.name.startswith("."):
            yield from (file for file in ((path,) if not path.is_dir() else sorted(path.iterdir())) if file.is_file())


def _part(path: Path, *, in_order: bool) -> str:
    """How much of a run a recording holds; empty for all of it, and for other files."""
    if path.suffix != ".mcap":
        return ""
    with path.open("rb") as file:
        size = path.stat().st_size
        file.seek(max(0, size - len(_MCAP_END)))
        if file.read() != _MCAP_END or size == len(_MCAP_END):  # a file begins with the same bytes
            return "cut off"
        if not in_order:
            return ""
        from mcap.reader import make_reader

        file.seek(0)
        reader = make_reader(file)
        if all(record.metadata.get("complete") != "false" for record in reader.iter_metadata()):
            return ""
        summary = reader.get_summary()
        statistics = summary.statistics if summary is not None else None
        if statistics is None or statistics.message_count <= 1:  # what the car looks like is a message too
            return "without a step"
        return f"up to {1e-9 * statistics.message_end_time:.3f} s"
