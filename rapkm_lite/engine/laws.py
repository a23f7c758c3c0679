"""The laws with a model (19)-(20), (28), (32): all of them command an end-effector acceleration.

With the mass matrix M and the other terms h of the model's equations of motion in end-effector coordinates,
c = A (A^T A)^-1 (M w + h(v, u) + g): a law only says which acceleration w it wants, which reference rate u takes the
place of one of the two rates in h, and which force g it adds.  v is the velocity of the pose.
"""

from __future__ import annotations

import math

from .jit import leaf, outlined
from .leaves import accelerations, drag, geometry, inertia, small_angle, solve2
from .rows import *
from .tables import *


@outlined
def look(lanes, drives, arms, table, o, w):
    """The model at the pose: rows b and l of its rates, a.d, 1 / (a x d), and the errors of the elbows."""
    L, N, W = len(lanes), len(drives), len(arms)
    far = 0
    for i in range(N):
        cos, sin = want(table, o, ELBOW_COS, i, W), want(table, o, ELBOW_SIN, i, W)
        rate = want(table, o, ELBOW_RATE, i, W)
        for j in range(L):
            ax, ay, dx, dy, ad, inv, _ = geometry(
                w[at(MODEL + BX, i, j, W, L)],
                w[at(MODEL + BY, i, j, W, L)],
                w[at(MODEL + L1SQ, i, j, W, L)],
                w[at(MODEL + HALF, i, j, W, L)],
                w[at(MODEL + MEAN, i, j, W, L)],
                w[at(MODEL + MODE, i, j, W, L)],
                w[of(PX, j, W, L)],
                w[of(PY, j, W, L)],
            )
            bx, by, lx, ly = dx * inv, dy * inv, ax * inv, ay * inv
            w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)], w[at(L1, i, j, W, L)], w[at(L2, i, j, W, L)] = bx, by, lx, ly
            w[at(MAD, i, j, W, L)], w[at(MINV, i, j, W, L)] = ad, inv
            # a x d and a.d are the sine and cosine of the elbow angle times both lengths.
            s, t = cos / inv - sin * ad, cos * ad + sin / inv
            s *= w[at(MODEL + ELBOW_SCALE, i, j, W, L)]
            w[at(ELBOW_E, i, j, W, L)] = small_angle(s)
            w[at(ELBOW_ED, i, j, W, L)] = -(bx + lx) * w[of(PVX, j, W, L)] - (by + ly) * w[of(PVY, j, W, L)] - rate
            far += 1 if min(0.1 - abs(s), t) < 0.0 else 0
    if far > 0:
        for i in range(N):
            cos, sin = want(table, o, ELBOW_COS, i, W), want(table, o, ELBOW_SIN, i, W)
            for j in range(L):
                ad, den = w[at(MAD, i, j, W, L)], 1.0 / w[at(MINV, i, j, W, L)]
                s, t = cos * den - sin * ad, cos * ad + sin * den
                # Only those that are far: no run feels its neighbours.
                if not (abs(s * w[at(MODEL + ELBOW_SCALE, i, j, W, L)]) <= 0.1 and t >= 0.0):
                    w[at(ELBOW_E, i, j, W, L)] = math.atan2(s, t)


