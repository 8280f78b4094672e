"""Runs for the sliders: a choice of the page becomes curves, track, poses and key figures of each controller."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.metrics import KEY_FIGURES
from activesteer.analysis.report.curves import plots
from activesteer.analysis.report.groups import groups_of
from activesteer.analysis.report.run_page import write_report
from activesteer.controllers import controller_spec
from activesteer.core.conventions import run_looks
from activesteer.core.metric_table import Better, recorded_metric
from activesteer.drawing.panels import EXPLORE
from activesteer.errors import ActiveSteerError, ParameterError
from activesteer.explore.car_shape import poses_of, shape_of
from activesteer.explore.choice import Folder, check_numbers
from activesteer.explore.messages import Choice, Describe, RunRequest
from activesteer.explore.sliders import Slider, sliders
from activesteer.plugins import Plugin
from activesteer.recording import Recording
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import Scenario, resolve
from activesteer.simulation.preparation import with_amplitude_found
from activesteer.simulation.simulation import Simulation

_CHUNK: Final = 500
"""Steps between two looks for a newer choice; about 10 ms."""


class Reply(NamedTuple):
    """A message to the page."""

    header: dict[str, Any]  # JSON values; `kind` names the message
    arrays: tuple[NDArray[np.float32], ...] = ()  # numbers that follow the header, 32 bits each


class Runs:
    """Runs for the sliders, with what is worth keeping between two of them."""

    def __init__(self, folder: Folder) -> None:
        """Start without a run."""
        self.folder = folder
        self._held_rad: dict[tuple[str, str], float] = {}
        self._kept: dict[str, tuple[str, Recording]] = {}  # name -> label and recording of its last run
        self._limits_of: tuple[Any, dict[str, tuple[float, float]]] = None, {}
        self._choice: tuple[Choice, dict[str, float]] | None = None

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
                "shape": header,
            },
            tuple(arrays),
        )

    def run(self, choice: RunRequest, stale: Callable[[], bool]) -> Iterator[Reply]:
        """Drive the chosen controllers, and yield a reply for each as soon as it is driven."""
        self.folder.check(choice)
        overrides = choice.values
        check_numbers(overrides, self._limits(choice))
        scenario = self._held(choice, self._resolved(choice, overrides))
        looks = run_looks(choice.controllers)
        self._kept, self._choice = {}, (choice, overrides)
        for name in choice.controllers:
            look = looks[name]
            run = {"kind": "run", "name": name, "label": look.label, "place": look.place, "dashes": look.dashes}
            run["title"] = scenario.maneuver.title or choice.maneuver
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
            shown = plots(groups_of({f"{name}.mcap": recording})[0], EXPLORE)
            yield Reply({**run, "plots": shown, "figures": _figures(recording), "pose_step_s": step_s}, (poses,))
        yield Reply({"kind": "finished", **self._commands(choice, overrides)})

    def save(self) -> Reply:
        """Write the last runs as recordings."""
        paths = []
        for label, recording in self._runs().values():
            path = free_path(self.folder.path, f"{recording.metadata['maneuver']['name']}-{label}", ".mcap")
            recording.save(path)
            paths.append(path)
        return Reply({"kind": "saved", "files": [path.name for path in paths], "folder": str(self.folder.path)})

    def report(self, path: Path) -> Reply:
        """Write a report of the last runs."""
        write_report({f"{_plain(name)}.mcap": recording for name, (_, recording) in self._runs().items()}, path)
        return Reply({"kind": "report"})

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
        """Return the limits of the sliders; those of the last choice are kept, since they take as long as a run."""
        names = choice.maneuver, choice.vehicle, choice.driver, choice.controllers
        if self._limits_of[0] != names:
            self._limits_of = names, {slider.key: (slider.low, slider.high) for slider in self._sliders(choice)}
        return self._limits_of[1]

    def _held(self, choice: RunRequest, scenario: Scenario) -> Scenario:
        """Return a scenario with its amplitude: that of the last search while a slider moves, else a new one."""
        maneuver: Any = scenario.maneuver
        if maneuver.search is None:
            return with_amplitude_found(scenario)
        key = choice.maneuver, choice.vehicle
        if choice.dragging and key in self._held_rad:
            return replace(scenario, maneuver=maneuver.with_amplitude(self._held_rad[key]))
        ready = with_amplitude_found(scenario)
        steer: Any = ready.maneuver
        self._held_rad[key] = steer.steer.steering_wheel_rad
        return ready

    def _driven(self, scenario: Scenario, controller: Plugin, stale: Callable[[], bool]) -> Recording | None:
        """Return the recording of a run, or None if a newer choice has come."""
        if stale():
            return None
        simulation = Simulation(scenario, controller)
        while not simulation.done:
            if stale():
                return None
            simulation.advance(min(_CHUNK, simulation.steps - round(simulation.time_s / 1e-3)))
        return simulation.recording()

    def _commands(self, choice: Choice, overrides: Mapping[str, float]) -> dict[str, str]:
        """Return the command line and the Python code that repeat the runs."""
        words = ["activesteer", "run", choice.maneuver]
        words += [word for name in choice.controllers for word in ("-c", name)]
        words += ["--vehicle", choice.vehicle] if choice.vehicle != "compact" else []
        words += ["--driver", choice.driver] if choice.driver != DEFAULT_DRIVER else []
        words += [word for key, value in overrides.items() for word in ("--set", f"{key}={value:g}")]
        given = {
            "vehicle": choice.vehicle if choice.vehicle != "compact" else None,
            "overrides": {key: float(f"{value:g}") for key, value in overrides.items()} or None,
            "driver": choice.driver if choice.driver != DEFAULT_DRIVER else None,
        }
        more = "".join(f", {key}={json.dumps(value)}" for key, value in given.items() if value is not None)
        names = json.dumps(list(choice.controllers))
        python = f"runs = [activesteer.simulate({json.dumps(choice.maneuver)}, name{more}) for name in {names}]"
        return {"command": shlex.join(words), "python": python}


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
    found = []
    for title, names in KEY_FIGURES.items():
        name = next((name for name in names if name in recording.metrics), None)
        if name is not None:
            metric, value = recorded_metric(name), float(recording.metrics[name]) * recorded_metric(name).unit.factor
            size = abs(value) if metric.better is Better.SMALLER else value
            shown = size if math.isfinite(size) else None
            digits = 0 if metric.whole else None  # by size
            found.append({"title": title, "unit": metric.unit_name, "value": shown, "digits": digits})
    return found
