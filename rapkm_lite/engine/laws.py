"""The laws with a model (19)-(20), (28), (32): all of them command an end-effector acceleration.

With the mass matrix M and the other terms h of the model's equations of motion in end-effector coordinates,
c = A (A^T A)^-1 (M w + h(v, u) + g): a law only says which acceleration w it wants, which reference rate u takes the
place of one of the two rates in h, and which force g it adds.  v is the velocity of the pose.
"""

from __future__ import annotations

import math

from .jit import leaf, outlined
from .leaves import accelerations, inertia, small_angle, solve2, solve_regular, tanh, weight
from .minimal import best_pair, joint_feedback, reference, task_feedback
from .pose import kept
from .rows import *
from .single import fetch
from .tables import *


@leaf
def arm_shares(w, p, P, extra, env, rates, links):
    """Write the shares of an arm, entry p of pair rows of P numbers, in M and h, and the accelerations of its joints
    at zero xdd.

    rates : v and the reference rate u.  links : as `geometry` gives them.
    """
    (vx, vy, ux, uy), (bx, by, lx, ly, ad, inv, _) = rates, links
    base, back, base_ref, back_ref = bx * vx + by * vy, lx * vx + ly * vy, bx * ux + by * uy, lx * ux + ly * uy
    l1sq, l2sq = w[(MODEL + L1SQ) * P + p], w[(MODEL + L2SQ) * P + p]
    base_acc, back_acc = accelerations(base, back, base_ref, back_ref, ad, inv, l1sq, l2sq)
    m11, m12, m22, fx, fy = inertia(
        w[(MODEL + S1) * P + p], w[(MODEL + S2) * P + p], w[(MODEL + TIP) * P + p], bx, by, lx, ly, base_acc, back_acc
    )
    if len(extra) > 0:
        gx, gy = weight(w[(MODEL + W1) * P + p], w[(MODEL + W2) * P + p], env[0], env[1], links)
        braking = w[(MODEL + FRICTION) * P + p] * tanh(base * env[2])
        fx, fy = fx + gx - bx * braking, fy + gy - by * braking
    w[P11 * P + p], w[P12 * P + p], w[P22 * P + p] = m11, m12, m22
    w[GX * P + p], w[GY * P + p] = -fx, -fy
    w[ACC_B * P + p], w[ACC_E * P + p] = base_acc, -base_acc - back_acc


@leaf
def at_pose(w, j, W, L):
    """Velocity of the pose of a run, its reference rate, and the environment of the model."""
    gx, gy = w[of(ENVIRONMENT + GRAVITY_X, j, W, L)], w[of(ENVIRONMENT + GRAVITY_Y, j, W, L)]
    rates = w[of(PVX, j, W, L)], w[of(PVY, j, W, L)], w[of(REF_X, j, W, L)], w[of(REF_Y, j, W, L)]
    return rates, (gx, gy, w[of(ENVIRONMENT + SHARPNESS, j, W, L)])


@outlined
def look(lanes, drives, arms, extra, table, o, w):
    """The model at the pose: the errors of the elbows, and the shares of the arms at the rate of the pose."""
    L, N, W = len(lanes), len(drives), len(arms)
    # What the arms of a single run share is read once: read among what is written it would keep the loop from vectors.
    alone = at_pose(w, 0, W, L)
    for i in range(N):
        cos, sin = desired(table, o, w, ELBOW_COS, i, W, L), desired(table, o, w, ELBOW_SIN, i, W, L)
        rate = desired(table, o, w, ELBOW_RATE, i, W, L)
        for j in range(L):
            (vx, vy, _, _), env = alone if L == 1 else at_pose(w, j, W, L)
            links = kept(w, i * L + j, W * L)
            bx, by, lx, ly, ad, _, den = links
            # a x d and a.d are the sine and cosine of the elbow angle times both lengths.
            s, t = cos * den - sin * ad, cos * ad + sin * den
            s *= w[at(MODEL + ELBOW_SCALE, i, j, W, L)]
            w[at(ELBOW_E, i, j, W, L)] = small_angle(s)
            w[at(NEAR, i, j, W, L)] = min(0.1 - abs(s), t)
            w[at(ELBOW_ED, i, j, W, L)] = -(bx + lx) * vx - (by + ly) * vy - rate
            arm_shares(w, i * L + j, W * L, extra, env, (vx, vy, vx, vy), links)
    far = 0
    for p in range(N * L):
        far += 1 if w[NEAR * W * L + p] < 0.0 else 0
    if far > 0:
        for i in range(N):
            cos, sin = want(table, o, ELBOW_COS, i, W), want(table, o, ELBOW_SIN, i, W)
            for j in range(L):
                ad, den = w[at(MAD, i, j, W, L)], w[at(MDEN, i, j, W, L)]
                s, t = cos * den - sin * ad, cos * ad + sin * den
                # Only those that are far: no run feels its neighbours.
                if w[at(NEAR, i, j, W, L)] < 0.0:
                    w[at(ELBOW_E, i, j, W, L)] = math.atan2(s, t)


