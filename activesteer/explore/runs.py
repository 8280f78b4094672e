"""Runs for the sliders: curves, track, poses and key figures of each controller for a choice of the page."""

from __future__ import annotations

import json
import math
import re
import shlex
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.harm import LOST, losses, shown
from activesteer.analysis.metrics import key_figures_of
from activesteer.analysis.report.curves import plots
from activesteer.analysis.report.groups import groups_of
from activesteer.analysis.series import changed_friction
from activesteer.analysis.step_response import NOT_FOLLOWED, follows_steering, without_response
from activesteer.config import field_in_unit, is_overruled, leaves, spellings
from activesteer.controllers import controller_spec, declared_parameters
from activesteer.core.conventions import CORNERS, run_looks
from activesteer.core.metric_table import LANE_OVERSTEP, Better, recorded_metric
from activesteer.core.units import parameter_label, parameter_words, split_ending
from activesteer.drawing.car_model import scene_of
from activesteer.drawing.cars import CHASSIS, dressed, height_colours
from activesteer.drawing.panels import EXPLORE
from activesteer.errors import ActiveSteerError, ManeuverError, ParameterError
from activesteer.explore.choice import Folder, check_numbers
from activesteer.explore.messages import Choice, Describe, RunRequest
from activesteer.maneuver.base import MIN_SEARCH_SPEED_MPS
from activesteer.plugins import Declared, Plugin
from activesteer.recording import Recording
from activesteer.resources import DEFAULT_DRIVER
from activesteer.road.course import Footprint
from activesteer.road.drawn import surface_in
from activesteer.road.road import road_of
from activesteer.scenario import Scenario, holders_of, resolve, value_of
from activesteer.simulation.preparation import searched_angle, with_amplitude_found
from activesteer.simulation.simulation import Simulation
from activesteer.vehicle import Vehicle

_MANEUVER: Final = {
    "speed_kmh": (20.0, 160.0, 1.0),
    "road.mu": (0.1, 1.1, 0.01),
    "road.mu_left": (0.1, 1.1, 0.01),
    "road.mu_right": (0.1, 1.1, 0.01),
    "road.patches.0.mu": (0.1, 1.1, 0.01),
    "steer.lateral_acceleration_mps2": (0.5, 9.0, 0.1),
    "steer.amplitude_factor": (0.5, 8.0, 0.1),
    "cones.spacing_m": (20.0, 60.0, 0.5),
    "cones.offset_m": (0.5, 4.0, 0.05),
    "brake.pedal": (0.0, 1.0, 0.01),
}
"""Smallest and largest value and step of each slider, by key of a manoeuvre. The ranges suit passenger cars."""
_CAR: Final = {
    "factors.mass": (0.8, 1.4, 0.01),
    "factors.yaw_inertia": (0.7, 1.4, 0.01),
    "load.cg_forward_change_m": (-0.3, 0.3, 0.005),
    "factors.front_cornering_stiffness": (0.6, 1.4, 0.01),
    "factors.rear_cornering_stiffness": (0.6, 1.4, 0.01),
    "factors.tyre_friction": (0.5, 1.2, 0.01),
    "factors.damper": (0.3, 2.0, 0.05),
    "factors.anti_roll_bar": (0.0, 2.0, 0.05),
    "factors.servo_lag": (0.2, 4.0, 0.1),
}
"""The same for keys of a vehicle."""
_UNIT: Final = "control unit and bus"
"""Group of the parameters that all controllers share."""
_TIMES: Final = 4.0
"""Greatest value of the slider of a gain, in multiples of its current value."""
_STEPS: Final = 200
_COVERED: Final = ("controllers", "single_track", "two_track")
"""Tables of a vehicle that controllers read; the controllers declare which keys they use."""


class Slider(NamedTuple):
    """A slider of the page, with its key and range."""

    key: str  # key as `--set` takes it
    label: str  # label in words, without its group
    unit: str  # unit of its value; empty for a pure number
    group: str  # `manoeuvre`, `car`, or a table of the parameters of controllers, in words
    low: float  # least value
    high: float  # greatest value
    step: float  # distance between two values
    value: float  # value of the files


