"""Makes the pictures of the documentation that come from runs: `python tools/make_doc_pictures.py [NAME]...`

One for every manoeuvre, as `activesteer run MANEUVER --plot` draws it, and those of the controller and tyre pages. Without names all
are made, in a minute or two; to be run again when the car, a controller or a manoeuvre has changed.
"""

from __future__ import annotations

import io
import re
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from PIL import Image

from activesteer.analysis.figures import BY_KIND, time_histories
from activesteer.resources import list_maneuvers, models_dir
from activesteer.runner import prepared, run_scenario
from activesteer.scenario import resolve

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOCS: Final = Path(__file__).resolve().parents[1] / "docs"
DOTS_PER_INCH: Final = 90
COLOURS: Final = 64
"""A plot has few colours and their shades: a palette makes the file a third as large."""
SYSTEMS: Final = ("none", "ars", "afs")
CONTROL_FREE: Final = frozenset({"slowly_increasing_steer", "constant_radius", "open_loop"})
"""Kinds that are there to look at the car itself, or in which no system has anything to do."""


def main(names: Sequence[str]) -> None:
    """Draws the pictures with these names, or all."""
    pictures: dict[str, Callable[[], Mapping[str, Figure]]] = {
        name: lambda name=name: {f"manoeuvre_{name}": _manoeuvre(name)} for name in list_maneuvers()
    }
    pictures |= {"controller": _controller, "tyres": _tyres}
    for name in names or pictures:
        if name not in pictures:
            sys.exit(f"there is no picture {name}; there are: {', '.join(pictures)}")
        for file, figure in pictures[name]().items():
            _save(figure, DOCS / "pictures" / f"{file}.png")


def _manoeuvre(name: str) -> Figure:
    scenario = prepared(resolve(name))
    kind = scenario.maneuver.kind
    controllers = ("none",) if kind in CONTROL_FREE else SYSTEMS
    return _draw(kind, {controller: run_scenario(scenario, controller) for controller in controllers})


def _controller() -> dict[str, Figure]:
    """The controller of the page on controllers, which is cut out of that page."""
    page = (DOCS / "controller.md").read_text(encoding="utf-8")
    found = re.search(r"```python\n(# yaw_damper\.py\n.*?)```", page, re.DOTALL)
    if found is None:
        sys.exit("docs/controller.md has no block that begins with `# yaw_damper.py`")
    scenario = prepared(resolve("sine_with_dwell"))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "yaw_damper.py")
        file.write_text(found[1], encoding="utf-8")
        runs = {"none": run_scenario(scenario), "YawDamper": run_scenario(scenario, f"{file}:YawDamper")}
    return {"controller_sine_with_dwell": _draw(scenario.maneuver.kind, runs)}


def _tyres() -> dict[str, Figure]:
    """Side force of the summer and of the winter tyre over slip angle, at three loads."""
    import numpy as np  # noqa: PLC0415 - only for this one

    from activesteer.pictures import new_figure  # noqa: PLC0415
    from activesteer.tyre import MagicFormula, load_tir  # noqa: PLC0415

    figure = new_figure(6.0, 3.2)
    axis = figure.subplots()
    alpha_deg = np.linspace(0.0, 15.0, 151)
    for file, colour in (("compact_205_55R16", "#333333"), ("winter_205_55R16", "#0072b2")):
        tyre = MagicFormula(load_tir(models_dir() / "tyres" / f"{file}.tir"))
        for load_N in (2000.0, 4000.0, 6000.0):
            forces = tyre.evaluate(np.full_like(alpha_deg, load_N), 0.0, np.radians(alpha_deg))
            label = file if load_N == 4000.0 else "_hidden"
            axis.plot(alpha_deg, forces.fy_N / 1000.0, color=colour, label=label)
    axis.set(xlabel="slip angle [deg]", ylabel="side force [kN]", xlim=(0.0, 15.0))
    axis.grid(visible=True, color="#dddddd", linewidth=0.6)
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(frameon=False)
    return {"tyres_side_force": figure}


def _draw(kind: str, runs: Mapping[str, Any]) -> Figure:
    return BY_KIND.get(kind, time_histories.general)(runs)


def _save(figure: Figure, path: Path) -> None:
    with io.BytesIO() as stream:
        figure.savefig(stream, dpi=DOTS_PER_INCH, format="png")
        picture = Image.open(stream).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    picture.save(path, optimize=True)
    print(f"{path.relative_to(DOCS.parent)}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