@outlined
def shares(lanes, drives, arms, extra, w):
    """The shares of the arms at the reference rate of the law."""
    L, N, W = len(lanes), len(drives), len(arms)
    alone = at_pose(w, 0, W, L)
    for i in range(N):
        for j in range(L):
            rates, env = alone if L == 1 else at_pose(w, j, W, L)
            arm_shares(w, i * L + j, W * L, extra, env, rates, kept(w, i * L + j, W * L))


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
def ask(lanes, drives, arms, law, table, o, w):
    """What (28) and (32) ask of the joints: their desired accelerations less those at zero xdd, and the feedback, in
    APD laws as a force."""
    L, N, W = len(lanes), len(drives), len(arms)
    # As a number: a choice among what is written would keep the arms of a single run from vectors.
    force = 1.0 if law.form == REDUNDANT_APD or law.form == REDUNDANT_APD_LINE2 else 0.0
    for i in range(N):
        base, elbow = desired(table, o, w, ACCELERATION, i, W, L), desired(table, o, w, ELBOW_ACCELERATION, i, W, L)
        for j in range(L):
            bx, by, lx, ly, _, _, _ = kept(w, i * L + j, W * L)
            s = w[at(GAIN_P, i, j, W, L)] * w[at(E, i, j, W, L)] + w[at(GAIN_D, i, j, W, L)] * w[at(ED, i, j, W, L)]
            t = (
                w[at(ELBOW_P, i, j, W, L)] * w[at(ELBOW_E, i, j, W, L)]
                + w[at(ELBOW_D, i, j, W, L)] * w[at(ELBOW_ED, i, j, W, L)]
            )
            r, q = base - w[at(ACC_B, i, j, W, L)], elbow - w[at(ACC_E, i, j, W, L)]
            w[at(ASK_B, i, j, W, L)], w[at(ASK_E, i, j, W, L)] = r - (1.0 - force) * s, q - (1.0 - force) * t
            w[at(GX, i, j, W, L)] += force * ((bx + lx) * t - bx * s)
            w[at(GY, i, j, W, L)] += force * ((by + ly) * t - by * s)


@outlined
def tangent(lanes, drives, arms, w):
    """The end-effector acceleration F^+ of what the joints ask."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        fx, fy = w[of(PUSH_X, j, W, L)], w[of(PUSH_Y, j, W, L)]
        for i in range(N):
            r, q = w[at(ASK_B, i, j, W, L)], w[at(ASK_E, i, j, W, L)]
            a1, a2 = w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)]
            fx += a1 * r - (a1 + w[at(L1, i, j, W, L)]) * q
            fy += a2 * r - (a2 + w[at(L2, i, j, W, L)]) * q
        w[of(ACC_X, j, W, L)], w[of(ACC_Y, j, W, L)] = solve2(
            w[of(G11, j, W, L)], w[of(G12, j, W, L)], w[of(G22, j, W, L)], fx, fy
        )
        w[of(PUSH_X, j, W, L)], w[of(PUSH_Y, j, W, L)] = 0.0, 0.0


@outlined
def unprojected(lanes, drives, arms, w):
    """Line 2 of (28) and (32): F^T G of what the joints ask is a force."""
    L, N, W = len(lanes), len(drives), len(arms)
    for i in range(N):
        for j in range(L):
            bx, by, lx, ly, ad, _, _ = kept(w, i * L + j, W * L)
            r, tip = w[at(ASK_B, i, j, W, L)], w[at(MODEL + TIP, i, j, W, L)]
            link = r + w[at(ASK_E, i, j, W, L)]
            p = (w[at(MODEL + S1, i, j, W, L)] + tip * w[at(MODEL + L1SQ, i, j, W, L)]) * r + tip * ad * link
            b = (w[at(MODEL + S2, i, j, W, L)] + tip * w[at(MODEL + L2SQ, i, j, W, L)]) * link + tip * ad * r
            w[at(GX, i, j, W, L)] += bx * p - lx * b
            w[at(GY, i, j, W, L)] += by * p - ly * b
            w[at(ASK_B, i, j, W, L)], w[at(ASK_E, i, j, W, L)] = 0.0, 0.0


@outlined
def bend(lanes, drives, arms, law, table, o, w):
    """In APD laws the part of the desired rates that is not tangent, turned by Fdot^T; in line 2 it meets C."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        tx = ty = 0.0
        vx, vy, ux, uy = w[of(PVX, j, W, L)], w[of(PVY, j, W, L)], w[of(REF_X, j, W, L)], w[of(REF_Y, j, W, L)]
        for i in range(N):
            bx, by, lx, ly, ad, inv, den = kept(w, i * L + j, W * L)
            base, back = bx * vx + by * vy, lx * vx + ly * vy
            rest = want(table, o, RATE, i, W) - (bx * ux + by * uy)
            both = rest + want(table, o, ELBOW_RATE, i, W) + ((bx + lx) * ux + (by + ly) * uy)
            if law.form == REDUNDANT_APD_LINE2:
                couple = w[at(MODEL + TIP, i, j, W, L)] * den
                p, b = couple * back * both, couple * base * rest
                w[at(GX, i, j, W, L)] += bx * p - lx * b
                w[at(GY, i, j, W, L)] += by * p - ly * b
            else:
                elbow, l1sq, l2sq = both - rest, w[at(MODEL + L1SQ, i, j, W, L)], w[at(MODEL + L2SQ, i, j, W, L)]
                p = inv * base * (ad * (rest - elbow) - l1sq * elbow)
                b = inv * back * (l2sq * (rest - elbow) - ad * elbow)
                tx, ty = tx + bx * p + lx * b, ty + by * p + ly * b
        w[of(PUSH_X, j, W, L)], w[of(PUSH_Y, j, W, L)] = tx, ty


