"""Where the controller thinks the machine is: its pose and control matrix A, true or by least squares."""

from __future__ import annotations

import math

from .arms import placed
from .jit import kernel, leaf, outlined
from .leaves import curvature, moved, pose_terms, solve2, solve_regular, turned
from .rows import *
from .tables import *


@leaf
def keep(w, p, P, links):
    """Write the links of an arm, above all its row b of A, entry p of pair rows of P numbers."""
    bx, by, lx, ly, ad, inv, den = links
    w[A1 * P + p], w[A2 * P + p], w[L1 * P + p], w[L2 * P + p] = bx, by, lx, ly
    w[MAD * P + p], w[MINV * P + p], w[MDEN * P + p] = ad, inv, den


@leaf
def kept(w, p, P):
    """The links that `keep` wrote."""
    bx, by, lx, ly = w[A1 * P + p], w[A2 * P + p], w[L1 * P + p], w[L2 * P + p]
    return bx, by, lx, ly, w[MAD * P + p], w[MINV * P + p], w[MDEN * P + p]


@outlined
def true_pose(lanes, drives, arms, modelled, law, w):
    """The true end-effector position and velocity, and A there."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        w[of(PX, j, W, L)], w[of(PY, j, W, L)] = w[of(X, j, W, L)], w[of(Y, j, W, L)]
        w[of(PVX, j, W, L)], w[of(PVY, j, W, L)] = w[of(VX, j, W, L)], w[of(VY, j, W, L)]
    if modelled is None and law.same:
        for i in range(W):
            for j in range(L):
                w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)] = w[at(B1, i, j, W, L)], w[at(B2, i, j, W, L)]
    else:
        for i in range(N):
            for j in range(L):
                links, _ = placed(MODEL, w, i, j, W, L, w[of(PX, j, W, L)], w[of(PY, j, W, L)])
                keep(w, i * L + j, W * L, links)


@leaf
def small(trace, det, l1sq, sx, sy):
    """Is a Newton step so small that what it leaves of the error, and what `moved` leaves out, is rounding?

    Both go with the square of the step, and grow towards stretched arms and singular poses.  trace, det : of the
    Hessian.  At this bound they are about ten times the rounding of `geometry`.
    """
    square = trace * trace
    return max(sx * sx, sy * sy) * (square * square) * l1sq < 2e-13 * det


@outlined
def newton_step(lanes, drives, arms, table, o, w):
    """One Newton step SX, SY for the least-squares pose of all runs; returns how many need another one.

    Those take it.  A run that is done stays where it is, and finds the same step again, whatever its neighbours need.
    """
    L, N, W = len(lanes), len(drives), len(arms)
    for i in range(N):
        ux, uy = want(table, o, COS, i, W), want(table, o, SIN, i, W)
        for j in range(L):
            place = placed(MODEL, w, i, j, W, L, w[of(PX, j, W, L)], w[of(PY, j, W, L)])
            p11, p12, p22, gx, gy, near = pose_terms(
                w[at(MODEL + L2SQ, i, j, W, L)], w[at(MODEL + SCALE, i, j, W, L)], place, ux, uy, w[at(E, i, j, W, L)]
            )
            w[at(P11, i, j, W, L)], w[at(P12, i, j, W, L)], w[at(P22, i, j, W, L)] = p11, p12, p22
            w[at(GX, i, j, W, L)], w[at(GY, i, j, W, L)], w[at(NEAR, i, j, W, L)] = gx, gy, near
            keep(w, i * L + j, W * L, place[0])
    count = 0
    for j in range(L):
        m11 = m12 = m22 = fx = fy = -0.0
        near = 1.0
        for i in range(N):
            m11, m12, m22 = m11 + w[at(P11, i, j, W, L)], m12 + w[at(P12, i, j, W, L)], m22 + w[at(P22, i, j, W, L)]
            fx, fy = fx + w[at(GX, i, j, W, L)], fy + w[at(GY, i, j, W, L)]
            near = min(near, w[at(NEAR, i, j, W, L)])
        sx, sy = solve2(m11, m12, m22, fx, fy)
        det, todo = m11 * m22 - m12 * m12, w[of(TODO, j, W, L)]
        least = min(m11, det)
        w[of(FAR, j, W, L)] += 0.0 if near >= 0.0 and least > 0.0 else todo
        enough = small(m11 + m22, det, w[at(MODEL + L1SQ, 0, j, W, L)], sx, sy)
        more = todo if near >= 0.0 and least > 0.0 and not enough else 0.0
        w[of(SX, j, W, L)], w[of(SY, j, W, L)], w[of(TODO, j, W, L)] = sx, sy, more
        w[of(PX, j, W, L)] += sx if more > 0.0 else 0.0
        w[of(PY, j, W, L)] += sy if more > 0.0 else 0.0
        count += 1 if more > 0.0 else 0
    return count


@outlined
def follow(lanes, drives, arms, w):
    """The small step SX, SY of all runs, and the links after it."""
    L, N, W = len(lanes), len(drives), len(arms)
    for i in range(N):
        for j in range(L):
            p, P = i * L + j, W * L
            keep(w, p, P, moved(kept(w, p, P), w[of(SX, j, W, L)], w[of(SY, j, W, L)]))
    for j in range(L):
        w[of(PX, j, W, L)] += w[of(SX, j, W, L)]
        w[of(PY, j, W, L)] += w[of(SY, j, W, L)]


@leaf
def single_step(arms, w, x, y):
    """`newton_step` of one run, its arms side by side: the shares of the arms at (x, y)."""
    W = len(arms)
    m = MODEL * W
    for i in range(W):
        place = placed(MODEL, w, i, 0, W, 1, x, y)
        ux, uy = w[(MOTION + COS) * W + i], w[(MOTION + SIN) * W + i]
        p11, p12, p22, gx, gy, near = pose_terms(w[m + L2SQ * W + i], w[m + SCALE * W + i], place, ux, uy, w[E * W + i])
        w[P11 * W + i], w[P12 * W + i], w[P22 * W + i], w[GX * W + i], w[GY * W + i] = p11, p12, p22, gx, gy
        w[NEAR * W + i] = near
        keep(w, i, W, place[0])


@outlined
def single_newton(drives, arms, w):
    """The pose of one run by Newton steps; TODO says whether it needs more of them, FAR whether they lead nowhere."""
    N, W = len(drives), len(arms)
    x, y = w[of(PX, 0, W, 1)], w[of(PY, 0, W, 1)]
    w[of(TODO, 0, W, 1)] = 1.0
    for _ in range(12):
        single_step(arms, w, x, y)
        m11, m12, m22 = total(P11, w, W), total(P12, w, W), total(P22, w, W)
        fx, fy, near = total(GX, w, W), total(GY, w, W), w[NEAR * W]
        for i in range(1, N):
            near = min(near, w[NEAR * W + i])
        det = m11 * m22 - m12 * m12
        if not (near >= 0.0 and min(m11, det) > 0.0):
            w[of(FAR, 0, W, 1)] = 1.0
            break
        sx, sy = solve2(m11, m12, m22, fx, fy)
        x, y = x + sx, y + sy
        if small(m11 + m22, det, w[(MODEL + L1SQ) * W], sx, sy):
            for i in range(W):
                keep(w, i, W, moved(kept(w, i, W), sx, sy))
            w[of(TODO, 0, W, 1)] = 0.0
            break
    w[of(PX, 0, W, 1)], w[of(PY, 0, W, 1)] = x, y


@kernel
def nearest(drives, arms, w, q_a, x, y):
    """Least-squares pose of measured base angles (N,) from a guess, for a controller in Python; and was it found?"""
    W = len(arms)
    for i in range(W):
        angle = q_a[min(i, len(drives) - 1)]
        w[(MOTION + COS) * W + i], w[(MOTION + SIN) * W + i] = math.cos(angle), math.sin(angle)
        w[E * W + i] = 0.0
    w[of(PX, 0, W, 1)], w[of(PY, 0, W, 1)], w[of(FAR, 0, W, 1)] = x, y, 0.0
    single_newton(drives, arms, w)
    return w[of(PX, 0, W, 1)], w[of(PY, 0, W, 1)], w[of(FAR, 0, W, 1)] + w[of(TODO, 0, W, 1)] == 0.0


@outlined
def rough_newton(drives, arms, table, o, w, j, L, x, y, guess_x, guess_y):
    """Least-squares pose of one run as `estimate_pose` finds it, from the guess, or from the last pose (x, y) where
    that fits better, as after an encoder's jump; and whether it converged."""
    N, W = len(drives), len(arms)
    longest = 0.0
    for i in range(N):
        longest = max(longest, 1.0 / w[at(MODEL + SCALE, i, j, W, L)])
    most, tolerance = 0.1 * longest, 1e-13 * longest + 2e-15 * (abs(x) + abs(y))
    x0, y0, px, py, least = x, y, 0.0, 0.0, 1e299
    for n in range(102):
        m11 = m12 = m22 = h11 = h12 = h22 = fx = fy = square = -0.0
        for i in range(N):
            links, area2 = placed(MODEL, w, i, j, W, L, x, y)
            ux, uy = want(table, o, COS, i, W), want(table, o, SIN, i, W)
            s, t = turned(links, ux, uy)
            r, bx, by = w[at(E, i, j, W, L)] - math.atan2(s, t), links[0], links[1]
            r -= 2.0 * math.pi * math.floor(r / (2.0 * math.pi) + 0.5)
            p11, p12, p22 = curvature(w[at(MODEL + L2SQ, i, j, W, L)], links, r)
            keep(w, i * L + j, W * L, links)
            square += r * r if area2 > 0.0 else 1e300
            m11, m12, m22, fx, fy = m11 + bx * bx, m12 + bx * by, m22 + by * by, fx + bx * r, fy + by * r
            h11, h12, h22 = h11 + p11, h12 + p12, h22 + p22
        if n == 0:
            least, x, y = min(square, least), guess_x, guess_y
            continue
        # A step is halved where it leaves the workspace or the residuals grow.
        if not square <= least + 1e-14:
            px, py = 0.5 * px, 0.5 * py
            x, y = x0 + px, y0 + py
            continue
        if h11 > 0.0 and h11 * h22 - h12 * h12 > 1e-3 * (m11 * m22 - m12 * m12):
            m11, m12, m22 = h11, h12, h22
        sx, sy = solve2(m11, m12, m22, fx, fy)
        # Near an input singularity the rounding of angles that fit moves x further.
        if max(abs(sx), abs(sy)) < tolerance * (1e3 if square < 1.6e-29 else 1.0):
            return x, y, True
        part = min(1.0, most / max(abs(sx), abs(sy)))
        x0, y0, px, py, least = x, y, part * sx, part * sy, square
        x, y = x0 + px, y0 + py
    return x, y, False


