"""Driver and car as one loop: whether they come to rest on a path."""

from __future__ import annotations

import pytest

from activesteer.studies.driver_loop import driver_loops
from activesteer.studies.small_step import damping_of, small_step

ALWAYS_ACTIVE = {
    f"controllers.{system}.corrector.{key}": value
    for system in ("ars", "afs")
    for key, value in (("deadband_start_degps", 0.0), ("deadband_end_degps", 0.001))
}
"""Correctors without a tolerance band."""
FRICTIONLESS = {"vehicle.friction.rack_N": 0.0}


@pytest.mark.parametrize("speed_kmh", [80.0, 100.0])
@pytest.mark.parametrize(
    ("controller", "overrides"),
    [("none", {}), ("ars", {}), ("afs", {}), ("ars", ALWAYS_ACTIVE), ("afs", ALWAYS_ACTIVE)],
    ids=["none", "ars", "afs", "ars_active", "afs_active"],
)
def test_typical_driver_and_car_are_damped_by_a_quarter(speed_kmh, controller, overrides):
    assert damping_of(small_step(speed_kmh / 3.6, controller, overrides=overrides))[0] >= 0.25


def test_drivers_differ_as_their_names_say():
    novice, typical, expert = (
        damping_of(small_step(100.0 / 3.6, driver=driver)) for driver in ("novice", "typical", "expert")
    )
    assert 0.0 < novice[0] < typical[0] < expert[0]
    # Who looks further ahead corrects more slowly.
    assert novice[1] > typical[1] > expert[1]


@pytest.mark.parametrize("controller", ["none", "ars"])
def test_linear_loop_is_damped_as_the_car_is_in_a_run(controller):
    # Without the friction of the rack, which no linear car can have, and without a tolerance band.
    (loop,) = driver_loops(controllers=[controller], speeds_kmh=[100.0], overrides=FRICTIONLESS | ALWAYS_ACTIVE)
    linear, natural_radps = loop.loop.damping()
    assert linear > 0.25
    assert loop.damping_in_run == pytest.approx(linear, abs=0.05)
    assert natural_radps > 1.0
