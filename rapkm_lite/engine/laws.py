"""The laws with a model (19)-(20), (28), (32): all of them command an end-effector acceleration.

With the mass matrix M and the other terms h of the model's equations of motion in end-effector coordinates,
c = A (A^T A)^-1 (M w + h(v, u) + g): a law only says which acceleration w it wants, which reference rate u takes the
place of one of the two rates in h, and which force g it adds.  v is the velocity of the pose.
"""

from __future__ import annotations

import math

from .jit import leaf, outlined
from .leaves import accelerations, drag, geometry, inertia, small_angle, solve2
from .minimal import best_pair, minimal_feedback, reference
from .rows import *
from .single import fetch
from .tables import *


@leaf
def arm_shares(w, p, P, extra, env, rates, links):
    """Write the shares of an arm, entry p of pair rows of P numbers, in M and h, and the accelerations of its joints
    at zero xdd.

    rates : v and the reference rate u.  links : b, l, a.d, 1 / (a x d) and a x d of the arm.
    """
    (vx, vy, ux, uy), (bx, by, lx, ly, ad, inv, den) = rates, links
    base = bx * vx + by * vy
    base_acc, back_acc = accelerations(
        base,
        lx * vx + ly * vy,
        bx * ux + by * uy,
        lx * ux + ly * uy,
        ad,
        inv,
        w[(MODEL + L1SQ) * P + p],
        w[(MODEL + L2SQ) * P + p],
    )
    m11, m12, m22, fx, fy = inertia(
        w[(MODEL + S1) * P + p], w[(MODEL + S2) * P + p], bx, by, lx, ly, base_acc, back_acc
    )
    if len(extra) > 0:
        place = lx * den, ly * den, bx * den, by * den, ad, inv, 0.0
        gx, gy = drag(w[(MODEL + W1) * P + p], w[(MODEL + W2) * P + p], w[(MODEL + FRICTION) * P + p], env, place, base)
        fx, fy = fx + gx, fy + gy
    w[P11 * P + p], w[P12 * P + p], w[P22 * P + p] = m11, m12, m22
    w[GX * P + p], w[GY * P + p] = -fx, -fy
    w[ACC_B * P + p], w[ACC_E * P + p] = base_acc, -base_acc - back_acc


@leaf
def pose_of(w, j, W, L):
    """Pose of a run, its velocity, and the environment of the model."""
    return (
        w[of(PX, j, W, L)],
        w[of(PY, j, W, L)],
        w[of(PVX, j, W, L)],
        w[of(PVY, j, W, L)],
        (
            w[of(ENVIRONMENT + GRAVITY_X, j, W, L)],
            w[of(ENVIRONMENT + GRAVITY_Y, j, W, L)],
            w[of(ENVIRONMENT + SHARPNESS, j, W, L)],
        ),
    )


@outlined
def look(lanes, drives, arms, extra, table, o, w):
    """The model at the pose: rows b and l of its rates, a.d, a x d and its inverse, and the errors of the elbows; the
    shares of the arms at the rate of the pose."""
    L, N, W = len(lanes), len(drives), len(arms)
    # What the arms of a single run share is read once: read among what is written it would keep the loop from vectors.
    alone = pose_of(w, 0, W, L)
    for i in range(N):
        cos, sin = desired(table, o, w, ELBOW_COS, i, W, L), desired(table, o, w, ELBOW_SIN, i, W, L)
        rate = desired(table, o, w, ELBOW_RATE, i, W, L)
        for j in range(L):
            x, y, vx, vy, env = alone if L == 1 else pose_of(w, j, W, L)
            ax, ay, dx, dy, ad, inv, _ = geometry(
                w[at(MODEL + BX, i, j, W, L)],
                w[at(MODEL + BY, i, j, W, L)],
                w[at(MODEL + L1SQ, i, j, W, L)],
                w[at(MODEL + HALF, i, j, W, L)],
                w[at(MODEL + MEAN, i, j, W, L)],
                w[at(MODEL + MODE, i, j, W, L)],
                x,
                y,
            )
            bx, by, lx, ly = dx * inv, dy * inv, ax * inv, ay * inv
            w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)], w[at(L1, i, j, W, L)], w[at(L2, i, j, W, L)] = bx, by, lx, ly
            den = ax * dy - ay * dx
            w[at(MAD, i, j, W, L)], w[at(MDEN, i, j, W, L)], w[at(MINV, i, j, W, L)] = ad, den, inv
            # a x d and a.d are the sine and cosine of the elbow angle times both lengths.
            s, t = cos * den - sin * ad, cos * ad + sin * den
            s *= w[at(MODEL + ELBOW_SCALE, i, j, W, L)]
            w[at(ELBOW_E, i, j, W, L)] = small_angle(s)
            w[at(NEAR, i, j, W, L)] = min(0.1 - abs(s), t)
            w[at(ELBOW_ED, i, j, W, L)] = -(bx + lx) * vx - (by + ly) * vy - rate
            arm_shares(w, i * L + j, W * L, extra, env, (vx, vy, vx, vy), (bx, by, lx, ly, ad, inv, den))
    near = 0.0
    for p in range(N * L):
        near = min(near, w[NEAR * W * L + p])
    if near < 0.0:
        for i in range(N):
            cos, sin = want(table, o, ELBOW_COS, i, W), want(table, o, ELBOW_SIN, i, W)
            for j in range(L):
                ad, den = w[at(MAD, i, j, W, L)], w[at(MDEN, i, j, W, L)]
                s, t = cos * den - sin * ad, cos * ad + sin * den
                # Only those that are far: no run feels its neighbours.
                if not (abs(s * w[at(MODEL + ELBOW_SCALE, i, j, W, L)]) <= 0.1 and t >= 0.0):
                    w[at(ELBOW_E, i, j, W, L)] = math.atan2(s, t)


