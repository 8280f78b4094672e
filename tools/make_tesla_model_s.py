"""Make the Tesla Model S of the package from the published numbers: tyre file, K&C tables, car.

python tools/make_tesla_model_s.py writes models/tyres/tesla_245_45R19.tir, models/reference/tesla_model_s/kc,
models/mjcf/tesla_model_s and models/vehicles/tesla_model_s.toml. What was settled and assumed stands here beside the
number, and in models/reference/tesla_model_s/README.md.
"""

from __future__ import annotations

import datetime
import json
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.config import toml_text
from activesteer.core.conventions import Array
from activesteer.resources import models_dir
from activesteer.studies.linear.identification import RADIUS_TEST, identify, write_identified
from activesteer.vehicle_builder import new_vehicle

SOURCE: Final = "TUMFTM/VVUQ-Framework; Danquah et al., Applied Sciences 11 (2021) 3, and Danquah's dissertation (TUM)"
NAME: Final = "tesla_model_s"
FOLDER: Final = models_dir() / "reference" / NAME
TYRE: Final = "tesla_245_45R19.tir"
ROLL_CENTRE_M: Final = 0.09
"""zRC* is -0.2606 m and r_stat0 0.3506 m: counted from the wheel centre, the roll centres lie 0.09 m over the road."""
PINION_M: Final = 0.0075
"""Chosen, because the source has no rack: rack travel over steering wheel angle."""
TRAVEL_M: Final = np.linspace(-0.08, 0.08, 33)
FORCE_N: Final = np.linspace(-4000.0, 4000.0, 17)
TYRE_WIDTH_M: Final = 0.245
MOTOR: Final = {
    "speed_radps": [0.0, 1900.0], "torque_Nm": [330.0, 330.0], "max_power_W": 150e3, "gear_ratio": 9.7,
    "efficiency": 0.9, "idle_loss_W": 300.0, "lag_s": 0.05, "rotor_inertia_kgm2": 0.0425,
}  # fmt: skip
"""The motor of each axle of a 85D, as a guess: 330 N m and half of the power of the car. Its gear is the maker's, its
efficiency, loss, lag and inertia are assumptions."""
WHEEL_KG: Final = 23.57
"""Of each wheel: `Iwf` and `Iwr` are those of a disc of 47.15 kg with the radius `r_stat0`, and that is what the
regression of the source's institute gives for both wheels of an axle (TUMFTM/TOTEM, after Fuchs, TUM 2014)."""


def main() -> None:
    """Write all files."""
    vehicle = json.loads((FOLDER / "vehicle.json").read_text(encoding="utf-8"))
    tyre = json.loads((FOLDER / "tyre.json").read_text(encoding="utf-8"))
    write_tyre(tyre, models_dir() / "tyres" / TYRE)
    tables = FOLDER / "kc"
    tables.mkdir(exist_ok=True)
    write_tables(vehicle, tables)
    (tables / "car.toml").write_text(car_table(vehicle), encoding="utf-8")
    make_car(NAME, tables, "python tools/make_tesla_model_s.py")


def make_car(name: str, tables: Path, command: str) -> None:
    """Make a car of the package from the tables of a rig.

    Args:
        name: Name of the car.
        tables: Folder with `car.toml` and the curves.
        command: Command that repeats this.
    """
    with tempfile.TemporaryDirectory() as scratch:
        made = new_vehicle(name, folder=Path(scratch) / name, kc=tables)
        mjcf = models_dir() / "mjcf" / name
        mjcf.mkdir(exist_ok=True)
        for file in made.folder.iterdir():
            if file.suffix == ".xml" or file.name == "README.md":
                shutil.copyfile(file, mjcf / file.name)
        text = made.vehicle_file.read_text(encoding="utf-8").replace(
            f'mjcf = "{name}.xml"', f'mjcf = "{name}/{name}.xml"'
        )
        file = models_dir() / "vehicles" / f"{name}.toml"
        file.write_text(text, encoding="utf-8")
        print(*made.questions, sep="\n")
    tell_controllers(file, name, command)


