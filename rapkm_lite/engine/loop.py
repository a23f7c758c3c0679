"""The sampled closed loop of every law: sense, measure, find the pose, command, record, hold.

One source serves a single run (its arms side by side, with a history) and a study (16 runs side by side, with sums).
All that a run does depends on its own column of the work table only, so that its numbers are the same in whatever
company it runs.
"""

from __future__ import annotations

import math

from . import plant, single
from .jit import kernel, leaf, outlined
from .laws import computed_torque
from .leaves import solve2
from .pose import measured_pose, measured_rate, true_pose
from .rows import (
    A1,
    A2,
    ANTAGONISM,
    B1,
    B2,
    COPPER,
    EASE,
    ED,
    GAIN_D,
    GAIN_I,
    GAIN_P,
    JOINT_J,
    JOINT_K,
    LIMIT,
    MEMORY,
    OFFSET,
    OLD,
    QD,
    READ,
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
    at,
    of,
    want,
)
from .tables import (
    ANGLE,
    COMMAND_FILTER,
    DONE,
    FORCE_FILTER,
    MEASURED,
    NO_FILTER,
    PD,
    PID,
    RATE,
    SINGULAR,
)


@leaf
def sense(lanes, drives, arms, machine, table, o, w, dt):
    """True base angles and rates, and the geometry and shares of the arms that the hold starts from."""
    if len(lanes) == 1:
        far = single.sense(arms, machine.env, machine.extra, table, 0, w, dt)
    else:
        far = plant.sense(lanes, arms, machine.env, machine.extra, table, o, w, dt)
    if far > 0:
        plant.mend(lanes, arms, table, o, w)


@leaf
def measure(lanes, arms, sensor, faulty, faults, table, o, w, dt, k):
    """Readings of the encoders with offsets, counts and faults, rates from their differences; the errors E, ED."""
    L, W = len(lanes), len(arms)
    for i in range(W):
        for j in range(L):
            w[at(E, i, j, W, L)] = w[at(Q, i, j, W, L)] + w[at(OFFSET, i, j, W, L)]
            w[at(ED, i, j, W, L)] = w[at(QD, i, j, W, L)]
    if len(faulty) > 0 or sensor.quantized or sensor.filtered:
        read(lanes, arms, sensor, faulty, faults, w, dt, k)
    for i in range(W):
        angle, rate = want(table, o, ANGLE, i, W), want(table, o, RATE, i, W)
        for j in range(L):
            w[at(E, i, j, W, L)] -= angle
            w[at(ED, i, j, W, L)] -= rate


@outlined
def read(lanes, arms, sensor, faulty, faults, w, dt, k):
    """What real encoders make of the angles and rates in E, ED."""
    L, W = len(lanes), len(arms)
    for i in range(W):
        if len(faulty) > 0:
            for j in range(L):
                w[at(E, i, j, W, L)] += faults.jump[k][i]
        if sensor.quantized:
            for j in range(L):
                w[at(E, i, j, W, L)] = sensor.quantum * math.floor(w[at(E, i, j, W, L)] / sensor.quantum + 0.5)
        if len(faulty) > 0 and k > 0 and faults.held[k][i] > 0.0:
            for j in range(L):
                w[at(E, i, j, W, L)], w[at(ED, i, j, W, L)] = w[at(READ, i, j, W, L)], 0.0
        if sensor.filtered:
            # Nothing to compare the first reading with.
            blend = sensor.blend if k > 0 else 0.0
            for j in range(L):
                rate, slow = (w[at(E, i, j, W, L)] - w[at(READ, i, j, W, L)]) / dt, w[at(SLOW, i, j, W, L)]
                w[at(SLOW, i, j, W, L)] = slow + blend * (rate - slow)
                w[at(ED, i, j, W, L)] = w[at(SLOW, i, j, W, L)]
        for j in range(L):
            w[at(READ, i, j, W, L)] = w[at(E, i, j, W, L)]


@leaf
def find_pose(lanes, drives, arms, law, smooth, table, o, w, k):
    """The pose that the law and its filter go by; none for decentralized laws."""
    if law.pose == MEASURED:
        measured_pose(lanes, drives, arms, table, o, w, k, smooth)
        if law.form > PID:
            measured_rate(lanes, drives, arms, table, o, w)
    else:
        true_pose(lanes, drives, arms, law, w)


