"""Reading refuses a tyre that is not finite inside its own ranges."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from activesteer.errors import ParameterError, TyreFileError
from activesteer.tyre.file.tir import tir_from_text
from tests.raising import raises
from tests.unit.tyre.tyres import TYRES, tyre

TEXT = (TYRES / "compact_205_55R16.tir").read_text()


def _with(key: str, value: str) -> str:
    text, count = re.subn(rf"(?m)^{key}\s*=\s*\S+", f"{key} = {value}", TEXT)
    assert count == 1
    return text


@pytest.mark.parametrize("value", ["1e308", "-1e308"])
@pytest.mark.parametrize("key", ["PHY2", "PDX1", "PKY1", "QSX3", "QDZ1"])
def test_a_coefficient_that_makes_forces_overflow_is_named_with_its_line(key: str, value: str) -> None:
    text = _with(key, value)
    line = next(number for number, line in enumerate(text.splitlines(), 1) if line.split("=")[0].strip() == key)
    with raises(TyreFileError, file="wild.tir", key=key, value=float(value), line=line):
        tir_from_text(text, Path("wild.tir"))


def test_finite_coefficients_may_make_a_tyre_that_is_not() -> None:
    with raises(ParameterError, key=None):
        tyre().with_values(LCZ=1e308)


def test_a_change_in_memory_is_looked_at_too() -> None:
    with raises(ParameterError, key="PHY2", value=1e308):
        tyre().with_values(PHY2=1e308)


@pytest.mark.parametrize("path", sorted(TYRES.glob("*.tir")), ids=lambda path: path.stem)
def test_the_tyres_of_the_package_are_finite(path: Path) -> None:
    assert tyre(path.stem).source == path
