"""Decentralized PD control, bare or filtered, of many runs in lockstep: lane j of every row of `w` belongs to run j.

One source serves a single run (one lane, with its history) and a study (16 lanes side by side, which the compiler turns
into vector instructions).  All that a run does depends on its own lane only, so that its numbers are the same in
whatever company it runs.
"""

from __future__ import annotations

import math

from .jit import kernel, leaf, outlined
from .lanes import (
    A1,
    A2,
    AD,
    ANTAGONISM,
    AX,
    AY,
    COPPER,
    DX,
    DY,
    ED,
    GAIN_D,
    GAIN_P,
    INV,
    LAST,
    OFFSET,
    OLD,
    QD,
    SAMPLE,
    SLOW,
    STATUS,
    TORQUE2,
    VX,
    VY,
    WEIGHT,
    WORK,
    C,
    E,
    Q,
    X,
    Y,
)
from .plant import add_arm, add_torque, at, drive, geometry, runge_kutta, small_angle, solve2
from .pose import measured_pose, true_pose
from .tables import (
    COLUMNS,
    DONE,
    FORCE_FILTER,
    LEFT_WORKSPACE,
    MEASURED,
    NO_FILTER,
    SCALE,
    TRUE_SAME,
)


@outlined
def sense(lanes, drives, arms, row, w, k):
    """Geometry, true base angles and rates, and measured errors E, ED; returns how many lanes need `sense_far`."""
    L, N = len(lanes), len(drives)
    count = 0
    for j in range(L):
        x, y, vx, vy = w[X * L + j], w[Y * L + j], w[VX * L + j], w[VY * L + j]
        near, low = 1.0, 1e300
        for i in range(N):
            ax, ay, dx, dy, ad, bx, by, _, _, inv, area2 = geometry(arms, i, x, y)
            low = min(low, area2)
            w[at(AX, i, j, N, L)], w[at(AY, i, j, N, L)] = ax, ay
            w[at(DX, i, j, N, L)], w[at(DY, i, j, N, L)] = dx, dy
            w[at(AD, i, j, N, L)], w[at(INV, i, j, N, L)] = ad, inv
            ux, uy = row[6 + 6 * N + i], row[6 + 7 * N + i]
            s = (ux * ay - uy * ax) * arms[i * COLUMNS + SCALE]
            near = min(near, min(0.1 - abs(s), ux * ax + uy * ay))
            angle, rate = small_angle(s), bx * vx + by * vy
            w[at(Q, i, j, N, L)], w[at(QD, i, j, N, L)] = row[6 + i] + angle, rate
            w[at(E, i, j, N, L)] = angle + w[at(OFFSET, i, j, N, L)]
            w[at(ED, i, j, N, L)] = rate - row[6 + 2 * N + i]
        count += 0 if near >= 0.0 else 1
        lost = 1.0 if w[STATUS * L + j] == DONE and low <= 0.0 else 0.0
        w[STATUS * L + j] += lost * LEFT_WORKSPACE
        w[SAMPLE * L + j] += lost * k
    return count


@leaf
def sense_far(lanes, drives, arms, row, w):
    """Base angles of arms more than 0.1 rad from the desired motion, by the arc tangent."""
    L, N = len(lanes), len(drives)
    for j in range(L):
        for i in range(N):
            ax, ay = w[at(AX, i, j, N, L)], w[at(AY, i, j, N, L)]
            ux, uy = row[6 + 6 * N + i], row[6 + 7 * N + i]
            s, t = ux * ay - uy * ax, ux * ax + uy * ay
            if not (abs(s * arms[i * COLUMNS + SCALE]) <= 0.1 and t >= 0.0):
                angle = math.atan2(s, t)
                w[at(Q, i, j, N, L)], w[at(E, i, j, N, L)] = row[6 + i] + angle, angle + w[at(OFFSET, i, j, N, L)]


@leaf
def measure(lanes, drives, row, w, dt, quantum, tau, k):
    """Errors E, ED of a real encoder: quantized angles, rates from their backward differences."""
    L, N = len(lanes), len(drives)
    if quantum > 0.0:
        for i in range(N):
            for j in range(L):
                angle = w[at(Q, i, j, N, L)] + w[at(OFFSET, i, j, N, L)]
                w[at(E, i, j, N, L)] = quantum * math.floor(angle / quantum + 0.5) - row[6 + i]
    if tau >= 0.0:
        blend = dt / (tau + dt)
        for i in range(N):
            for j in range(L):
                angle, slow = w[at(E, i, j, N, L)] + row[6 + i], w[at(SLOW, i, j, N, L)]
                if k > 0:
                    slow += blend * ((angle - w[at(LAST, i, j, N, L)]) / dt - slow)
                w[at(LAST, i, j, N, L)], w[at(SLOW, i, j, N, L)] = angle, slow
                w[at(ED, i, j, N, L)] = slow - row[6 + 2 * N + i]


