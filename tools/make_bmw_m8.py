"""Make the BMW M8 of the package: tyre files, tables of the axles, car.

python tools/make_bmw_m8.py writes models/tyres/bmw_m8_*.tir, models/reference/bmw_m8/kc (except car.toml, which is
written by hand and gives the source of each number), models/mjcf/bmw_m8 and models/vehicles/bmw_m8.toml.

No kinematics, compliance or tyre of this car is public. Both are those of the Tesla Model S, the only car of a similar
class in the package: without its springs, and with the steering ratio of the M8.
"""

from __future__ import annotations

import re
from typing import Final

from make_tesla_model_s import make_car

from activesteer.resources import models_dir

NAME: Final = "bmw_m8"
RATIO: Final = 14.3
"""Steering ratio of the maker [-]. The tables of the Tesla have 15.48."""
TESLA_RATIO: Final = 15.48
TYRES: Final = {"front": ("275/35 ZR 20", 0.275), "rear": ("285/35 ZR 20", 0.285)}
"""Axle -> size and width [m]; aspect ratio 0.35, rim 20 in."""
SERVOS: Final = """# The front servo turns its hinge with 8 rad/s: quicker at the wheels than with the compact's ratio.
[controllers.servos]
superposition_rate_degps = 32.0
"""
_RIM_M: Final = 0.254


def main() -> None:
    """Write all files."""
    models = models_dir()
    tesla = (models / "tyres" / "tesla_245_45R19.tir").read_text(encoding="utf-8")
    for axle, (size, width_m) in TYRES.items():
        text = tesla.replace(
            tesla.splitlines()[0],
            f"$ {size} of the BMW M8: size of this tyre, and all coefficients of the Tesla's 245/45 R 19\n"
            "$ (tesla_245_45R19.tir), as a tyre of a similar class. Made by tools/make_bmw_m8.py.",
        )
        for key, value in {
            "UNLOADED_RADIUS": _RIM_M + 0.35 * width_m, "WIDTH": width_m, "ASPECT_RATIO": 0.35, "RIM_RADIUS": _RIM_M,
            "RIM_WIDTH": round(width_m - 0.033, 4),
        }.items():  # fmt: skip
            text = re.sub(rf"^({key} +=) .*$", rf"\1 {value:g}", text, flags=re.MULTILINE)
        (models / "tyres" / f"bmw_m8_{axle}.tir").write_text(text, encoding="utf-8")
    tables = models / "reference" / NAME / "kc"
    for file in (models / "reference" / "tesla_model_s" / "kc").glob("*.csv"):
        source, head, *rows = file.read_text(encoding="utf-8").splitlines()
        cells = [row.split(",") for row in rows]
        names = head.split(",")
        if "left_load [N]" in names:  # springs are those of car.toml
            keep = names.index("left_load [N]")
            names.pop(keep)
            for row in cells:
                row.pop(keep)
        if names[0] == "steering_wheel [deg]":
            for row in cells:
                row[0] = f"{float(row[0]) * RATIO / TESLA_RATIO:.7g}"
        lines = [f"{source}; copied by tools/make_bmw_m8.py", ",".join(names), *map(",".join, cells), ""]
        (tables / file.name).write_text("\n".join(lines), encoding="utf-8")
    make_car(NAME, tables, "python tools/make_bmw_m8.py")
    file = models / "vehicles" / f"{NAME}.toml"
    text = file.read_text(encoding="utf-8")
    note = f"# BMW M8: models/reference/{NAME}/kc/car.toml gives the source of each number.\n"
    file.write_text(f"{note}{text}\n{SERVOS}", encoding="utf-8")


if __name__ == "__main__":
    main()
