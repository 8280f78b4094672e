"""Surfaces of uneven roads: ISO 8608, profiles, OpenCRG files, obstacles."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer.core import path as lines
from activesteer.errors import ManeuverError
from activesteer.road.course import ProfileTable
from activesteer.road.crg import CrgRoad, packed, read_crg, referenced, unpacked
from activesteer.road.drawn import DrawnSurface, places_to_draw
from activesteer.road.obstacles import CLASSES, STEP_M, Obstacle, Roughness
from activesteer.road.road import BankingTable, LaidRoad, Road
from activesteer.road.surface import Surface, level_at, near_obstacles, surface_of
from activesteer.scenario import resolve


def surface(**keys: Any) -> Surface:
    return surface_of(Road(**keys))


def spectra(seeds: range, **keys: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return frequencies, mean displacement spectrum, and mean coherence of two tracks 1 m apart."""
    s = np.arange(0.0, 200.0, STEP_M)
    own, cross = np.zeros(s.size // 2 + 1), np.zeros(s.size // 2 + 1, np.complex128)
    for seed in seeds:
        road = surface(roughness=Roughness("C", seed, length_m=200.0, width_m=1.0, **keys), start_m=3.0)
        road.head["blend_m"], road.head["start_m"] = -1.0, 0.0
        left, right = (np.fft.rfft(road.at(s, np.full(s.size, d))[:, 0]) for d in (0.5, -0.5))
        own = own + np.abs(left) ** 2 + np.abs(right) ** 2
        cross = cross + left * right.conj()
    scale = 2.0 * STEP_M / s.size / len(seeds)
    return np.fft.rfftfreq(s.size, STEP_M), scale * own / 2.0, np.real(cross) / own * 2.0


def test_the_spectrum_is_that_of_the_class_and_the_tracks_are_coherent() -> None:
    n, level, coherence = spectra(range(100))
    expected = CLASSES["C"] * (np.maximum(n, 1e-9) / 0.1) ** -2.0
    # Bands of ISO 8608: octaves, thirds from 0.03 and twelfths from 0.25 cycles/m, as far as bins of 0.005 resolve.
    edges = [0.0156, 0.0312, *(0.0312 * 2.0 ** (np.arange(1, 10) / 3.0)), *(0.25 * 2.0 ** (np.arange(1, 44) / 12.0))]
    for low, high in itertools.pairwise(edges):
        band = (n >= low) & (n < high)
        if band.any():
            assert abs(10.0 * math.log10(level[band].mean() / expected[band].mean())) < 1.0, (low, high)
    assert coherence[(n > 0.01) & (n < 0.03)].mean() > 0.97
    # x K1(x) at x = 2 pi 0.3: 0.35; at 1 cycle/m 0.006.
    assert coherence[(n > 0.28) & (n < 0.32)].mean() == pytest.approx(0.35, abs=0.05)
    assert abs(coherence[(n > 0.9) & (n < 1.1)].mean()) < 0.03


def test_a_seed_repeats_its_surface_and_classes_are_a_factor_of_two_apart() -> None:
    one = Roughness("A", 7, length_m=50.0, width_m=1.0).grid().z_m
    assert np.array_equal(one, Roughness("A", 7, length_m=50.0, width_m=1.0).grid().z_m)
    assert not np.array_equal(one, Roughness("A", 8, length_m=50.0, width_m=1.0).grid().z_m)
    assert Roughness("B", 7, length_m=50.0, width_m=1.0).grid().z_m == pytest.approx(2.0 * one)


def test_slopes_are_the_derivatives_of_the_height() -> None:
    road = surface(
        obstacle=(
            Obstacle("cosine_bump", 12.0, 3.0, 0.1, angle_rad=0.4), Obstacle("kerb", 18.0, None, 0.12, left_m=-0.5),
            Obstacle("sine_wave", 30.0, 4.0, 0.05, waves=3), Obstacle("cross_slope_ramp", 45.0, 10.0, slope=-0.1),
        ),
        banking=BankingTable((0.0, 40.0, 60.0), (0.0, 0.1, 0.0)),
        heights=ProfileTable((0.0, 20.0, 40.0, 60.0), (0.0, 0.4, 0.1, 0.3), (0.0, 0.3, 0.2, 0.5)),
        roughness=Roughness("C", 3, length_m=70.0, width_m=4.0),
    )  # fmt: skip
    random, h = np.random.default_rng(5), 1e-7
    s, d = random.uniform(2.5, 60.0, 400), random.uniform(-1.8, 1.8, 400)
    at = road.at(s, d)
    for column, (ds, dd) in enumerate(((h, 0.0), (0.0, h)), 1):
        numeric = (road.at(s + ds, d + dd)[:, 0] - road.at(s - ds, d - dd)[:, 0]) / (2.0 * h)
        # A few of 400 places lie within 1e-7 m of an edge.
        assert np.quantile(np.abs(numeric - at[:, column]), 0.99) < 1e-5
    assert road.at(np.array([0.0, 1.9]), np.zeros(2)) == pytest.approx(0.0)
    # The tyres take most heights without slopes.
    levels = [
        level_at(road.head[0], road.numbers, road.obstacles, *near_obstacles(road.obstacles, *place)[:2], *place)
        for place in zip(s, d, strict=True)
    ]
    assert at[:, 0] == pytest.approx(np.array(levels))


def test_an_edge_rises_before_the_middle_of_an_obstacle_and_falls_behind_it() -> None:
    road = surface(obstacle=(Obstacle("cleat", 10.0, 2.0, 0.1, left_m=1.0, right_m=-1.0, edge_m=0.2),))
    along = road.at(np.array([10.1, 11.0, 11.9]), np.zeros(3))
    assert along == pytest.approx(np.array([[0.05, 0.5, 0.0], [0.1, 0.0, 0.0], [0.05, -0.5, 0.0]]))
    across = road.at(np.full(3, 11.0), np.array([-0.9, 0.0, 0.9]))
    assert across == pytest.approx(np.array([[0.05, 0.0, 0.5], [0.1, 0.0, 0.0], [0.05, 0.0, -0.5]]))


HEAD = """$CT
A road for tests
$!*
$ROAD_CRG                  ! comment
REFERENCE_LINE_INCREMENT = 0.5
LONG_SECTION_V_RIGHT = -1.0
LONG_SECTION_V_LEFT = 1.0
{more}
$!*
{blocks}$KD_DEFINITION
#:{form}
D:reference line phi,rad
D:reference line banking,m/m
D:long section 1,m
D:long section 2,m
D:long section 3,m
$!*
$$$$$$$$
"""


def crg(data: np.ndarray, form: str = "LRFI", more: str = "", blocks: str = "") -> CrgRoad:
    return read_crg("road.crg", lambda _: crg_content(data, form, more, blocks))


def crg_content(data: np.ndarray, form: str = "LRFI", more: str = "", blocks: str = "") -> bytes:
    head = HEAD.format(form=form, more=more, blocks=blocks).encode()
    if form == "KRBI":
        text = data.astype(">f4").tobytes()
        return head + text + bytes(-len(text) % 80)
    width = 10 if form == "LRFI" else 20
    cells = ["".join(f"{'*missing*' if np.isnan(x) else f'{x:.7f}'[:width]:>{width}}" for x in row) for row in data]
    lines = [row[start : start + 80] for row in cells for start in range(0, len(row), 80)]
    return head + "\n".join(lines).encode()


def rows() -> np.ndarray:
    data = np.zeros((9, 5))
    data[:, 0] = 0.02 * np.arange(9)
    data[0, 0] = np.nan
    data[:, 1] = 0.01 * np.arange(9)
    data[:, 2:] = np.arange(27).reshape(9, 3) * 1e-3
    return data


@pytest.mark.parametrize("form", ["LRFI", "LDFI", "KRBI"])
def test_a_crg_file_gives_grid_banking_and_reference_line(form: str) -> None:
    road = crg(rows(), form)
    expected = rows()[:, 2:] + rows()[:, 1:2] * np.array([-1.0, 0.0, 1.0])
    assert road.grid.z_m == pytest.approx(expected - expected[0, 1], abs=1e-6)
    assert (road.grid.step_s_m, road.grid.d_m, road.grid.step_d_m) == (0.5, -1.0, 1.0)
    assert road.line is not None
    # A curve of 0.02 rad per 0.5 m, 25 m radius, from heading 0 in the first step.
    assert (road.line.x_m[-1], road.line.y_m[-1]) == pytest.approx((3.99, 0.28), abs=0.01)


def test_a_crg_file_of_a_straight_road_has_no_line() -> None:
    data = rows()
    data[1:, 0] = 0.0
    assert crg(data).line is None


def test_a_crg_file_with_one_row_is_no_surface() -> None:
    with pytest.raises(ManeuverError, match="1 rows; at least 2"):
        crg(rows()[:1])


def test_scales_and_missing_heights_follow_the_file() -> None:
    data = rows()
    data[3, 2] = np.nan
    assert crg(data).grid.z_m[3, 0] == pytest.approx(crg(data).grid.z_m[3, 1] - 0.03, abs=1e-6)
    scaled = crg(rows(), blocks="$ROAD_CRG_MODS\nSCALE_Z_GRID = 2.0\nSCALE_BANKING = 0\n$!\n")
    assert scaled.grid.z_m[-1] == pytest.approx(2e-3 * (np.arange(24, 27) - 1.0), abs=1e-6)


def test_the_slope_of_a_crg_file_belongs_to_the_step_before_its_point() -> None:
    data = rows()
    data[:, 1:] = 0.0
    data[:, 1] = 0.1 * (np.arange(9) == 3)
    head = HEAD.format(form="LDFI", more="", blocks="").replace("reference line banking", "reference line slope")
    lines = ["".join(f"{number:20.7f}" for number in row) for row in np.nan_to_num(data)]
    text = "\n".join(part for line in lines for part in (line[:80], line[80:]))
    heights = read_crg("road.crg", lambda _: f"{head}{text}".encode()).grid.z_m
    assert heights[:, 1] == pytest.approx(0.05 * (np.arange(9) >= 3))


def test_bytes_lost_as_text_are_an_error() -> None:
    data = np.full((400, 5), 0.3)
    data[200, 3] = np.frombuffer(b"\x3e\x99\x0d\x0a", ">f4")[0]
    head, text = HEAD.format(form="KRBI", more="", blocks="").encode(), data.astype(">f4").tobytes()
    assert read_crg("a", lambda _: head + text).grid.z_m.shape == (400, 3)
    with pytest.raises(ManeuverError, match="lost or gained bytes"):
        read_crg("a", lambda _: head + text.replace(b"\r\n", b"\n"))


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda d: d.__setitem__((4, 3), np.nan), "has a hole"),
        (lambda d: d.__setitem__((4, slice(2, 5)), np.nan), "no height at all"),
        (lambda d: d.__setitem__((slice(1, 9), 0), 0.6 * np.arange(8)), "folds over itself"),
        (lambda d: d.__setitem__((4, 3), 5000.0), "exceed 1000 m"),
        (lambda d: d.__setitem__((4, 3), np.inf), "not a finite number"),
        (lambda d: d.__setitem__((3, 0), np.nan), "heading of the reference line"),
    ],
)
def test_a_bad_grid_is_one_error(change: Any, problem: str) -> None:
    data = rows()
    change(data)
    with pytest.raises(ManeuverError, match=problem):
        crg(data)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "not an OpenCRG file"),
        (b"$KD_DEFINITION\n$\n$ROAD_CRG\nREFERENCE_LINE_INCREMENT = x\n$\n", "not a finite number"),
        *(
            (
                HEAD.format(form="LRFI", more=f"REFERENCE_LINE_END_U = {value}", blocks="").encode(),
                "not a finite number|largest number allowed",
            )
            for value in ("inf", "-inf", "nan", "1e13")
        ),
        (
            HEAD.format(form="LRFI", more="", blocks="")
            .replace("section 1", "section at v = inf")
            .replace("section 2", "section at v = 1")
            .replace("section 3", "section at v = 2")
            .encode()
            + 2 * (5 * b"         0" + b"\n"),
            "not a finite number",
        ),
        (b"$ROAD_CRG\nA = 1\n$\n$KD_DEFINITION\n#:XYZ\n$\n$$$$\n", "known: LRFI"),
        (HEAD.format(form="LRFI", more="", blocks="").encode() + b" 0.0 junk \n" * 9, "is not a number"),
    ],
)
def test_a_bad_file_is_one_error(content: bytes, problem: str) -> None:
    with pytest.raises(ManeuverError, match=problem):
        read_crg("bad.crg", lambda _: content)


