"""The formulas of one arm, without loops or memory: every layout of the engine is made of them.

Everything is rational in the arm vectors a, d but for one square root per arm: no trigonometry in the loop.  The two
links of an arm are replaced by two inertias S1, S2 without coupling and a mass at the end-effector (`tables`), so that
with v the end-effector velocity, b = d / (a x d) and l = a / (a x d) the link rates are b.v and -l.v, and

    M = sum_i S1 b b^T + S2 l l^T + tip masses.
"""

from __future__ import annotations

import math

from .jit import COMPILED, SHIFT, leaf, power

# Largest |qdd| h / v0 of a Runge-Kutta step across the bend of the friction law, and the angle in rad by which a step
# that is longer may err, as where a machine is thrown about.
FAST, FINE = 0.6, 3e-9


@leaf
def solve2(m11, m12, m22, fx, fy):
    """Solve a symmetric 2 x 2 system."""
    scale = 1.0 / (m11 * m22 - m12 * m12)
    return (m22 * fx - m12 * fy) * scale, (m11 * fy - m12 * fx) * scale


@leaf
def solve_regular(m11, m12, m22, fx, fy):
    """The same with A^T A; not a number at an input singularity, where nothing but rounding would be left.

    That is where singular values have a ratio below 3e-8, for A^T A squares it; `mechanics.cores`, which works on A
    itself, refuses below 1e-12.
    """
    det, trace = m11 * m22 - m12 * m12, m11 + m22
    scale = 1.0 / (det if det > 1e-15 * (trace * trace) else math.nan)
    return (m22 * fx - m12 * fy) * scale, (m11 * fy - m12 * fx) * scale


@leaf
def small_angle(s):
    """arcsin(s) for |s| < 0.1 by its series: the next term is below 2e-18 of the first."""
    z = s * s
    z2 = z * z
    # In pairs, so that less waits for each other.
    low = (1.0 + z * (1 / 6)) + z2 * (3 / 40 + z * (5 / 112))
    high = (35 / 1152 + z * (63 / 2816)) + z2 * (231 / 13312 + z * (143 / 10240))
    return s * (low + z2 * z2 * high)


@leaf
def smooth_sign(z):
    """tanh(z) without branches: (e^u - 1) / (e^u + 1) at u = -2 |z| = k ln 2 + r, k a whole number.

    e^r = (p + q) / (p - q) with Pade's p and q of order six, which for |r| <= ln 2 / 2 leave 2e-19.
    """
    u = max(-2.0 * abs(z), -40.0)
    shifted = u * (1.0 / math.log(2.0)) + SHIFT
    r = u - (shifted - SHIFT) * math.log(2.0)
    r2 = r * r
    p = (665280.0 + 75600.0 * r2) + (r2 * r2) * (840.0 + r2)
    q = r * (332640.0 + r2 * (10080.0 + 42.0 * r2))
    scale = power(shifted)
    less, more = scale - 1.0, scale + 1.0
    t = (less * p + more * q) / (more * p + less * q)
    return -t if z > 0.0 else t


# In plain Python the library's is sooner done.
tanh = smooth_sign if COMPILED else math.tanh


@leaf
def geometry(base_x, base_y, l1sq, half, mode, x, y):
    """An arm with its tip at (x, y): its links b, l, a.d, 1 / (a x d), a x d; and (a x d)^2, which is not positive
    outside the reach.

    r is the way from the base to the tip.  With r' = (r_y, -r_x) the links are a = k r + h r' and d = (1 - k) r - h r';
    as a x d = h r^2, the part of b and l along r' is -1 / r^2 and 1 / r^2, whatever the root.  One division serves all.
    """
    X, Y = x - base_x, y - base_y
    rho2 = X * X + Y * Y
    # kappa = a.r, and a.d = a.r - a.a.
    kappa = 0.5 * rho2 + half
    area2 = l1sq * rho2 - kappa * kappa
    inside = max(area2, 1e-300)
    root, quotient = math.sqrt(inside), mode / (rho2 * inside)
    # Arms that only fill up a row have mode 0: all of theirs is zero.
    across = mode * inside * quotient
    scale = root * quotient
    inv, far, turnX, turnY = rho2 * scale, (rho2 - kappa) * scale, across * X, across * Y
    near = inv - far  # for a + d = r
    bx, by = far * X - turnY, far * Y + turnX
    lx, ly = near * X + turnY, near * Y - turnX
    return (bx, by, lx, ly, kappa - l1sq, inv, mode * root), area2


@leaf
def turned(links, ux, uy):
    """Sine and cosine of the angle from a vector u to the proximal link a, times the lengths of both."""
    _, _, lx, ly, _, _, den = links
    ax, ay = den * lx, den * ly
    return ux * ay - uy * ax, ux * ax + uy * ay


@leaf
def accelerations(base, back, base_ref, back_ref, ad, inv, l1sq, l2sq):
    """Of the proximal link and, with the opposite sign, of the distal link at zero xdd; `back` is l.v.

    Bilinear in the rates and the reference rates, which are the same but in APD laws.
    """
    base2, back2 = base * base_ref * inv, back * back_ref * inv
    return base2 * ad + back2 * l2sq, base2 * l1sq + back2 * ad