def sliders(scenario: Scenario, controllers: Sequence[str], own: Mapping[str, Path] | None = None) -> list[Slider]:
    """Return the sliders of a run. A group in `own` gets a slider for every number in the user's file."""
    found = [*_of("manoeuvre", scenario, _MANEUVER), *_of("car", scenario, _CAR)]
    for group, file in (own or {}).items():
        found += _of_file(group, scenario, file)
    for name in controllers:
        for key, declared in declared_parameters(name, scenario.car.config.controllers).items():
            if (gain := _gain(key, declared)) is not None:
                found.append(gain)
    first: dict[str, Slider] = {}
    for slider in found:  # a file may give a quantity in another unit
        first.setdefault(split_ending(slider.key)[0], slider)
    return list(first.values())


def _of(group: str, scenario: Scenario, ranges: Mapping[str, tuple[float, float, float]]) -> Iterator[Slider]:
    for key, (least, high, step) in ranges.items():
        if not holders_of(key, type(scenario.maneuver)):
            continue  # the error of `value_of` would look for similar names, which takes 50 ms
        searches = key == "speed_kmh" and scenario.maneuver.search is not None
        low = max(least, round(3.6 * MIN_SEARCH_SPEED_MPS, 6)) if searches else least
        with suppress(ParameterError):  # a key may have no value
            value = value_of(scenario, key)
            # A manoeuvre that begins at rest has its speeds in its phases.
            if _moves(scenario, key, value) and not (key == "speed_kmh" and value == 0.0):
                yield Slider(key, *parameter_label(key), group, min(low, value), max(high, value), step, value)


def _of_file(group: str, scenario: Scenario, file: Path) -> Iterator[Slider]:
    """Yield a slider for each positive number in a file, from half to twice its value."""
    table = tomllib.loads(file.read_text("utf-8"))
    for path, given in leaves(table).items():
        key = ".".join(path)
        if path[0] in _COVERED or not _is_number(given):
            continue
        with suppress(ParameterError):  # such as the keys of a table that is read from another file
            value = value_of(scenario, key)
            if _moves(scenario, key, value) and value > 0.0:
                label, unit = parameter_label(key)
                high = 1.0 if not unit and value <= 1.0 else 2.0 * value
                digits = 4 - math.floor(math.log10(high))
                yield Slider(key, label, unit, group, 0.5 * value, high, round(high / _STEPS, digits), value)