def test_a_reference_through_the_environment_is_refused() -> None:
    with pytest.raises(ManeuverError, match="without environment variables"):
        referenced(b"$ROAD_CRG_FILE\n$HOME/x.crg\n$\n")
    for text in ((), ("!!",), packed({"x": b"no crg"})):
        with pytest.raises(ManeuverError, match=r"empty|damaged|not an OpenCRG"):
            unpacked(text)


def test_a_manoeuvre_reads_its_crg_file_and_the_files_that_it_refers_to(tmp_path: Path) -> None:
    (tmp_path / "data.crg").write_bytes(crg_content(rows()))
    (tmp_path / "named.crg").write_bytes(b"$ROAD_CRG_FILE\ndata.crg\n$!\n")

    def grid(name: str) -> np.ndarray:
        road = {"crg": str(tmp_path / name)}
        table = {"kind": "open_loop", "speed_kmh": 30.0, "duration_s": 1.0, "road": road}
        return unpacked(resolve(table).maneuver.road.crg_data).grid.z_m

    np.testing.assert_array_equal(grid("data.crg"), crg(rows()).grid.z_m)
    np.testing.assert_array_equal(grid("named.crg"), crg(rows()).grid.z_m)
    (tmp_path / "data.crg").unlink()
    with pytest.raises(ManeuverError, match=r"'data\.crg', which is not found next to it"):
        grid("named.crg")
    (tmp_path / "named.crg").write_bytes(b"$ROAD_CRG_FILE\nnamed.crg\n$!\n")
    with pytest.raises(ManeuverError, match="files in a chain"):
        grid("named.crg")


