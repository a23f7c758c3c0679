"""The compiled kernel under `simulation`: plant, sensors and controllers of one sampled closed loop, arm by arm.

The plant moves in end-effector coordinates, regular everywhere inside the workspace, so that the loops stay closed by
construction.  Everything is rational in the arm vectors a_i, d_i but for one square root per arm: no trigonometry in
the loop.  Without Numba the same source runs as plain Python, slower, with the same numbers.
"""

from __future__ import annotations

import math
import os

import numpy as np

try:
    if os.environ.get("RAPKM_LITE_NUMBA", "1") == "0":
        raise ImportError
    from numba import njit

    COMPILED = True
except ImportError:
    COMPILED = False

    def njit(*args, **kwargs):
        """Stand-in for numba.njit: leave the function as it is."""
        return args[0] if args else lambda function: function


# What a run ended with.
DONE, LEFT_WORKSPACE, NO_POSE, SINGULAR = 0, 1, 2, 3
# Laws, filters, pose sources.
PD, APD, CTC, SWITCHED, REDUNDANT_APD, REDUNDANT_CTC, REDUNDANT_CTC_LINE2 = range(7)
NO_FILTER, FORCE_FILTER, COMMAND_FILTER = range(3)
MEASURED, TRUE = range(2)

# Columns of the arm table.
BX, BY, L1, L2, MODE, J_A, J_D, P, W1, W2, FRICTION = range(11)


def arm_table(robot) -> np.ndarray:
    """The constants of each arm that the kernel needs, (N, 11)."""
    l1, l2 = robot.lengths.T
    J_a, J_d, coupling = robot.arm_inertias.T
    w1, w2 = robot.arm_moments.T
    return np.column_stack([robot.base, l1, l2, robot.mode, J_a, J_d, coupling / (l1 * l2), w1 / l1, w2 / l2,
                            robot.friction])


def environment(robot) -> np.ndarray:
    """Gravity vector and friction velocity, (3,)."""
    return np.array([*robot.gravity, robot.friction_velocity])


def motion_table(trajectory) -> np.ndarray:
    """Desired motion per sample: x, xd, xdd, q, qd, qdd and the unit vectors along the proximal links, (k, 6 + 8N)."""
    N = trajectory.n_arms
    angle = trajectory.q[:, :N]
    return np.column_stack([trajectory.x, trajectory.xd, trajectory.xdd, trajectory.q, trajectory.qd, trajectory.qdd,
                            np.cos(angle), np.sin(angle)])


@njit(cache=True)
def arm_geometry(arm, x, y):
    """Arm vectors a, d, their cross product l1 l2 sin(elbow) and its inverse; NaN outside the reach."""
    X, Y = x - arm[BX], y - arm[BY]
    l1sq, l2sq = arm[L1] * arm[L1], arm[L2] * arm[L2]
    rho2 = X * X + Y * Y
    kappa = 0.5 * (rho2 + l1sq - l2sq)
    area2 = l1sq * rho2 - kappa * kappa
    if area2 <= 0.0:
        return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    den = arm[MODE] * math.sqrt(area2)
    inverse = 1.0 / (rho2 * den)
    k, h = kappa * den * inverse, den * den * inverse
    ax, ay = k * X + h * Y, k * Y - h * X
    return ax, ay, X - ax, Y - ay, den, rho2 * inverse


@njit(cache=True)
def acceleration(arms, env, x, y, vx, vy, c):
    """End-effector acceleration of the plant under the torques c: M xdd + mu = sum_i A_i c_i."""
    m11 = m12 = m22 = fx = fy = 0.0
    for i in range(arms.shape[0]):
        arm = arms[i]
        ax, ay, dx, dy, den, inv = arm_geometry(arm, x, y)
        bx, by, lx, ly = dx * inv, dy * inv, -ax * inv, -ay * inv
        base, link = bx * vx + by * vy, lx * vx + ly * vy
        ad = ax * dx + ay * dy
        base2, link2 = base * base, link * link
        base_acc = (base2 * ad + link2 * arm[L2] * arm[L2]) * inv
        link_acc = -(base2 * arm[L1] * arm[L1] + link2 * ad) * inv
        J_a, J_d, p = arm[J_A], arm[J_D], arm[P]
        t1 = c[i] - J_a * base_acc - p * (ad * link_acc - den * link2)
        t2 = -J_d * link_acc - p * (ad * base_acc + den * base2)
        t1 -= arm[W1] * (env[0] * ay - env[1] * ax)
        t2 -= arm[W2] * (env[0] * dy - env[1] * dx)
        if arm[FRICTION] > 0.0:
            t1 -= arm[FRICTION] * math.tanh(base / env[2])
        fx += bx * t1 + lx * t2
        fy += by * t1 + ly * t2
        u, v = J_a * bx + p * ad * lx, J_a * by + p * ad * ly
        w, z = p * ad * bx + J_d * lx, p * ad * by + J_d * ly
        m11 += bx * u + lx * w
        m12 += bx * v + lx * z
        m22 += by * v + ly * z
    scale = 1.0 / (m11 * m22 - m12 * m12)
    return (m22 * fx - m12 * fy) * scale, (m11 * fy - m12 * fx) * scale


