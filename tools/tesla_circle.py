"""Contributions to the steering wheel angle of the Tesla Model S on its measured circle.

python tools/tesla_circle.py prints where the predicted angle comes from: the steps from geometry to the second
prediction, the second prediction without one effect, and with one open decision reversed. docs/measured_cars.md shows
the numbers. `changed` also gives the values of the car in models/reference/tesla_model_s/validation.toml.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.config import read_toml
from activesteer.core.conventions import Array
from activesteer.measured.circle import steering_wheel_deg
from activesteer.measured.folder_file import MeasuredFile, read_measured
from activesteer.resources import find_vehicle, models_dir
from activesteer.studies.engine.workers import in_parallel
from activesteer.vehicle.curve_axles import COORDINATES, upper_triangle

FOLDER: Final = models_dir() / "reference" / "tesla_model_s"
VEHICLE: Final = "tesla_model_s"
Case = dict[str, Any]
"""Overrides of the car on the circle."""
_TOE, _CAMBER, _SIDE = (COORDINATES.index(name) for name in ("toe", "camber", "y"))
_ENTRIES: Final = np.triu_indices(5)
_RADIUS_M: Final = 0.335
"""Height of the wheel centre: a side force at the road acts at the centre as the force and a moment about x."""


class Change(NamedTuple):
    """A change of the car, whose given fields act in this order."""

    without: tuple[str, ...] = ()  # effects to remove
    set: Mapping[str, Any] = MappingProxyType({})  # overrides
    axle: str = "front"  # axle of the following fields
    hold: str = ""  # curve over travel to be held at its static value
    centre: str = ""  # curve over travel to be shifted so that its static value is zero
    steer: float = 1.0  # factor on the steer angle of the rack
    steer_at_lock: float | None = None  # the factor at the lock. It changes in proportion to the rack travel.
    lock_m: float = 0.06  # rack travel at the lock [m]
    compliance: str = ""  # change of the linear compliance, one of `COMPLIANCES`


def changed(case: Case, *changes: Change) -> Case:
    """Return a case with changes."""
    curves = read_toml(find_vehicle(VEHICLE))[0]["curves"]
    for change in changes:
        for name in change.without:
            case = changed(case, *EFFECTS[name])
        case = case | dict(change.set)
        key = f"curves.{change.axle}."

        def curve(name: str, case: Case = case, change: Change = change) -> Array:
            return np.array(case.get(f"curves.{change.axle}.{name}", curves[change.axle][name]), np.float64)

        for name, held in ((change.hold, True), (change.centre, False)):
            if name:
                values = curve(name)
                static = float(np.interp(0.0, curve("travel_m"), values))
                case[key + name] = (np.full_like(values, static) if held else values - static).tolist()
        if change.steer != 1.0 or change.steer_at_lock is not None:
            end = change.steer if change.steer_at_lock is None else change.steer_at_lock
            factors = change.steer + (end - change.steer) * np.abs(curve("rack_m")) / change.lock_m
            case[key + "rack_steer_deg"] = (factors * curve("rack_steer_deg")).tolist()
        if change.compliance:
            matrix = np.zeros((5, 5))
            matrix[_ENTRIES] = curve("stiffness")
            compliance = np.asarray(np.linalg.inv(matrix + np.triu(matrix, 1).T), np.float64)
            COMPLIANCES[change.compliance](compliance)
            inverse = np.asarray(np.linalg.inv(compliance), np.float64)
            case[key + "stiffness"] = np.array(upper_triangle(inverse)).tolist()
    return case


def without(case: Case, *effects: str) -> Case:
    """Return a case without effects."""
    return changed(case, Change(without=effects))


def _no_toe_by_force(compliance: Array) -> None:
    """Leave only the compliance of toe to aligning moment."""
    others = [index for index in range(5) if index != _TOE]
    compliance[_TOE, others] = compliance[others, _TOE] = 0.0


def _least_toe_by_moment(compliance: Array) -> None:
    """Keep toe over side force, and reduce toe over aligning moment to the least value that allows."""
    others = [index for index in range(5) if index != _TOE]
    coupling = compliance[_TOE, others]
    least = float(coupling @ np.linalg.solve(compliance[np.ix_(others, others)], coupling))
    # Slightly above the bound of a positive definite matrix, and positive where side force has no effect.
    compliance[_TOE, _TOE] = max(1.05 * least, 1e-2 * compliance[_TOE, _TOE])


def _no_camber(compliance: Array) -> None:
    """Reduce the camber compliance to a thousandth, without a change of toe versus side force at the road."""
    own, over_roll = compliance[_CAMBER, _CAMBER], compliance[_TOE, _CAMBER]
    compliance[_CAMBER, :] = compliance[:, _CAMBER] = 0.0
    compliance[_CAMBER, _CAMBER] = 1e-3 * own
    compliance[_TOE, _SIDE] += _RADIUS_M * over_roll
    compliance[_SIDE, _TOE] = compliance[_TOE, _SIDE]


def _reversed_toe(compliance: Array) -> None:
    compliance[_TOE, :] *= -1.0
    compliance[:, _TOE] *= -1.0


COMPLIANCES: Final = {
    "no_toe_by_force": _no_toe_by_force, "least_toe_by_moment": _least_toe_by_moment, "no_camber": _no_camber,
    "reversed_toe": _reversed_toe,
}  # fmt: skip
BY_MOMENT: Final = tuple(f"toe over aligning moment, {axle} (assumed)" for axle in ("front", "rear"))
COLUMN: Final = "twist of the column (assumed)"
EFFECTS: Final[dict[str, Sequence[Change]]] = {
    **{f"roll steer, {axle}": [Change(axle=axle, hold="toe_deg")] for axle in ("front", "rear")},
    **{
        f"toe over side force, {axle}": [Change(axle=axle, compliance="no_toe_by_force")] for axle in ("front", "rear")
    },
    **{
        f"toe over aligning moment, {axle} (assumed)": [Change(axle=axle, compliance="least_toe_by_moment")]
        for axle in ("front", "rear")
    },
    "all six effects on toe": [
        Change(
            without=(
                "roll steer, front", "roll steer, rear", "toe over side force, front", "toe over side force, rear",
                *BY_MOMENT,
            )
        )
    ],
    **{f"camber over side force, {axle}": [Change(axle=axle, compliance="no_camber")] for axle in ("front", "rear")},
    **{f"static camber, {axle}": [Change(axle=axle, centre="camber_deg")] for axle in ("front", "rear")},
    "static toe, rear": [Change(axle="rear", centre="toe_deg")],
    COLUMN: [Change(set={"stiff_column": True})],
    "drive on the front wheels (assumed)": [Change(set={"powertrain.front_fraction": 0.0})],
}  # fmt: skip
"""Effect -> changes that remove it."""
STEPS: Final = (
    ("geometry and tyres", "geometry", ()),
    ("camber over side force", "measured", ("camber over side force, front", "camber over side force, rear")),
    ("static camber and toe", "measured", ("static camber, front", "static camber, rear", "static toe, rear")),
    ("toe over travel (roll steer)", "measured", ("roll steer, front", "roll steer, rear")),
    ("toe over side force", "measured", ("toe over side force, front", "toe over side force, rear")),
    ("toe over aligning moment", "assumed", BY_MOMENT),
    ("twist of the column", "assumed", (COLUMN,)),
)
"""Name, origin and effects of each step from geometry and tyres to the second prediction. Toe over side force is the
last measured step: without the assumed compliance to aligning moment, an axle cannot have it and no camber over side
force."""
DECISIONS: Final = {
    "no toe over aligning moment (assumed: the compact's)": [Change(without=BY_MOMENT)],
    # isteerR 0.070055, isteerL 0.0646: half of their sum over isteerL, and their ratio.
    "isteerR as given (used: the mirror image of isteerL)": [Change(steer=1.0422213622291)],
    "isteer_skalar for both wheels (used: isteerL and its mirror image)": [Change(steer=1.08444272445820)],
    # The maker's service manual (Technical Data) gives 2.45 turns from lock to lock, a circle of 12.4 m between kerbs
    # and a variable ratio. At 441 deg `isteerL` turns the outer wheel by 25.6 deg. That circle needs
    # asin(2.96 / (6.2 - 0.12)) = 29.1 deg, which is 12.4 % more of the mean angle, 28.5 deg. The rack travel at the
    # lock is 441 deg at 7.5 mm per radian.
    "steering ratio of the maker's circle between kerbs, everywhere": [Change(steer=1.124)],
    "the same ratio at the lock, unchanged at the centre": [Change(steer_at_lock=1.124, lock_m=0.0577)],
    "anti-roll bars twice as stiff (used: rate of an axle, like springs)": [Change(set={"factors.anti_roll_bar": 2.0})],
    "springs and bars twice as stiff (used: rates of an axle)": [
        Change(set={"factors.anti_roll_bar": 2.0, "factors.spring_rate": 2.0})
    ],
    "elkin_y_toe of the front axle reversed (used: toe-out)": [Change(compliance="reversed_toe")],
    "elkin_y_toe of both axles reversed (used: understeering)": [
        Change(compliance="reversed_toe"), Change(axle="rear", compliance="reversed_toe"),
    ],
}  # fmt: skip
"""Open decision -> changes that reverse it."""
PREDICTION: Final = Change(without=(*BY_MOMENT, COLUMN))
"""From the second to the main prediction: `[circle.prediction]`, and the low end of the interval of compliance."""
QUICK_RATIO: Final = Change(steer=1.08479327259986)  # 15.48 / 14.27
"""The low end of the interval of the steering ratio."""


def fall(case: Case, place: int) -> Case:
    """Return the case of a step: without the effects that later steps add."""
    return without(case, *(name for _, _, adds in STEPS[:place:-1] for name in adds))


def main() -> None:
    """Drive all cases, and print three tables."""
    file: MeasuredFile = read_measured(FOLDER)
    full = file.on_circle
    tables = {
        "From geometry to the second prediction [deg]": {
            f"{name} ({origin})": fall(full, place) for place, (name, origin, _) in enumerate(STEPS)
        },
        "Second prediction without one effect [deg]": {name: without(full, name) for name in EFFECTS},
        "Second prediction with one open decision reversed [deg]": {
            name: changed(full, *changes) for name, changes in DECISIONS.items()
        },
    }
    calls = [(VEHICLE, case) for cases in tables.values() for case in cases.values()]
    angles = iter(in_parallel(steering_wheel_deg, calls))
    for title, cases in tables.items():
        print(title)
        for name in cases:
            print(f"  {name:70} {next(angles):6.1f}")


if __name__ == "__main__":
    main()
