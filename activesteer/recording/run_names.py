"""Names of runs that are shown together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from activesteer.recording.recording import Recording


def run_names(sources: Sequence[str | Path], recordings: Iterable[Recording]) -> list[str]:
    """Return a name for each run: its controller if all differ, else its file, with the folder if needed."""
    # A user's controller is named by file and class; the class is enough.
    controllers = [
        str(run.metadata.get("controller", "run")).rpartition(":")[2]
        + ("+truth" if run.metadata.get("controller_uses_truth") else "")
        for run in recordings
    ]
    if len(set(controllers)) == len(controllers):
        return controllers
    paths = [str(source).removesuffix(".mcap") for source in sources]
    stems = Counter(Path(path).name for path in paths)
    return [Path(path).name if stems[Path(path).name] == 1 else path for path in paths]
