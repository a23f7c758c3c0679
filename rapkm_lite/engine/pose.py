"""Where the controller thinks the machine is: control matrix at the true or at the measured pose, in lockstep."""

from __future__ import annotations

import math

from .jit import leaf, outlined
from .lanes import A1, A2, DX, DY, FAR, INV, PX, PX1, PX2, PY, PY1, PY2, SAMPLE, STATUS, TODO, E, X, Y
from .plant import at, geometry, small_angle, solve2
from .tables import COLUMNS, DONE, L2SQ, NO_POSE, SCALE


@leaf
def true_pose(lanes, drives, model, same, w):
    """Control matrix of the controller's model at the true end-effector position."""
    L, N = len(lanes), len(drives)
    for j in range(L):
        for i in range(N):
            if same:
                inv = w[at(INV, i, j, N, L)]
                w[at(A1, i, j, N, L)], w[at(A2, i, j, N, L)] = w[at(DX, i, j, N, L)] * inv, w[at(DY, i, j, N, L)] * inv
            else:
                place = geometry(model, i, w[X * L + j], w[Y * L + j])
                w[at(A1, i, j, N, L)], w[at(A2, i, j, N, L)] = place[5], place[6]


@leaf
def pose_terms(model, i, ux, uy, e, x, y):
    """Shares of arm i in the Hessian and gradient of the pose error, its row of the control matrix, and a flag."""
    ax, ay, _, _, ad, bx, by, lx, ly, inv, area2 = geometry(model, i, x, y)
    s = (ux * ay - uy * ax) * model[i * COLUMNS + SCALE]
    # The flag is negative where the series does not hold or the arm does not reach.
    flag = min(min(0.1 - abs(s), ux * ax + uy * ay), area2)
    r = e - small_angle(s)
    # Second derivative of the base angle: (a.d b b^T + l2^2 j j^T) / (a x d).
    h = r * inv
    g1, g2 = 1.0 - h * ad, h * model[i * COLUMNS + L2SQ]
    return (g1 * bx * bx - g2 * lx * lx, g1 * bx * by - g2 * lx * ly, g1 * by * by - g2 * ly * ly,
            bx * r, by * r, bx, by, flag)


@outlined
def newton_step(lanes, drives, model, row, w, tolerance):
    """One Newton step for the least-squares pose of all lanes; returns how many lanes need another one."""
    L, N = len(lanes), len(drives)
    count = 0
    for j in range(L):
        px, py, todo = w[PX * L + j], w[PY * L + j], w[TODO * L + j]
        m11 = m12 = m22 = fx = fy = -0.0
        flag = 1.0
        for i in range(N):
            p11, p12, p22, gx, gy, a1, a2, f = pose_terms(model, i, row[6 + 6 * N + i], row[6 + 7 * N + i],
                                                          w[at(E, i, j, N, L)], px, py)
            m11, m12, m22, fx, fy = m11 + p11, m12 + p12, m22 + p22, fx + gx, fy + gy
            flag = min(flag, f)
            w[at(A1, i, j, N, L)], w[at(A2, i, j, N, L)] = a1, a2
        sx, sy = solve2(m11, m12, m22, fx, fy)
        flag = min(min(flag, m11), m11 * m22 - m12 * m12)
        size = max(abs(sx), abs(sy))
        more = todo if flag > 0.0 and size >= tolerance else 0.0
        w[FAR * L + j] += 0.0 if flag > 0.0 else todo
        # A run that is done stays where it is and finds the same matrix again, whatever its neighbours still need.
        w[PX * L + j] = px + sx if more > 0.0 else px
        w[PY * L + j] = py + sy if more > 0.0 else py
        w[TODO * L + j] = more
        count += 1 if more > 0.0 else 0
    return count


@leaf
def gauss_newton(drives, model, row, w, j, L, x, y, tolerance):
    """Least-squares pose of one lane from a rough start; returns it, and whether it converged."""
    N = len(drives)
    for _ in range(50):
        m11 = m12 = m22 = fx = fy = -0.0
        for i in range(N):
            ax, ay, _, _, _, bx, by, _, _, _, area2 = geometry(model, i, x, y)
            if not area2 > 0.0:
                return x, y, False
            ux, uy = row[6 + 6 * N + i], row[6 + 7 * N + i]
            r = w[at(E, i, j, N, L)] - math.atan2(ux * ay - uy * ax, ux * ax + uy * ay)
            w[at(A1, i, j, N, L)], w[at(A2, i, j, N, L)] = bx, by
            m11, m12, m22, fx, fy = m11 + bx * bx, m12 + bx * by, m22 + by * by, fx + bx * r, fy + by * r
        sx, sy = solve2(m11, m12, m22, fx, fy)
        if abs(sx) < tolerance and abs(sy) < tolerance:
            return x, y, True
        x, y = x + sx, y + sy
    return x, y, False


@leaf
def measured_pose(lanes, drives, model, row, w, k, smooth):
    """Least-squares pose of the measured base angles, and the control matrix there (`estimate_pose`)."""
    L = len(lanes)
    tolerance = 1e-13 / model[SCALE]
    for j in range(L):
        w[TODO * L + j], w[FAR * L + j] = 1.0, 0.0
        if smooth:
            # The pose moves on smoothly: a parabola through the last three.
            guess_x = 3.0 * (w[PX * L + j] - w[PX1 * L + j]) + w[PX2 * L + j]
            guess_y = 3.0 * (w[PY * L + j] - w[PY1 * L + j]) + w[PY2 * L + j]
        else:
            guess_x, guess_y = w[PX * L + j], w[PY * L + j]
        w[PX2 * L + j], w[PY2 * L + j] = w[PX1 * L + j], w[PY1 * L + j]
        w[PX1 * L + j], w[PY1 * L + j] = w[PX * L + j], w[PY * L + j]
        w[PX * L + j], w[PY * L + j] = guess_x, guess_y
    count = L
    for _ in range(12):
        if count > 0:
            count = newton_step(lanes, drives, model, row, w, tolerance)
    rough = 0.0
    for j in range(L):
        rough += w[FAR * L + j] + w[TODO * L + j]
    if rough > 0.0:
        for j in range(L):
            if w[FAR * L + j] + w[TODO * L + j] > 0.0 and w[STATUS * L + j] == DONE:
                px, py, found = gauss_newton(drives, model, row, w, j, L, w[PX1 * L + j], w[PY1 * L + j], tolerance)
                w[PX * L + j], w[PY * L + j] = px, py
                if not found:
                    w[STATUS * L + j], w[SAMPLE * L + j] = NO_POSE, k
