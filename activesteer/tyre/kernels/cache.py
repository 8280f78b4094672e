"""Keeps the compiled kernels on disk honest.

numba stores a compiled function beside its source and compiles again when that one file changes; it does not notice a
change in a file whose functions or constants were compiled in. The kernels of this package call each other across
files and share the parameter indices, so the stored code is dropped when any of the sources is newer.
"""

from __future__ import annotations

import contextlib
from pathlib import Path


def drop_stale_kernels(folder: Path) -> int:
    """Remove the stored kernels of a package folder that are older than its newest source.

    Args:
        folder: Folder of the package's sources.

    Returns:
        How many index files were removed. Where the folder cannot be written, nothing happens: nobody edits it then.
    """
    newest = max((source.stat().st_mtime_ns for source in folder.rglob("*.py")), default=0)
    removed = 0
    for index in folder.rglob("__pycache__/*.nbi"):
        with contextlib.suppress(OSError):
            if index.stat().st_mtime_ns < newest:
                index.unlink()
                removed += 1
    return removed