@leaf
def command(lanes, drives, arms, model, law, table, o, w, dt):
    """Drive torques C."""
    if law.form == PD:
        proportional(lanes, arms, w)
    elif law.form == PID:
        integral(lanes, arms, w, dt)
    else:
        computed_torque(lanes, drives, arms, model, law, table, o, w)
    if law.filter == FORCE_FILTER:
        force_filter(lanes, drives, arms, w)
    elif law.filter == COMMAND_FILTER:
        command_filter(lanes, drives, arms, w)


@leaf
def proportional(lanes, arms, w):
    """PD (12)."""
    L, W = len(lanes), len(arms)
    for i in range(W):
        for j in range(L):
            w[at(C, i, j, W, L)] = -(w[at(GAIN_P, i, j, W, L)] * w[at(E, i, j, W, L)]
                                     + w[at(GAIN_D, i, j, W, L)] * w[at(ED, i, j, W, L)])


@outlined
def integral(lanes, arms, w, dt):
    """PD with an integral that stands still while its drive is at the limit."""
    L, W = len(lanes), len(arms)
    for i in range(W):
        for j in range(L):
            e, ed, memory = w[at(E, i, j, W, L)], w[at(ED, i, j, W, L)], w[at(MEMORY, i, j, W, L)]
            grown, limit = memory + w[at(GAIN_I, i, j, W, L)] * dt * e, w[at(LIMIT, i, j, W, L)]
            c = -(w[at(GAIN_P, i, j, W, L)] * e + w[at(GAIN_D, i, j, W, L)] * ed + grown)
            held = min(max(c, -limit), limit)
            w[at(C, i, j, W, L)], w[at(MEMORY, i, j, W, L)] = held, grown if held == c else memory


@outlined
def force_filter(lanes, drives, arms, w):
    """The filter (16) of whatever stands in C, weighted where W is not the identity."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        m11 = m12 = m22 = fx = fy = -0.0
        for i in range(N):
            a1, a2, c, ease = (w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)], w[at(C, i, j, W, L)],
                               w[at(EASE, i, j, W, L)])
            m11, m12, m22 = m11 + ease * a1 * a1, m12 + ease * a1 * a2, m22 + ease * a2 * a2
            fx, fy = fx + a1 * c, fy + a2 * c
        gx, gy = solve2(m11, m12, m22, fx, fy)
        for i in range(N):
            w[at(C, i, j, W, L)] = w[at(EASE, i, j, W, L)] * (w[at(A1, i, j, W, L)] * gx + w[at(A2, i, j, W, L)] * gy)


@outlined
def command_filter(lanes, drives, arms, w):
    """PD drives with filtered commands (17)-(18)."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        m11 = m12 = m22 = fx = fy = n11 = n12 = n22 = hx = hy = -0.0
        for i in range(N):
            p, d, a1, a2 = (w[at(GAIN_P, i, j, W, L)], w[at(GAIN_D, i, j, W, L)], w[at(A1, i, j, W, L)],
                            w[at(A2, i, j, W, L)])
            e, ed, pp, dd = p * w[at(E, i, j, W, L)], d * w[at(ED, i, j, W, L)], p * p, d * d
            m11, m12, m22, fx, fy = m11 + pp * a1 * a1, m12 + pp * a1 * a2, m22 + pp * a2 * a2, fx + a1 * e, fy + a2 * e
            n11, n12, n22 = n11 + dd * a1 * a1, n12 + dd * a1 * a2, n22 + dd * a2 * a2
            hx, hy = hx + a1 * ed, hy + a2 * ed
        gx, gy = solve2(m11, m12, m22, fx, fy)
        rx, ry = solve2(n11, n12, n22, hx, hy)
        for i in range(N):
            p, d = w[at(GAIN_P, i, j, W, L)], w[at(GAIN_D, i, j, W, L)]
            w[at(C, i, j, W, L)] = -(w[at(A1, i, j, W, L)] * (p * p * gx + d * d * rx)
                                     + w[at(A2, i, j, W, L)] * (p * p * gy + d * d * ry))


@leaf
def break_drives(lanes, arms, faults, w, k):
    """What is left of the torques C in drives that are dead or at their limit."""
    L, W = len(lanes), len(arms)
    for i in range(W):
        for j in range(L):
            c, limit = w[at(C, i, j, W, L)] * faults.alive[k][i], faults.limit[i]
            w[at(C, i, j, W, L)] = min(max(c, -limit), limit)


