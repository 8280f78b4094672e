"""The forces of curve axles; see `curve_axles`.

With e = q - f(z) - g(s), the deflection of the five coordinates q from their curves over the travel z and the rack s,
and t = a . e along each hardening spring, the energy is U = e'Ke/2 + sum(s t^3/3 + t^4/4) + the integral of the load
over z. Its slopes are the forces: Q_q = -dU/de, and by the chain rule Q_z = dU/de f'(z), Q_s = dU/de g'(s). No work is
lost or gained, whatever the curves.

The engine is implicit in tendons only, so each corner has some tendons for the stiff part of K, with the slopes of the
curves in the design position (`curve_axles`). The forces here are the difference: the forces above less those of
these tendons.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from activesteer.compilation import inlined
from activesteer.native_memory import records_at
from activesteer.vehicle import force_block as fb

_wheels_at: Final = records_at(fb.CURVE_AXLE_WHEEL)
_tables_at: Final = records_at(fb.CURVE_TABLE)
_numbers_at: Final = records_at(np.dtype(np.float64))
_HEAD: Final = fb.CURVE_TABLE.itemsize // 8


@inlined
def _place(table, position):
    """Return the interval, the place in it from 0 to 1, and the distance beyond the ends, in intervals."""
    at = (position - table.start_m) * table.per_m
    count = table.intervals
    inside = min(max(at, 0.0), count)
    interval = min(int(inside), int(count) - 1)
    return interval, inside - interval, at - inside


@inlined
def _curve(table, cubics, index, place):
    """Return the value of a curve and its slope."""
    interval, t, beyond = place
    start = 4 * (interval * int(table.count) + index)
    a, b, c, d = cubics[start], cubics[start + 1], cubics[start + 2], cubics[start + 3]
    slope = b + t * (2.0 * c + 3.0 * d * t)
    return a + t * (b + t * (c + d * t)) + beyond * slope, slope * table.per_m


@inlined
def _strain(record, travel, tc, rack, rc, index, q, v, moved, on_travel, on_rack):
    """Return the deflection of a coordinate of the (mirrored) left wheel from its curves, its rate, the curves' slopes.

    Then follow deflection and rate as the engine's tendons have them, with straight curves.
    """
    z, vz, s, vs = moved
    f, slope_z = _curve(travel, tc, index, on_travel)
    g, slope_s = 0.0, 0.0
    if record.rack >= 0.0:
        g, slope_s = _curve(rack, rc, index, on_rack)
    straight_z, straight_s = record.travel_slope[index], record.rack_slope[index]
    return (
        q - f - g,
        v - slope_z * vz - slope_s * vs,
        slope_z,
        slope_s,
        q - straight_z * z - straight_s * s,
        v - straight_z * vz - straight_s * vs,
    )


@inlined
def _row(matrix, start, e0, e1, e2, e3, e4):
    m = matrix[start:]
    return m[0] * e0 + m[1] * e1 + m[2] * e2 + m[3] * e3 + m[4] * e4


@inlined
def _hardened(record, spring, e0, e1, e2, e3, e4):
    """Return the force of a hardening spring over its direction a; see `AxleCurves.hardening`."""
    t = _row(record.hardening, 5 * spring, e0, e1, e2, e3, e4)
    return t * t * (record.square[spring] + t)


@inlined
def add_curve_axle_forces(block, header, qpos, qvel, qfrc):
    """Add the forces of all wheels of curve axles."""
    records = _wheels_at(block, header.curve_axle_wheels, header.n_curve_axle_wheels)
    curves = _numbers_at(block, header.curves, header.n_curves)
    for index in range(records.size):
        record = records[index]
        travel = _tables_at(block, header.curves + record.travel_table, 1)[0]
        rack = _tables_at(block, header.curves + record.rack_table, 1)[0]
        tc, rc = curves[int(record.travel_table) + _HEAD :], curves[int(record.rack_table) + _HEAD :]
        p, d, side = int(record.qpos), int(record.dof), record.side
        z, vz, s, vs = qpos[p + 2], qvel[d + 2], 0.0, 0.0
        on_travel, on_rack = _place(travel, z), (0, 0.0, 0.0)
        if record.rack >= 0.0:
            s, vs = side * qpos[int(record.rack)], side * qvel[int(record.rack_dof)]
            on_rack = _place(rack, s)
        moved = z, vz, s, vs
        e0, r0, z0, s0, l0, m0 = _strain(record, travel, tc, rack, rc, 0, qpos[p], qvel[d], moved, on_travel, on_rack)
        e1, r1, z1, s1, l1, m1 = _strain(
            record, travel, tc, rack, rc, 1, side * qpos[p + 1], side * qvel[d + 1], moved, on_travel, on_rack
        )
        e2, r2, z2, s2, l2, m2 = _strain(
            record, travel, tc, rack, rc, 2, side * qpos[p + 4], side * qvel[d + 4], moved, on_travel, on_rack
        )
        e3, r3, z3, s3, l3, m3 = _strain(
            record, travel, tc, rack, rc, 3, qpos[p + 5], qvel[d + 5], moved, on_travel, on_rack
        )
        e4, r4, z4, s4, l4, m4 = _strain(
            record, travel, tc, rack, rc, 4, side * qpos[p + 3], side * qvel[d + 3], moved, on_travel, on_rack
        )
        k, c, h = record.stiffness, record.damping, record.hardening
        kh, ch = record.held_stiffness, record.held_damping
        f1 = _hardened(record, 0, e0, e1, e2, e3, e4)
        f2 = _hardened(record, 1, e0, e1, e2, e3, e4)
        w0 = _row(kh, 0, l0, l1, l2, l3, l4) + _row(ch, 0, m0, m1, m2, m3, m4)
        u0 = _row(k, 0, e0, e1, e2, e3, e4) + _row(c, 0, r0, r1, r2, r3, r4) + h[0] * f1 + h[5] * f2
        w1 = _row(kh, 5, l0, l1, l2, l3, l4) + _row(ch, 5, m0, m1, m2, m3, m4)
        u1 = _row(k, 5, e0, e1, e2, e3, e4) + _row(c, 5, r0, r1, r2, r3, r4) + h[1] * f1 + h[6] * f2
        w2 = _row(kh, 10, l0, l1, l2, l3, l4) + _row(ch, 10, m0, m1, m2, m3, m4)
        u2 = _row(k, 10, e0, e1, e2, e3, e4) + _row(c, 10, r0, r1, r2, r3, r4) + h[2] * f1 + h[7] * f2
        w3 = _row(kh, 15, l0, l1, l2, l3, l4) + _row(ch, 15, m0, m1, m2, m3, m4)
        u3 = _row(k, 15, e0, e1, e2, e3, e4) + _row(c, 15, r0, r1, r2, r3, r4) + h[3] * f1 + h[8] * f2
        w4 = _row(kh, 20, l0, l1, l2, l3, l4) + _row(ch, 20, m0, m1, m2, m3, m4)
        u4 = _row(k, 20, e0, e1, e2, e3, e4) + _row(c, 20, r0, r1, r2, r3, r4) + h[4] * f1 + h[9] * f2
        load, _ = _curve(travel, tc, 5, on_travel)
        zs, ss = record.travel_slope, record.rack_slope
        qfrc[d] -= u0 - w0
        qfrc[d + 1] -= side * (u1 - w1)
        qfrc[d + 2] += u0 * z0 + u1 * z1 + u2 * z2 + u3 * z3 + u4 * z4 - _row(zs, 0, w0, w1, w2, w3, w4) - load
        qfrc[d + 3] -= side * (u4 - w4)
        qfrc[d + 4] -= side * (u2 - w2)
        qfrc[d + 5] -= u3 - w3
        if record.rack >= 0.0:
            handed_on = u0 * s0 + u1 * s1 + u2 * s2 + u3 * s3 + u4 * s4 - _row(ss, 0, w0, w1, w2, w3, w4)
            qfrc[int(record.rack_dof)] += side * handed_on