@outlined
def measured_pose(lanes, drives, arms, history, study, table, o, w, k, smooth):
    """Least-squares pose of the measured base angles, and A there (`estimate_pose`)."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        x, y = w[of(PX, j, W, L)], w[of(PY, j, W, L)]
        x1, y1 = w[of(PX1, j, W, L)], w[of(PY1, j, W, L)]
        # The pose moves on smoothly, unless angles are stepped: a parabola through the last three.
        px = 3.0 * (x - x1) + w[of(PX2, j, W, L)] if smooth else x
        py = 3.0 * (y - y1) + w[of(PY2, j, W, L)] if smooth else y
        w[of(PX, j, W, L)], w[of(PY, j, W, L)], w[of(GUESS_X, j, W, L)], w[of(GUESS_Y, j, W, L)] = px, py, px, py
        w[of(PX2, j, W, L)], w[of(PY2, j, W, L)], w[of(PX1, j, W, L)], w[of(PY1, j, W, L)] = x1, y1, x, y
        w[of(TODO, j, W, L)], w[of(FAR, j, W, L)] = 1.0, 0.0
    if history is not None:
        single_newton(drives, arms, w)
    if study is not None:
        count = L
        for _ in range(12):
            if count > 0:
                count = newton_step(lanes, drives, arms, table, o, w)
        follow(lanes, drives, arms, w)
    rough = 0
    for j in range(L):
        rough += 1 if w[of(FAR, j, W, L)] + w[of(TODO, j, W, L)] > 0.0 else 0
    if rough > 0:
        for j in range(L):
            if w[of(FAR, j, W, L)] + w[of(TODO, j, W, L)] > 0.0 and w[of(STATUS, j, W, L)] == DONE:
                x, y = w[of(PX1, j, W, L)], w[of(PY1, j, W, L)]
                px, py = w[of(GUESS_X, j, W, L)], w[of(GUESS_Y, j, W, L)]
                px, py, found = rough_newton(drives, arms, table, o, w, j, L, x, y, px, py)
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
        w[of(PVX, j, W, L)], w[of(PVY, j, W, L)] = solve_regular(m11, m12, m22, fx, fy)


@leaf
def find_pose(lanes, drives, arms, posed, modelled, history, study, law, table, o, w, k):
    """Pose, its velocity, and A there, from the source that the law asks for."""
    if posed is not None:
        if law.pose == TRUE:
            true_pose(lanes, drives, arms, modelled, law, w)
        else:
            measured_pose(lanes, drives, arms, history, study, table, o, w, k, law.pose == MEASURED)
            # Filters around PD and PID do not ask for it.
            if law.form > PID:
                measured_rate(lanes, drives, arms, table, o, w)
