"""The machine in end-effector coordinates: regular everywhere inside the workspace, so that the loops stay closed.

Everything is rational in the arm vectors a_i, d_i but for one square root per arm: no trigonometry in the loop.
The two links of an arm are replaced by two inertias without coupling and a mass at the end-effector (`arm_table`), so
that with v the end-effector velocity, b = d / (a x d) and l = a / (a x d) the link rates are b.v and -l.v, and

    M = sum_i S1 b b^T + S2 l l^T + tip masses.

Sizes come as tuples, whose length the compiler knows: ``drives`` has one entry per arm; ``extra`` has one when the
machine has gravity or friction, else none.
"""

from __future__ import annotations

import math

from .jit import kernel, leaf
from .lanes import SINGLES
from .tables import BX, BY, COLUMNS, FRICTION, HALF, L1SQ, L2SQ, MEAN, MODE, S1, S2, SCALE, W1, W2


@leaf
def at(block, i, j, N, L):
    """Index of lane j in row i of a block."""
    return (SINGLES + block * N + i) * L + j


@leaf
def small_angle(s):
    """arcsin(s) for |s| < 0.1 by its series."""
    z = s * s
    z2 = z * z
    # In pairs, so that less waits for each other.
    low = 1.0 + z * (1 / 6) + z2 * (3 / 40 + z * (5 / 112))
    high = 35 / 1152 + z * (63 / 2816) + z2 * (231 / 13312 + z * (143 / 10240) + z2 * (6435 / 557056))
    return s * (low + z2 * z2 * high)


@leaf
def turned_by(ux, uy, ax, ay, scale):
    """Angle from the unit vector u to the vector a of length 1 / scale, rad."""
    s, t = ux * ay - uy * ax, ux * ax + uy * ay
    if abs(s * scale) <= 0.1 and t >= 0.0:
        return small_angle(s * scale)
    return math.atan2(s, t)


@leaf
def geometry(arms, i, x, y):
    """Arm i with its tip at (x, y): arm vectors a, d, their product a.d, rows b = d / (a x d) and l = a / (a x d),
    1 / (a x d), and (a x d)^2, which is not positive outside the reach.  Link rates are b.v and -l.v."""
    o = i * COLUMNS
    X, Y = x - arms[o + BX], y - arms[o + BY]
    rho2 = X * X + Y * Y
    kappa = 0.5 * rho2 + arms[o + HALF]
    area2 = arms[o + L1SQ] * rho2 - kappa * kappa
    den = arms[o + MODE] * math.sqrt(max(area2, 1e-300))
    inverse = 1.0 / rho2
    k, h = kappa * inverse, den * inverse
    ax, ay = k * X + h * Y, k * Y - h * X
    dx, dy, inv = X - ax, Y - ay, 1.0 / den
    return ax, ay, dx, dy, 0.5 * rho2 - arms[o + MEAN], dx * inv, dy * inv, ax * inv, ay * inv, inv, area2


@leaf
def smooth_sign(z):
    """tanh(z) without branches, by halving the argument: t = e^u - 1 at u = -2 |z| / 256, doubled eight times."""
    u = max(-2.0 * abs(z), -40.0) * 0.00390625
    t = u * (1.0 + u * (1 / 2 + u * (1 / 6 + u * (1 / 24 + u * (1 / 120 + u * (1 / 720 + u * (1 / 5040 + u * (
        1 / 40320 + u * (1 / 362880)))))))))
    for _ in range(8):
        t = t * (2.0 + t)
    t = t / (2.0 + t)
    return -t if z > 0.0 else t


@leaf
def add_arm(arms, i, env, extra, place, vx, vy, sums):
    """Add the share of arm i without its torque: mass matrix, force at zero acceleration, smallest (a x d)^2."""
    m11, m12, m22, fx, fy, low = sums
    ax, ay, dx, dy, ad, bx, by, lx, ly, inv, area2 = place
    o = i * COLUMNS
    base, back = bx * vx + by * vy, lx * vx + ly * vy
    base2, back2 = base * base * inv, back * back * inv
    # Accelerations of the proximal link and, with the opposite sign, of the distal link at zero xdd.
    base_acc, back_acc = base2 * ad + back2 * arms[o + L2SQ], base2 * arms[o + L1SQ] + back2 * ad
    sx, sy, tx, ty = arms[o + S1] * bx, arms[o + S1] * by, arms[o + S2] * lx, arms[o + S2] * ly
    fx, fy = fx - sx * base_acc - tx * back_acc, fy - sy * base_acc - ty * back_acc
    if len(extra) > 0:
        drag = arms[o + W1] * (env[0] * ay - env[1] * ax) + arms[o + FRICTION] * smooth_sign(base * env[2])
        weight = arms[o + W2] * (env[0] * dy - env[1] * dx)
        fx, fy = fx - bx * drag + lx * weight, fy - by * drag + ly * weight
    return m11 + sx * bx + tx * lx, m12 + sx * by + tx * ly, m22 + sy * by + ty * ly, fx, fy, min(low, area2)


@leaf
def solve2(m11, m12, m22, fx, fy):
    """Solve a symmetric 2 x 2 system."""
    scale = 1.0 / (m11 * m22 - m12 * m12)
    return (m22 * fx - m12 * fy) * scale, (m11 * fy - m12 * fx) * scale


