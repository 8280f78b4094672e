from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from activesteer.errors import ParameterError, TyreFileError
from activesteer.tyre import TyreParameters, load_tir
from activesteer.tyre.file.tir import tir_from_text
from tests.raising import raises
from tests.unit.tyre.tyres import TYRES, differing, tyre

MINIMAL = """
[MODEL]
FITTYP = 61
[DIMENSION]
UNLOADED_RADIUS = 0.3
[VERTICAL]
FNOMIN = 4000
VERTICAL_STIFFNESS = 200000
[LONGITUDINAL_COEFFICIENTS]
PCX1 = 1.6
PDX1 = 1
PKX1 = 22
[LATERAL_COEFFICIENTS]
PCY1 = 1.3
PDY1 = 1
PKY1 = -20
PKY2 = 1.7
"""
FILE = Path("a.tir")


def _read(text: str, **options) -> TyreParameters:
    return tir_from_text(text, FILE, **options)


def test_missing_coefficients_take_their_defaults() -> None:
    parameters = _read(MINIMAL)
    assert parameters["PKY4"] == 2.0
    assert parameters["LMUX"] == 1.0
    assert parameters["FZMAX"] == 10000.0
    assert parameters["NOMPRES"] == parameters["INFLPRES"] == 220e3


@pytest.mark.parametrize(("fittyp", "version"), [(5, 52), (6, 52), (21, 52), (52, 52), (60, 60), (61, 61), (62, 62)])
def test_every_version_is_known_by_its_number(fittyp: int, version: int) -> None:
    assert _read(MINIMAL.replace("FITTYP = 61", f"FITTYP = {fittyp}")).version == version


def test_a_pac2002_file_needs_no_fittyp_and_names_its_own_pressure() -> None:
    text = MINIMAL.replace("FITTYP = 61", "PROPERTY_FILE_FORMAT = 'PAC2002'") + "[X]\nIP = 250000\nIP_NOM = 240000\n"
    parameters = _read(text)
    assert parameters.version == 52
    assert (parameters["INFLPRES"], parameters["NOMPRES"]) == (250e3, 240e3)


def test_files_of_other_tyre_models_are_refused() -> None:
    with raises(TyreFileError, file="a.tir", key="PROPERTY_FILE_FORMAT", value="FIALA"):
        _read(MINIMAL.replace("FITTYP = 61", "PROPERTY_FILE_FORMAT = 'FIALA'"))


def test_case_comments_line_ends_and_tables_do_not_matter() -> None:
    text = MINIMAL.replace("PDX1 = 1", "pdx1 =1.0D0 $ friction = 'x'").replace("[MODEL]", "! note\n$---[x]\n[model]")
    text += "[SHAPE]\n{radial width}\n 1.0  0.0\n 0.9  1.0\n"
    parameters = _read(text.replace("\n", "\r\n"))
    assert parameters["PDX1"] == 1.0
    assert parameters.tables["SHAPE"] == ((1.0, 0.0), (0.9, 1.0))


def test_bytes_beyond_ascii_are_read(tmp_path: Path) -> None:
    path = tmp_path / "reifen.tir"
    path.write_bytes(MINIMAL.encode() + "$ Größe µ\n".encode("latin-1"))
    assert load_tir(path)["PKX1"] == 22.0


def test_the_mass_of_the_units_is_not_the_mass_of_the_tyre() -> None:
    parameters = _read("[UNITS]\nMASS = 'kg'\n" + MINIMAL + "[INERTIA]\nMASS = 9.3\n")
    assert parameters["MASS"] == 9.3


def test_units_are_converted() -> None:
    text = "[UNITS]\nLENGTH='mm'\nFORCE='kilonewton'\nANGLE='deg'\nTIME='second'\nMASS='pound_mass'\n" + MINIMAL
    text = text.replace("= 0.3", "= 300").replace("= 4000", "= 4").replace("= 200000", "= 0.2")
    text += "[INERTIA]\nMASS = 10\n[SLIP_ANGLE_RANGE]\nALPMAX = 45\n[A]\nLONGVL = 20000\nNOMPRES = 0.00024\n"
    parameters = _read(text)
    plain = _read(MINIMAL)
    for key in ("UNLOADED_RADIUS", "FNOMIN", "VERTICAL_STIFFNESS", "PKX1"):
        assert parameters[key] == pytest.approx(plain[key])
    assert parameters["MASS"] == pytest.approx(4.5359237)
    assert parameters["ALPMAX"] == pytest.approx(np.pi / 4)
    assert parameters["LONGVL"] == pytest.approx(20.0)
    assert parameters["NOMPRES"] == pytest.approx(240e3)


