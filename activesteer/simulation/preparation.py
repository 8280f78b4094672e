"""Searches by driving before a scenario can run: single-track model, amplitude of the steering wheel."""

from __future__ import annotations

from dataclasses import replace

from activesteer.controllers import find_controller
from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.recording import Recording
from activesteer.scenario import Scenario
from activesteer.simulation.amplitude_search import amplitude
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.recorder import Recorder
from activesteer.simulation.run_context import RunContext
from activesteer.simulation.single_track_search import with_identified_single_track
from activesteer.theory.single_track import IDENTIFY


def prepared(scenario: Scenario, timestep_s: float = DEFAULT_TIMESTEP_S) -> Scenario:
    """Return the scenario with the results of all searches: single-track model, steering wheel amplitude.

    Args:
        scenario: A scenario.
        timestep_s: Step of the simulation [s].

    Returns:
        A scenario whose input is the same for every controller.

    Raises:
        ManeuverError: no amplitude gives the lateral acceleration.
    """
    if scenario.car.config.single_track.source == IDENTIFY:
        scenario = with_identified_single_track(scenario, _test_drive)
    # The search drives the car without faults and with ideal sensors, so that the input does not depend on them.
    search = replace(scenario.maneuver, fault=()).search
    if search is None:
        return scenario
    found = search.accept(amplitude(replace(scenario, car=scenario.car.with_ideal_sensors()), search, timestep_s))
    return replace(scenario, maneuver=replace(found, fault=scenario.maneuver.fault))


def _test_drive(scenario: Scenario) -> Recording:
    loop = ClosedLoop(replace(scenario, car=scenario.car.with_ideal_sensors()))
    recorder = Recorder(loop.vehicle, loop.steps)
    loop.run(recorder)
    return RunContext.of(scenario, loop.vehicle, find_controller("none")).recording(recorder)
