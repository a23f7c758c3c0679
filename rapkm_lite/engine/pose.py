"""Where the controller thinks the machine is: its pose and control matrix A, true or by least squares."""

from __future__ import annotations

import math

from .jit import outlined
from .leaves import geometry, small_angle, solve2
from .rows import *
from .tables import *


@outlined
def true_pose(lanes, drives, arms, law, w):
    """The true end-effector position and velocity, and A there."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        w[of(PX, j, W, L)], w[of(PY, j, W, L)] = w[of(X, j, W, L)], w[of(Y, j, W, L)]
        w[of(PVX, j, W, L)], w[of(PVY, j, W, L)] = w[of(VX, j, W, L)], w[of(VY, j, W, L)]
    if law.same:
        for i in range(W):
            for j in range(L):
                w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)] = w[at(B1, i, j, W, L)], w[at(B2, i, j, W, L)]
    else:
        control_rows(lanes, drives, arms, w)


@outlined
def control_rows(lanes, drives, arms, w):
    """Rows b = d / (a x d) of A at the pose."""
    L, N, W = len(lanes), len(drives), len(arms)
    for i in range(N):
        for j in range(L):
            place = geometry(w[at(MODEL + BX, i, j, W, L)], w[at(MODEL + BY, i, j, W, L)],
                             w[at(MODEL + L1SQ, i, j, W, L)], w[at(MODEL + HALF, i, j, W, L)],
                             w[at(MODEL + MEAN, i, j, W, L)], w[at(MODEL + MODE, i, j, W, L)],
                             w[of(PX, j, W, L)], w[of(PY, j, W, L)])
            w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)] = place[2] * place[5], place[3] * place[5]


@outlined
def newton_step(lanes, drives, arms, table, o, w, tolerance):
    """One Newton step for the least-squares pose of all runs; returns how many need another one."""
    L, N, W = len(lanes), len(drives), len(arms)
    for i in range(N):
        ux, uy = want(table, o, COS, i, W), want(table, o, SIN, i, W)
        for j in range(L):
            l2sq = w[at(MODEL + L2SQ, i, j, W, L)]
            ax, ay, dx, dy, ad, inv, area2 = geometry(
                w[at(MODEL + BX, i, j, W, L)], w[at(MODEL + BY, i, j, W, L)], w[at(MODEL + L1SQ, i, j, W, L)],
                w[at(MODEL + HALF, i, j, W, L)], w[at(MODEL + MEAN, i, j, W, L)], w[at(MODEL + MODE, i, j, W, L)],
                w[of(PX, j, W, L)], w[of(PY, j, W, L)])
            bx, by, lx, ly = dx * inv, dy * inv, ax * inv, ay * inv
            s = (ux * ay - uy * ax) * w[at(MODEL + SCALE, i, j, W, L)]
            # Negative where the series does not hold or the arm does not reach.
            w[at(NEAR, i, j, W, L)] = min(min(0.1 - abs(s), ux * ax + uy * ay), area2)
            r = w[at(E, i, j, W, L)] - small_angle(s)
            # Second derivative of the base angle: (a.d b b^T + l2^2 l l^T) / (a x d).
            h = r * inv
            g1, g2 = 1.0 - h * ad, h * l2sq
            w[at(P11, i, j, W, L)] = g1 * bx * bx - g2 * lx * lx
            w[at(P12, i, j, W, L)] = g1 * bx * by - g2 * lx * ly
            w[at(P22, i, j, W, L)] = g1 * by * by - g2 * ly * ly
            w[at(GX, i, j, W, L)], w[at(GY, i, j, W, L)] = bx * r, by * r
            w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)] = bx, by
    count = 0
    for j in range(L):
        m11 = m12 = m22 = fx = fy = -0.0
        near = 1.0
        for i in range(N):
            m11, m12, m22 = m11 + w[at(P11, i, j, W, L)], m12 + w[at(P12, i, j, W, L)], m22 + w[at(P22, i, j, W, L)]
            fx, fy = fx + w[at(GX, i, j, W, L)], fy + w[at(GY, i, j, W, L)]
            near = min(near, w[at(NEAR, i, j, W, L)])
        sx, sy = solve2(m11, m12, m22, fx, fy)
        near = min(min(near, m11), m11 * m22 - m12 * m12)
        todo = w[of(TODO, j, W, L)]
        more = todo if near > 0.0 and max(abs(sx), abs(sy)) >= tolerance else 0.0
        w[of(FAR, j, W, L)] += 0.0 if near > 0.0 else todo
        # A run that is done stays where it is and finds the same matrix again, whatever its neighbours still need.
        w[of(PX, j, W, L)] += sx if more > 0.0 else 0.0
        w[of(PY, j, W, L)] += sy if more > 0.0 else 0.0
        w[of(TODO, j, W, L)] = more
        count += 1 if more > 0.0 else 0
    return count


@outlined
def gauss_newton(drives, arms, table, o, w, j, L, x, y, tolerance):
    """Least-squares pose of one run from a rough start; returns it, and whether it converged."""
    N, W = len(drives), len(arms)
    for _ in range(50):
        m11 = m12 = m22 = fx = fy = -0.0
        for i in range(N):
            ax, ay, dx, dy, _, inv, area2 = geometry(
                w[at(MODEL + BX, i, j, W, L)], w[at(MODEL + BY, i, j, W, L)], w[at(MODEL + L1SQ, i, j, W, L)],
                w[at(MODEL + HALF, i, j, W, L)], w[at(MODEL + MEAN, i, j, W, L)], w[at(MODEL + MODE, i, j, W, L)], x, y)
            if not area2 > 0.0:
                return x, y, False
            bx, by = dx * inv, dy * inv
            ux, uy = want(table, o, COS, i, W), want(table, o, SIN, i, W)
            r = w[at(E, i, j, W, L)] - math.atan2(ux * ay - uy * ax, ux * ax + uy * ay)
            w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)] = bx, by
            m11, m12, m22, fx, fy = m11 + bx * bx, m12 + bx * by, m22 + by * by, fx + bx * r, fy + by * r
        sx, sy = solve2(m11, m12, m22, fx, fy)
        if abs(sx) < tolerance and abs(sy) < tolerance:
            return x, y, True
        x, y = x + sx, y + sy
    return x, y, False


@outlined
def measured_pose(lanes, drives, arms, table, o, w, k, smooth):
    """Least-squares pose of the measured base angles, and A there (`estimate_pose`)."""
    L, W = len(lanes), len(arms)
    tolerance = 1e-13 / w[at(MODEL + SCALE, 0, 0, W, L)]
    for j in range(L):
        x, y = w[of(PX, j, W, L)], w[of(PY, j, W, L)]
        x1, y1 = w[of(PX1, j, W, L)], w[of(PY1, j, W, L)]
        # The pose moves on smoothly, unless angles are stepped: a parabola through the last three.
        w[of(PX, j, W, L)] = 3.0 * (x - x1) + w[of(PX2, j, W, L)] if smooth else x
        w[of(PY, j, W, L)] = 3.0 * (y - y1) + w[of(PY2, j, W, L)] if smooth else y
        w[of(PX2, j, W, L)], w[of(PY2, j, W, L)], w[of(PX1, j, W, L)], w[of(PY1, j, W, L)] = x1, y1, x, y
        w[of(TODO, j, W, L)], w[of(FAR, j, W, L)] = 1.0, 0.0
    count = L
    for _ in range(12):
        if count > 0:
            count = newton_step(lanes, drives, arms, table, o, w, tolerance)
    rough = 0.0
    for j in range(L):
        rough += w[of(FAR, j, W, L)] + w[of(TODO, j, W, L)]
    if rough > 0.0:
        for j in range(L):
            if w[of(FAR, j, W, L)] + w[of(TODO, j, W, L)] > 0.0 and w[of(STATUS, j, W, L)] == DONE:
                px, py, found = gauss_newton(drives, arms, table, o, w, j, L, w[of(PX1, j, W, L)], w[of(PY1, j, W, L)],
                                             tolerance)
                w[of(PX, j, W, L)], w[of(PY, j, W, L)] = px, py
                if not found:
                    w[of(STATUS, j, W, L)], w[of(SAMPLE, j, W, L)] = NO_POSE, k


@outlined
def measured_rate(lanes, drives, arms, table, o, w):
    """End-effector velocity by least squares from the measured base rates."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        m11 = m12 = m22 = fx = fy = -0.0
        for i in range(N):
            a1, a2 = w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)]
            rate = w[at(ED, i, j, W, L)] + want(table, o, RATE, i, W)
            m11, m12, m22, fx, fy = m11 + a1 * a1, m12 + a1 * a2, m22 + a2 * a2, fx + a1 * rate, fy + a2 * rate
        w[of(PVX, j, W, L)], w[of(PVY, j, W, L)] = solve2(m11, m12, m22, fx, fy)