PLACES = [Path(__file__).resolve().parents[up] / "shared/reference/roads/crg" for up in (4, 5)]
EXAMPLES = next((place for place in PLACES if place.is_dir()), None)


@pytest.mark.skipif(EXAMPLES is None, reason="ASAM's example files are not beside the project")
def test_the_examples_of_asam_are_read() -> None:
    assert EXAMPLES is not None
    folder = EXAMPLES

    def table(name: str) -> dict[str, Any]:
        road = {"crg": str(folder / name)}
        return {"kind": "open_loop", "speed_kmh": 30.0, "duration_s": 1.0, "road": road}

    found = {path.name: path for path in folder.glob("*.crg")}
    missing, damaged = found.pop("testOptionBorderMode.crg"), found.pop("belgian_block.crg")
    roads = {name: resolve(table(name)).maneuver.road for name in found}
    grids = {name: unpacked(road.crg_data).grid for name, road in roads.items()}
    # Numbers of the files themselves: row and long section, less the height in the middle of the first row.
    assert grids["handmade_straight.crg"].z_m[3] == pytest.approx([0.0] + 5 * [0.0111111] + [0.0])
    curved = grids["handmade_curved_banked_sloped.crg"]
    assert curved.z_m[5, 6] == pytest.approx(0.011 + 0.022 + 0.033 + 0.044 + 0.0111111)
    assert np.array_equal(curved.z_m, grids["fileref_opts.crg"].z_m)
    with pytest.raises(ManeuverError, match="not found next to it"):
        resolve(table(missing.name))
    with pytest.raises(ManeuverError, match="lost or gained bytes"):
        resolve(table(damaged.name))


