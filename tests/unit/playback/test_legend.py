from __future__ import annotations

from activesteer.playback import runs_of
from activesteer.playback.layout import _LETTER, _ROW, _WIDTH, _places, height
from activesteer.playback.plots import curves, pages
from tests.unit.playback.synthetic import circle


def test_no_two_names_are_in_one_place_and_none_is_cut_off() -> None:
    names = {name: "#ffffff" for name in ("a long name of a run", *(f"line number {number}" for number in range(9)))}
    ends: dict[int, float] = {}
    for name, (row, middle) in zip(names, _places(names), strict=True):
        half = 0.5 * _LETTER * len(name)
        assert middle - half > ends.get(row, 0.0)
        assert middle + half < _WIDTH
        ends[row] = middle + half
    assert height(names) == _ROW * len(ends)


def test_every_curve_of_a_page_is_named_once_in_a_colour_of_its_own() -> None:
    (run,) = runs_of({"ars": circle(0.1)})
    for page, plots in pages(run).items():
        named = curves(plots, run, alone=True)
        for plot in plots:
            of_plot = curves([plot], run, alone=True)
            assert of_plot.items() <= named.items(), page
            assert len(set(of_plot.values())) == len(of_plot), page
    assert run.label in curves(pages(run)["Motion"], run, alone=True)
