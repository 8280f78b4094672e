"""The forces of an axle that is guided by curves; see `axle_curves`.

With e = q - f(z) - g(s), the deflection of the five guided coordinates q from their curves over the travel z and the
rack s, and t = a . e along each spring that hardens, the energy is U = e'Ke/2 + sum(s t^3/3 + t^4/4) + the integral of
the load over z. Its slopes are the forces: Q_q = -dU/de, and by the chain rule Q_z = dU/de f'(z), Q_s = dU/de g'(s): no
work is lost or won, whatever the curves.

The engine is implicit in what tendons carry, and therefore has five in each corner for K, with the slopes that the
curves have in the design position (`guide_model`). What stands here is the difference: the forces above less those of
these tendons.
"""

from __future__ import annotations

from activesteer.compilation import inlined
from activesteer.vehicle import force_block as fb


@inlined
def _place(table, position):
    """Interval, place in it from 0 to 1, and how far beyond the ends, in intervals."""
    at = (position - table[fb.T_START]) * table[fb.T_PER_m]
    count = table[fb.T_INTERVALS]
    inside = min(max(at, 0.0), count)
    interval = min(int(inside), int(count) - 1)
    return interval, inside - interval, at - inside


@inlined
def _curve(table, index, interval, t, beyond):
    """Value of a curve and its slope."""
    start = fb.T_CURVES + 4 * (interval * int(table[fb.T_COUNT]) + index)
    a, b, c, d = table[start], table[start + 1], table[start + 2], table[start + 3]
    slope = b + t * (2.0 * c + 3.0 * d * t)
    return a + t * (b + t * (c + d * t)) + beyond * slope, slope * table[fb.T_PER_m]


@inlined
def _strain(record, travel, rack, index, q, v, vz, vs, zi, zt, zb, si, st, sb):
    """Deflection of a coordinate of the mirrored, that is left, wheel, its rate, and the slopes of its curves."""
    f, slope_z = _curve(travel, index, zi, zt, zb)
    g, slope_s = 0.0, 0.0
    if record[fb.G_RACK] >= 0.0:
        g, slope_s = _curve(rack, index, si, st, sb)
    return q - f - g, v - slope_z * vz - slope_s * vs, slope_z, slope_s


@inlined
def _linear(record, index, q, v, z, vz, s, vs):
    """The same as the engine's tendons have it: with straight curves."""
    slope_z, slope_s = record[fb.G_TRAVEL_SLOPE + index], record[fb.G_RACK_SLOPE + index]
    return q - slope_z * z - slope_s * s, v - slope_z * vz - slope_s * vs


@inlined
def _row(matrix, start, e0, e1, e2, e3, e4):
    m = matrix[start:]
    return m[0] * e0 + m[1] * e1 + m[2] * e2 + m[3] * e3 + m[4] * e4


@inlined
def _hardened(record, spring, e0, e1, e2, e3, e4):
    """Force of a hardening spring over its direction a; see `AxleCurves.hardening`."""
    a = record[fb.G_HARDENING + 5 * spring :]
    t = _row(a, 0, e0, e1, e2, e3, e4)
    return t * t * (record[fb.G_SQUARE + spring] + t)


