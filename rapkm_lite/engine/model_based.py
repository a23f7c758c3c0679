"""The laws with a model (19)-(20), (28), (32) and switching: one sampled run."""

from __future__ import annotations

import math

import numpy as np

from .jit import kernel, leaf, outlined
from .plant import base_angles, geometry, hold, solve2, turned_by
from .tables import (
    APD,
    COLUMNS,
    DONE,
    FRICTION,
    L1SQ,
    L2SQ,
    LEFT_WORKSPACE,
    MEASURED,
    NO_POSE,
    REDUNDANT_APD,
    REDUNDANT_CTC,
    REDUNDANT_CTC_LINE2,
    S1,
    S2,
    SCALE,
    SINGULAR,
    SWITCHED,
    TIP,
    W1,
    W2,
)


@outlined
def find_pose(drives, arms, row, q, x, y):
    """Least-squares end-effector position of measured base angles by Gauss-Newton steps from (x, y); else NaN."""
    N = len(drives)
    tolerance = 1e-13 / arms[SCALE]
    for _ in range(50):
        m11 = m12 = m22 = fx = fy = 0.0
        for i in range(N):
            ax, ay, _, _, _, bx, by, _, _, _, area2 = geometry(arms, i, x, y)
            if not area2 > 0.0:
                return math.nan, math.nan
            ux, uy = row[6 + 6 * N + i], row[6 + 7 * N + i]
            r = q[i] - row[6 + i] - turned_by(ux, uy, ax, ay, arms[i * COLUMNS + SCALE])
            m11, m12, m22, fx, fy = m11 + bx * bx, m12 + bx * by, m22 + by * by, fx + bx * r, fy + by * r
        sx, sy = solve2(m11, m12, m22, fx, fy)
        if max(abs(sx), abs(sy)) < tolerance:
            return x, y
        x, y = x + sx, y + sy
    return math.nan, math.nan


@outlined
def complement(drives, arms, x, y, vx, vy, F, Fd):
    """F and dF/dt of the end-effector position in absolute link angles: rows base 1..N, link 1..N."""
    N = len(drives)
    for i in range(N):
        _, _, _, _, ad, bx, by, lx, ly, inv, _ = geometry(arms, i, x, y)
        F[i, 0], F[i, 1], F[N + i, 0], F[N + i, 1] = bx, by, -lx, -ly
        base, link = bx * vx + by * vy, -(lx * vx + ly * vy)
        for k in range(2):
            Fd[i, k] = (base * ad * F[i, k] + link * arms[i * COLUMNS + L2SQ] * F[N + i, k]) * inv
            Fd[N + i, k] = -(base * arms[i * COLUMNS + L1SQ] * F[i, k] + link * ad * F[N + i, k]) * inv


@outlined
def tree_wrench(drives, arms, env, x, y, vx, vy, F, rate, acc):
    """F^T (G acc + C rate + Q) with reference rates and accelerations of the absolute link angles, (2N,) each."""
    N = len(drives)
    fx = fy = 0.0
    for i in range(N):
        o = i * COLUMNS
        ax, ay, dx, dy, ad, _, _, _, _, inv, _ = geometry(arms, i, x, y)
        base, link = F[i, 0] * vx + F[i, 1] * vy, F[N + i, 0] * vx + F[N + i, 1] * vy
        tip, den = arms[o + TIP], 1.0 / inv
        t1 = (arms[o + S1] + tip * arms[o + L1SQ]) * acc[i] + tip * (ad * acc[N + i] - den * link * rate[N + i])
        t2 = (arms[o + S2] + tip * arms[o + L2SQ]) * acc[N + i] + tip * (ad * acc[i] + den * base * rate[i])
        t1 += arms[o + W1] * (env[0] * ay - env[1] * ax) + arms[o + FRICTION] * math.tanh(base * env[2])
        t2 += arms[o + W2] * (env[0] * dy - env[1] * dx)
        fx += F[i, 0] * t1 + F[N + i, 0] * t2
        fy += F[i, 1] * t1 + F[N + i, 1] * t2
    return fx, fy