def tell_controllers(file: Path, name: str, command: str) -> None:
    """Write what controllers and estimators know of the car, from its runs, by the rules in the compact's file."""
    found = identify(name)
    write_identified(file, found, command, datetime.date.today().isoformat())
    text = file.read_text(encoding="utf-8")
    start = text.index("# Controllers of the compact")
    controllers = re.sub(r"^#.*\n", "", text[start:], flags=re.MULTILINE).replace(
        "max_lateral_acceleration_mps2 = 7.74",
        f"max_lateral_acceleration_mps2 = {0.9 * found.tests[RADIUS_TEST]['limit_acceleration_mps2']:.2f}",
    )
    model = found.single_track
    rear = model.rear_stiffness_Nprad * model.cg_to_rear_m / model.yaw_inertia_kgm2
    front = model.front_stiffness_Nprad * model.cg_to_front_m / model.yaw_inertia_kgm2
    note = (
        "# Chosen: the paper's controllers by the compact's rules. a_y_max: reached by this car with mu 0.9.\n"
        f"# The gains are those of the compact. Yaw rate over rear angle integrates with {rear:.0f} 1/s, over front\n"
        f"# angle with {front:.0f} 1/s (compact: 105 and 49), so the phase margins are larger.\n"
    )
    file.write_text(text[:start] + note + controllers, encoding="utf-8")


def write_tyre(given: dict[str, Any], file: Path) -> None:
    """Write the tyre as PAC2002 with half of DIAMETER as radius, as UNLOADED_RADIUS (0.314 m) is another tyre's."""
    dimension = {
        "UNLOADED_RADIUS": 0.5 * given["DIAMETER"], "WIDTH": given["WIDTH"], "ASPECT_RATIO": given["ASPECT_RATIO"],
        "RIM_RADIUS": 0.5 * 0.0254 * given["RIM"], "RIM_WIDTH": given["RIM_WIDTH"],
    }  # fmt: skip
    sections: dict[str, dict[str, Any]] = {
        "MODEL": {"PROPERTY_FILE_FORMAT": "'PAC2002'", "VXLOW": 1, "LONGVL": given["LONGVL"], "TYRESIDE": "'LEFT'"},
        "DIMENSION": dimension,
        "VERTICAL": _of(given, "VERTICAL_STIFFNESS", "VERTICAL_DAMPING", "BREFF", "DREFF", "FREFF", "FNOMIN"),
        "LONG_SLIP_RANGE": _of(given, "KPUMIN", "KPUMAX"),
        "SLIP_ANGLE_RANGE": _of(given, "ALPMIN", "ALPMAX"),
        "INCLINATION_ANGLE_RANGE": _of(given, "CAMMIN", "CAMMAX"),
        "VERTICAL_FORCE_RANGE": _of(given, "FZMIN", "FZMAX"),
        "SCALING_COEFFICIENTS": {key: value for key, value in given.items() if key.startswith("L") and key in _SCALES},
        "LONGITUDINAL_COEFFICIENTS": _starting(given, _LONGITUDINAL),
        "OVERTURNING_COEFFICIENTS": _starting(given, ("QSX",)),
        "LATERAL_COEFFICIENTS": _starting(given, _LATERAL),
        "ROLLING_COEFFICIENTS": _starting(given, ("QSY",)),
        "ALIGNING_COEFFICIENTS": _starting(given, ("QBZ", "QCZ", "QDZ", "QEZ", "QHZ", "SSZ", "QTZ")),
    }  # fmt: skip
    lines = [
        f"$ 245/45 R 19 of the Tesla Model S: coefficients of {SOURCE}, as facts.",
        "$ Same tyre on both axles, at its own pressure: pressure terms have no effect and are left out.",
        "[UNITS]", "LENGTH = 'meter'", "FORCE = 'newton'", "ANGLE = 'radian'", "MASS = 'kg'", "TIME = 'second'",
    ]  # fmt: skip
    for section, values in sections.items():
        lines += [f"[{section}]", *(f"{key:24} = {value}" for key, value in values.items())]
    file.write_text("\n".join([*lines, ""]), encoding="utf-8")


