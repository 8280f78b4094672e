"""Modes of a linearised car, named after the parts that take part in them.

The participation of state i in mode k is |w_ki v_ik|, with the left and right eigenvectors w and v, divided by the sum
over all states; it does not depend on the units of the states. Bounce, roll and pitch each name the one mode in which
they take part most. Every other mode has the name of another part, the one that takes part most. If two modes are
close, such as roll and yaw/sideslip of a fast car, they mix and exchange their names.

Source: Perez-Arriaga, Verghese and Schweppe, Selective modal analysis, IEEE Trans. Power Apparatus and Systems 101
(1982), participation factors.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.errors import ModelError

_PARTS: Final = (
    ("speed", r"d_x"),
    ("yaw/sideslip", r"d_y|d_yaw"),
    ("bounce", r"(d_)?z"),
    ("roll", r"(d_)?roll"),
    ("pitch", r"(d_)?pitch"),
    ("front wheel hop", r"(d_)?f[lr]_(jounce|z)"),
    ("rear wheel hop", r"(d_)?r[lr]_z"),
    ("front wheel steer", r"(d_)?(f[lr]_(topmount_z|rot_z|toe)|rack)"),
    ("front wheel fore-aft", r"(d_)?f[lr]_(topmount_y|mount_x|x|rot_y|caster)"),
    ("front wheel camber", r"(d_)?f[lr]_(topmount_x|mount_y|y|rot_x|camber)"),
    ("rear wheel steer", r"(d_)?r[lr]_(rot_z|toe|steer)"),
    ("rear wheel fore-aft", r"(d_)?r[lr]_(x|rot_y|caster)"),
    ("rear wheel camber", r"(d_)?r[lr]_(y|rot_x|camber)"),
    ("front wheel rotation", r"d_f[lr]_spin|act_f[lr]_slip_x"),
    ("rear wheel rotation", r"d_r[lr]_spin|act_r[lr]_slip_x"),
    ("front tyre lateral", r"act_f[lr]_slip_y"),
    ("rear tyre lateral", r"act_r[lr]_slip_y"),
    ("front tyre turn slip", r"act_f[lr]_slip_z"),
    ("rear tyre turn slip", r"act_r[lr]_slip_z"),
    ("front damper", r"act_f[lr]_damper_friction|(d_)?f[lr]_mount_z"),
    ("rear damper", r"act_r[lr]_damper_friction|(d_)?r[lr]_mount_z"),
    ("drive", r"act_[fr][lr]_drive"),
    ("rear steering servo", r"act_r[lr]_steer"),
    ("superposition servo", r"act_superposition"),
    ("superposition gear", r"(d_)?superposition"),
    ("steering wheel", r"(d_)?steering_wheel"),
)
"""Parts of a car and their states (see `LocalState`); each other state is its own part."""

_BODY_PARTS: Final = ("bounce", "roll", "pitch")
"""Motions of the body that have one mode each."""

_MIN_LIKENESS: Final = 0.9
"""Least similarity of left and right for a mode to count as parallel or opposite."""


@dataclass(frozen=True)
class Mode:
    """One mode, or a conjugate pair.

    Attributes:
        name: Name of the part that takes part most; with `parallel` or `opposite` for wheels.
        eigenvalue_1ps: s [1/s], imaginary part not negative.
        participation: Participation factors of the parts, largest first; the sum is 1.
        shape: Right eigenvector, complex, shape (n,).
        left: Left eigenvector, complex, shape (n,); its product with `shape` is 1.
    """

    name: str
    eigenvalue_1ps: complex
    participation: dict[str, float]
    shape: NDArray[np.complex128]
    left: NDArray[np.complex128]

    @property
    def natural_frequency_Hz(self) -> float:
        """Undamped natural frequency |s|/2pi [Hz]."""
        return abs(self.eigenvalue_1ps) / (2.0 * math.pi)

    @property
    def damping_ratio(self) -> float:
        """Damping ratio [-]; 1 for a mode that decays without oscillation."""
        return -self.eigenvalue_1ps.real / abs(self.eigenvalue_1ps)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, without the vectors."""
        s = self.eigenvalue_1ps
        return {
            "name": self.name, "natural_frequency_Hz": self.natural_frequency_Hz, "damping_ratio": self.damping_ratio,
            "real_1ps": s.real, "imaginary_1ps": s.imag, "participation": self.participation,
        }  # fmt: skip


def find_modes(a: NDArray[np.float64], states: tuple[str, ...], timestep_s: float) -> list[Mode]:
    """Find the modes of a system in discrete time.

    Args:
        a: System matrix of one step, shape (n, n).
        states: Names of the states, n.
        timestep_s: Length of a step [s].

    Returns:
        Modes by natural frequency; of a conjugate pair the one with positive imaginary part.

    Raises:
        ModelError: the matrix is not finite, or its eigenvectors do not span the states.
    """
    try:
        values, right = np.linalg.eig(a)
        left = np.linalg.inv(right)
    except np.linalg.LinAlgError as reason:
        raise ModelError(f"the car's motion has no full set of modes: {reason}") from reason
    participation = np.abs(right * left.T)
    participation /= participation.sum(axis=0)
    parts = [_part_of(state) for state in states]
    by_mode: dict[int, dict[str, float]] = {}
    for index in np.flatnonzero(np.imag(values) >= 0.0):
        sums = dict.fromkeys(parts, 0.0)
        for part, amount in zip(parts, participation[:, index], strict=True):
            sums[part] += float(amount)
        by_mode[int(index)] = dict(sorted(sums.items(), key=lambda item: -item[1]))
    names: dict[int, str] = {}
    for part in _BODY_PARTS:
        maximum = max(by_mode, key=lambda index: by_mode[index].get(part, 0.0))
        if by_mode[maximum].get(part, 0.0) > 0.0:
            names[maximum] = part
    modes = []
    for index, sums in by_mode.items():
        if values[index] == 0.0:
            continue  # it settles within one step, as a state that each step sets anew
        # ln of a negative real z means half a turn per step: the steps do not resolve such a mode.
        s = complex(np.log(complex(values[index]))) / timestep_s
        name = names.get(index)
        if name is None:
            name = next((part for part in sums if part not in _BODY_PARTS), next(iter(sums)))
            name += _sides(right[:, index], participation[:, index], states)
        modes.append(Mode(name, s, sums, right[:, index].astype(complex), left[index].astype(complex)))
    return sorted(modes, key=lambda mode: (abs(mode.eigenvalue_1ps), mode.name))


def _part_of(state: str) -> str:
    for part, pattern in _PARTS:
        if re.fullmatch(pattern, state):
            return part
    return state.removeprefix("d_")


def _sides(shape: NDArray[np.complex128], participation: NDArray[np.float64], states: tuple[str, ...]) -> str:
    """Return ` parallel` or ` opposite` for a mode in which left and right wheels move alike or oppositely."""
    top = states[int(participation.argmax())]
    match = re.search(r"(?<![a-z])([fr])([lr])_", top)
    if match is None:
        return ""
    front, side = match.groups()
    other = top.replace(f"{front}{side}_", f"{front}{'r' if side == 'l' else 'l'}_")
    if other not in states:
        return ""
    one, two = shape[states.index(top)], shape[states.index(other)]
    alike = float((one.conjugate() * two).real) * 2.0 / float(abs(one) ** 2 + abs(two) ** 2)
    # Coordinates of both sides have the same directions in vehicle axes, so wheels that steer alike turn alike.
    if abs(alike) < _MIN_LIKENESS:
        return ""
    return ", parallel" if alike > 0.0 else ", opposite"
