"""The page of a study, and the sensitivity indices in it."""

from __future__ import annotations

import copy
import json
import re
import shutil
import subprocess
from importlib import resources

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from activesteer import study
from activesteer.commands.cli import main
from activesteer.errors import StudyError
from activesteer.pages import Page, Section, render_page
from activesteer.studies.engine.analysis import indices
from activesteer.studies.engine.design import draw
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.report import _finding, write_report
from tests.raising import raises
from tests.unit.studies.short import RATIO, short_study, write_controller

ISHIGAMI = [Factor(uniform=(-np.pi, np.pi), key=key) for key in ("x1", "x2", "x3")]
"""Ishigami and Homma (1990), with a = 7 and b = 0.1: S1 0.3139, 0.4424, 0; ST 0.5576, 0.4424, 0.2437."""


def ishigami(kind: str, count: int) -> dict[tuple[str, str], tuple[float, float]]:
    samples = draw(ISHIGAMI, kind, count, 1)
    x1, x2, x3 = (np.array(samples.columns[factor.key]) for factor in ISHIGAMI)
    values = np.sin(x1) + 7.0 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)
    found = indices(kind, ISHIGAMI, samples.columns, values)
    return {(index.factor, index.name): (index.value, index.confidence) for index in found}


def test_saltelli_indices_are_those_of_a_function_with_known_ones():
    found = ishigami("saltelli", 4096)
    known = {"S1": (0.3139, 0.4424, 0.0), "ST": (0.5576, 0.4424, 0.2437)}
    for name, values in known.items():
        for key, value in zip(("x1", "x2", "x3"), values, strict=True):
            index, confidence = found[key, name]
            assert index == pytest.approx(value, abs=0.03)
            assert abs(index - value) < 2.0 * confidence + 1e-3


@pytest.mark.parametrize("kind", ["sobol", "latin_hypercube", "random"])
def test_any_sample_gives_first_order_indices(kind):
    found = ishigami(kind, 8192)
    for key, value in (("x1", 0.3139), ("x2", 0.4424), ("x3", 0.0)):
        assert found[key, "S1"][0] == pytest.approx(value, abs=0.05)


def test_elementary_effects_of_a_plane_are_its_slopes_over_the_range():
    factors = [Factor(uniform=(0.0, 2.0), key="a"), Factor(uniform=(-1.0, 4.0), key="b")]
    samples = draw(factors, "morris", 8, 1)
    values = 3.0 * np.array(samples.columns["a"]) - np.array(samples.columns["b"])
    found = {index.factor: index for index in indices("morris", factors, samples.columns, values)}
    assert found["a"].value == pytest.approx(6.0)
    assert found["b"].value == pytest.approx(5.0)
    assert found["a"].spread == pytest.approx(0.0, abs=1e-9)


def test_a_design_that_lost_runs_gives_no_indices():
    samples = draw(ISHIGAMI, "saltelli", 16, 1)
    values = np.linspace(0.0, 1.0, len(samples))
    values[3] = np.nan
    assert indices("saltelli", ISHIGAMI, samples.columns, values) == []


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    path = write_controller(folder, 0.9)
    controllers = ["none", "ars", f"{path}:Fails"]
    table = short_study(0.8, 0.9, 1.0, key=RATIO, controllers=controllers, title="Ratio </script><b>")
    table["factors"]["speed_kmh"] = {"grid": [70.0, 80.0]}
    rows = study(table, output=folder / "s", jobs=1).to_pylist()
    text = write_report(folder / "s").read_text(encoding="utf-8")
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    assert data is not None
    return text, json.loads(data[1]), rows


def test_a_heat_map_of_three_grids_shows_driven_values_of_two_and_means_over_the_third(tmp_path):
    table = short_study(0.8, 1.0, key=RATIO, controllers=["none"])
    table["factors"] |= {"speed_kmh": {"grid": [70.0, 80.0]}, "road.mu": {"grid": [0.5, 0.9]}}
    rows = study(table, output=tmp_path / "s", jobs=1).to_pylist()
    text = write_report(tmp_path / "s").read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    heat = json.loads(found[1])["by_group"][0]["yaw_rate_peak_radps"]["heat"]
    assert [axis["levels"] for axis in heat["axes"]] == [[0.8, 1.0], [70.0, 80.0]]
    peaks = [row["yaw_rate_peak_radps"] for row in rows if (row[RATIO], row["speed_kmh"]) == (1.0, 70.0)]
    assert heat["maps"][0][1][0] == pytest.approx(np.degrees(np.mean(peaks)), rel=1e-4)


