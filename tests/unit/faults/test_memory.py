"""The numbers that a late signal waits in."""

from __future__ import annotations

from activesteer.vehicle.native_faults import keep, memory_of, oldest


def test_a_memory_keeps_the_newest_numbers_and_gives_the_oldest_of_them() -> None:
    """With room for three: before it is full the first number, then that of three steps ago, round and round."""
    memory = memory_of(3)
    given = []
    for value in range(1, 9):
        keep(memory, 3, float(value))
        given.append(oldest(memory, 3))
    assert given == [1.0, 1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert sorted(memory[2:]) == [6.0, 7.0, 8.0]
