"""Content of an error, and the length of its single line."""

from __future__ import annotations

import pickle

import pytest

from activesteer.errors import MAX_SHOWN, ManeuverError, ParameterError, nearest_names, shown


def test_message_is_made_from_the_fields():
    error = ManeuverError("is 9 s; at most 5 s", file="a.toml", line=3, key="brake.start_s", value=9, allowed=(0, 5))
    assert str(error) == "a.toml, line 3: brake.start_s: is 9 s; at most 5 s"
    assert (error.file, error.line, error.key, error.value, error.allowed) == ("a.toml", 3, "brake.start_s", 9, (0, 5))
    assert str(ParameterError("is 9", file="a.toml", key="x", overridden=True)) == "override x: is 9"
    assert str(ParameterError("there is none")) == "there is none"


def test_error_survives_the_way_to_another_process():
    error = pickle.loads(pickle.dumps(ParameterError("is 9", file="a.toml", line=1, key="x", value=9)))
    assert str(error) == "a.toml, line 1: x: is 9"
    assert (error.file, error.line, error.key, error.value, error.problem) == ("a.toml", 1, "x", 9, "is 9")


@pytest.mark.parametrize("text", ["a\nb", "a \r\n  b", "\na\n\n\nb\n"])
def test_message_is_one_line(text):
    assert str(ParameterError(text)) == "a b"


def test_message_holds_no_sign_that_cannot_be_printed():
    assert str(ParameterError("\x1b[31m \udcff \0")) == r"\x1b[31m \udcff \x00"


def test_long_value_is_shown_in_part():
    for value in ("x" * 9999, b"x" * 9999, list(range(9999)), dict.fromkeys(range(999)), 10**999, 10**9999, "\n" * 999):
        assert 0 < len(shown(value)) <= MAX_SHOWN


def test_message_as_a_whole_is_bounded():
    assert len(str(ParameterError("x " * 9999))) <= 1000


def test_value_of_any_depth_is_shown():
    deep: list[object] = []
    for _ in range(100_000):
        deep = [deep]
    assert len(shown(deep)) <= MAX_SHOWN


def test_short_value_is_shown_as_python_writes_it():
    for value in (1, 1.5, "a b", [1, 2], {"a": {"b": None}}, True, None):
        assert shown(value) == repr(value)


def test_five_names_are_offered_at_most():
    names = [f"speed_{number}_mps" for number in range(50)]
    assert nearest_names("speed_mps", names).count("speed_") == 5
    assert nearest_names("zzz", names) == f"known names: {', '.join(sorted(names)[:5])} and 45 more"
    assert nearest_names("zzz", ["a", "b"]) == "known names: a, b"
    assert nearest_names("zzz", []) == "known names: none"
    assert len(nearest_names("x" * 10_000_000, names)) < MAX_SHOWN
