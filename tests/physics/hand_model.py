"""A linear hand calculation of the compact, independent of the program's equations of motion.

Its numbers come from the car's README, the vehicle file, the tyre file and the K&C rig (`activesteer kc`).

It has the 11 states of `STATES`. Axes and signs follow ISO 8855. `v` is the lateral speed of the contact points at the
longitudinal position of the centre of gravity, `phi` the roll angle of the body, and `phi_t` the part of the roll angle
by which the tyres deflect vertically. The slip angles are those behind the relaxation lengths, and a positive one gives
a force to the left. `steer` is the angle of the front wheels without roll steer, and `rack` the rack travel as an angle
of the wheels. States that are not in `dynamic` follow at once, with their static effect: the steady state stays the
same. Without any dynamic part the model is a single track of two states.

Left out: vertical motion, fore-aft motion and camber motion of the wheels, friction of the rack, drive torque.

Sources of the formulas: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012 (Magic Formula 6.1 at zero slip; relaxation
length as cornering stiffness over carcass stiffness); all others are equilibria of forces and moments.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
STATES = ("v", "r", "phi", "p", "phi_t", "slip_f", "slip_r", "steer", "d_steer", "rack", "d_rack")
RELAXATION, STEERING, ROLL = STATES[5:7], STATES[7:], STATES[2:5]
G_MPS2, DEG = 9.81, math.pi / 180.0

# The car's README: mass, inertia, wheelbase, ratio, wheel. The height of the centre of gravity is that of the rig.
MASS_KG, ROLL_INERTIA_KGM2, YAW_INERTIA_KGM2 = 1430.0, 530.0, 2200.0
WHEELBASE_M, TO_FRONT_M, CG_HEIGHT_M, RATIO = 2.637, 1.0821, 0.5433, 15.8
WHEEL_HEIGHT_M, ROLLING_RADIUS_M, SPIN_KGM2, DIAMETER_KGM2 = 0.295, 0.313, 1.0, 0.58
ENGINE_KGM2 = 0.5 * 3.7  # at each front wheel
TYRE_VERTICAL_NPM = 220e3
VIBRATION_MPS = 0.07  # smooths the friction of the dampers


class Axle(NamedTuple):
    """Numbers of an axle in the README, the vehicle file and the K&C rig, per wheel where not said otherwise."""

    load_N: float
    unsprung_kg: float
    track_m: float
    roll_centre_m: float
    toe_in_rad: float
    camber_in_rad: float
    roll_steer: float  # to the left, per roll angle of the suspension
    roll_camber: float  # gain of the wheel's inclination against the body
    side_m_per_N: float  # contact point under side force
    toe_radpN: float  # to the left under a side force to the left, at the contact point
    toe_behind_radpN: float  # the same, 30 mm behind it
    camber_radpN: float  # lean out of the turn under side force
    roll_Nmprad: float  # roll stiffness of the axle, tyres rigid
    damper_Nspm: float  # mean slope at rest
    friction_N: float
    damper_ratio: float
    spin_kgm2: float


FRONT = Axle(
    4136.4, 39.0, 1.530, 0.0738, 0.05 * DEG, 0.5 * DEG, -0.039, -0.237, 0.513e-6,
    -0.121e-3 * DEG, -0.306e-3 * DEG, 0.110e-3 * DEG, 52.93e3, (130 + 60) / 0.1, 40.0, 0.925, SPIN_KGM2 + ENGINE_KGM2,
)  # fmt: skip
REAR = Axle(
    2877.8, 37.0, 1.524, 0.1101, 0.12 * DEG, 1.3 * DEG, 0.044, -0.292, 0.743e-6,
    0.055e-3 * DEG, 0.009e-3 * DEG, 0.122e-3 * DEG, 43.15e3, (98 + 45) / 0.1, 30.0, 0.995, SPIN_KGM2,
)  # fmt: skip

# Steering, as the README has it: rack of 43 kg with 300 N s/m; column; damping of the tie rods. The rack moves by 46.42
# mm for a turn of the steering wheel.
RACK_MPRAD = 0.04642 / (2.0 * math.pi) * 15.81
RACK_KG, RACK_NSPM, COLUMN_NPM, COLUMN_NSPM, TIE_ROD_NSPM = 43.0, 300.0, 4e6, 16e3, 3000.0
# Of both front wheels with their knuckles about the steering axis, which passes the wheel centre at 59 mm and the
# centre of the knuckle at 12 mm.
STEERED_KGM2 = 2.0 * (DIAMETER_KGM2 + 0.16 + 18.5 * 0.059**2 + 20.5 * 0.012**2)


class Tyre(NamedTuple):
    """Derivatives of a tyre at zero slip."""

    cornering_Nprad: float
    camber_Nprad: float
    trail_m: float
    camber_moment_Nmprad: float
    relaxation_m: float


def tyre(load_N: float, camber_rad: float) -> Tyre:
    """Evaluate the Magic Formula 6.1 of compact_205_55R16.tir by hand."""
    nominal_N, radius_m = 4000.0, 0.316
    more = load_N / nominal_N - 1.0
    cornering = 23.1 * nominal_N * math.sin(2.0 * math.atan(load_N / (1.65 * nominal_N))) * (1 - 0.3695 * camber_rad)
    return Tyre(
        cornering,
        (0.8987 + 0.23303 * more) * load_N,
        load_N * radius_m / nominal_N * (0.09068 - 0.00565 * more),
        (0.1428 - 0.00915 * more) * load_N * radius_m,
        cornering / (160e3 * (1.0 + 0.16365 * more)),
    )


def _force_per_load_transfer(axle: Axle) -> float:
    """Return the side force of the axle per load that moves to its outer wheel, from static toe and camber."""
    more, less = (tyre(axle.load_N + sign, axle.camber_in_rad) for sign in (1.0, -1.0))
    cornering = more.cornering_Nprad - less.cornering_Nprad
    camber = more.camber_Nprad - less.camber_Nprad
    return cornering * axle.toe_in_rad + camber * axle.camber_in_rad


class HandModel(NamedTuple):
    """E x' = A x + B u + B1 u' with the steering wheel angle u, and outputs C x."""

    e: Vector
    a: Vector
    b: Vector
    b1: Vector
    outputs: dict[str, Vector]

    def response(self, output: str, frequency_Hz: Vector) -> NDArray[np.complex128]:
        """Return the response to the steering wheel angle."""
        s = 2j * math.pi * frequency_Hz
        return np.array([self.outputs[output] @ np.linalg.solve(x * self.e - self.a, self.b + x * self.b1) for x in s])


def hand_model(speed_mps: float, dynamic: Collection[str] = STATES) -> HandModel:
    """Return the model at a speed [m/s]; states outside `dynamic` follow at once."""
    x = dict(zip(STATES, np.eye(len(STATES)), strict=True))
    row = {name: place for place, name in enumerate(STATES)}
    e, a = np.zeros((2, len(STATES), len(STATES)))
    to_front, to_rear = TO_FRONT_M, WHEELBASE_M - TO_FRONT_M
    axles, places = (FRONT, REAR), (to_front, -to_rear)
    tyres = [tyre(axle.load_N, axle.camber_in_rad) for axle in axles]
    slips = x["slip_f"], x["slip_r"]

    # Masses. The body rolls about the roll axis; the centres of the wheels move sideways by their inclination.
    unsprung_kg = sum(2.0 * axle.unsprung_kg for axle in axles)
    sprung_kg = MASS_KG - unsprung_kg
    sprung_height = (MASS_KG * CG_HEIGHT_M - unsprung_kg * 0.3) / sprung_kg
    axis_height = (FRONT.roll_centre_m * to_rear + REAR.roll_centre_m * to_front) / WHEELBASE_M
    arm = sprung_height - axis_height
    wheels = sum(2.0 * axle.unsprung_kg * (0.25 * axle.track_m**2 + (CG_HEIGHT_M - 0.3) ** 2) for axle in axles)
    sprung_inertia = ROLL_INERTIA_KGM2 - wheels - 4.0 * DIAMETER_KGM2
    inclinations = [1.0 + axle.roll_camber for axle in axles]
    lean = [
        2.0 * axle.unsprung_kg * WHEEL_HEIGHT_M * inclined for axle, inclined in zip(axles, inclinations, strict=True)
    ]
    coupling = sprung_kg * arm + sum(lean)
    roll_inertia = sprung_inertia + sprung_kg * arm**2
    roll_inertia += sum(each * WHEEL_HEIGHT_M * inclined for each, inclined in zip(lean, inclinations, strict=True))
    spins = sum(0.5 * axle.spin_kgm2 * axle.track_m**2 for axle in axles) / ROLLING_RADIUS_M**2
    gyro = SPIN_KGM2 * speed_mps / ROLLING_RADIUS_M  # angular momentum of a wheel

    # Side forces of the axles: slip, camber by roll and by side force, load transfer onto toed and leaning wheels.
    suspension = x["phi"] - x["phi_t"]
    forces, leans = [], []
    for axle, found, slip, inclined in zip(axles, tyres, slips, inclinations, strict=True):
        by_roll = inclined * suspension + x["phi_t"]
        transfer = _force_per_load_transfer(axle) / axle.track_m
        own = 1.0 + found.camber_Nprad * axle.camber_radpN - transfer * axle.roll_centre_m
        force = 2.0 * found.cornering_Nprad * slip - 2.0 * found.camber_Nprad * by_roll
        forces.append((force + transfer * axle.roll_Nmprad * suspension) / own)
        leans.append(by_roll + 0.5 * axle.camber_radpN * forces[-1])
    aligning = [
        -2.0 * found.cornering_Nprad * found.trail_m * slip - 2.0 * found.camber_moment_Nmprad * leaning
        for found, slip, leaning in zip(tyres, slips, leans, strict=True)
    ]

    # Sideways and yaw.
    e[row["v"]] = MASS_KG * x["v"] - coupling * x["p"]
    a[row["v"]] = forces[0] + forces[1] - MASS_KG * speed_mps * x["r"]
    e[row["r"]] = (YAW_INERTIA_KGM2 + spins) * x["r"]
    a[row["r"]] = to_front * forces[0] - to_rear * forces[1] + aligning[0] + aligning[1]
    a[row["r"]] -= 2.0 * gyro * sum(inclinations) * x["p"]

    # Roll of the body on its springs, and of the axles on the tyres.
    stiffness = sum(axle.roll_Nmprad for axle in axles)
    damping = 0.0
    for axle in axles:
        at_damper = axle.damper_Nspm + axle.friction_N * math.sqrt(2.0 / math.pi) / VIBRATION_MPS
        damping += 0.5 * at_damper * axle.damper_ratio**2 * axle.track_m**2
    at_tyres = 0.5 * TYRE_VERTICAL_NPM * sum(axle.track_m**2 for axle in axles)
    springs = stiffness * suspension + damping * x["p"]
    e[row["phi"]], a[row["phi"]] = x["phi"], x["p"]
    e[row["p"]] = roll_inertia * x["p"] - coupling * x["v"] - damping * x["phi_t"]
    a[row["p"]] = (coupling * speed_mps + 4.0 * gyro) * x["r"] + sprung_kg * G_MPS2 * arm * x["phi"] - springs
    e[row["phi_t"]] = damping * x["phi_t"]
    a[row["phi_t"]] = springs - at_tyres * x["phi_t"]
    for axle, force in zip(axles, forces, strict=True):
        a[row["p"]] += (axis_height - axle.roll_centre_m) * force
        a[row["phi_t"]] += axle.roll_centre_m * force

    # Relaxation, with the lateral compliance of the axle in series with the carcass.
    behind = tyres[1].trail_m / 0.030
    rear_toe = 0.5 * (REAR.toe_radpN + (REAR.toe_behind_radpN - REAR.toe_radpN) * behind) * forces[1]
    for name, axle, found, slip, place, angle in zip(
        ("slip_f", "slip_r"), axles, tyres, slips, places, (x["steer"], rear_toe), strict=True
    ):
        e[row[name]] = (found.relaxation_m + axle.side_m_per_N * found.cornering_Nprad) * slip
        a[row[name]] = speed_mps * (angle + axle.roll_steer * suspension - slip) - x["v"] - place * x["r"]
        a[row[name]] -= (axis_height - axle.roll_centre_m) * x["p"]

    # Steering: wheels, links, rack, column. The K&C rig gives links and column in series.
    per_moment = (FRONT.toe_radpN - FRONT.toe_behind_radpN) / 0.030
    column, column_damping = COLUMN_NPM * RACK_MPRAD**2, COLUMN_NSPM * RACK_MPRAD**2
    links = 1.0 / (0.5 * per_moment - 1.0 / column)
    in_links = links * (x["steer"] - x["rack"]) + 2.0 * TIE_ROD_NSPM * RACK_MPRAD**2 * (x["d_steer"] - x["d_rack"])
    side_arm = -FRONT.toe_radpN / per_moment
    e[row["steer"]], a[row["steer"]] = x["steer"], x["d_steer"]
    e[row["rack"]], a[row["rack"]] = x["rack"], x["d_rack"]
    e[row["d_steer"]] = STEERED_KGM2 * x["d_steer"]
    a[row["d_steer"]] = -in_links - side_arm * forces[0] + aligning[0] - 2.0 * gyro * inclinations[0] * x["p"]
    e[row["d_rack"]] = RACK_KG * RACK_MPRAD**2 * x["d_rack"]
    a[row["d_rack"]] = in_links - column * x["rack"] - (column_damping + RACK_NSPM * RACK_MPRAD**2) * x["d_rack"]
    b, b1 = column / RATIO * x["d_rack"], column_damping / RATIO * x["d_rack"]
    for name in STATES[2:]:
        if name not in dynamic:
            e[:, row[name]] = 0.0
    if "rack" not in dynamic:
        b1 = 0.0 * b1
    outputs = {"yaw_rate_radps": x["r"], "ay_mps2": (forces[0] + forces[1]) / MASS_KG, "roll_rad": x["phi"]}
    return HandModel(e, a, b, b1, outputs)