@outlined
def shares(lanes, drives, arms, extra, w):
    """The shares of the arms at a reference rate of its own, as in APD laws."""
    L, N, W = len(lanes), len(drives), len(arms)
    for i in range(N):
        for j in range(L):
            _, _, vx, vy, env = pose_of(w, j, W, L)
            rates = vx, vy, w[of(REF_X, j, W, L)], w[of(REF_Y, j, W, L)]
            links = (
                w[at(A1, i, j, W, L)],
                w[at(A2, i, j, W, L)],
                w[at(L1, i, j, W, L)],
                w[at(L2, i, j, W, L)],
                w[at(MAD, i, j, W, L)],
                w[at(MINV, i, j, W, L)],
                w[at(MDEN, i, j, W, L)],
            )
            arm_shares(w, i * L + j, W * L, extra, env, rates, links)


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
    force = law.form == REDUNDANT_APD or law.form == REDUNDANT_APD_LINE2
    line2 = law.form == REDUNDANT_CTC_LINE2 or law.form == REDUNDANT_APD_LINE2
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
            r = desired(table, o, w, ACCELERATION, i, W, L) - w[at(ACC_B, i, j, W, L)]
            q = desired(table, o, w, ELBOW_ACCELERATION, i, W, L) - w[at(ACC_E, i, j, W, L)]
            ad, inv = w[at(MAD, i, j, W, L)], w[at(MINV, i, j, W, L)]
            l1sq, l2sq = w[at(MODEL + L1SQ, i, j, W, L)], w[at(MODEL + L2SQ, i, j, W, L)]
            if force:
                gx, gy = gx - bx * s - ex * t, gy - by * s - ey * t
                # The part of the desired rates that is not tangent, turned by Fdot^T; in line 2 it meets C.
                base, back = inv * (bx * vx + by * vy), inv * (lx * vx + ly * vy)
                rest = want(table, o, RATE, i, W) - (bx * ux + by * uy)
                bend = want(table, o, ELBOW_RATE, i, W) - (ex * ux + ey * uy)
                if line2:
                    couple = w[at(MODEL + TIP, i, j, W, L)] * w[at(MDEN, i, j, W, L)]
                    p, b = couple * (lx * vx + ly * vy) * (rest + bend), couple * (bx * vx + by * vy) * rest
                    gx, gy = gx + bx * p - lx * b, gy + by * p - ly * b
                else:
                    p = base * ad * (rest - bend) - base * l1sq * bend
                    b = back * l2sq * (rest - bend) - back * ad * bend
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
    if len(lanes) == 1:
        for block in (ACCELERATION, ELBOW_RATE, ELBOW_ACCELERATION, ELBOW_COS, ELBOW_SIN):
            fetch(block, len(arms), table, o, w)
    look(lanes, drives, arms, extra, table, o, w)
    if law.switched:
        best_pair(lanes, drives, arms, w)
    redundant = law.form >= REDUNDANT_APD
    if redundant:
        gram(lanes, drives, arms, w)
    reference(lanes, drives, arms, law, table, o, w)
    if law.form in (APD, REDUNDANT_APD, REDUNDANT_APD_LINE2):
        shares(lanes, drives, arms, extra, w)
    if redundant:
        redundant_feedback(lanes, drives, arms, law, table, o, w)
    else:
        minimal_feedback(lanes, drives, arms, law, table, o, w)
    distribute(lanes, drives, arms, w)
