"""What the loop hands to a law that a user compiled: one buffer with the desired motion and the model's matrices.

It holds, one after the other: t; q_a, qd_a; x, xd, xdd; q, qd, qdd; the matrices of `rapkm_lite.at` in the order of
`pointer.Matrices`, of which A and A_tilde are the first rows of F and N; the law's memory; its answer c.
"""

from __future__ import annotations

import math

from numpy.lib.stride_tricks import as_strided

from .arms import placed
from .jit import leaf, outlined, view
from .leaves import solve_regular, tanh
from .rows import *
from .tables import *


@leaf
def product(out, A, B, rows, inner, columns):
    """out = A B of matrices with these sizes, which the compiler knows."""
    for i in range(rows):
        for j in range(columns):
            s = 0.0
            for k in range(inner):
                s += A[i, k] * B[k, j]
            out[i, j] = s


@view
def matrix(buffer, start, rows, columns):
    """A matrix that stands in the buffer, and where the next one starts; `reshape` would call a function in C."""
    size = rows * columns
    return as_strided(buffer[start : start + size], (rows, columns), (8 * columns, 8)), start + size


@outlined
def fill(drives, arms, law, t, table, o, w, buffer):
    """What a law may know at a sample: time, measurement, desired motion, and the matrices that `law.asks` for."""
    N, W = len(drives), len(arms)
    buffer[0] = t
    for i in range(N):
        buffer[1 + i] = w[E * W + i] + want(table, o, ANGLE, i, W)
        buffer[1 + N + i] = w[ED * W + i] + want(table, o, RATE, i, W)
    p = 1 + 2 * N
    for i in range(6):
        buffer[p + i] = table[o + i]
    p += 6
    for block in (ANGLE, ELBOW, RATE, ELBOW_RATE, ACCELERATION, ELBOW_ACCELERATION):
        for i in range(N):
            buffer[p + i] = want(table, o, block, i, W)
        p += N
    if law.asks != NOTHING:
        fill_matrices(drives, arms, law, table, o, w, buffer[p:])


@leaf
def links(law, table, o, w, W, i):
    """Both links of arm i, their cross product, and their rates, at the pose that the law asks for."""
    m = MODEL * W + i
    if law.asks == DESIRED:
        cos, sin = want(table, o, COS, i, W), want(table, o, SIN, i, W)
        turn_c, turn_s = want(table, o, ELBOW_COS, i, W), want(table, o, ELBOW_SIN, i, W)
        l1, l2 = math.sqrt(w[m + L1SQ * W]), math.sqrt(w[m + L2SQ * W])
        ax, ay, dx, dy = l1 * cos, l1 * sin, l2 * (cos * turn_c - sin * turn_s), l2 * (sin * turn_c + cos * turn_s)
        base = want(table, o, RATE, i, W)
        return ax, ay, dx, dy, ax * dy - ay * dx, base, base + want(table, o, ELBOW_RATE, i, W)
    (bx, by, lx, ly, _, _, den), _ = placed(MODEL, w, i, 0, W, 1, w[of(PX, 0, W, 1)], w[of(PY, 0, W, 1)])
    vx, vy = w[of(PVX, 0, W, 1)], w[of(PVY, 0, W, 1)]
    return den * lx, den * ly, den * bx, den * by, den, bx * vx + by * vy, -(lx * vx + ly * vy)


@leaf
def angles(law, table, o, w, W, i, ax, ay, cross, dot):
    """Base and elbow angle of arm i at the pose that the law asks for, on the turn of the measured or desired ones."""
    near = want(table, o, ANGLE, i, W)
    if law.asks == DESIRED:
        return near, want(table, o, ELBOW, i, W)
    near += 0.0 if law.pose == TRUE else w[E * W + i]
    angle = math.atan2(ay, ax)
    return angle + 2.0 * math.pi * math.floor((near - angle) / (2.0 * math.pi) + 0.5), math.atan2(cross, dot)


