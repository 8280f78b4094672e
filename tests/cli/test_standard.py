"""`activesteer test`: the printed results."""

from __future__ import annotations

import pytest


@pytest.mark.slow
def test_results_are_aligned_with_the_longest_controller_name(call, tmp_path):
    code = "class Nothing:\n    def step(self, command, measurement):\n        return ActuatorCommand()\n"
    (tmp_path / "my_idle.py").write_text(f"from activesteer import ActuatorCommand\n\n\n{code}")
    told = call("test", "iso21994", "-c", "none", "-c", "my_idle.py:Nothing", "--jobs", "1")
    assert told.status == 0
    first, second = (line for line in told.out.splitlines() if "from 100 km/h" in line)
    assert first.startswith("none ")
    assert second.startswith("my_idle.py:Nothing ")
    column = first.index(first.split()[1])
    assert second.index(second.split()[1]) == column
    following = told.out.splitlines()[2]
    assert len(following) - len(following.lstrip()) == column
