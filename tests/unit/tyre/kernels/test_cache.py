from __future__ import annotations

import os
from pathlib import Path

from activesteer.tyre.kernels.cache import drop_stale_kernels


def test_only_kernels_older_than_the_newest_source_are_dropped(tmp_path: Path) -> None:
    cache = tmp_path / "__pycache__"
    cache.mkdir()
    for name, seconds in (("a.py", 100), ("b.py", 200), ("__pycache__/a.nbi", 150), ("__pycache__/b.nbi", 250)):
        (tmp_path / name).write_text("")
        os.utime(tmp_path / name, (seconds, seconds))
    assert drop_stale_kernels(tmp_path) == 1
    assert [path.name for path in cache.iterdir()] == ["b.nbi"]


def test_a_folder_without_kernels_is_left_alone(tmp_path: Path) -> None:
    assert drop_stale_kernels(tmp_path) == 0
