"""Tables fit 80 columns: narrower columns, parts below each other, or wrapped words."""

from __future__ import annotations

from activesteer.core.text_table import COLUMNS, text_table, wrapped_line

HEAD = ["", "unit", *(f"controller_{number}" for number in range(8))]
ROWS = [HEAD, ["yaw rate peak", "deg/s", *(f"{number}.125" for number in range(8))]]


def test_a_narrow_table_keeps_its_widths_and_aligns_numbers_to_the_right():
    assert list(text_table([["", "a"], ["mass", "1.5"]], least=8)) == ["             a", "mass       1.5"]


def test_a_table_that_nearly_fits_gets_narrower_gaps():
    row = ["x" * 10] * 7
    assert list(text_table([row], text=0)) == [" ".join(row)]


def test_a_wide_table_is_split_into_parts_that_repeat_the_first_columns():
    lines = list(text_table(ROWS, text=2, repeat=2))
    assert max(map(len, lines)) <= COLUMNS
    assert sum(line.startswith("yaw rate peak  deg/s") for line in lines) == 2
    assert [word for line in lines for word in line.split() if word.startswith("controller_")] == HEAD[2:]
    assert [float(word) for line in lines for word in line.split() if "." in word] == [n + 0.125 for n in range(8)]


def test_words_are_wrapped_between_words_and_rows_keep_their_marks():
    sentence = "a tolerance of half a degree and six per cent, wider by the noise of the measurement"
    rows = [["run", "tolerance"], ["double_lane_change", sentence], ["x", "y"]]
    lines = list(text_table(rows, text=2, marks=["  ", "! ", "  "]))
    assert max(map(len, lines)) <= COLUMNS
    assert [line[0] for line in lines] == [" ", "!", " ", " "]
    assert " ".join(" ".join(line[22:] for line in lines[1:3]).split()) == sentence


def test_colours_take_no_room():
    plain, coloured = (list(text_table([["", "a"], ["m", cell]])) for cell in ("1.5", "\x1b[31m1.5\x1b[0m"))
    assert plain[0] == coloured[0]
    assert plain[1] == coloured[1].replace("\x1b[31m", "").replace("\x1b[0m", "")


def test_a_long_line_goes_on_further_to_the_right():
    first, *rest = wrapped_line("  - " + "word " * 40)
    assert first.startswith("  - word")
    assert rest
    assert all(line.startswith("      word") for line in rest)
    assert max(map(len, (first, *rest))) <= COLUMNS


def test_a_zero_has_no_minus_sign():
    cells = ["-0.000", "-0", "-0.0004", "-0.0 deg", "x-0", "1.5 to -0.0"]
    shown = [line.strip() for line in text_table([["a"], *([cell] for cell in cells)])][1:]
    assert shown == ["0.000", "0", "-0.0004", "0.0 deg", "x-0", "1.5 to 0.0"]