@leaf
def fill_loops(J, J_dot, N, i, ax, ay, dx, dy, base, link):
    """What arm i adds to the loop constraints: every arm is cut from the second one."""
    for row in range(N - 1):
        arm = row if row < 1 else row + 1
        sign = 1.0 if arm == i else -1.0 if i == 1 else 0.0
        if sign != 0.0:
            J[2 * row, i], J[2 * row + 1, i] = -sign * (ay + dy), sign * (ax + dx)
            J[2 * row, N + i], J[2 * row + 1, N + i] = -sign * dy, sign * dx
            J_dot[2 * row, i] = -sign * (base * ax + link * dx)
            J_dot[2 * row + 1, i] = -sign * (base * ay + link * dy)
            J_dot[2 * row, N + i], J_dot[2 * row + 1, N + i] = -sign * link * dx, -sign * link * dy


@view
def fill_matrices(drives, arms, law, table, o, w, room):
    """Pose, rates and all matrices of `rapkm_lite.at` at the desired, measured or true pose."""
    N, W = len(drives), len(arms)
    n, r = 2 * N, 2 * N - 2
    x, p = matrix(room, 0, 2, 2)
    q, p = matrix(room, p, 2, n)
    F, p = matrix(room, p, n, 2)
    F_dot, p = matrix(room, p, n, 2)
    A_T_pinv, p = matrix(room, p, N, 2)
    J, p = matrix(room, p, r, n)
    J_dot, p = matrix(room, p, r, n)
    P, p = matrix(room, p, n, n)
    P_dot, p = matrix(room, p, n, n)
    G, p = matrix(room, p, n, n)
    C_, p = matrix(room, p, n, n)
    Q_, p = matrix(room, p, n, 1)
    G2, p = matrix(room, p, 2, 2)
    C2, p = matrix(room, p, 2, 2)
    Q2, p = matrix(room, p, 2, 1)
    Gn, p = matrix(room, p, n, n)
    Cn, p = matrix(room, p, n, n)
    Qn, p = matrix(room, p, n, 1)
    pinv, p = matrix(room, p, N, n)
    scratch = room[p : p + 10 * n].reshape(5, n, 2)
    J[:], J_dot[:], G[:], C_[:] = 0.0, 0.0, 0.0, 0.0
    env = ENVIRONMENT + GRAVITY_X
    gx, gy = w[of(env, 0, W, 1)], w[of(env + 1, 0, W, 1)]
    sharpness = w[of(ENVIRONMENT + SHARPNESS, 0, W, 1)]
    for i in range(N):
        m = MODEL * W + i
        l1sq, l2sq = w[m + L1SQ * W], w[m + L2SQ * W]
        ax, ay, dx, dy, den, base, link = links(law, table, o, w, W, i)
        if i == 1:  # every arm is cut from it
            x[0, 0], x[0, 1] = w[m + BX * W] + ax + dx, w[m + BY * W] + ay + dy
            x[1, 0], x[1, 1] = -(base * ay + link * dy), base * ax + link * dx
        ad, tip = ax * dx + ay * dy, w[m + TIP * W]
        q[0, i], q[0, N + i] = angles(law, table, o, w, W, i, ax, ay, den, ad)
        q[1, i], q[1, N + i] = base, link - base
        den_dot = (link - base) * ad
        F[i, 0], F[i, 1], F[N + i, 0], F[N + i, 1] = dx / den, dy / den, -(ax + dx) / den, -(ay + dy) / den
        bx, by = (-link * dy - dx * den_dot / den) / den, (link * dx - dy * den_dot / den) / den
        F_dot[i, 0], F_dot[i, 1] = bx, by
        F_dot[N + i, 0] = (base * ay + ax * den_dot / den) / den - bx
        F_dot[N + i, 1] = (-base * ax + ay * den_dot / den) / den - by
        Ja, Jd, coupling = w[m + S1 * W] + tip * l1sq, w[m + S2 * W] + tip * l2sq, tip * ad
        G[i, i], G[i, N + i], G[N + i, i], G[N + i, N + i] = Ja + Jd + 2.0 * coupling, Jd + coupling, Jd + coupling, Jd
        bend, elbow = tip * den, link - base
        C_[i, i], C_[i, N + i], C_[N + i, i] = -bend * elbow, -bend * link, bend * base
        distal = w[m + W2 * W] * (gx * dy - gy * dx)
        drag = w[m + FRICTION * W] * tanh(base * sharpness)
        Q_[i, 0], Q_[N + i, 0] = w[m + W1 * W] * (gx * ay - gy * ax) + distal + drag, distal
        fill_loops(J, J_dot, N, i, ax, ay, dx, dy, base, link)
    U, H, T = scratch[0], scratch[1], scratch[2]
    # Minimal coordinates: F^T G F, F^T (C F + G Fdot), F^T Q.
    product(H, G, F, n, n, 2)
    product(G2, F.T, H, 2, n, 2)
    product(H, C_, F, n, n, 2)
    product(T, G, F_dot, n, n, 2)
    for i in range(n):
        H[i, 0], H[i, 1] = H[i, 0] + T[i, 0], H[i, 1] + T[i, 1]
    product(C2, F.T, H, 2, n, 2)
    product(Q2, F.T, Q_, 2, n, 1)
    # Redundant coordinates with N = U U^T: U (U^T G U) U^T and so on.
    project(F, F_dot, U, T, P, P_dot, n)
    small, wide = scratch[3], scratch[4].reshape(2, n)
    product(H, G, U, n, n, 2)
    product(small, U.T, H, 2, n, 2)
    product(T, U, small, n, 2, 2)
    spread(Gn, T, U, n)
    product(wide, H.T, P_dot, 2, n, n)
    product(T, C_, U, n, n, 2)
    product(small, U.T, T, 2, n, 2)
    for i in range(2):
        for j in range(n):
            wide[i, j] += small[i, 0] * U[j, 0] + small[i, 1] * U[j, 1]
    product(Cn, U, wide, n, 2, n)
    product(small, U.T, Q_, 2, n, 1)
    product(Qn, U, small, n, 2, 1)
    m11 = m12 = m22 = 0.0
    for i in range(N):
        m11, m12, m22 = m11 + F[i, 0] * F[i, 0], m12 + F[i, 0] * F[i, 1], m22 + F[i, 1] * F[i, 1]
    for i in range(N):
        u, v = solve_regular(m11, m12, m22, F[i, 0], F[i, 1])
        A_T_pinv[i, 0], A_T_pinv[i, 1] = u, v
        for j in range(n):
            pinv[i, j] = u * F[j, 0] + v * F[j, 1]