@leaf
def redundant_feedback(lanes, drives, arms, law, table, o, w):
    """w and g of (28) and (32) in all joints: w = F^+ (v - Fdot u), or F^T G (v - Fdot u) as a force in line 2."""
    ask(lanes, drives, arms, law, table, o, w)
    if law.form == REDUNDANT_CTC_LINE2 or law.form == REDUNDANT_APD_LINE2:
        unprojected(lanes, drives, arms, w)
    if law.form == REDUNDANT_APD or law.form == REDUNDANT_APD_LINE2:
        bend(lanes, drives, arms, law, table, o, w)
    tangent(lanes, drives, arms, w)


@outlined
def distribute(lanes, drives, arms, w):
    """c = A (A^T A)^-1 (M w + h + g), weighted where W is not the identity."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        m11 = m12 = m22 = n11 = n12 = n22 = 0.0
        fx, fy = w[of(PUSH_X, j, W, L)], w[of(PUSH_Y, j, W, L)]
        for i in range(N):
            m11, m12, m22 = m11 + w[at(P11, i, j, W, L)], m12 + w[at(P12, i, j, W, L)], m22 + w[at(P22, i, j, W, L)]
            fx, fy = fx + w[at(GX, i, j, W, L)], fy + w[at(GY, i, j, W, L)]
            a1, a2, ease = w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)], w[at(EASE, i, j, W, L)]
            n11, n12, n22 = n11 + ease * a1 * a1, n12 + ease * a1 * a2, n22 + ease * a2 * a2
        wx, wy = w[of(ACC_X, j, W, L)], w[of(ACC_Y, j, W, L)]
        gx, gy = solve_regular(n11, n12, n22, fx + m11 * wx + m12 * wy, fy + m12 * wx + m22 * wy)
        for i in range(N):
            w[at(C, i, j, W, L)] = w[at(EASE, i, j, W, L)] * (w[at(A1, i, j, W, L)] * gx + w[at(A2, i, j, W, L)] * gy)


@leaf
def joint_coordinates(lanes, drives, arms, extra, law, table, o, w):
    """Shares of the arms, w and g of the laws in two or all joints."""
    if len(lanes) == 1:
        for block in (ACCELERATION, ELBOW_RATE, ELBOW_ACCELERATION, ELBOW_COS, ELBOW_SIN):
            fetch(block, len(arms), table, o, w)
    look(lanes, drives, arms, extra, table, o, w)
    if law.switched:
        best_pair(lanes, drives, arms, w)
    redundant = law.form >= REDUNDANT_APD
    if redundant:
        gram(lanes, drives, arms, w)
    if law.form in (APD, REDUNDANT_APD, REDUNDANT_APD_LINE2):
        reference(lanes, drives, arms, law, table, o, w)
        shares(lanes, drives, arms, extra, w)
    if redundant:
        redundant_feedback(lanes, drives, arms, law, table, o, w)
    else:
        joint_feedback(lanes, drives, arms, law, table, o, w)


@outlined
def computed_torque(lanes, drives, arms, extra, law, table, o, w):
    """Drive torques C of the laws with a model, at the pose PX, PY, PVX, PVY."""
    if law.task:
        task_feedback(lanes, arms, law, table, o, w)
        shares(lanes, drives, arms, extra, w)
    else:
        joint_coordinates(lanes, drives, arms, extra, law, table, o, w)
    distribute(lanes, drives, arms, w)