@outlined
def distribute(F, fx, fy, c):
    """The smallest torques with A^T c = f: c = A (A^T A)^-1 f."""
    m11 = m12 = m22 = 0.0
    for i in range(c.shape[0]):
        m11, m12, m22 = m11 + F[i, 0] ** 2, m12 + F[i, 0] * F[i, 1], m22 + F[i, 1] ** 2
    gx, gy = solve2(m11, m12, m22, fx, fy)
    for i in range(c.shape[0]):
        c[i] = F[i, 0] * gx + F[i, 1] * gy


@outlined
def best_pair(drives, arms, x, y, pair, hysteresis):
    """Pair of drives with the largest |d_j x d_k|, kept while no other is better by the factor `hysteresis`."""
    N = len(drives)
    best, now, j0, k0 = -1.0, -1.0, pair[0], pair[1]
    for j in range(N):
        _, _, djx, djy, _, _, _, _, _, _, _ = geometry(arms, j, x, y)
        for k in range(j + 1, N):
            _, _, dkx, dky, _, _, _, _, _, _, _ = geometry(arms, k, x, y)
            measure = abs(djx * dky - djy * dkx) / math.sqrt(arms[j * COLUMNS + L2SQ] * arms[k * COLUMNS + L2SQ])
            if j == j0 and k == k0:
                now = measure
            if measure > best:
                best, pair[0], pair[1] = measure, j, k
    if now >= 0.0 and best <= hysteresis * now:
        pair[0], pair[1] = j0, k0


@leaf
def joint_row(F, N, j, k):
    """Entry (j, k) of F for the relative joint angles."""
    return F[j, k] if j < N else F[j, k] - F[j - N, k]


@outlined
def minimal_feedback(F, Fd, N, pair, row, q, qd, vx, vy, K_P, K_D, torque_level, out):
    """Errors, references of the pair of independent joints: end-effector velocity and acceleration, extra force.

    out = (ux, uy, wx, wy, fx, fy); at torque level (APD) the feedback is a force, otherwise an acceleration (CTC).
    """
    j, k = pair[0], pair[1]
    a11, a12, a21, a22 = joint_row(F, N, j, 0), joint_row(F, N, j, 1), joint_row(F, N, k, 0), joint_row(F, N, k, 1)
    det = a11 * a22 - a12 * a21
    e1, e2 = q[j] - row[6 + j], q[k] - row[6 + k]
    e1d, e2d = qd[j] - row[6 + 2 * N + j], qd[k] - row[6 + 2 * N + k]
    s1, s2 = K_P[0] * e1 + K_D[0] * e1d, K_P[1] * e2 + K_D[1] * e2d
    v1, v2 = row[6 + 4 * N + j], row[6 + 4 * N + k]
    ux, uy = vx, vy
    if torque_level:
        r1, r2 = row[6 + 2 * N + j], row[6 + 2 * N + k]
        ux, uy = (a22 * r1 - a12 * r2) / det, (a11 * r2 - a21 * r1) / det
        out[4], out[5] = -(a11 * s1 + a21 * s2), -(a12 * s1 + a22 * s2)
    else:
        v1, v2 = v1 - s1, v2 - s2
        out[4] = out[5] = 0.0
    v1 -= joint_row(Fd, N, j, 0) * ux + joint_row(Fd, N, j, 1) * uy
    v2 -= joint_row(Fd, N, k, 0) * ux + joint_row(Fd, N, k, 1) * uy
    out[0], out[1], out[2], out[3] = ux, uy, (a22 * v1 - a12 * v2) / det, (a11 * v2 - a21 * v1) / det