@njit(cache=True)
def advance(arms, env, x, y, vx, vy, c, dt):
    """One Runge-Kutta step (order 4) over one hold of the torques c."""
    h = 0.5 * dt
    k1x, k1y = acceleration(arms, env, x, y, vx, vy, c)
    ux, uy = vx + h * k1x, vy + h * k1y
    k2x, k2y = acceleration(arms, env, x + h * vx, y + h * vy, ux, uy, c)
    wx, wy = vx + h * k2x, vy + h * k2y
    k3x, k3y = acceleration(arms, env, x + h * ux, y + h * uy, wx, wy, c)
    zx, zy = vx + dt * k3x, vy + dt * k3y
    k4x, k4y = acceleration(arms, env, x + dt * wx, y + dt * wy, zx, zy, c)
    s = dt / 6.0
    return (x + s * (vx + 2.0 * (ux + wx) + zx), y + s * (vy + 2.0 * (uy + wy) + zy),
            vx + s * (k1x + 2.0 * (k2x + k3x) + k4x), vy + s * (k1y + 2.0 * (k2y + k3y) + k4y))


@njit(cache=True)
def turned_by(ux, uy, ax, ay, length):
    """Angle from the unit vector u to the vector a of known length, rad."""
    s = (ux * ay - uy * ax) / length
    if abs(s) < 0.05 and ux * ax + uy * ay > 0.0:
        z = s * s
        return s * (1.0 + z * (1 / 6 + z * (3 / 40 + z * (15 / 336 + z * (105 / 3456 + z * 945 / 42240)))))
    return math.atan2(ux * ay - uy * ax, ux * ax + uy * ay)


@njit(cache=True)
def sense(arms, row, x, y, vx, vy, q, qd):
    """True base angles and rates at the end-effector state, written to q and qd; `row` is the desired motion."""
    N = arms.shape[0]
    for i in range(N):
        ax, ay, dx, dy, den, inv = arm_geometry(arms[i], x, y)
        q[i] = row[6 + i] + turned_by(row[6 + 6 * N + i], row[6 + 7 * N + i], ax, ay, arms[i, L1])
        qd[i] = (dx * vx + dy * vy) * inv


@njit(cache=True)
def solve2(m11, m12, m22, fx, fy):
    """Solve a symmetric 2 x 2 system."""
    scale = 1.0 / (m11 * m22 - m12 * m12)
    return (m22 * fx - m12 * fy) * scale, (m11 * fy - m12 * fx) * scale


@njit(cache=True)
def find_pose(arms, row, q, start_x, start_y):
    """Least-squares end-effector position of measured base angles by Gauss-Newton; NaN when there is none."""
    N = arms.shape[0]
    x, y = start_x, start_y
    for _ in range(50):
        m11 = m12 = m22 = fx = fy = 0.0
        for i in range(N):
            ax, ay, dx, dy, den, inv = arm_geometry(arms[i], x, y)
            r = q[i] - row[6 + i] - turned_by(row[6 + 6 * N + i], row[6 + 7 * N + i], ax, ay, arms[i, L1])
            bx, by = dx * inv, dy * inv
            m11, m12, m22 = m11 + bx * bx, m12 + bx * by, m22 + by * by
            fx, fy = fx + bx * r, fy + by * r
        sx, sy = solve2(m11, m12, m22, fx, fy)
        if not (abs(sx) < 1e300 and abs(sy) < 1e300):
            return math.nan, math.nan
        if max(abs(sx), abs(sy)) < 1e-13 * arms[0, L1]:
            return x, y
        x, y = x + sx, y + sy
    return math.nan, math.nan