@pytest.mark.parametrize(
    ("change", "line", "key"),
    [
        (("PDX1 = 1", "PDX1 = one"), 11, "PDX1"),
        (("PDX1 = 1", "PDX1 = 1\nPDX1 = 2"), 12, "PDX1"),
        (("PDX1 = 1", "PDX1"), 11, None),
        (("PDX1 = 1", ""), None, "PDX1"),
        (("FNOMIN = 4000", "FNOMIN = -4000"), 7, "FNOMIN"),
        (("FITTYP = 61", "FITTYP = 70"), 3, "FITTYP"),
        (("FNOMIN = 4000", "FNOMIN = 1e400"), 7, "FNOMIN"),
        (("VERTICAL_STIFFNESS = 200000", "Q_FZ2 = 1"), None, "VERTICAL_STIFFNESS, Q_FZ1"),
        (("VERTICAL_STIFFNESS = 200000", "VERTICAL_STIFFNESS = 2000\nQ_FZ2 = 15"), 9, "Q_FZ2"),
        (("[MODEL]", "[UNITS]\nLENGTH = 'parsec'\n[MODEL]"), 3, "LENGTH"),
        (("FITTYP = 61", "FITTYP = 61\nTYRESIDE = 'UP'"), None, "TYRESIDE"),
        (("[MODEL]", "[MODEL"), 2, None),
        (("FITTYP = 61", "FITTYP = 61\nKPUMIN = 2"), 4, "KPUMIN"),
    ],
)
def test_errors_say_where_and_what(change: tuple[str, str], line: int | None, key: str | None) -> None:
    with raises(TyreFileError, file="a.tir", line=line, key=key):
        _read(MINIMAL.replace(*change, 1))


def test_a_file_that_is_not_there_or_too_long_is_an_error(tmp_path: Path) -> None:
    with raises(TyreFileError, cause=FileNotFoundError):
        load_tir(tmp_path / "none.tir")
    with raises(TyreFileError, value=tmp_path):
        load_tir(tmp_path)
    long = tmp_path / "long.tir"
    long.write_bytes(b"$" * 4_000_001)
    with raises(TyreFileError, value=long, allowed=4_000_000):
        load_tir(long)


def test_a_misspelt_coefficient_is_named_with_its_neighbours() -> None:
    with raises(ParameterError, value="PKYI"):
        tyre()["PKYI"]
    with raises(ParameterError, key="LMUXX"):
        tyre().with_values(LMUXX=0.9)


def test_what_no_formula_uses_is_kept_and_shown() -> None:
    parameters = _read(MINIMAL + "[EXTRA]\nNOVELTY = 3\nWORD = 'x'\n")
    assert parameters.unused["EXTRA", "NOVELTY"] == 3.0
    assert parameters.texts["EXTRA", "WORD"] == "x"


def test_a_right_hand_file_mounted_left_is_mirrored() -> None:
    text = MINIMAL.replace("FITTYP = 61", "FITTYP = 61\nTYRESIDE = 'RIGHT'")
    assert _read(text).record.tolist() == _read(MINIMAL).record.tolist()
    mirrored = _read(text, mounted="LEFT").record
    given = _read(MINIMAL).record
    assert differing(mirrored, given) == ["SIDE"]


def _mutated(data: bytes, chance: random.Random) -> bytes:
    """Return a file after some random edits of bytes, lines and numbers."""
    pieces = bytearray(data)
    for _ in range(chance.randint(1, 8)):
        place = chance.randrange(len(pieces) + 1)
        kind = chance.randrange(6)
        if kind == 0:
            pieces[place : place + chance.randint(0, 40)] = b""
        elif kind == 1:
            pieces[place:place] = bytes(chance.randrange(256) for _ in range(chance.randint(1, 12)))
        elif kind == 2:
            words = (
                b"1e308",
                b"-1e308",
                b"0",
                b"nan",
                b"inf",
                b"1e-320",
                b"[",
                b"]",
                b"=",
                b"'",
                b"\0",
                b"\r",
                b"FITTYP = 62\n",
            )
            pieces[place:place] = chance.choice(words)
        elif kind == 3 and pieces:
            pieces[place - 1] = chance.randrange(256)
        elif kind == 4:
            lines = bytes(pieces).split(b"\n")
            chance.shuffle(lines)
            pieces = bytearray(b"\n".join(lines))
        else:
            lines = bytes(pieces).split(b"\n")
            line = chance.randrange(len(lines))
            key = lines[line].partition(b"=")[0]
            lines[line] = (
                key + b"= " + chance.choice((b"0", b"-1", b"1e300", b"-1e300", b"1e-300", b"'x'", b"", b"61", b"'mm'"))
            )
            pieces = bytearray(b"\n".join(lines))
    return bytes(pieces)


WHOLE_FILES = (MINIMAL.encode(), (TYRES / "compact_205_55R16.tir").read_bytes()[:3000] + MINIMAL.encode())


def _is_read(damaged: bytes) -> bool:
    """Return True if a damaged file is read, with finite numbers; only `TyreFileError` may refuse it."""
    try:
        record = tir_from_text(damaged.decode("latin-1"), FILE).record
    except TyreFileError:
        return False
    assert np.isfinite(record.tolist()).all()
    return True


@settings(max_examples=500, deadline=None, derandomize=True, database=None)
@given(whole=st.sampled_from(WHOLE_FILES), chance=st.randoms(use_true_random=False))
def test_damaged_files_end_in_a_tyre_file_error_or_a_finite_tyre(whole: bytes, chance: random.Random) -> None:
    _is_read(_mutated(whole, chance))


@settings(max_examples=500, deadline=None, derandomize=True, database=None)
@given(st.binary(max_size=400))
def test_bytes_at_random_end_in_a_tyre_file_error(noise: bytes) -> None:
    assert not _is_read(noise)
    _is_read(MINIMAL.encode() + noise)


@pytest.mark.slow
def test_a_hundred_thousand_damaged_files() -> None:
    chance = random.Random(2)
    read = sum(_is_read(_mutated(chance.choice(WHOLE_FILES), chance)) for _ in range(100_000))
    assert 1000 < read < 99_000