@outlined
def project(F, N, v, weighted):
    """F^+ v for relative joint values v (2N,), or F^T v when not `weighted`."""
    m11 = m12 = m22 = fx = fy = 0.0
    for j in range(2 * N):
        rx, ry = joint_row(F, N, j, 0), joint_row(F, N, j, 1)
        m11, m12, m22 = m11 + rx * rx, m12 + rx * ry, m22 + ry * ry
        fx, fy = fx + rx * v[j], fy + ry * v[j]
    if weighted:
        return solve2(m11, m12, m22, fx, fy)
    return fx, fy


@outlined
def redundant_feedback(F, Fd, N, row, q, qd, vx, vy, K_P, K_D, torque_level, work, out):
    """The same as `minimal_feedback` in redundant coordinates; `work` (2N,) is overwritten."""
    out[4] = out[5] = 0.0
    if not torque_level:
        for j in range(2 * N):
            s = K_P[j] * (q[j] - row[6 + j]) + K_D[j] * (qd[j] - row[6 + 2 * N + j])
            work[j] = row[6 + 4 * N + j] - s - (joint_row(Fd, N, j, 0) * vx + joint_row(Fd, N, j, 1) * vy)
        out[0], out[1] = vx, vy
        out[2], out[3] = project(F, N, work, True)
        return
    for j in range(2 * N):
        work[j] = -K_P[j] * (q[j] - row[6 + j]) - K_D[j] * (qd[j] - row[6 + 2 * N + j])
    out[4], out[5] = project(F, N, work, False)
    ux, uy = project(F, N, row[6 + 2 * N:6 + 4 * N], True)
    # N_J qdd^d + Ndot_J qd^d = F w + Fdot u, with the part of qd^d that is not tangent turned by Fdot.
    m11 = m12 = m22 = gx = gy = 0.0
    for j in range(2 * N):
        rx, ry = joint_row(F, N, j, 0), joint_row(F, N, j, 1)
        sx, sy = joint_row(Fd, N, j, 0), joint_row(Fd, N, j, 1)
        normal = row[6 + 2 * N + j] - rx * ux - ry * uy
        m11, m12, m22 = m11 + rx * rx, m12 + rx * ry, m22 + ry * ry
        gx, gy = gx + sx * normal, gy + sy * normal
        work[j] = row[6 + 4 * N + j] - (sx * ux + sy * uy)
    wx, wy = project(F, N, work, True)
    tx, ty = solve2(m11, m12, m22, gx, gy)
    out[0], out[1], out[2], out[3] = ux, uy, wx + tx, wy + ty


@outlined
def torques(drives, arms, env, row, law, x, y, vx, vy, q, qd, K_P, K_D, pair, hysteresis, F, Fd, work, c):
    """Drive torques of one sample, written to c, from the pose (x, y, vx, vy) and the measured base angles in q, qd."""
    N = len(drives)
    complement(drives, arms, x, y, vx, vy, F, Fd)
    for i in range(N):
        _, _, _, _, ad, _, _, _, _, inv, _ = geometry(arms, i, x, y)
        q[N + i] = math.atan2(1.0 / inv, ad)
        qd[N + i] = (F[N + i, 0] - F[i, 0]) * vx + (F[N + i, 1] - F[i, 1]) * vy
    out = work[2]
    if law == SWITCHED:
        best_pair(drives, arms, x, y, pair, hysteresis)
    rate, acc = work[0], work[1]
    if law == REDUNDANT_CTC_LINE2:
        for j in range(2 * N):
            acc[j] = row[6 + 4 * N + j] - K_P[j] * (q[j] - row[6 + j]) - K_D[j] * (qd[j] - row[6 + 2 * N + j])
            rate[j] = F[j, 0] * vx + F[j, 1] * vy
        for i in range(N):
            acc[N + i] += acc[i]
        out[4] = out[5] = 0.0
    else:
        if law == REDUNDANT_APD or law == REDUNDANT_CTC:
            redundant_feedback(F, Fd, N, row, q, qd, vx, vy, K_P, K_D, law == REDUNDANT_APD, acc, out)
        elif pair[0] >= 0:
            minimal_feedback(F, Fd, N, pair, row, q, qd, vx, vy, K_P, K_D, law == APD, out)
        else:
            e1, e2 = x - row[0], y - row[1]
            s1 = K_P[0] * e1 + K_D[0] * (vx - row[2])
            s2 = K_P[1] * e2 + K_D[1] * (vy - row[3])
            if law == APD:
                out[0], out[1], out[2], out[3], out[4], out[5] = row[2], row[3], row[4], row[5], -s1, -s2
            else:
                out[0], out[1], out[2], out[3], out[4], out[5] = vx, vy, row[4] - s1, row[5] - s2, 0.0, 0.0
        for j in range(2 * N):
            rate[j] = F[j, 0] * out[0] + F[j, 1] * out[1]
            acc[j] = F[j, 0] * out[2] + F[j, 1] * out[3] + Fd[j, 0] * out[0] + Fd[j, 1] * out[1]
    fx, fy = tree_wrench(drives, arms, env, x, y, vx, vy, F, rate, acc)
    distribute(F, fx + out[4], fy + out[5], c)


