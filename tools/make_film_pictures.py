"""Makes the still and the animation of README and documentation: `python tools/make_film_pictures.py`.

Both are of the sine with dwell, in which the three systems differ most. It needs offscreen OpenGL; to be run again when
films look different, or the car or a controller has changed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from PIL import Image

from activesteer.conventions import SYSTEM_LABELS
from activesteer.scenario import resolve
from activesteer.simulation.preparation import prepared
from activesteer.simulation.runner import run_scenario
from activesteer.video import Film, Settings

PICTURES: Final = Path(__file__).resolve().parents[1] / "docs" / "pictures"
STILL, ANIMATION = PICTURES / "film_rear_steering.webp", PICTURES / "film_three_systems.webp"
LAYOUT_SIZE: Final = (850, 360)
"""The width of README on GitHub."""
RATE_HZ: Final = 10.0
FROM_S, TO_S = -0.2, 4.0
"""Of the animation, from the begin of steering [s]."""
STILL_S: Final = 0.55
"""Of the still: the steering wheel goes back, the rear wheels are turned most [s]."""
QUALITY: Final = 45


def main() -> None:
    """Drives the three systems and draws them."""
    scenario = prepared(resolve("sine_with_dwell"))
    runs = {name: run_scenario(scenario, name) for name in SYSTEM_LABELS}
    begin_s = runs["none"].metrics["steer_begin_time_s"]
    with Film({"ars": runs["ars"]}, Settings()) as film:
        Image.fromarray(film.picture(begin_s + STILL_S)).save(STILL, quality=85)
    with Film(runs, Settings(size=LAYOUT_SIZE, layout="side-by-side", gauges="sideslip")) as film:
        count = round((TO_S - FROM_S) * RATE_HZ)
        pictures = [Image.fromarray(film.picture(begin_s + FROM_S + number / RATE_HZ)) for number in range(count)]
    first, *others = pictures
    times_ms = [round(1000.0 / RATE_HZ)] * (count - 1) + [2000]
    first.save(ANIMATION, save_all=True, append_images=others, duration=times_ms, loop=0, quality=QUALITY, method=4)
    for file in (STILL, ANIMATION):
        print(f"{file.name}: {file.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