def test_the_page_needs_nothing_from_elsewhere_and_escapes_what_it_shows(page):
    text, *_ = page
    assert not re.search(r"""(src|href|url)\s*[=(]\s*["']?https?:""", text)
    assert "</script><b>" not in text
    assert "16 ok" in text
    assert "2 failed" in text


def test_the_page_holds_what_the_rows_say(page):
    _, data, rows = page
    found = data["by_group"][0]["yaw_rate_peak_radps"]
    peaks = {(row["controller"], row[RATIO], row["speed_kmh"]): row["yaw_rate_peak_radps"] for row in rows}
    degps = {key: np.degrees(value) for key, value in peaks.items() if value is not None}
    none = [value for key, value in degps.items() if key[0] == "none"]
    # Six runs have no 5 % quantile.
    assert found["few"]
    assert found["quantiles"][0] == pytest.approx([min(none), np.median(none), max(none)], rel=1e-4)
    differences = [degps["ars", *key[1:]] - value for key, value in degps.items() if key[0] == "none"]
    assert found["paired"][0]["quantiles"][1] == pytest.approx(np.median(differences), rel=1e-3, abs=1e-4)
    assert found["heat"]["maps"][0][1][0] == pytest.approx(degps["none", 0.9, 70.0], rel=1e-4)
    assert found["heat"]["maps"][2][1] == [None, None]
    assert sum(found["histogram"]["counts"][0]) == 6
    assert found["extremes"][0][0][1] == pytest.approx(max(none), rel=1e-4)
    metric = next(metric for metric in data["metrics"] if metric["name"] == "yaw_rate_peak_radps")
    assert metric["unit"] == "deg/s"


def test_controllers_are_compared_in_the_same_samples_even_if_some_lack_runs(tmp_path):
    controllers = ["none", "ars", "afs"]
    wanted = short_study(controllers=controllers, design={"kind": "morris", "samples": 8}) | {
        "factors": {"road.mu": {"uniform": [0.5, 0.9]}}
    }
    table = study(wanted, output=tmp_path / "s", jobs=1)
    lost = {("none", 1), ("afs", 0)}
    left = [(row["controller"], row["sample"]) not in lost for row in table.to_pylist()]
    for rows, complete in ((table, True), (table.filter(left), False)):
        pq.write_table(rows, tmp_path / "s" / "results.parquet")
        text = write_report(tmp_path / "s").read_text(encoding="utf-8")
        data = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
        assert data is not None
        found = json.loads(data[1])["by_group"][0]["yaw_rate_peak_radps"]
        degps = {(row["controller"], row["sample"]): np.degrees(row["yaw_rate_peak_radps"]) for row in rows.to_pylist()}
        for place, name in enumerate(controllers[1:]):
            both = [sample for sample in range(8) if {("none", sample), (name, sample)} <= degps.keys()]
            differences = [degps[name, sample] - degps["none", sample] for sample in both]
            assert found["paired"][place]["quantiles"][1] == pytest.approx(np.median(differences), rel=1e-3, abs=1e-4)
        assert bool(found["indices"]) == complete


def test_a_metric_that_one_car_lacks_leaves_its_other_metrics(tmp_path):
    wanted = short_study(0.9, controllers=["none"], vehicles=["compact", "sedan"])
    table = study(wanted, output=tmp_path / "s", jobs=1)

    def shown() -> list[list[str]]:
        text = write_report(tmp_path / "s").read_text(encoding="utf-8")
        data = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
        assert data is not None
        return [list(group) for group in json.loads(data[1])["by_group"]]

    (first, *others), both = shown()
    assert others
    values = [None if row["vehicle"] == "compact" else row[first] for row in table.to_pylist()]
    column = pa.array(values, pa.float64())
    pq.write_table(table.set_column(table.column_names.index(first), first, column), tmp_path / "s" / "results.parquet")
    assert shown() == [others, both]