@outlined
def command(lanes, drives, form, w):
    """Drive torques C: PD (12), its force filter (16) or its command filter (17)."""
    L, N = len(lanes), len(drives)
    if form == NO_FILTER:
        for i in range(N):
            for j in range(L):
                w[at(C, i, j, N, L)] = -(w[at(GAIN_P, i, j, N, L)] * w[at(E, i, j, N, L)]
                                         + w[at(GAIN_D, i, j, N, L)] * w[at(ED, i, j, N, L)])
    elif form == FORCE_FILTER:
        for j in range(L):
            m11 = m12 = m22 = fx = fy = -0.0
            for i in range(N):
                a1, a2 = w[at(A1, i, j, N, L)], w[at(A2, i, j, N, L)]
                t = w[at(GAIN_P, i, j, N, L)] * w[at(E, i, j, N, L)] + w[at(GAIN_D, i, j, N, L)] * w[at(ED, i, j, N, L)]
                m11, m12, m22, fx, fy = m11 + a1 * a1, m12 + a1 * a2, m22 + a2 * a2, fx + a1 * t, fy + a2 * t
            gx, gy = solve2(m11, m12, m22, fx, fy)
            for i in range(N):
                w[at(C, i, j, N, L)] = -(w[at(A1, i, j, N, L)] * gx + w[at(A2, i, j, N, L)] * gy)
    else:
        for j in range(L):
            m11 = m12 = m22 = fx = fy = n11 = n12 = n22 = hx = hy = 0.0
            for i in range(N):
                p, d = w[at(GAIN_P, i, j, N, L)], w[at(GAIN_D, i, j, N, L)]
                a1, a2, b1, b2 = (p * w[at(A1, i, j, N, L)], p * w[at(A2, i, j, N, L)],
                                  d * w[at(A1, i, j, N, L)], d * w[at(A2, i, j, N, L)])
                e, ed = w[at(E, i, j, N, L)], w[at(ED, i, j, N, L)]
                m11, m12, m22, fx, fy = m11 + a1 * a1, m12 + a1 * a2, m22 + a2 * a2, fx + a1 * e, fy + a2 * e
                n11, n12, n22, hx, hy = n11 + b1 * b1, n12 + b1 * b2, n22 + b2 * b2, hx + b1 * ed, hy + b2 * ed
            gx, gy = solve2(m11, m12, m22, fx, fy)
            rx, ry = solve2(n11, n12, n22, hx, hy)
            for i in range(N):
                p, d = w[at(GAIN_P, i, j, N, L)], w[at(GAIN_D, i, j, N, L)]
                p, d = p * p, d * d
                w[at(C, i, j, N, L)] = -(w[at(A1, i, j, N, L)] * (p * gx + d * rx)
                                         + w[at(A2, i, j, N, L)] * (p * gy + d * ry))


@outlined
def add_up(lanes, drives, w):
    """Sums over the holds: squared torques, per drive and all, and the weighted antagonistic part at the true pose."""
    L, N = len(lanes), len(drives)
    for j in range(L):
        m11 = m12 = m22 = fx = fy = square = null = -0.0
        for i in range(N):
            inv, c = w[at(INV, i, j, N, L)], w[at(C, i, j, N, L)]
            a1, a2 = w[at(DX, i, j, N, L)] * inv, w[at(DY, i, j, N, L)] * inv
            m11, m12, m22, fx, fy = m11 + a1 * a1, m12 + a1 * a2, m22 + a2 * a2, fx + a1 * c, fy + a2 * c
            w[at(COPPER, i, j, N, L)] += c * c
            square += c * c
        gx, gy = solve2(m11, m12, m22, fx, fy)
        for i in range(N):
            useful = (w[at(DX, i, j, N, L)] * gx + w[at(DY, i, j, N, L)] * gy) * w[at(INV, i, j, N, L)]
            rest = w[at(C, i, j, N, L)] - useful
            null += w[at(WEIGHT, i, j, N, L)] * (rest * rest)
        w[TORQUE2 * L + j] += square
        w[ANTAGONISM * L + j] += null


@leaf
def sensed(w, j, i, N, L, vx, vy, dt):
    """The geometry that `sense` left in w; instead of (a x d)^2 what tells that the arm is lost within the hold."""
    ax, ay, dx, dy = w[at(AX, i, j, N, L)], w[at(AY, i, j, N, L)], w[at(DX, i, j, N, L)], w[at(DY, i, j, N, L)]
    ad, inv = w[at(AD, i, j, N, L)], w[at(INV, i, j, N, L)]
    bx, by, lx, ly = dx * inv, dy * inv, ax * inv, ay * inv
    # An arm that would be stretched or folded before the hold ends, at its present elbow rate.
    ahead = 1.0 - dt * ad * inv * ((bx + lx) * vx + (by + ly) * vy)
    return ax, ay, dx, dy, ad, bx, by, lx, ly, inv, ahead