_LONGITUDINAL: Final = ("PCX", "PDX", "PEX", "PKX", "PHX", "PVX", "RBX", "RCX", "REX", "RHX", "PTX")
_LATERAL: Final = ("PCY", "PDY", "PEY", "PKY", "PHY", "PVY", "RBY", "RCY", "REY", "RHY", "RVY", "PTY")
_SCALES: Final = (
    "LFZO", "LCX", "LMUX", "LEX", "LKX", "LHX", "LVX", "LGAX", "LCY", "LMUY", "LEY", "LKY", "LHY", "LVY", "LGAY", "LTR",
    "LRES", "LGAZ", "LXAL", "LYKA", "LVYKA", "LS", "LSGKP", "LSGAL", "LGYR", "LMX", "LVMX", "LMY",
)  # fmt: skip


def _of(given: dict[str, Any], *keys: str) -> dict[str, Any]:
    return {key: given[key] for key in keys}


def _starting(given: dict[str, Any], starts: tuple[str, ...]) -> dict[str, Any]:
    return {key: value for key, value in given.items() if key.startswith(starts)}


def write_tables(given: dict[str, Any], folder: Path) -> None:
    """Write the data of each axle in the form of a laboratory report."""
    for axle, end, track in (("front", "f", given["sF"]), ("rear", "r", given["sR"])):
        toe, toe0 = given[f"kin_toe_{end}"]
        camber, camber0 = given[f"kin_camb_{end}"]
        rate = _rate(given[f"cF_{axle}_travel_m__force_N"])
        # Roll centre at ROLL_CENTRE_M: the contact point moves outwards by its height over half the track.
        columns = {
            "left_travel [m]": TRAVEL_M,
            "left_toe [deg]": toe0 + toe * TRAVEL_M,
            "left_camber [deg]": -(camber0 + camber * TRAVEL_M),
            "left_contact_outwards [m]": ROLL_CENTRE_M / (0.5 * track) * TRAVEL_M,
            "left_load [N]": rate * TRAVEL_M,
        }
        _write(folder / f"{axle}_parallel_travel.csv", columns)
        # Side force towards the middle of the car: the left wheel's is to the right.
        columns = {
            "force [N]": FORCE_N,
            "left_toe [deg]": np.polyval(given[f"elkin_y_toe_{end}"], FORCE_N),
            "left_camber [deg]": np.polyval(given[f"elkin_y_camb_{end}"], FORCE_N),
        }
        _write(folder / f"{axle}_side_force_opposed.csv", columns)
        # elkin_x counts braking; the tables count forwards.
        columns = {"force [N]": -FORCE_N, "left_toe [deg]": np.polyval(given[f"elkin_x_toe_{end}"], FORCE_N)}
        _write(folder / f"{axle}_braking_force.csv", columns)
    angle = np.linspace(-460.0, 460.0, 47)
    # isteerL is the left wheel's, isteer its mirror image; isteerR is the scalar ratio, which no symmetrical car has.
    steer = np.polyval(given["isteerL"], angle)
    _write(folder / "front_steering.csv", {"steering_wheel [deg]": angle, "left_toe [deg]": -steer})


def _rate(curve: list[list[float]]) -> float:
    travel, force = np.array(curve).T
    return float(np.polyfit(travel, force, 1)[0])


def _write(file: Path, columns: dict[str, Array]) -> None:
    rows = [",".join(f"{value:.7g}" for value in row) for row in np.array(list(columns.values())).T]
    file.write_text("\n".join([f"# {SOURCE}", ",".join(columns), *rows, ""]), encoding="utf-8")