@outlined
def best_pair(lanes, drives, arms, w):
    """The pair of drives with the largest |d_j x d_k|, kept while no other is better by the factor HYSTERESIS."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        w[of(BEST, j, W, L)], w[of(NOW, j, W, L)] = -1.0, -1.0
    for i in range(N):
        for k in range(i + 1, N):
            for j in range(L):
                # d / l2 from b = d / (a x d).
                size = (
                    w[at(MODEL + ELBOW_SCALE, i, j, W, L)]
                    * w[at(MODEL + ELBOW_SCALE, k, j, W, L)]
                    / (
                        w[at(MODEL + SCALE, i, j, W, L)]
                        * w[at(MODEL + SCALE, k, j, W, L)]
                        * w[at(MINV, i, j, W, L)]
                        * w[at(MINV, k, j, W, L)]
                    )
                )
                measure = abs(
                    size
                    * (w[at(A1, i, j, W, L)] * w[at(A2, k, j, W, L)] - w[at(A2, i, j, W, L)] * w[at(A1, k, j, W, L)])
                )
                used = w[of(JOINT_J, j, W, L)] == i and w[of(JOINT_K, j, W, L)] == k
                w[of(NOW, j, W, L)] = measure if used else w[of(NOW, j, W, L)]
                better = measure > w[of(BEST, j, W, L)]
                w[of(BEST_J, j, W, L)] = i if better else w[of(BEST_J, j, W, L)]
                w[of(BEST_K, j, W, L)] = k if better else w[of(BEST_K, j, W, L)]
                w[of(BEST, j, W, L)] = measure if better else w[of(BEST, j, W, L)]
    for j in range(L):
        now = w[of(NOW, j, W, L)]
        change = now < 0.0 or w[of(BEST, j, W, L)] > w[of(HYSTERESIS, j, W, L)] * now
        w[of(JOINT_J, j, W, L)] = w[of(BEST_J, j, W, L)] if change else w[of(JOINT_J, j, W, L)]
        w[of(JOINT_K, j, W, L)] = w[of(BEST_K, j, W, L)] if change else w[of(JOINT_K, j, W, L)]


@leaf
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
    """The reference rate u: the velocity of the pose, in APD laws what the desired rates of the coordinates mean."""
    L, N, W = len(lanes), len(drives), len(arms)
    if law.form == REDUNDANT_APD:
        for j in range(L):
            fx = fy = 0.0
            for i in range(N):
                a1, a2, rate, elbow = (
                    w[at(A1, i, j, W, L)],
                    w[at(A2, i, j, W, L)],
                    want(table, o, RATE, i, W),
                    want(table, o, ELBOW_RATE, i, W),
                )
                fx += a1 * rate - (a1 + w[at(L1, i, j, W, L)]) * elbow
                fy += a2 * rate - (a2 + w[at(L2, i, j, W, L)]) * elbow
            w[of(REF_X, j, W, L)], w[of(REF_Y, j, W, L)] = solve2(
                w[of(G11, j, W, L)], w[of(G12, j, W, L)], w[of(G22, j, W, L)], fx, fy
            )
    elif law.form == APD:
        for j in range(L):
            a11, a12, _, _, _, r1, _ = joint(drives, arms, table, o, w, JOINT_J, j, L)
            a21, a22, _, _, _, r2, _ = joint(drives, arms, table, o, w, JOINT_K, j, L)
            task = w[of(JOINT_J, j, W, L)] < 0.0
            det = 1.0 if task else a11 * a22 - a12 * a21
            w[of(REF_X, j, W, L)] = table[o + 2] if task else (a22 * r1 - a12 * r2) / det
            w[of(REF_Y, j, W, L)] = table[o + 3] if task else (a11 * r2 - a21 * r1) / det
    else:
        for j in range(L):
            w[of(REF_X, j, W, L)], w[of(REF_Y, j, W, L)] = w[of(PVX, j, W, L)], w[of(PVY, j, W, L)]


@outlined
def shares(lanes, drives, arms, extra, w):
    """Shares of the arms in M and h, and the accelerations of their joints at zero xdd, with the reference rate."""
    L, N, W = len(lanes), len(drives), len(arms)
    for i in range(N):
        for j in range(L):
            bx, by, lx, ly = w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)], w[at(L1, i, j, W, L)], w[at(L2, i, j, W, L)]
            vx, vy, ux, uy = w[of(PVX, j, W, L)], w[of(PVY, j, W, L)], w[of(REF_X, j, W, L)], w[of(REF_Y, j, W, L)]
            ad, inv, base = w[at(MAD, i, j, W, L)], w[at(MINV, i, j, W, L)], bx * vx + by * vy
            base_acc, back_acc = accelerations(
                base,
                lx * vx + ly * vy,
                bx * ux + by * uy,
                lx * ux + ly * uy,
                ad,
                inv,
                w[at(MODEL + L1SQ, i, j, W, L)],
                w[at(MODEL + L2SQ, i, j, W, L)],
            )
            m11, m12, m22, fx, fy = inertia(
                w[at(MODEL + S1, i, j, W, L)], w[at(MODEL + S2, i, j, W, L)], bx, by, lx, ly, base_acc, back_acc
            )
            if len(extra) > 0:
                env = (
                    w[of(ENVIRONMENT + GRAVITY_X, j, W, L)],
                    w[of(ENVIRONMENT + GRAVITY_Y, j, W, L)],
                    w[of(ENVIRONMENT + SHARPNESS, j, W, L)],
                )
                place = lx / inv, ly / inv, bx / inv, by / inv, ad, inv, 0.0
                gx, gy = drag(
                    w[at(MODEL + W1, i, j, W, L)],
                    w[at(MODEL + W2, i, j, W, L)],
                    w[at(MODEL + FRICTION, i, j, W, L)],
                    env,
                    place,
                    base,
                )
                fx, fy = fx + gx, fy + gy
            w[at(P11, i, j, W, L)], w[at(P12, i, j, W, L)], w[at(P22, i, j, W, L)] = m11, m12, m22
            w[at(GX, i, j, W, L)], w[at(GY, i, j, W, L)] = -fx, -fy
            w[at(ACC_B, i, j, W, L)], w[at(ACC_E, i, j, W, L)] = base_acc, -base_acc - back_acc


@outlined
def minimal_feedback(lanes, drives, arms, law, table, o, w):
    """w and g of APD and CTC for two joints or, where JOINT_J is negative, the end-effector position."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        a11, a12, acc1, e1, e1d, _, v1 = joint(drives, arms, table, o, w, JOINT_J, j, L)
        a21, a22, acc2, e2, e2d, _, v2 = joint(drives, arms, table, o, w, JOINT_K, j, L)
        task = w[of(JOINT_J, j, W, L)] < 0.0
        a11, a12, a21, a22 = 1.0 if task else a11, 0.0 if task else a12, 0.0 if task else a21, 1.0 if task else a22
        e1, e2 = w[of(PX, j, W, L)] - table[o] if task else e1, w[of(PY, j, W, L)] - table[o + 1] if task else e2
        e1d = w[of(PVX, j, W, L)] - table[o + 2] if task else e1d
        e2d = w[of(PVY, j, W, L)] - table[o + 3] if task else e2d
        v1, v2 = table[o + 4] if task else v1 - acc1, table[o + 5] if task else v2 - acc2
        s1 = w[of(PAIR_P1, j, W, L)] * e1 + w[of(PAIR_D1, j, W, L)] * e1d
        s2 = w[of(PAIR_P2, j, W, L)] * e2 + w[of(PAIR_D2, j, W, L)] * e2d
        force = law.form == APD
        v1, v2 = v1 if force else v1 - s1, v2 if force else v2 - s2
        det = a11 * a22 - a12 * a21
        w[of(ACC_X, j, W, L)], w[of(ACC_Y, j, W, L)] = (a22 * v1 - a12 * v2) / det, (a11 * v2 - a21 * v1) / det
        w[of(PUSH_X, j, W, L)] = -(a11 * s1 + a21 * s2) if force else 0.0
        w[of(PUSH_Y, j, W, L)] = -(a12 * s1 + a22 * s2) if force else 0.0


