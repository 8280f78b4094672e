"""Modes of small systems with known solutions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import block_diag, expm

from activesteer.errors import ModelError
from activesteer.vehicle.linear_state import find_modes
from tests.raising import raises

STEP_S = 0.001


def oscillator(frequency_Hz: float, damping: float) -> np.ndarray:
    w = 2.0 * math.pi * frequency_Hz
    return np.array([[0.0, 1.0], [-(w**2), -2.0 * damping * w]])


def blocks(*parts: np.ndarray | list[list[float]]) -> np.ndarray:
    return np.asarray(block_diag(*parts), dtype=np.float64)


def modes(a: np.ndarray, states: tuple[str, ...]):
    return find_modes(np.asarray(expm(a * STEP_S), dtype=np.float64), states, STEP_S)


def test_frequency_and_damping_of_oscillators_come_out_in_order():
    a = blocks(oscillator(12.0, 0.3), oscillator(1.2, 0.25), [[-0.5]])
    found = modes(a, ("fl_jounce", "d_fl_jounce", "z", "d_z", "d_x"))
    assert [mode.name for mode in found][:2] == ["speed", "bounce"]
    assert [mode.natural_frequency_Hz for mode in found] == pytest.approx([0.5 / 2 / math.pi, 1.2, 12.0])
    assert [mode.damping_ratio for mode in found] == pytest.approx([1.0, 0.25, 0.3])
    assert all(sum(mode.participation.values()) == pytest.approx(1.0) for mode in found)


def test_left_and_right_wheels_move_alike_or_against_each_other():
    k, c = (2 * math.pi * 12.0) ** 2, 20.0
    stiffness = np.array([[k, -0.1 * k], [-0.1 * k, k]])
    a = np.block([[np.zeros((2, 2)), np.eye(2)], [-stiffness, -c * np.eye(2)]])
    found = modes(a, ("fl_jounce", "fr_jounce", "d_fl_jounce", "d_fr_jounce"))
    assert [mode.name for mode in found] == ["front wheel hop, parallel", "front wheel hop, opposite"]


def test_roll_is_one_mode_even_where_it_mixes_with_yaw():
    a = blocks(oscillator(1.6, 0.27), oscillator(2.0, 0.6))
    turn = np.array([[0.6, 0.0, 0.8, 0.0], [0.0, 0.6, 0.0, 0.8], [-0.8, 0.0, 0.6, 0.0], [0.0, -0.8, 0.0, 0.6]])
    found = modes(turn @ a @ turn.T, ("roll", "d_roll", "d_y", "d_yaw"))
    assert sorted(mode.name for mode in found) == ["roll", "yaw/sideslip"]


def test_left_and_right_eigenvectors_belong_together():
    a = blocks(oscillator(5.0, 0.2), oscillator(1.0, 0.1))
    for mode in modes(a, ("z", "d_z", "roll", "d_roll")):
        assert mode.left @ mode.shape == pytest.approx(1.0)


def test_state_of_no_known_part_is_named_itself():
    assert modes(np.array([[-3.0]]), ("d_trailer",))[0].name == "trailer"


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_motion_without_a_full_set_of_modes_is_answered(value):
    with raises(ModelError, cause=np.linalg.LinAlgError):
        find_modes(np.array([[value, 0.0], [0.0, 1.0]]), ("d_x", "d_y"), STEP_S)