def test_the_share_beyond_the_known_surface_follows_the_path() -> None:
    turn = np.linspace(0.0, math.pi, 200)
    path = lines.Path.through(40.0 * np.sin(turn), 40.0 * (1.0 - np.cos(turn)))
    road = LaidRoad(along="path", roughness=Roughness(class_="A", length_m=60.0, width_m=6.0), start_m=3.0, path=path)
    along, across = np.array([0.0, 20.0, 58.0, 62.0, 20.0]), np.array([0.0, 1.5, -1.5, 0.0, 5.0])
    places = road.placed(along, across)
    assert np.allclose(road.located(*places), (along, across), atol=0.02)
    # The last two are behind the end and beside the surface; the first one is where every road is even.
    assert road.extended_share(*places) == pytest.approx(0.4)


def test_both_ends_of_each_edge_are_drawn() -> None:
    kerb = Obstacle("kerb", 18.0, 4.0, 0.12, left_m=1.0, right_m=-0.7, edge_m=0.23)
    along, across = places_to_draw(Road(obstacle=(kerb,)), 30.0)
    assert np.isin(np.round([-0.7 - 0.001, -0.7 + 0.23, 1.0 - 0.23, 1.0 + 0.001], 4), across).all()
    assert np.isin(np.round([18.0 - 0.001, 18.0 + 0.23, 22.0 - 0.23, 22.0 + 0.001], 4), along).all()


@pytest.mark.parametrize("angle_deg", [-70.0, 70.0])
def test_a_skew_kerb_is_drawn_without_teeth(angle_deg: float) -> None:
    kerb = Obstacle(kind="kerb", start_m=8.0, height_m=0.06, edge_m=0.02, angle_rad=math.radians(angle_deg))
    road = Road(obstacle=(kerb,))
    along, across = places_to_draw(road, 30.0)
    s, d = np.meshgrid(along, across, indexing="ij")
    heights = surface(obstacle=(kerb,)).at(s.ravel(), d.ravel())[:, 0].reshape(s.shape)
    corners, triangles = DrawnSurface(along, across, heights).mesh(road)
    distances = []
    for one, other in ((0, 1), (1, 2), (2, 0)):
        a, b = corners[triangles[:, one]], corners[triangles[:, other]]
        crosses = (a[:, 2] - 0.03) * (b[:, 2] - 0.03) < 0.0
        part = ((0.03 - a[:, 2]) / np.where(crosses, b[:, 2] - a[:, 2], 1.0))[crosses, None]
        x, y, _ = (a[crosses] + part * (b - a)[crosses]).T
        distances.append((x - 8.0) * math.cos(kerb.angle_rad) + y * math.sin(kerb.angle_rad))
    assert np.ptp(np.concatenate(distances)) < 0.1