@njit(cache=True)
def complement(arms, x, y, vx, vy, F, Fd):
    """F and dF/dt of the end-effector position in absolute link angles: rows base 1..N, link 1..N."""
    N = arms.shape[0]
    for i in range(N):
        ax, ay, dx, dy, den, inv = arm_geometry(arms[i], x, y)
        F[i, 0], F[i, 1], F[N + i, 0], F[N + i, 1] = dx * inv, dy * inv, -ax * inv, -ay * inv
        base, link = F[i, 0] * vx + F[i, 1] * vy, F[N + i, 0] * vx + F[N + i, 1] * vy
        ad = ax * dx + ay * dy
        for k in range(2):
            Fd[i, k] = (base * ad * F[i, k] + link * arms[i, L2] ** 2 * F[N + i, k]) * inv
            Fd[N + i, k] = -(base * arms[i, L1] ** 2 * F[i, k] + link * ad * F[N + i, k]) * inv


@njit(cache=True)
def tree_wrench(arms, env, x, y, vx, vy, F, rate, acc):
    """F^T (G acc + C rate + Q) with reference rates and accelerations of the absolute link angles, (2N,) each."""
    N = arms.shape[0]
    fx = fy = 0.0
    for i in range(N):
        arm = arms[i]
        ax, ay, dx, dy, den, inv = arm_geometry(arm, x, y)
        base, link = F[i, 0] * vx + F[i, 1] * vy, F[N + i, 0] * vx + F[N + i, 1] * vy
        ad = ax * dx + ay * dy
        t1 = arm[J_A] * acc[i] + arm[P] * (ad * acc[N + i] - den * link * rate[N + i])
        t2 = arm[J_D] * acc[N + i] + arm[P] * (ad * acc[i] + den * base * rate[i])
        t1 += arm[W1] * (env[0] * ay - env[1] * ax)
        t2 += arm[W2] * (env[0] * dy - env[1] * dx)
        if arm[FRICTION] > 0.0:
            t1 += arm[FRICTION] * math.tanh(base / env[2])
        fx += F[i, 0] * t1 + F[N + i, 0] * t2
        fy += F[i, 1] * t1 + F[N + i, 1] * t2
    return fx, fy


@njit(cache=True)
def distribute(F, fx, fy, c):
    """The smallest torques with A^T c = f: c = A (A^T A)^-1 f."""
    m11 = m12 = m22 = 0.0
    for i in range(c.shape[0]):
        m11, m12, m22 = m11 + F[i, 0] ** 2, m12 + F[i, 0] * F[i, 1], m22 + F[i, 1] ** 2
    gx, gy = solve2(m11, m12, m22, fx, fy)
    for i in range(c.shape[0]):
        c[i] = F[i, 0] * gx + F[i, 1] * gy


@njit(cache=True)
def best_pair(arms, x, y, pair, hysteresis):
    """Pair of drives with the largest |d_j x d_k|, kept while no other is better by the factor `hysteresis`."""
    N = arms.shape[0]
    best, now, j0, k0 = -1.0, -1.0, pair[0], pair[1]
    for j in range(N):
        for k in range(j + 1, N):
            _, _, djx, djy, _, _ = arm_geometry(arms[j], x, y)
            _, _, dkx, dky, _, _ = arm_geometry(arms[k], x, y)
            measure = abs(djx * dky - djy * dkx) / (arms[j, L2] * arms[k, L2])
            if j == j0 and k == k0:
                now = measure
            if measure > best:
                best, pair[0], pair[1] = measure, j, k
    if now >= 0.0 and best <= hysteresis * now:
        pair[0], pair[1] = j0, k0


@njit(cache=True)
def filtered_torques(F, gain, e, form, c):
    """c -= K R_K e (command form) or R K e (force form), or K e without filter, for diagonal gains."""
    N = c.shape[0]
    if form == NO_FILTER:
        for i in range(N):
            c[i] -= gain[i] * e[i]
        return
    m11 = m12 = m22 = fx = fy = 0.0
    for i in range(N):
        weight = gain[i] ** 2 if form == COMMAND_FILTER else 1.0
        m11, m12, m22 = m11 + weight * F[i, 0] ** 2, m12 + weight * F[i, 0] * F[i, 1], m22 + weight * F[i, 1] ** 2
        fx, fy = fx + F[i, 0] * gain[i] * e[i], fy + F[i, 1] * gain[i] * e[i]
    gx, gy = solve2(m11, m12, m22, fx, fy)
    for i in range(N):
        weight = gain[i] ** 2 if form == COMMAND_FILTER else 1.0
        c[i] -= weight * (F[i, 0] * gx + F[i, 1] * gy)


@njit(cache=True)
def joint_row(F, N, j, k):
    """Entry (j, k) of F for the relative joint angles."""
    return F[j, k] if j < N else F[j, k] - F[j - N, k]