@leaf
def record(drives, arms, history, w, k):
    """A sample of a single run."""
    W = len(arms)
    s, q, qd, c, pairs = history.states, history.q_a, history.qd_a, history.c, history.pairs
    s[k, 0], s[k, 1], s[k, 2], s[k, 3] = w[of(X, 0, W, 1)], w[of(Y, 0, W, 1)], w[of(VX, 0, W, 1)], w[of(VY, 0, W, 1)]
    for i in range(len(drives)):
        q[k, i], qd[k, i], c[k, i] = w[at(Q, i, 0, W, 1)], w[at(QD, i, 0, W, 1)], w[at(C, i, 0, W, 1)]
    pairs[k, 0], pairs[k, 1] = w[of(JOINT_J, 0, W, 1)], w[of(JOINT_K, 0, W, 1)]


@outlined
def add_up(lanes, drives, arms, w):
    """Sums of a study: squared torques, per drive and all, and the weighted antagonistic part at the true pose."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        m11 = m12 = m22 = fx = fy = square = null = -0.0
        for i in range(N):
            a1, a2, c = w[at(B1, i, j, W, L)], w[at(B2, i, j, W, L)], w[at(C, i, j, W, L)]
            m11, m12, m22, fx, fy = m11 + a1 * a1, m12 + a1 * a2, m22 + a2 * a2, fx + a1 * c, fy + a2 * c
            w[at(COPPER, i, j, W, L)] += c * c
            square += c * c
        gx, gy = solve2(m11, m12, m22, fx, fy)
        for i in range(N):
            rest = w[at(C, i, j, W, L)] - (w[at(B1, i, j, W, L)] * gx + w[at(B2, i, j, W, L)] * gy)
            null += w[at(WEIGHT, i, j, W, L)] * (rest * rest)
        w[of(TORQUE2, j, W, L)] += square
        w[of(ANTAGONISM, j, W, L)] += null


@leaf
def add_work(lanes, drives, arms, w):
    """Work of the hold that ends at this sample."""
    L, W = len(lanes), len(arms)
    for i in range(len(drives)):
        for j in range(L):
            angle = w[at(Q, i, j, W, L)]
            w[at(WORK, i, j, W, L)] += w[at(C, i, j, W, L)] * (angle - w[at(OLD, i, j, W, L)])
            w[at(OLD, i, j, W, L)] = angle


@kernel
def closed_loops(lanes, drives, arms, faulty, machine, model, motion, sensor, law, faults, w, history):
    """Sampled runs side by side, whatever their law; returns the sample where the last of them ended.

    A single run leaves its history, a study its sums and final states in w, both their status.
    """
    L, table, columns = len(lanes), motion.table, 6 + 9 * len(arms)
    samples = len(table) // columns
    for k in range(samples):
        o = k * columns
        sense(lanes, drives, arms, machine, table, o, w, motion.dt)
        if L > 1:
            add_work(lanes, drives, arms, w)
        measure(lanes, arms, sensor, faulty, faults, table, o, w, motion.dt, k)
        if law.form > PID or law.filter != NO_FILTER:
            find_pose(lanes, drives, arms, law, not sensor.quantized, table, o, w, k)
        if L > 1 and k + 1 == samples:
            return k
        command(lanes, drives, arms, model, law, table, o, w, motion.dt)
        if len(faulty) > 0:
            break_drives(lanes, arms, faults, w, k)
        if L == 1:
            record(drives, arms, history, w, k)
            if lost(lanes, drives, arms, w, k) or k + 1 == samples:
                return k
            single.hold(arms, machine.env, machine.extra, w, motion.dt)
            if plant.judge(lanes, arms, w, k) > 0:
                return k
        else:
            add_up(lanes, drives, arms, w)
            lost(lanes, drives, arms, w, k)
            if plant.hold(lanes, arms, machine.env, machine.extra, w, motion.dt, k) == L:
                return k
    return samples - 1


@leaf
def lost(lanes, drives, arms, w, k):
    """Mark runs whose torques are not finite; true when all have ended."""
    L, W = len(lanes), len(arms)
    ended = 0
    for j in range(L):
        size = 0.0
        for i in range(len(drives)):
            size += abs(w[at(C, i, j, W, L)])
        running = w[of(STATUS, j, W, L)] == DONE
        w[of(SAMPLE, j, W, L)] = k if running else w[of(SAMPLE, j, W, L)]
        w[of(STATUS, j, W, L)] = SINGULAR if running and not size < 1e300 else w[of(STATUS, j, W, L)]
        ended += w[of(STATUS, j, W, L)] != DONE
    return ended == L