@leaf
def inertia(s1, s2, tip, bx, by, lx, ly, base_acc, back_acc):
    """Share of an arm in the mass matrix and in the force at zero xdd: m11, m12, m22, fx, fy."""
    sx, sy, tx, ty = s1 * bx, s1 * by, s2 * lx, s2 * ly
    m11, m12, m22 = tip + sx * bx + tx * lx, sx * by + tx * ly, tip + sy * by + ty * ly
    return m11, m12, m22, -(sx * base_acc + tx * back_acc), -(sy * base_acc + ty * back_acc)


@leaf
def weight(w1, w2, gx, gy, links):
    """Force of gravity (gx, gy) on an arm at its tip."""
    bx, by, lx, ly, _, _, den = links
    drive, distal = w1 * den * (gx * ly - gy * lx), w2 * den * (gx * by - gy * bx)
    return lx * distal - bx * drive, ly * distal - by * drive


@leaf
def share(s1, s2, tip, l1sq, l2sq, links, vx, vy):
    """An arm in the equations of motion: m11, m12, m22, fx, fy of `inertia`; b; base rate and its part of the base
    acceleration at zero xdd; cotangent of the elbow angle, and its rate; a x d decays with the product of both."""
    bx, by, lx, ly, ad, inv, _ = links
    base, back = bx * vx + by * vy, lx * vx + ly * vy
    base_acc, back_acc = accelerations(base, back, base, back, ad, inv, l1sq, l2sq)
    m11, m12, m22, fx, fy = inertia(s1, s2, tip, bx, by, lx, ly, base_acc, back_acc)
    return m11, m12, m22, fx, fy, bx, by, base, base_acc, ad * inv, base + back


@leaf
def steep(cotangent, rate, dt):
    """Above one where an arm is so near to its stretched or folded pose, or will be in a hold, that `edge` has to look:
    where its elbow's sine may change by more than a twentieth, at its rate or at 5000 rad/s^2, or is below 0.3."""
    return abs(cotangent) * (20.0 * dt * (abs(rate) + 2500.0 * dt) + 0.3)


@leaf
def curvature(l2sq, links, r):
    """Share of an arm of residual r in the Hessian of half the squared error of the pose: m11, m12, m22 of
    b b^T - r d2 q / dx2, with the second derivative (a.d b b^T + l2^2 l l^T) / (a x d) of the base angle."""
    bx, by, lx, ly, ad, inv, _ = links
    h = r * inv
    g1, g2 = 1.0 - h * ad, h * l2sq
    return g1 * bx * bx - g2 * lx * lx, g1 * bx * by - g2 * lx * ly, g1 * by * by - g2 * ly * ly


@leaf
def pose_terms(l2sq, scale, place, ux, uy, e):
    """An arm in the least-squares pose of the measured base angles: Hessian and gradient of half the squared error, and
    a number that is negative where the series does not hold or the arm does not reach.

    u : unit vector of the desired proximal link.  e : measured minus desired base angle, rad.
    """
    links, area2 = place
    bx, by = links[0], links[1]
    s, t = turned(links, scale * ux, scale * uy)
    near = min(min(0.1 - abs(s), t), area2)
    r = e - small_angle(s)
    # An arm that has turned right round has another r.
    return (*curvature(l2sq, links, r), bx * r, by * r, min(near, 3.0 - abs(r)))


@leaf
def moved(links, sx, sy):
    """Links after a small step (sx, sy) of the tip, to first order: each of them turns, by b.s and by -l.s."""
    bx, by, lx, ly, ad, inv, den = links
    base, back = bx * sx + by * sy, lx * sx + ly * sy
    bent = base + back
    grown = inv * ad * bent
    return (
        bx + grown * bx + back * by,
        by + grown * by - back * bx,
        lx + grown * lx - base * ly,
        ly + grown * ly + base * lx,
        ad + den * bent,
        inv + inv * grown,
        den - ad * bent,
    )


@leaf
def stiffness(friction, sharpness, inertia, b, rate, acc, k, dt):
    """What friction of a drive asks of a hold: lambda dt, steps across the bend, and 1 where the drive can pass zero.

    lambda : its share f_c / v0 b^T M^-1 b in the decay rate of creep, 1/s.  inertia : m11, m12, m22 of M.  k :
    acceleration of the end-effector.
    """
    (m11, m12, m22), (bx, by) = inertia, b
    gx, gy = solve2(m11, m12, m22, bx, by)
    yields = friction * (bx * gx + by * gy)
    qdd = abs(bx * k[0] + by * k[1] + acc)
    passes = abs(rate) < 20.0 / sharpness + (qdd + 2.0 * yields) * dt
    steps = min((qdd + yields) * dt * sharpness / FAST, yields * dt * dt / FINE)
    return yields * sharpness * dt, steps, 1.0 if passes and friction > 0.0 else 0.0