@njit(cache=True)
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


@njit(cache=True)
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


@njit(cache=True)
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


@njit(cache=True)
def torques(arms, env, row, law, form, x, y, vx, vy, q, qd, K_P, K_D, pair, hysteresis, F, Fd, work, c):
    """Drive torques of one sample, written to c, from the pose (x, y, vx, vy) and the measured base angles in q, qd."""
    N = arms.shape[0]
    if law == PD:
        for i in range(N):
            c[i] = 0.0
            work[0, i], work[1, i] = q[i] - row[6 + i], qd[i] - row[6 + 2 * N + i]
        if form != NO_FILTER:
            complement(arms, x, y, vx, vy, F, Fd)
        filtered_torques(F, K_P, work[0], form, c)
        filtered_torques(F, K_D, work[1], form, c)
        return
    complement(arms, x, y, vx, vy, F, Fd)
    for i in range(N):
        ax, ay, dx, dy, den, inv = arm_geometry(arms[i], x, y)
        q[N + i] = math.atan2(den, ax * dx + ay * dy)
        qd[N + i] = (F[N + i, 0] - F[i, 0]) * vx + (F[N + i, 1] - F[i, 1]) * vy
    out = work[2]
    if law == SWITCHED:
        best_pair(arms, x, y, pair, hysteresis)
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
    fx, fy = tree_wrench(arms, env, x, y, vx, vy, F, rate, acc)
    distribute(F, fx + out[4], fy + out[5], c)


@njit(cache=True, nogil=True)
def closed_loop(plant, plant_env, model, model_env, table, dt, law, form, pose, K_P, K_D, pair, hysteresis,
                offset, quantum, velocity_filter, states, q_a, qd_a, c, pairs):
    """One sampled run; fills states (k, 4), q_a, qd_a, c (k, N), pairs (k, 2).  Returns (status, sample)."""
    N, samples = plant.shape[0], table.shape[0]
    F, Fd, work = np.empty((2 * N, 2)), np.empty((2 * N, 2)), np.empty((3, max(2 * N, 6)))
    q, qd, last, slow = np.empty(2 * N), np.empty(2 * N), np.empty(N), np.zeros(N)
    x, y, vx, vy = table[0, 0], table[0, 1], table[0, 2], table[0, 3]
    px, py, pvx, pvy = x, y, vx, vy
    blend = dt / (velocity_filter + dt)
    for k in range(samples):
        row = table[k]
        sense(plant, row, x, y, vx, vy, q, qd)
        for i in range(N):
            q_a[k, i], qd_a[k, i] = q[i], qd[i]
            q[i] += offset[i]
            if quantum > 0.0:
                q[i] = quantum * math.floor(q[i] / quantum + 0.5)
            if velocity_filter >= 0.0:
                if k > 0:
                    slow[i] += blend * ((q[i] - last[i]) / dt - slow[i])
                last[i], qd[i] = q[i], slow[i]
        if pose == TRUE or (law == PD and form == NO_FILTER):
            px, py, pvx, pvy = x, y, vx, vy
        else:
            px, py = find_pose(model, row, q, px, py)
            if not abs(px) < 1e300:
                return NO_POSE, k
            complement(model, px, py, 0.0, 0.0, F, Fd)
            m11 = m12 = m22 = fx = fy = 0.0
            for i in range(N):
                m11, m12, m22 = m11 + F[i, 0] ** 2, m12 + F[i, 0] * F[i, 1], m22 + F[i, 1] ** 2
                fx, fy = fx + F[i, 0] * qd[i], fy + F[i, 1] * qd[i]
            pvx, pvy = solve2(m11, m12, m22, fx, fy)
        torques(model, model_env, row, law, form, px, py, pvx, pvy, q, qd, K_P, K_D, pair, hysteresis, F, Fd, work,
                c[k])
        states[k, 0], states[k, 1], states[k, 2], states[k, 3] = x, y, vx, vy
        pairs[k, 0], pairs[k, 1] = pair[0], pair[1]
        for i in range(N):
            if not abs(c[k, i]) < 1e300:
                return SINGULAR, k
        if k + 1 < samples:
            x, y, vx, vy = advance(plant, plant_env, x, y, vx, vy, c[k], dt)
            if not (abs(x) < 1e300 and abs(y) < 1e300 and abs(vx) < 1e300 and abs(vy) < 1e300):
                return LEFT_WORKSPACE, k
            for i in range(N):
                if not abs(arm_geometry(plant[i], x, y)[5]) < 1e300:
                    return LEFT_WORKSPACE, k
    return DONE, samples - 1