def car_table(given: dict[str, Any]) -> str:
    """Return the table of the car."""
    to_front, to_rear, height = given["lF"], given["lR"], given["zSP_r"]
    unsprung = {"front": given["m_usF"], "rear": given["m_usR"]}
    tracks = {"front": given["sF"], "rear": given["sR"]}
    arms = {"front": to_front, "rear": to_rear}
    # I* are taken as those of the sprung mass: the whole car's yaw inertia is then 0.94 m l_f l_r, a car's; without the
    # unsprung masses it would be 0.80.
    centre = 0.335
    ix, iy, iz = given["Ix"], given["Iy"], given["Iz"]
    for axle, mass in unsprung.items():
        low, side = height - centre, 0.5 * tracks[axle]
        ix += mass * (side**2 + low**2)
        iy += mass * (arms[axle] ** 2 + low**2)
        iz += mass * (side**2 + arms[axle] ** 2)
    table: dict[str, Any] = {
        "units": "m",
        "source": SOURCE,
        "width_m": 1.964,
        "mass": {
            "total_kg": given["m"],
            "front_fraction": round(to_rear / given["l"], 5),
            "cg_height_m": height,
            "inertia_kgm2": [round(ix, 1), round(iy, 1), round(iz, 1)],
        },
        "steering": {"rack_limit_m": round(PINION_M * np.radians(455.0), 4)},
        "brakes": {"front_torque_Nm": 3600.0, "rear_torque_Nm": 1700.0, "drag_torque_Nm": 3.0},
        # A 85D as a guess: both axles driven, as in the source (FWD and RWD are 1).
        "powertrain": {
            "front_fraction": 0.5, "max_torque_Nm": 6400.0, "max_power_W": 300e3, "engine_brake_torque_Nm": 1200.0,
            "max_wheel_speed_radps": 195.0,
        },
        "motors": {"front": MOTOR, "rear": MOTOR},
        "battery": {"discharge_power_W": 340e3, "charge_power_W": 60e3, "auxiliary_power_W": 500.0},
        "aerodynamics": {"drag_area_m2": given["cx"], "pressure_point_m": [-1.48, 0.0, 0.6]},
    }  # fmt: skip
    for axle, end, x in (("front", "F", 0.0), ("rear", "R", -given["l"])):
        carrier = 0.0 if axle == "front" else 6.0
        knuckle = round(0.5 * unsprung[axle] - WHEEL_KG - carrier, 2)
        # Bars and dampers of the source are those of an axle, as its springs are: csF is twice a wheel's rate.
        compression, rebound = (-0.5 * given[f"dd{end}_{way}"][0] for way in ("comp", "reb"))
        table[axle] = {
            "type": "curves",
            "tyre": TYRE,
            "anti_roll_bar_Npm": round(0.25 * given[f"carb{end}"], 1),
            "bump_stop_m": 0.05,
            "rebound_stop_m": 0.07,
            "stop_stiffness": [4e4, 2.4e6, 9e7],
            "damper_ratio": 1.0,
            "damper_velocity_mps": [-2.0, 0.0, 2.0],
            "damper_force_N": [round(-2.0 * rebound, 1), 0.0, round(2.0 * compression, 1)],
            "damper_friction_N": 40.0,
            "wheel_mass_kg": WHEEL_KG,
            "wheel_spin_inertia_kgm2": round(0.5 * given[f"Iw{end.lower()}"], 4),
            "wheel_inertia_kgm2": round(0.25 * given[f"Iw{end.lower()}"] + WHEEL_KG * TYRE_WIDTH_M**2 / 12.0, 4),
            "knuckle_mass_kg": knuckle,
            "points": {"wheel_centre": [x, 0.5 * tracks[axle], centre]},
        }
    return f"# Made by tools/make_tesla_model_s.py, which lists the assumptions.\n{toml_text(table)}"


if __name__ == "__main__":
    main()