def _moves(scenario: Scenario, key: str, value: Any) -> bool:
    """Return whether the slider of a key has an effect at a value."""
    owner, _, name = key.rpartition(".")
    return _is_number(value) and not (owner and is_overruled(value_of(scenario, owner), name))


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _gain(key: str, declared: Declared) -> Slider | None:
    """Return the slider of a gain, from zero to a multiple of its value, or None if it is not a number."""
    if not _is_number(declared.default):
        return None
    tables, _, name = key.rpartition(".")
    shown = spellings(name)[-1]
    _, factor = field_in_unit(shown, (name,))
    value, (low, high) = declared.default / factor, (limit / factor for limit in declared.limits)
    top = min(high, _TIMES * abs(value) if value else 1.0)
    bottom = max(low, 0.0 if value >= 0.0 else -top)
    digits = 4 - math.floor(math.log10(max(top - bottom, 1e-9)))
    label, unit = parameter_label(f"{tables}.{shown}")
    table = tables.split(".")[1] if "." in tables else ""
    # The table of a user's controller has the name of its class.
    group = parameter_words(re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", table).lower()) if table else _UNIT
    label = label.removeprefix(parameter_words(table)).removeprefix(":").strip()
    return Slider(
        f"{tables}.{shown}", label, unit or declared.unit, group, bottom, round(top, digits),
        round((top - bottom) / _STEPS, digits), value,
    )  # fmt: skip


BODIES: Final = (CHASSIS, *(f"{corner}_wheel" for corner in CORNERS))
"""Bodies whose poses the page gets, in this order."""
POSE_HZ: Final = 50.0
"""Rate of the poses of a recorded run [1/s]; the page interpolates between them."""


def shape_of(vehicle: Vehicle) -> tuple[dict[str, Any], list[NDArray[np.float32]]]:
    """Return the surfaces of a car for the page."""
    size = Footprint.from_table(vehicle.dimensions())
    _, panels = dressed(scene_of(vehicle.model), size)
    shown = [panel for panel in panels if panel.body in BODIES]
    header = {
        "bodies": list(BODIES),
        "size": {"front_m": size.front_m, "rear_m": size.rear_m, "width_m": size.width_m},
        "panels": [{"body": panel.body, "rgb": panel.rgb} for panel in shown],
    }
    arrays = [
        np.asarray(values[panel.faces.reshape(-1)], np.float32)
        for panel in shown
        for values in (panel.vertices_m, panel.normals)
    ]
    return header, arrays


def poses_of(recording: Recording) -> tuple[float, NDArray[np.float32]]:
    """Return the poses of `BODIES` of a recorded run."""
    poses = recording.poses
    step_s = float(np.median(np.diff(poses.time_s))) if len(poses.time_s) > 1 else 1.0 / POSE_HZ
    every = max(1, round(1.0 / (POSE_HZ * step_s)))
    columns = [poses.names.index(name) for name in BODIES]
    both = np.concatenate([poses.positions_m[::every, columns], poses.quaternions[::every, columns]], axis=2)
    return every * step_s, both.astype(np.float32)


def surface_of(recording: Recording) -> tuple[float, tuple[NDArray[np.float32], ...]]:
    """Return the ground for the page: its height, and the coloured mesh of an uneven road."""
    drawn = surface_in(recording.metadata)
    if drawn is None:
        return 0.0, ()
    corners_m, triangles = drawn.mesh(road_of(recording.metadata))
    factors = height_colours(corners_m[:, 2]) / height_colours(np.zeros(1))
    low = corners_m[:, 2] < 0.0
    factors[low] = factors[low].min(axis=1, keepdims=True)  # dark: blue is a slippery road
    return drawn.plane_below_m, (corners_m.astype(np.float32), factors.astype(np.float32), triangles.astype(np.float32))


_CHUNK: Final = 500
"""Steps between two checks for a newer choice; about 10 ms."""


class Reply(NamedTuple):
    """A message to the page."""

    header: dict[str, Any]  # JSON values; `kind` names the message
    arrays: tuple[NDArray[np.float32], ...] = ()  # numbers that follow the header, 32 bits each


class Runs:
    """Runs for the sliders, with the data that are kept between two runs."""

    def __init__(self, folder: Folder) -> None:
        """Start without a run."""
        self.folder = folder
        self._held_rad: dict[tuple[str, str], float] = {}
        self._kept: dict[str, tuple[str, Recording]] = {}  # name -> label and recording of its last run
        self._files: list[Path] = []  # recordings that hold these runs
        self._limits_of: tuple[Any, dict[str, tuple[float, float]]] = None, {}

    def describe(self, choice: Describe) -> Reply:
        """Return the sliders and the car of a choice."""
        self.folder.check(choice)
        self._limits_of = None, {}  # files may have changed
        scenario = self._resolved(choice, {})
        header, arrays = shape_of(scenario.car.on(scenario.maneuver.road, 1e-3))
        return Reply(
            {
                "kind": "description",
                "title": scenario.maneuver.title or choice.maneuver,
                "sliders": [slider._asdict() for slider in self._sliders(choice)],
                "steered": scenario.maneuver.course is None,
                "shape": header,
            },
            tuple(arrays),
        )

    def run(self, choice: RunRequest, stale: Callable[[], bool]) -> Iterator[Reply]:
        """Drive the chosen controllers, and yield a reply when each run ends."""
        self._kept, self._files = {}, []  # what fails from here on leaves nothing to save
        self.folder.check(choice)
        check_numbers(choice.values, self._limits(choice))
        scenario, overrides, held, note = self._held(choice, choice.values)
        looks = run_looks(choice.controllers)
        road = scenario.maneuver.road
        mu = None if is_overruled(road, "mu") else road.mu
        for name in choice.controllers:
            look = looks[name]
            run = {"kind": "run", "name": name, "place": look.place, "dashes": look.dashes, "mu": mu}
            run |= {"title": (scenario.maneuver.title or choice.maneuver) + held, "note": note}
            run["a_deg"] = _a_deg(scenario)
            try:
                controller = controller_spec(self.folder.located(name))
                recording = self._driven(scenario, controller, stale)
            except ActiveSteerError as error:
                yield Reply({**run, "error": str(error)})
                continue
            if recording is None:
                return
            self._kept[name] = controller.label, recording
            step_s, poses = poses_of(recording)
            drawn = plots(groups_of({f"{name}.mcap": recording})[0], EXPLORE)
            run["patches_s"] = changed_friction(recording)[0]
            run["losses"] = list(losses(recording.metrics))
            run["remark"] = "" if follows_steering(recording) else NOT_FOLLOWED
            surface: tuple[NDArray[np.float32], ...] = ()
            if len(self._kept) == 1 and not choice.dragging:  # all runs have the same road
                run["ground_m"], surface = surface_of(recording)
            shown_run = {**run, "plots": drawn, "figures": _figures(recording), "pose_step_s": step_s}
            yield Reply(shown_run, (poses, *surface))
        yield Reply({"kind": "finished", **self._commands(choice, overrides, list(self._kept))})

    def save(self) -> Reply:
        """Write the last runs as recordings, unless they are saved already."""
        folder = str(self.folder.path)
        if self._files and all(file.exists() for file in self._files):
            return Reply({"kind": "saved", "files": [], "exist": [file.name for file in self._files], "folder": folder})
        paths = []
        for label, recording in self._runs().values():
            path = free_path(self.folder.path, f"{recording.metadata['maneuver']['name']}-{label}", ".mcap")
            recording.save(path)
            paths.append(path)
        self._files = paths
        return Reply({"kind": "saved", "files": [path.name for path in paths], "folder": folder})

    def driven(self) -> dict[str, Recording]:
        """Return the recordings of the last runs, with the names of their files in a report as keys."""
        return {f"{_plain(name)}.mcap": recording for name, (_, recording) in self._runs().items()}

    def _runs(self) -> dict[str, tuple[str, Recording]]:
        if not self._kept:
            raise ParameterError("there is no run to save yet; move a slider or choose a manoeuvre")
        return self._kept

    def _resolved(self, choice: Choice, overrides: Mapping[str, float]) -> Scenario:
        maneuver, vehicle, driver = map(self.folder.located, (choice.maneuver, choice.vehicle, choice.driver))
        return resolve(maneuver, vehicle, overrides, driver, controllers=self._located(choice))

    def _located(self, choice: Choice) -> list[str]:
        return [self.folder.located(name) for name in choice.controllers]

    def _sliders(self, choice: Choice) -> list[Slider]:
        named = {"manoeuvre": choice.maneuver, "car": choice.vehicle}
        own = {group: self.folder.path / name for group, name in named.items() if name.endswith(".toml")}
        return sliders(self._resolved(choice, {}), self._located(choice), own)

    def _limits(self, choice: Choice) -> dict[str, tuple[float, float]]:
        """Return the limits of the sliders. They are cached, because they take as long as a run."""
        names = choice.maneuver, choice.vehicle, choice.driver, choice.controllers
        if self._limits_of[0] != names:
            self._limits_of = names, {slider.key: (slider.low, slider.high) for slider in self._sliders(choice)}
        return self._limits_of[1]

    def _held(self, choice: RunRequest, overrides: dict[str, float]) -> tuple[Scenario, dict[str, float], str, str]:
        """Return a scenario with its amplitude, its overrides, words for its title, and a note for the reader."""
        # While a slider moves, the amplitude comes from the last search, else from a new one. If a new search fails,
        # the amplitude stays, and becomes an override.
        scenario, key = self._resolved(choice, overrides), (choice.maneuver, choice.vehicle)
        if choice.dragging and key in self._held_rad:
            found = with_amplitude_found(scenario, angle_rad=self._held_rad[key])
            return found, overrides, " (amplitude as before, until you let go)", ""
        try:
            if (angle_rad := searched_angle(scenario)) is not None:
                self._held_rad[key] = angle_rad
            return with_amplitude_found(scenario, angle_rad=angle_rad), overrides, "", ""
        except ManeuverError:
            if scenario.maneuver.search is None:
                raise
            if key not in self._held_rad and (angle_rad := searched_angle(self._resolved(choice, {}))) is not None:
                self._held_rad[key] = angle_rad
        fixed, words = _fixed_amplitude(with_amplitude_found(scenario, angle_rad=self._held_rad[key]), overrides)
        note = f"The search for the amplitude fails with these values, so {words}."
        return with_amplitude_found(self._resolved(choice, fixed)), fixed, "", note

    def _driven(self, scenario: Scenario, controller: Plugin, stale: Callable[[], bool]) -> Recording | None:
        """Return the recording of a run, or None if a newer choice has arrived."""
        if stale():
            return None
        simulation = Simulation(scenario, controller)
        while not simulation.done:
            if stale():
                return None
            simulation.advance(min(_CHUNK, simulation.steps - round(simulation.time_s / 1e-3)))
        return simulation.recording()

    def _commands(self, choice: Choice, overrides: Mapping[str, float], driven: Sequence[str]) -> dict[str, str]:
        """Return the command line and the Python code that repeat the runs of some controllers."""
        if not driven:
            return {"command": "", "python": ""}
        words = ["activesteer", "run", choice.maneuver]
        words += [word for name in driven for word in ("-c", name)]
        words += ["--vehicle", choice.vehicle] if choice.vehicle != "compact" else []
        words += ["--driver", choice.driver] if choice.driver != DEFAULT_DRIVER else []
        words += [word for key, value in overrides.items() for word in ("--set", f"{key}={value:g}")]
        given = {
            "vehicle": choice.vehicle if choice.vehicle != "compact" else None,
            "overrides": {key: float(f"{value:g}") for key, value in overrides.items()} or None,
            "driver": choice.driver if choice.driver != DEFAULT_DRIVER else None,
        }
        more = "".join(f", {key}={json.dumps(value)}" for key, value in given.items() if value is not None)
        names = json.dumps(list(driven))
        python = f"runs = [activesteer.simulate({json.dumps(choice.maneuver)}, name{more}) for name in {names}]"
        return {"command": shlex.join(words), "python": python}


def _a_deg(scenario: Scenario) -> float | None:
    """Return A, the steering wheel angle at 0.3 g [deg], if the amplitude is a multiple of A."""
    steer: Any = getattr(scenario.maneuver, "steer", None)
    factor, angle_rad = (getattr(steer, name, None) for name in ("amplitude_factor", "steering_wheel_rad"))
    return math.degrees(angle_rad) / factor if factor and angle_rad is not None else None


_SEARCHED: Final = {"steer": "steering_wheel", "turn": "steering_wheel", "": "reference_angle"}
"""Keys of the steering wheel angles that a search finds, without their unit, by table of a manoeuvre, or none."""


def _fixed_amplitude(scenario: Scenario, overrides: Mapping[str, float]) -> tuple[dict[str, float], str]:
    """Return overrides that give the amplitude of a scenario without a search, and the amplitude in words."""
    maneuver: Any = scenario.maneuver
    for table, name in _SEARCHED.items():
        owner = getattr(maneuver, table, None) if table else maneuver
        angle_rad = getattr(owner, f"{name}_rad", None)
        if angle_rad is not None:
            angle_deg = float(f"{math.degrees(angle_rad):g}")  # as the command repeats it
            useless = {f"{table}.{key}" for key in getattr(owner, "OVERRULED", {})}
            kept = {key: value for key, value in overrides.items() if key not in useless}
            words = f"the {name.replace('_', ' ').removesuffix(' angle')} angle stays at {angle_deg:.0f} deg"
            if factor := getattr(owner, "amplitude_factor", None):
                words = f"A, the steering wheel angle at 0.3 g, stays at {angle_deg / factor:.1f} deg"
                words += f" as the last search found it. The amplitude is {angle_deg:.0f} deg"
            return {**kept, f"{table}.{name}_deg".lstrip("."): angle_deg}, words
    raise ManeuverError(f"{maneuver.name}: the amplitude of this manoeuvre has no key")


def free_path(folder: Path, stem: str, suffix: str) -> Path:
    """Return a path in a folder that does not exist yet, numbered if necessary."""
    path, number = folder / f"{stem}{suffix}", 1
    while path.exists():
        number += 1
        path = folder / f"{stem}_{number}{suffix}"
    return path


def _plain(name: str) -> str:
    """Return a controller's name as part of a file name."""
    return "".join(letter if letter.isalnum() else "_" for letter in name)[:100]


def _figures(recording: Recording) -> list[dict[str, Any]]:
    """Return the key figures of a run in display units."""
    found, metrics = [], without_response(recording, recording.metrics)
    for title, name in key_figures_of(metrics).items():
        metric, value = recorded_metric(name), float(metrics[name]) * recorded_metric(name).unit.factor
        size = abs(value) if metric.better is Better.SMALLER else value
        is_lost = shown(name, metrics, "") == LOST
        # Times differ by milliseconds, and lengths by millimetres; other values have digits by their size.
        fine = metric.unit_name == "s" or (metric.unit_name == "m" and size < 1.0)
        digits = 0 if metric.whole else 3 if fine else None
        known = size if math.isfinite(size) and not is_lost else None
        figure = {"title": title, "unit": metric.unit_name, "value": known, "digits": digits, "lost": is_lost}
        if name == LANE_OVERSTEP:  # a distance that is negative inside the lane reads like a fault
            figure["value"] = None if known is None else -known
        found.append(figure)
    return found
