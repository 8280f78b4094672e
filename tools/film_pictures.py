"""Make the still and the animations of README and documentation: `python tools/renew.py films [NAME]...`.

The still and the animation of README are of the sine with dwell, in which the three systems differ most; each page of
manoeuvres has an animation of one of its own. Names of files choose some of them. It needs offscreen OpenGL; to be run
again when films look different, or the car or a controller has changed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from PIL import Image

from activesteer.core.conventions import SYSTEM_LABELS
from activesteer.recording import Recording
from activesteer.scenario import resolve
from activesteer.simulation.preparation import with_amplitude_found
from activesteer.simulation.runner import run_scenario
from activesteer.video import Film, Settings

PICTURES: Final = Path(__file__).resolve().parents[1] / "docs" / "pictures"
STILL, ANIMATION = PICTURES / "film_rear_steering.webp", PICTURES / "film_three_systems.webp"
LAYOUT_SIZE: Final = (850, 360)
"""The width of README on GitHub."""
SCENE_SIZE, SINGLE_SIZE = (720, 300), (640, 400)
RATE_HZ: Final = 10.0
FROM_S, TO_S = -0.2, 4.0
"""Of the animation, from the begin of steering [s]."""
STILL_S: Final = 0.55
"""Of the still: the steering wheel goes back, the rear wheels are turned most [s]."""
QUALITY: Final = 45


class Scene(NamedTuple):
    """An animation of a page of manoeuvres.

    Attributes:
        maneuver: The manoeuvre.
        systems: The systems to show side by side.
        from_s: Time of the first picture [s].
        to_s: Time of the last picture [s].
        camera: The camera.
        gauges: What the gauges show.
    """

    maneuver: str
    systems: tuple[str, ...]
    from_s: float
    to_s: float
    camera: str = "chase"
    gauges: str = "sideslip"


SCENES: Final = {
    "braking": Scene("split_mu_braking", ("none", "integrated"), 0.8, 4.8),
    "lane_changes": Scene("slalom", ("none", "ars"), 2.0, 6.0),
    "low_speed": Scene("parking", ("none",), 3.0, 9.0, "top", "full"),
    "phases": Scene("fishhook", ("none", "lqr"), 0.6, 5.0),
    "steady_state": Scene("slowly_increasing_steer", ("none", "ars"), 34.0, 38.0),
    "uneven_roads": Scene("kerb_strike", ("none",), 0.6, 2.6, "wheel", "full"),
}
"""Animations by their page. That on transient manoeuvres shows the one of README."""


def draw_films(names: Sequence[str] = ()) -> None:
    """Drive the cars and draw them."""
    wanted = set(names)
    known = {STILL.name, ANIMATION.name, *(f"film_{page}.webp" for page in SCENES)}
    if unknown := wanted - known:
        raise SystemExit(f"no film is named {', '.join(sorted(unknown))}; known are: {', '.join(sorted(known))}")
    for page, scene in SCENES.items():
        name = f"film_{page}.webp"
        if not wanted or name in wanted:
            scenario = with_amplitude_found(resolve(scene.maneuver))
            runs = {system: run_scenario(scenario, system) for system in scene.systems}
            size, layout = (SCENE_SIZE, "side-by-side") if len(runs) > 1 else (SINGLE_SIZE, "overlay")
            settings = Settings(scene.camera, "fr", size, layout=layout, gauges=scene.gauges)
            animate(runs, settings, PICTURES / name, scene.from_s, scene.to_s)
    if not wanted or wanted & {STILL.name, ANIMATION.name}:
        scenario = with_amplitude_found(resolve("sine_with_dwell"))
        runs = {name: run_scenario(scenario, name) for name in SYSTEM_LABELS}
        begin_s = runs["none"].metrics["steer_begin_time_s"]
        with Film({"ars": runs["ars"]}, Settings()) as film:
            Image.fromarray(film.picture(begin_s + STILL_S)).save(STILL, quality=85)
        settings = Settings(size=LAYOUT_SIZE, layout="side-by-side", gauges="sideslip")
        animate(runs, settings, ANIMATION, begin_s + FROM_S, begin_s + TO_S)


def animate(runs: Mapping[str, Recording], settings: Settings, file: Path, from_s: float, to_s: float) -> None:
    """Write the animation of some runs."""
    count = round((to_s - from_s) * RATE_HZ)
    with Film(runs, settings) as film:
        first, *others = (Image.fromarray(film.picture(from_s + number / RATE_HZ)) for number in range(count))
    times_ms = [round(1000.0 / RATE_HZ)] * (count - 1) + [2000]
    first.save(file, save_all=True, append_images=others, duration=times_ms, loop=0, quality=QUALITY, method=4)
    print(f"{file.name}: {file.stat().st_size / 1000:.0f} kB")