@kernel
def closed_loop(drives, extra, plant, plant_env, model, model_env, table, dt, law, pose, K_P, K_D, pair, hysteresis,
                offset, quantum, tau, states, q_a, qd_a, c, pairs):
    """One sampled run; fills states (k, 4), q_a, qd_a, c (k, N), pairs (k, 2).  Returns (status, sample)."""
    N, samples = len(drives), len(table)
    F, Fd, work = np.empty((2 * N, 2)), np.empty((2 * N, 2)), np.empty((3, max(2 * N, 6)))
    q, qd, last, slow = np.empty(2 * N), np.empty(2 * N), np.empty(N), np.zeros(N)
    x, y, vx, vy = table[0][0], table[0][1], table[0][2], table[0][3]
    px, py, pvx, pvy = x, y, vx, vy
    blend = dt / (tau + dt) if tau >= 0.0 else 0.0
    for k in range(samples):
        row = table[k]
        base_angles(drives, plant, row, x, y, vx, vy, q, qd)
        for i in range(N):
            q_a[k, i], qd_a[k, i] = q[i], qd[i]
            q[i] += offset[i]
            if quantum > 0.0:
                q[i] = quantum * math.floor(q[i] / quantum + 0.5)
            if tau >= 0.0:
                if k > 0:
                    slow[i] += blend * ((q[i] - last[i]) / dt - slow[i])
                last[i], qd[i] = q[i], slow[i]
        if pose != MEASURED:
            px, py, pvx, pvy = x, y, vx, vy
        else:
            px, py = find_pose(drives, model, row, q, px, py)
            if not abs(px) < 1e300:
                return NO_POSE, k
            complement(drives, model, px, py, 0.0, 0.0, F, Fd)
            m11 = m12 = m22 = fx = fy = 0.0
            for i in range(N):
                m11, m12, m22 = m11 + F[i, 0] ** 2, m12 + F[i, 0] * F[i, 1], m22 + F[i, 1] ** 2
                fx, fy = fx + F[i, 0] * qd[i], fy + F[i, 1] * qd[i]
            pvx, pvy = solve2(m11, m12, m22, fx, fy)
        torques(drives, model, model_env, row, law, px, py, pvx, pvy, q, qd, K_P, K_D, pair, hysteresis, F, Fd, work,
                c[k])
        states[k, 0], states[k, 1], states[k, 2], states[k, 3] = x, y, vx, vy
        pairs[k, 0], pairs[k, 1] = pair[0], pair[1]
        for i in range(N):
            if not abs(c[k, i]) < 1e300:
                return SINGULAR, k
        if k + 1 < samples:
            x, y, vx, vy, low = hold(drives, plant, plant_env, extra, x, y, vx, vy, c[k], dt)
            if not (low > 0.0 and abs(x) + abs(y) + abs(vx) + abs(vy) < 1e300):
                return LEFT_WORKSPACE, k
    return DONE, samples - 1
