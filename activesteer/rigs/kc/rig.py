"""Call of the kinematics and compliance rig."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from activesteer.errors import ModelError
from activesteer.rigs.kc.metrics import load_targets
from activesteer.rigs.kc.programme import measure
from activesteer.rigs.kc.result import KcResult, evaluated
from activesteer.scenario import FileOrTable, check_gains, load_car
from activesteer.vehicle.parameters import Friction


def kinematics_compliance(
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    targets: str | os.PathLike[str] | None = None,
) -> KcResult:
    """Measure kinematics and compliance of a car with a held chassis and its wheels on pads.

    Args:
        vehicle: Name, path, or table of a vehicle.
        overrides: Dotted key of the vehicle, such as `factors.mass`, to value.
        targets: File with target bands. Default: the file with the vehicle's name in `models/targets`.

    Returns:
        Metrics with their bands, and all curves, of the car without the dry friction of its dampers and rack.

    Raises:
        ParameterError: the vehicle or the targets are not found or wrong.
        ModelError: the model is not found, lacks a part, or has no equilibrium.
        TyreFileError: a tyre file is not found or wrong.

    Examples:
        >>> from activesteer.rigs.kc.rig import kinematics_compliance
        >>> result = kinematics_compliance("compact")
        >>> result["front", "bump_steer"] < 0.0
        True
    """
    car = load_car(vehicle, overrides)
    check_gains(overrides or {}, ())
    bands = load_targets(car.name, targets)
    # Dry friction acts equally in both directions: without it the rig finds the mean of both directions of a sweep.
    # The play of screws is removed for the same reason: the rig would find one of its ends by chance.
    rear = car.config.rear_actuator.smooth()
    smooth = dataclasses.replace(car, config=dataclasses.replace(car.config, friction=Friction(), rear_actuator=rear))
    try:
        measured = measure(smooth.on(), car.tyres)
    except np.linalg.LinAlgError as reason:
        raise ModelError(f"{car.mjcf}: the car has no equilibrium on the rig: {reason}") from reason
    except KeyError as reason:
        # The message of the engine's look-up by name lists the known names.
        raise ModelError(
            f"{car.mjcf}: the kinematics and compliance rig needs a part that the model lacks: {reason}"
        ) from reason
    return evaluated(car.name, measured, bands)