@inlined
def guides(block, qpos, qvel, qfrc):
    """Adds the forces of all guided wheels."""
    for index in range(int(block[fb.N_GUIDES])):
        record = block[int(block[fb.GUIDES_START]) + index * fb.GUIDE_SIZE :]
        travel = block[int(block[fb.GUIDES_START]) + int(record[fb.G_TRAVEL_TABLE]) :]
        rack = block[int(block[fb.GUIDES_START]) + int(record[fb.G_RACK_TABLE]) :]
        p, d, side = int(record[fb.G_QPOS]), int(record[fb.G_DOF]), record[fb.G_SIDE]
        z, vz, s, vs = qpos[p + 2], qvel[d + 2], 0.0, 0.0
        zi, zt, zb = _place(travel, z)
        si, st, sb = 0, 0.0, 0.0
        if record[fb.G_RACK] >= 0.0:
            s, vs = side * qpos[int(record[fb.G_RACK])], side * qvel[int(record[fb.G_RACK_DOF])]
            si, st, sb = _place(rack, s)
        e0, r0, z0, s0 = _strain(record, travel, rack, 0, 1.0 * qpos[p], 1.0 * qvel[d], vz, vs, zi, zt, zb, si, st, sb)
        l0, m0 = _linear(record, 0, 1.0 * qpos[p], 1.0 * qvel[d], z, vz, s, vs)
        e1, r1, z1, s1 = _strain(
            record, travel, rack, 1, side * qpos[p + 1], side * qvel[d + 1], vz, vs, zi, zt, zb, si, st, sb
        )
        l1, m1 = _linear(record, 1, side * qpos[p + 1], side * qvel[d + 1], z, vz, s, vs)
        e2, r2, z2, s2 = _strain(
            record, travel, rack, 2, side * qpos[p + 4], side * qvel[d + 4], vz, vs, zi, zt, zb, si, st, sb
        )
        l2, m2 = _linear(record, 2, side * qpos[p + 4], side * qvel[d + 4], z, vz, s, vs)
        e3, r3, z3, s3 = _strain(
            record, travel, rack, 3, 1.0 * qpos[p + 5], 1.0 * qvel[d + 5], vz, vs, zi, zt, zb, si, st, sb
        )
        l3, m3 = _linear(record, 3, 1.0 * qpos[p + 5], 1.0 * qvel[d + 5], z, vz, s, vs)
        e4, r4, z4, s4 = _strain(
            record, travel, rack, 4, side * qpos[p + 3], side * qvel[d + 3], vz, vs, zi, zt, zb, si, st, sb
        )
        l4, m4 = _linear(record, 4, side * qpos[p + 3], side * qvel[d + 3], z, vz, s, vs)
        k, c, h = record[fb.G_STIFFNESS :], record[fb.G_DAMPING :], record[fb.G_HARDENING :]
        f1 = _hardened(record, 0, e0, e1, e2, e3, e4)
        f2 = _hardened(record, 1, e0, e1, e2, e3, e4)
        w0 = _row(k, 0, l0, l1, l2, l3, l4) + _row(c, 0, m0, m1, m2, m3, m4)
        u0 = _row(k, 0, e0, e1, e2, e3, e4) + _row(c, 0, r0, r1, r2, r3, r4) + h[0] * f1 + h[5] * f2
        w1 = _row(k, 5, l0, l1, l2, l3, l4) + _row(c, 5, m0, m1, m2, m3, m4)
        u1 = _row(k, 5, e0, e1, e2, e3, e4) + _row(c, 5, r0, r1, r2, r3, r4) + h[1] * f1 + h[6] * f2
        w2 = _row(k, 10, l0, l1, l2, l3, l4) + _row(c, 10, m0, m1, m2, m3, m4)
        u2 = _row(k, 10, e0, e1, e2, e3, e4) + _row(c, 10, r0, r1, r2, r3, r4) + h[2] * f1 + h[7] * f2
        w3 = _row(k, 15, l0, l1, l2, l3, l4) + _row(c, 15, m0, m1, m2, m3, m4)
        u3 = _row(k, 15, e0, e1, e2, e3, e4) + _row(c, 15, r0, r1, r2, r3, r4) + h[3] * f1 + h[8] * f2
        w4 = _row(k, 20, l0, l1, l2, l3, l4) + _row(c, 20, m0, m1, m2, m3, m4)
        u4 = _row(k, 20, e0, e1, e2, e3, e4) + _row(c, 20, r0, r1, r2, r3, r4) + h[4] * f1 + h[9] * f2
        load, _ = _curve(travel, 5, zi, zt, zb)
        zs, ss = record[fb.G_TRAVEL_SLOPE :], record[fb.G_RACK_SLOPE :]
        qfrc[d] -= u0 - w0
        qfrc[d + 1] -= side * (u1 - w1)
        qfrc[d + 2] += u0 * z0 + u1 * z1 + u2 * z2 + u3 * z3 + u4 * z4 - _row(zs, 0, w0, w1, w2, w3, w4) - load
        qfrc[d + 3] -= side * (u4 - w4)
        qfrc[d + 4] -= side * (u2 - w2)
        qfrc[d + 5] -= u3 - w3
        if record[fb.G_RACK] >= 0.0:
            on_rack = u0 * s0 + u1 * s1 + u2 * s2 + u3 * s3 + u4 * s4 - _row(ss, 0, w0, w1, w2, w3, w4)
            qfrc[int(record[fb.G_RACK_DOF])] += side * on_rack
