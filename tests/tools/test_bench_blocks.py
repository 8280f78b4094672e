from __future__ import annotations

import pytest

from tools.bench_blocks import DrivenStop


@pytest.mark.slow
def test_the_stop_has_a_working_anti_lock_system():
    assert DrivenStop().anti_lock_fraction > 0.5
