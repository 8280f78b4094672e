"""An isolated FMU that returns invalid data is a fault."""

from __future__ import annotations

import struct

import pytest

from activesteer.core.child_process import ChildFault
from activesteer.coupling.fmu import instance as module
from activesteer.coupling.fmu.instance import FmuFault, Group, IsolatedInstance, Spec


class Answers:
    """A child process that gives one answer to every request after the first."""

    alive = True
    answer = b"0"

    def __init__(self, _file: str) -> None:
        pass

    def ask(self, _request: bytes, _doing: str, _limit_s: float, max_bytes: int) -> bytes:
        if len(self.answer) > max_bytes:
            raise ChildFault("answers too much")
        return self.answer

    def close(self) -> None:
        self.alive = False


@pytest.mark.parametrize(
    "answer", [b"", b"0", b"0" + bytes(15), b"0" + bytes(17), b"x" + bytes(16), b"0" + bytes(2**17)]
)
def test_a_step_needs_as_many_numbers_as_the_fmu_has_outputs(monkeypatch: pytest.MonkeyPatch, answer: bytes) -> None:
    monkeypatch.setattr(module, "Child", Answers)
    group = Group("Real", "d", [1, 2], 2)
    isolated = IsolatedInstance(Spec("", 2, "", "", 1e-3, [group], [group], [], ""), 1.0)
    monkeypatch.setattr(Answers, "answer", b"0" + struct.pack("=2d", 1.0, 2.0))
    assert isolated.step((0.0, 0.0)) == (1.0, 2.0)
    monkeypatch.setattr(Answers, "answer", answer)
    with pytest.raises(FmuFault, match=r"returns invalid data|answers too much"):
        isolated.step((0.0, 0.0))


@pytest.mark.parametrize("answer", [b"0", b"0-1", b"0x", b"0" + b"9" * 30])
def test_a_saved_state_has_a_number(monkeypatch: pytest.MonkeyPatch, answer: bytes) -> None:
    monkeypatch.setattr(module, "Child", Answers)
    isolated = IsolatedInstance(Spec("", 2, "", "", 1e-3, [], [], [], ""), 1.0)
    monkeypatch.setattr(Answers, "answer", b"07")
    assert isolated.save() == 7
    monkeypatch.setattr(Answers, "answer", answer)
    with pytest.raises(FmuFault, match="returns invalid data"):
        isolated.save()
