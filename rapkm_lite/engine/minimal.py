"""Two joints, or the end-effector position, as the coordinates of a law: the best pair of drives, reference rates, and
the feedback of (19)-(20)."""

from __future__ import annotations

import math

from .jit import index, outlined
from .leaves import solve2
from .rows import *
from .tables import *

# Ratio of two measures above which rounding does not decide which pair is better.
TIE = 1.0 + 1e-9


@outlined
def best_pair(lanes, drives, arms, w):
    """The pair of drives with the largest |d_j x d_k|, kept while no other is better by the factor HYSTERESIS;
    of equal ones the first."""
    L, N, W = len(lanes), len(drives), len(arms)
    for i in range(N):
        for j in range(L):
            # d / l2 from b = d / (a x d).
            size = w[at(MODEL + ELBOW_SCALE, i, j, W, L)] / w[at(MODEL + SCALE, i, j, W, L)] * w[at(MDEN, i, j, W, L)]
            w[at(ASK_B, i, j, W, L)] = size * w[at(A1, i, j, W, L)]
            w[at(ASK_E, i, j, W, L)] = size * w[at(A2, i, j, W, L)]
    for j in range(L):
        used_j, used_k = w[of(JOINT_J, j, W, L)], w[of(JOINT_K, j, W, L)]
        best, now, best_j, best_k = -1.0, -1.0, 0.0, 0.0
        for i in range(N):
            for k in range(i + 1, N):
                measure = abs(
                    w[at(ASK_B, i, j, W, L)] * w[at(ASK_E, k, j, W, L)]
                    - w[at(ASK_E, i, j, W, L)] * w[at(ASK_B, k, j, W, L)]
                )
                now = measure if used_j == i and used_k == k else now
                better = measure > TIE * best
                best_j, best_k, best = i if better else best_j, k if better else best_k, measure if better else best
        change = now < 0.0 or best > TIE * w[of(HYSTERESIS, j, W, L)] * now
        w[of(JOINT_J, j, W, L)] = best_j if change else used_j
        w[of(JOINT_K, j, W, L)] = best_k if change else used_k


@index
def joint(drives, arms, table, o, w, which, j, L):
    """Of the joint whose number stands in the run row `which`: its row of F, its acceleration at zero xdd, its errors,
    desired rate and acceleration."""
    N, W = len(drives), len(arms)
    number = w[of(which, j, W, L)]
    fx = fy = acc = e = ed = rate = desired = 0.0
    for i in range(N):
        # Masks instead of an index: every run may have joints of its own.
        b, s = 1.0 if number == i else 0.0, 1.0 if number == N + i else 0.0
        a1, a2 = w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)]
        fx += b * a1 - s * (a1 + w[at(L1, i, j, W, L)])
        fy += b * a2 - s * (a2 + w[at(L2, i, j, W, L)])
        acc += b * w[at(ACC_B, i, j, W, L)] + s * w[at(ACC_E, i, j, W, L)]
        e += b * w[at(E, i, j, W, L)] + s * w[at(ELBOW_E, i, j, W, L)]
        ed += b * w[at(ED, i, j, W, L)] + s * w[at(ELBOW_ED, i, j, W, L)]
        rate += b * want(table, o, RATE, i, W) + s * want(table, o, ELBOW_RATE, i, W)
        desired += b * want(table, o, ACCELERATION, i, W) + s * want(table, o, ELBOW_ACCELERATION, i, W)
    return fx, fy, acc, e, ed, rate, desired


@outlined
def reference(lanes, drives, arms, law, table, o, w):
    """The reference rate u of APD laws: what the desired rates of the joints mean at the end-effector."""
    L, N, W = len(lanes), len(drives), len(arms)
    if law.form == REDUNDANT_APD or law.form == REDUNDANT_APD_LINE2:
        for j in range(L):
            fx = fy = 0.0
            for i in range(N):
                a1, a2 = w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)]
                rate, elbow = want(table, o, RATE, i, W), want(table, o, ELBOW_RATE, i, W)
                fx += a1 * rate - (a1 + w[at(L1, i, j, W, L)]) * elbow
                fy += a2 * rate - (a2 + w[at(L2, i, j, W, L)]) * elbow
            w[of(REF_X, j, W, L)], w[of(REF_Y, j, W, L)] = solve2(
                w[of(G11, j, W, L)], w[of(G12, j, W, L)], w[of(G22, j, W, L)], fx, fy
            )
    else:
        for j in range(L):
            a11, a12, _, _, _, r1, _ = joint(drives, arms, table, o, w, JOINT_J, j, L)
            a21, a22, _, _, _, r2, _ = joint(drives, arms, table, o, w, JOINT_K, j, L)
            det = a11 * a22 - a12 * a21
            w[of(REF_X, j, W, L)], w[of(REF_Y, j, W, L)] = (a22 * r1 - a12 * r2) / det, (a11 * r2 - a21 * r1) / det


@outlined
def joint_feedback(lanes, drives, arms, law, table, o, w):
    """w and g of APD and CTC for two joints."""
    L, W, force = len(lanes), len(arms), law.form == APD
    for j in range(L):
        a11, a12, acc1, e1, e1d, _, v1 = joint(drives, arms, table, o, w, JOINT_J, j, L)
        a21, a22, acc2, e2, e2d, _, v2 = joint(drives, arms, table, o, w, JOINT_K, j, L)
        s1 = w[of(PAIR_P1, j, W, L)] * e1 + w[of(PAIR_D1, j, W, L)] * e1d
        s2 = w[of(PAIR_P2, j, W, L)] * e2 + w[of(PAIR_D2, j, W, L)] * e2d
        v1, v2 = v1 - acc1 - (0.0 if force else s1), v2 - acc2 - (0.0 if force else s2)
        det, size = a11 * a22 - a12 * a21, (a11 * a11 + a12 * a12) * (a21 * a21 + a22 * a22)
        # At a parameterization singularity nothing but rounding is left.
        det = det if det * det > 1e-24 * size else math.nan
        w[of(ACC_X, j, W, L)], w[of(ACC_Y, j, W, L)] = (a22 * v1 - a12 * v2) / det, (a11 * v2 - a21 * v1) / det
        w[of(PUSH_X, j, W, L)] = -(a11 * s1 + a21 * s2) if force else 0.0
        w[of(PUSH_Y, j, W, L)] = -(a12 * s1 + a22 * s2) if force else 0.0


@outlined
def task_feedback(lanes, arms, law, table, o, w):
    """Reference rate, w and g of APD and CTC in the end-effector position."""
    L, W, force = len(lanes), len(arms), law.form == APD
    xd, yd, xdd, ydd = table[o + 2], table[o + 3], table[o + 4], table[o + 5]
    for j in range(L):
        ex, ey = w[of(PX, j, W, L)] - table[o], w[of(PY, j, W, L)] - table[o + 1]
        vx, vy = w[of(PVX, j, W, L)], w[of(PVY, j, W, L)]
        s1 = w[of(PAIR_P1, j, W, L)] * ex + w[of(PAIR_D1, j, W, L)] * (vx - xd)
        s2 = w[of(PAIR_P2, j, W, L)] * ey + w[of(PAIR_D2, j, W, L)] * (vy - yd)
        w[of(REF_X, j, W, L)], w[of(REF_Y, j, W, L)] = xd if force else vx, yd if force else vy
        w[of(ACC_X, j, W, L)], w[of(ACC_Y, j, W, L)] = xdd if force else xdd - s1, ydd if force else ydd - s2
        w[of(PUSH_X, j, W, L)], w[of(PUSH_Y, j, W, L)] = -s1 if force else 0.0, -s2 if force else 0.0