@outlined
def gram(lanes, drives, arms, w):
    """F^T F of all joints."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        m11 = m12 = m22 = 0.0
        for i in range(N):
            bx, by = w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)]
            ex, ey = bx + w[at(L1, i, j, W, L)], by + w[at(L2, i, j, W, L)]
            m11, m12, m22 = m11 + bx * bx + ex * ex, m12 + bx * by + ex * ey, m22 + by * by + ey * ey
        w[of(G11, j, W, L)], w[of(G12, j, W, L)], w[of(G22, j, W, L)] = m11, m12, m22


@outlined
def redundant_feedback(lanes, drives, arms, law, table, o, w):
    """w and g of (28) and (32) in all joints: w = F^+ (v - Fdot u), or F^T G (v - Fdot u) as a force in line 2."""
    L, N, W = len(lanes), len(drives), len(arms)
    force, line2 = law.form == REDUNDANT_APD, law.form == REDUNDANT_CTC_LINE2
    for j in range(L):
        wx = wy = gx = gy = tx = ty = 0.0
        vx, vy, ux, uy = w[of(PVX, j, W, L)], w[of(PVY, j, W, L)], w[of(REF_X, j, W, L)], w[of(REF_Y, j, W, L)]
        for i in range(N):
            bx, by, lx, ly = w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)], w[at(L1, i, j, W, L)], w[at(L2, i, j, W, L)]
            ex, ey = -(bx + lx), -(by + ly)
            s = w[at(GAIN_P, i, j, W, L)] * w[at(E, i, j, W, L)] + w[at(GAIN_D, i, j, W, L)] * w[at(ED, i, j, W, L)]
            t = (
                w[at(ELBOW_P, i, j, W, L)] * w[at(ELBOW_E, i, j, W, L)]
                + w[at(ELBOW_D, i, j, W, L)] * w[at(ELBOW_ED, i, j, W, L)]
            )
            r = want(table, o, ACCELERATION, i, W) - w[at(ACC_B, i, j, W, L)]
            q = want(table, o, ELBOW_ACCELERATION, i, W) - w[at(ACC_E, i, j, W, L)]
            ad, inv = w[at(MAD, i, j, W, L)], w[at(MINV, i, j, W, L)]
            l1sq, l2sq = w[at(MODEL + L1SQ, i, j, W, L)], w[at(MODEL + L2SQ, i, j, W, L)]
            if force:
                gx, gy = gx - bx * s - ex * t, gy - by * s - ey * t
                # The part of the desired rates that is not tangent, turned by Fdot^T.
                base, back = inv * (bx * vx + by * vy), inv * (lx * vx + ly * vy)
                rest = want(table, o, RATE, i, W) - (bx * ux + by * uy)
                bend = want(table, o, ELBOW_RATE, i, W) - (ex * ux + ey * uy)
                p, b = base * ad * (rest - bend) - base * l1sq * bend, back * l2sq * (rest - bend) - back * ad * bend
                tx, ty = tx + bx * p + lx * b, ty + by * p + ly * b
            else:
                r, q = r - s, q - t
            if line2:
                tip, link = w[at(MODEL + TIP, i, j, W, L)], r + q
                p = (w[at(MODEL + S1, i, j, W, L)] + tip * l1sq) * r + tip * ad * link
                b = (w[at(MODEL + S2, i, j, W, L)] + tip * l2sq) * link + tip * ad * r
                gx, gy = gx + bx * p - lx * b, gy + by * p - ly * b
            else:
                wx, wy = wx + bx * r + ex * q, wy + by * r + ey * q
        w[of(ACC_X, j, W, L)], w[of(ACC_Y, j, W, L)] = solve2(
            w[of(G11, j, W, L)], w[of(G12, j, W, L)], w[of(G22, j, W, L)], wx + tx, wy + ty
        )
        w[of(PUSH_X, j, W, L)], w[of(PUSH_Y, j, W, L)] = gx, gy


@outlined
def distribute(lanes, drives, arms, w):
    """c = A (A^T A)^-1 (M w + h + g), weighted where W is not the identity."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        mass = w[of(ENVIRONMENT + MASS, j, W, L)]
        m11, m12, m22 = mass, 0.0, mass
        n11 = n12 = n22 = 0.0
        fx, fy = w[of(PUSH_X, j, W, L)], w[of(PUSH_Y, j, W, L)]
        for i in range(N):
            m11, m12, m22 = m11 + w[at(P11, i, j, W, L)], m12 + w[at(P12, i, j, W, L)], m22 + w[at(P22, i, j, W, L)]
            fx, fy = fx + w[at(GX, i, j, W, L)], fy + w[at(GY, i, j, W, L)]
            a1, a2, ease = w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)], w[at(EASE, i, j, W, L)]
            n11, n12, n22 = n11 + ease * a1 * a1, n12 + ease * a1 * a2, n22 + ease * a2 * a2
        wx, wy = w[of(ACC_X, j, W, L)], w[of(ACC_Y, j, W, L)]
        gx, gy = solve2(n11, n12, n22, fx + m11 * wx + m12 * wy, fy + m12 * wx + m22 * wy)
        for i in range(N):
            w[at(C, i, j, W, L)] = w[at(EASE, i, j, W, L)] * (w[at(A1, i, j, W, L)] * gx + w[at(A2, i, j, W, L)] * gy)


@outlined
def computed_torque(lanes, drives, arms, extra, law, table, o, w):
    """Drive torques C of the laws with a model, at the pose PX, PY, PVX, PVY."""
    look(lanes, drives, arms, table, o, w)
    if law.switched:
        best_pair(lanes, drives, arms, w)
    redundant = law.form >= REDUNDANT_APD
    if redundant:
        gram(lanes, drives, arms, w)
    reference(lanes, drives, arms, law, table, o, w)
    shares(lanes, drives, arms, extra, w)
    if redundant:
        redundant_feedback(lanes, drives, arms, law, table, o, w)
    else:
        minimal_feedback(lanes, drives, arms, law, table, o, w)
    distribute(lanes, drives, arms, w)