@leaf
def add_torque(place, c, sums):
    """Add the force of the torque c of an arm."""
    m11, m12, m22, fx, fy, low = sums
    return m11, m12, m22, fx + place[5] * c, fy + place[6] * c, low


@leaf
def drive(drives, g0, g1, g2, g3, c, first, stride, sums):
    """Add the forces of the torques c[first + i * stride] of the first four arms."""
    sums = add_torque(g1, c[first + stride], add_torque(g0, c[first], sums))
    if len(drives) > 2:
        sums = add_torque(g2, c[first + 2 * stride], sums)
    if len(drives) > 3:
        sums = add_torque(g3, c[first + 3 * stride], sums)
    return sums


@leaf
def acceleration(drives, arms, env, extra, x, y, vx, vy, c, first, stride, low):
    """End-effector acceleration under the torques c[first + i * stride], and the smallest of low and all (a x d)^2.

    Written out for up to four arms: straight code is what the compiler turns into vector instructions over runs.
    """
    N = len(drives)
    g0, g1 = geometry(arms, 0, x, y), geometry(arms, 1, x, y)
    g2 = geometry(arms, 2, x, y) if N > 2 else g0
    g3 = geometry(arms, 3, x, y) if N > 3 else g0
    # -0.0 is the zero that an addition does not need.
    sums = add_arm(arms, 0, env, extra, g0, vx, vy, (env[3], -0.0, env[3], -0.0, -0.0, low))
    sums = add_arm(arms, 1, env, extra, g1, vx, vy, sums)
    if N > 2:
        sums = add_arm(arms, 2, env, extra, g2, vx, vy, sums)
    if N > 3:
        sums = add_arm(arms, 3, env, extra, g3, vx, vy, sums)
    for i in range(4, N):
        place = geometry(arms, i, x, y)
        sums = add_torque(place, c[first + i * stride], add_arm(arms, i, env, extra, place, vx, vy, sums))
    m11, m12, m22, fx, fy, low = drive(drives, g0, g1, g2, g3, c, first, stride, sums)
    gx, gy = solve2(m11, m12, m22, fx, fy)
    return gx, gy, low


@leaf
def runge_kutta(drives, arms, env, extra, x, y, vx, vy, k1x, k1y, low, c, first, stride, dt):
    """The rest of a Runge-Kutta step (order 4) after its first stage, and the smallest of low and all (a x d)^2."""
    h = 0.5 * dt
    ux, uy = vx + h * k1x, vy + h * k1y
    k2x, k2y, low = acceleration(drives, arms, env, extra, x + h * vx, y + h * vy, ux, uy, c, first, stride, low)
    wx, wy = vx + h * k2x, vy + h * k2y
    k3x, k3y, low = acceleration(drives, arms, env, extra, x + h * ux, y + h * uy, wx, wy, c, first, stride, low)
    zx, zy = vx + dt * k3x, vy + dt * k3y
    k4x, k4y, low = acceleration(drives, arms, env, extra, x + dt * wx, y + dt * wy, zx, zy, c, first, stride, low)
    s = dt / 6.0
    return (x + s * (vx + 2.0 * (ux + wx) + zx), y + s * (vy + 2.0 * (uy + wy) + zy),
            vx + s * (k1x + 2.0 * (k2x + k3x) + k4x), vy + s * (k1y + 2.0 * (k2y + k3y) + k4y), low)


@leaf
def hold(drives, arms, env, extra, x, y, vx, vy, c, dt):
    """One hold of the torques c (N,): the next state, and a number that is not positive if an arm was lost on the way.

    An arm that its present elbow rate would stretch or fold before the hold ends is lost too: in end-effector
    coordinates a Runge-Kutta step could jump over that instant.
    """
    low = 1e300
    for i in range(len(drives)):
        _, _, _, _, ad, bx, by, lx, ly, inv, _ = geometry(arms, i, x, y)
        low = min(low, 1.0 - dt * ad * inv * ((bx + lx) * vx + (by + ly) * vy))
    k1x, k1y, low = acceleration(drives, arms, env, extra, x, y, vx, vy, c, 0, 1, low)
    x, y, vx, vy, low = runge_kutta(drives, arms, env, extra, x, y, vx, vy, k1x, k1y, low, c, 0, 1, dt)
    for i in range(len(drives)):
        low = min(low, geometry(arms, i, x, y)[10])
    return x, y, vx, vy, low


@kernel
def advance(drives, extra, arms, env, x, y, vx, vy, c, dt):
    """`hold` for a controller in Python."""
    return hold(drives, arms, env, extra, x, y, vx, vy, c, dt)


@leaf
def base_angles(drives, arms, row, x, y, vx, vy, q, qd):
    """True base angles and rates, written to q and qd (N,); `row` is the desired motion."""
    N = len(drives)
    for i in range(N):
        ax, ay, _, _, _, bx, by, _, _, _, _ = geometry(arms, i, x, y)
        q[i] = row[6 + i] + turned_by(row[6 + 6 * N + i], row[6 + 7 * N + i], ax, ay, arms[i * COLUMNS + SCALE])
        qd[i] = bx * vx + by * vy


@kernel
def observe(drives, arms, row, x, y, vx, vy, q, qd):
    """`base_angles` for a controller in Python."""
    base_angles(drives, arms, row, x, y, vx, vy, q, qd)