@leaf
def move(lanes, drives, arms, env, extra, w, dt, k):
    """One hold: Runge-Kutta step of all lanes; returns how many runs have ended."""
    L, N = len(lanes), len(drives)
    ended = 0
    for j in range(L):
        x, y, vx, vy = w[X * L + j], w[Y * L + j], w[VX * L + j], w[VY * L + j]
        g0, g1 = sensed(w, j, 0, N, L, vx, vy, dt), sensed(w, j, 1, N, L, vx, vy, dt)
        g2 = sensed(w, j, 2, N, L, vx, vy, dt) if N > 2 else g0
        g3 = sensed(w, j, 3, N, L, vx, vy, dt) if N > 3 else g0
        sums = add_arm(arms, 0, env, extra, g0, vx, vy, (env[3], -0.0, env[3], -0.0, -0.0, 1e300))
        sums = add_arm(arms, 1, env, extra, g1, vx, vy, sums)
        if N > 2:
            sums = add_arm(arms, 2, env, extra, g2, vx, vy, sums)
        if N > 3:
            sums = add_arm(arms, 3, env, extra, g3, vx, vy, sums)
        for i in range(4, N):
            place = sensed(w, j, i, N, L, vx, vy, dt)
            sums = add_torque(place, w[at(C, i, j, N, L)], add_arm(arms, i, env, extra, place, vx, vy, sums))
        first = at(C, 0, j, N, L)
        sums = drive(drives, g0, g1, g2, g3, w, first, L, sums)
        m11, m12, m22, fx, fy, low = sums
        k1x, k1y = solve2(m11, m12, m22, fx, fy)
        x, y, vx, vy, low = runge_kutta(drives, arms, env, extra, x, y, vx, vy, k1x, k1y, low, w, first, L, dt)
        w[X * L + j], w[Y * L + j], w[VX * L + j], w[VY * L + j] = x, y, vx, vy
        status = DONE if low > 0.0 and abs(x) + abs(y) + abs(vx) + abs(vy) < 1e300 else LEFT_WORKSPACE
        running = w[STATUS * L + j] == DONE
        w[SAMPLE * L + j] = k if running else w[SAMPLE * L + j]
        w[STATUS * L + j] = status if running else w[STATUS * L + j]
        ended += w[STATUS * L + j] != DONE
    return ended


@kernel
def closed_loops(lanes, drives, extra, keep, plant, env, model, table, dt, form, pose, quantum, tau, w,
                 states, q_a, qd_a, c):
    """Sampled runs in lockstep: leaves final state and status in w, and sums.

    With an entry in `keep` it writes, instead of the sums, the history of a single run to states (k, 4), q_a, qd_a and
    c (k, N).
    """
    L, N = len(lanes), len(drives)
    samples = len(table)
    for k in range(samples):
        row = table[k]
        if sense(lanes, drives, plant, row, w, k) > 0:
            sense_far(lanes, drives, plant, row, w)
        if L == 1:
            if w[STATUS] != DONE:
                return
            w[SAMPLE] = k
        if len(keep) == 0:
            for i in range(N):
                for j in range(L):
                    angle = w[at(Q, i, j, N, L)]
                    w[at(WORK, i, j, N, L)] += w[at(C, i, j, N, L)] * (angle - w[at(OLD, i, j, N, L)])
                    w[at(OLD, i, j, N, L)] = angle
        if quantum > 0.0 or tau >= 0.0:
            measure(lanes, drives, row, w, dt, quantum, tau, k)
        if form != NO_FILTER:
            if pose != MEASURED:
                true_pose(lanes, drives, model, pose == TRUE_SAME, w)
            else:
                measured_pose(lanes, drives, model, row, w, k, quantum == 0.0)
        if len(keep) == 0 and k + 1 == samples:
            return
        command(lanes, drives, form, w)
        if len(keep) > 0:
            states[k, 0], states[k, 1], states[k, 2], states[k, 3] = w[X], w[Y], w[VX], w[VY]
            for i in range(N):
                q_a[k, i], qd_a[k, i], c[k, i] = w[at(Q, i, 0, N, 1)], w[at(QD, i, 0, N, 1)], w[at(C, i, 0, N, 1)]
        else:
            add_up(lanes, drives, w)
        if k + 1 < samples and move(lanes, drives, plant, env, extra, w, dt, k) == L:
            return
