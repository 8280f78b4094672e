"""End of a command within a second of Ctrl-C or SIGTERM, with one line about saved files.

The signal raises KeyboardInterrupt in the command, which closes files and ends worker processes. A thread ends the
process if that takes too long: native code may run, or user code may have caught the exception.

This module is imported first and imports little, so that signals are handled from the start.
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
    from pathlib import Path
    from types import FrameType
    from typing import Final

_IN_ORDER_S: Final = 0.7
"""Time for a command to end in order [s]."""
_CLOCK_STEP_NS: Final = 20_000_000
"""Largest lag of a file's time behind the clock [ns]: a tick of the kernel is at most 10 ms."""
_MAX_NAMED: Final = 3
_MCAP_END: Final = b"\x89MCAP0\r\n"


class StopSignals:
    """Handler of the signals that stop the program."""

    def __init__(self) -> None:
        self.number: int | None = None
        # `output` is the file or folder that the command writes; `saved`, if set, lists its own files in a shared
        # folder; `how_to_resume`, if set, follows the list of saved files.
        self.options: argparse.Namespace | None = None
        self.finished = False  # only the interpreter has to end
        self._begun_ns = time.time_ns() - _CLOCK_STEP_NS
        self._clock_ns = time.time_ns() - time.monotonic_ns()
        self._watching = self._raised = False
        self._ending = threading.Lock()

    def watch(self) -> None:
        """Handle signals until the process ends."""
        self._watching = True
        # After killed workers, a process of multiprocessing cleans up and warns; the warning means nothing to a user.
        sys.warnoptions.append("ignore:resource_tracker:UserWarning")
        read, write = os.pipe()
        os.set_blocking(write, False)
        # Python calls its handlers between its own instructions only; this byte is written at once.
        signal.set_wakeup_fd(write, warn_on_full_buffer=False)
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not signal.SIG_IGN:  # as under nohup
                signal.signal(number, self._interrupt)
        threading.Thread(target=self._end_in_time, args=(read,), daemon=True).start()
        # Registered first, so called last: the exit status is fixed then, and Python would remove its handlers.
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
        """Suppress tracebacks of threads, of imports and of callbacks from native code."""
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
        """Print which files are saved, and end the process if it belongs to the program."""
        number = self.number or signal.SIGINT
        with self._ending:  # never released by the first caller; a second one waits for the end
            if in_order and self._watching:
                try:
                    sys.stdout.flush()
                except Exception:
                    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            try:
                saved = self._saved(in_order=in_order)
            except Exception:
                saved = "the saved files are unknown"
            name = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name
            line = f"activesteer: stopped by {name}; {saved}{getattr(self.options, 'how_to_resume', '')}"
            if "activesteer.core.files" in sys.modules:
                sys.modules["activesteer.core.files"].delete_temporary_files()
            if not self._watching:
                print(line, file=sys.stderr)
                return 128 + number
            try:
                start = "" if in_order or not os.isatty(2) else "\n"  # after a progress bar in the same line
                os.write(2, f"{start}{line}\n".encode(errors="backslashreplace"))
            except OSError:
                pass
            os._exit(128 + number)

    def _saved(self, *, in_order: bool) -> str:
        """Return a message with the files that the command has written."""
        output: Path | None = getattr(self.options, "output", None)
        own: list[Path] | None = getattr(self.options, "saved", None)
        if own is None:
            # Where the clock was set back meanwhile, files written since have earlier times.
            set_back_ns = max(0, self._clock_ns - (time.time_ns() - time.monotonic_ns()))
            files = [path for path in _files(output) if path.stat().st_mtime_ns >= self._begun_ns - set_back_ns]
        else:
            files = [path for path in own if path.is_file()]
        if not files:
            return "nothing was saved"
        parts = {path: _part(path, in_order=in_order) for path in files}
        words = [str(path) for path, part in parts.items() if not part]
        if len(words) > _MAX_NAMED:
            words = [f"{len(words)} files in {output}"]
        words += [f"{path} ({part})" for path, part in parts.items() if part]
        return f"saved: {', '.join(words)}"


def _files(output: Path | None) -> list[Path]:
    """Return the file, or the visible files of a folder and of its subfolders."""
    if output is None or not output.is_dir():
        return [output] if output is not None and output.exists() else []
    return sorted(path for pattern in ("[!.]*", "[!.]*/[!.]*") for path in output.glob(pattern) if path.is_file())


def _part(path: Path, *, in_order: bool) -> str:
    """Describe the part of a run that a recording holds, empty for a complete run and for other files."""
    if path.suffix != ".mcap":
        return ""
    with path.open("rb") as file:
        size = path.stat().st_size
        file.seek(max(0, size - len(_MCAP_END)))
        if file.read() != _MCAP_END or size == len(_MCAP_END):  # a file starts with the same bytes
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
        if statistics is None or statistics.message_count <= 1:  # the scene is one message
            return "without a step"
        return f"up to {1e-9 * statistics.message_end_time:.3f} s"