def test_the_line_of_a_run_drives_it_again(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    given = {
        "maneuvers": ["straight_line"],
        "overrides": {"duration_s": 0.5},
        "factors": {"speed_kmh": {"grid": [50.0]}},
    }
    [row] = study(given, output="s", jobs=1).to_pylist()
    text = write_report("s").read_text(encoding="utf-8")
    data = json.loads(text.split('id="data">')[1].split("</script>")[0])
    command = data["by_group"][0]["speed_end_mps"]["extremes"][0][0][2]
    words = command.split(" && ")[0].split()
    assert words[0] == "activesteer"
    assert main([*words[1:], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["runs"][0]["metrics"]["speed_end_mps"] == row["speed_end_mps"]


def test_a_study_without_rows_has_no_page(tmp_path):
    with raises(StudyError, value=tmp_path):
        write_report(tmp_path)


def test_the_head_says_what_was_driven(page):
    text, data, _ = page
    head = text.partition('id="study"')[0]
    maneuver, vehicle = data["groups"][0].split(", ")
    told = f"Manoeuvres: {maneuver}. Vehicles: {vehicle}. Controllers: {', '.join(data['controllers'])}."
    assert f"16 ok, 2 failed. {told}" in head
    assert {factor["key"]: factor["range"] for factor in data["factors"]} == {
        RATIO: "0.8 to 1",
        "speed_kmh": "70 to 80",
    }
    assert text.index("70 to 80") < text.index('class="drawn"')
    assert "depends most" not in head  # six runs of a controller are too few for a rank


@pytest.mark.parametrize("runs", [16, 20])
def test_the_head_names_the_factor_that_a_metric_falls_with_if_the_runs_are_many(runs):
    """A greater gain gives less sideslip; the ratio hardly matters."""
    factors = [{"key": key, "label": key, "numeric": True} for key in ("ratio", "gain")]
    several = runs // 4
    rows = {
        "group": [0] * runs, "controller": [0] * runs,
        "metrics": {"sideslip_peak_abs_rad": [4.0, 3.0, 1.0, 2.0] * several},
        "factors": {"ratio": [1.0, 2.0, 2.0, 1.0] * several, "gain": [0.1, 0.2, 0.4, 0.3] * several},
    }  # fmt: skip
    data = {
        "rows": rows, "factors": factors, "controllers": ["ars"], "groups": ["slalom"],
        "by_group": [{"sideslip_peak_abs_rad": {}}],
    }  # fmt: skip
    if runs < 20:
        assert _finding(data) == []
        return
    (words,) = _finding(data)
    assert "gain with ars (\N{MINUS SIGN}1.00)" in str(words)


def test_the_plots_of_several_manoeuvres_stand_where_the_script_looks_for_them(page):
    """The script draws into a child of the section."""
    data = page[1] | {"groups": ["one, compact", "two, compact"]}
    text = render_page(Page("", "", [], [Section(anchor="study")], ["study.js"], data))
    assert "<details" not in text.partition('id="study"')[2].partition('class="drawn"')[0]


def test_a_metric_that_hardly_varies_has_a_histogram_that_can_be_drawn(page):
    _, data, _ = page
    for group in data["by_group"]:
        for found in group.values():
            assert np.all(np.diff(found["histogram"]["edges"]) > 0.0)


def test_factors_are_described_and_their_keys_can_be_read(page):
    text, found, _ = page
    factors = {factor["key"]: (factor["label"], factor["unit"]) for factor in found["factors"]}
    assert factors["speed_kmh"] == ("speed", "km/h")
    assert all(f"<code>{key}</code>" in text for key in factors)


FAKE = """
const pictures = {}, drawn = [];
const element = (name, attributes = {}, ...children) => ({
  name, children, value: "", append(...more) { this.children.push(...more); },
  appendChild(child) { this.children.push(child); return child; },
  replaceChildren(...others) { this.children = others; }, addEventListener() {},
});
const document = { querySelector() { return element("div"); } };
const NARROW = { matches: false }, MANY = 6;
class Element {}
const short = (value) => String(+value.toPrecision(3));
const addContents = () => {};
const drawPicture = (box, picture, id) => { pictures[id] = picture; };
"""
"""What the script of the page finds in a browser; `drawPicture` keeps what it is given."""


def drawn(data, folder, metric="yaw_rate_peak_radps"):
    """Return the pictures of the page by part, and its paragraphs."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed: apt-get install nodejs")
    draws = (resources.files("activesteer.pages") / "templates" / "study.js").read_text("utf-8").partition("\n")[2]
    choice = f'chosenMetric.value = {json.dumps(metric)}; chosenGroup.value = "0"; delete pictures.heat; drawAll();'
    parts = "all.children.flatMap(({ children }) => children)"
    paragraphs = f'{parts}.filter(({{ name }}) => name === "p").flatMap(({{ children }}) => children)'
    told = f"console.log(JSON.stringify([pictures, {paragraphs}]));"
    (folder / "page.js").write_text("\n".join((f"const DATA = {json.dumps(data)};", FAKE, draws, choice, told)))
    done = subprocess.run([node, folder / "page.js"], capture_output=True, text=True, timeout=60, check=True)
    return json.loads(done.stdout)


def test_a_metric_is_drawn_over_each_factor_by_value_or_by_level(page, tmp_path):
    data, rows = copy.deepcopy(page[1]), page[2]
    data["factors"][0] |= {"numeric": False, "levels": ["0.8", "0.9", "1"], "label": "a factor of words"}
    assert not {"parallel", "distribution"} & drawn(data, tmp_path)[0].keys()  # of few runs
    for found in data["by_group"][0].values():
        found["few"] = False
    pictures, _ = drawn(data, tmp_path)
    words, speed = pictures["scatter"]["panels"]
    assert (words["x"], words["x_levels"]) == ("a factor of words", ["0.8", "0.9", "1"])
    assert (speed["x"], speed["x_levels"], speed["y"]) == ("speed [km/h]", None, "peak yaw rate [deg/s]")
    none = [row for row in rows if row["controller"] == "none"]
    points = zip(speed["curves"][0]["x"], speed["curves"][0]["y"], speed["curves"][0]["told"], strict=True)
    for row, (speed_kmh, peak_degps, told) in zip(none, points, strict=True):
        # Two values: the first of three controllers stands before them.
        assert speed_kmh == pytest.approx(row["speed_kmh"] - 0.16 * 10.0 / 3.0)
        assert peak_degps == pytest.approx(np.degrees(row["yaw_rate_peak_radps"]), rel=1e-4)
        assert f"run {row['run']}" in told
    assert [curve["label"] for curve in pictures["paired"]["panels"][1]["curves"]] == data["controllers"][1:]
    assert [round(curve["x"][0] - words["curves"][0]["x"][0], 2) for curve in words["curves"]] == [0.0, 0.16, 0.32]
    parallel = pictures["parallel"]["panels"]
    assert [panel["title"] for panel in parallel] == data["controllers"]
    assert parallel[0]["names"][-1].partition(":")[0] == "peak yaw rate [deg/s]"
    # A line enters the strip of an axis where it leaves it, with no room between the strip and the line.
    panel, line = parallel[0], parallel[0]["curves"][0]
    assert panel["y_range"][0] == panel["areas"][0]["low"][0]
    x, y = line["x"][: line["x"].index(None) + 2], line["y"][: line["y"].index(None) + 2]
    edges = [edge for area in panel["areas"] for edge in (area["low"][0], area["high"][0])]
    assert (y[0], y[1]) == (edges[1], edges[2])
    assert (x[1], y[-1]) == (x[-1], edges[3])


def test_fields_of_driven_values_are_named_by_them_and_fields_of_a_range_have_its_ends(page, tmp_path):
    data = copy.deepcopy(page[1])
    first, second = (factor["key"] for factor in data["factors"])
    speeds, mus, controllers = [70.0, 90.0] * 8, np.linspace(0.8, 1.0, 16).tolist(), data["controllers"]
    places = [place for place in range(16) for _ in controllers]
    data["rows"] = {
        "group": [0] * len(places), "controller": [*range(len(controllers))] * 16, "sample": places, "run": places,
        "factors": {first: [speeds[i] for i in places], second: [mus[i] for i in places]},
        "metrics": {name: [float(i) for i in places] for name in data["rows"]["metrics"]},
    }  # fmt: skip
    data["by_group"][0]["yaw_rate_peak_radps"] |= {"heat": None, "paired": [None] * (len(controllers) - 1)}
    panel = drawn(data, tmp_path)[0]["heat"]["panels"][0]
    assert (panel["x_levels"], panel["y_levels"]) == (["70", "90"], None)
    assert panel["y_range"] == pytest.approx([0.8, 1.0])
    assert panel["areas"][0]["high"] == pytest.approx([0.9, 0.9])
    # The fields at 70 km/h hold the even places, those at 90 km/h the odd ones.
    assert [note[2] for note in panel["notes"]] == ["3", "11", "4", "12"]


def test_a_heat_map_has_a_scale_of_its_colours_unless_all_fields_are_the_same(page, tmp_path):
    data = copy.deepcopy(page[1])
    pictures, texts = drawn(data, tmp_path)
    maps = data["by_group"][0]["yaw_rate_peak_radps"]["heat"]["maps"]
    values = [value for chart in maps for line in chart for value in line if value is not None]
    assert len(pictures["heat"]["panels"]) == len(data["controllers"])
    assert pictures["heat"]["scale"][1:] == [min(values), max(values)]
    areas = [area for panel in pictures["heat"]["panels"] for area in panel["areas"]]
    assert sorted(area["shade"] for area in areas)[:: len(areas) - 1] == [0.0, 1.0]
    assert len(areas) == len(values)
    for chart in maps:
        for line in chart:
            line[:] = [None if value is None else 2.0 for value in line]
    pictures, texts = drawn(data, tmp_path)
    assert "heat" not in pictures
    assert any("is 2 in every field" in text for text in texts)