@leaf
def spread(out, A, B, n):
    """out = A B^T of two columns each."""
    for i in range(n):
        for j in range(n):
            out[i, j] = A[i, 0] * B[j, 0] + A[i, 1] * B[j, 1]


@leaf
def project(F, F_dot, U, V, P, P_dot, n):
    """The projector onto the range of F and its rate, from an orthonormal basis U of the two columns."""
    r11, r12, r22 = 1.0, 0.0, 1.0
    for i in range(n):
        U[i, 0], U[i, 1] = F[i, 0], F[i, 1]
    # Gram-Schmidt twice: the second time removes what rounding left.
    for _ in range(2):
        aa = ab = bb = 0.0
        for i in range(n):
            aa += U[i, 0] * U[i, 0]
        a = math.sqrt(aa)
        for i in range(n):
            U[i, 0] /= a
            ab += U[i, 0] * U[i, 1]
        for i in range(n):
            U[i, 1] -= ab * U[i, 0]
            bb += U[i, 1] * U[i, 1]
        b = math.sqrt(bb)
        for i in range(n):
            U[i, 1] /= b
        r11, r12, r22 = a * r11, a * r12 + ab * r22, b * r22
    spread(P, U, U, n)
    # F_dot R^-1, then its part across the range.
    p11 = p12 = p21 = p22 = 0.0
    for i in range(n):
        V[i, 0] = F_dot[i, 0] / r11
        V[i, 1] = (F_dot[i, 1] - V[i, 0] * r12) / r22
        p11, p12 = p11 + U[i, 0] * V[i, 0], p12 + U[i, 0] * V[i, 1]
        p21, p22 = p21 + U[i, 1] * V[i, 0], p22 + U[i, 1] * V[i, 1]
    for i in range(n):
        V[i, 0], V[i, 1] = V[i, 0] - U[i, 0] * p11 - U[i, 1] * p21, V[i, 1] - U[i, 0] * p12 - U[i, 1] * p22
    for i in range(n):
        for j in range(n):
            P_dot[i, j] = V[i, 0] * U[j, 0] + V[i, 1] * U[j, 1] + U[i, 0] * V[j, 0] + U[i, 1] * V[j, 1]
