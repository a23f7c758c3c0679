"""Holds near the edge of the workspace, in as many steps as an arm needs that is about to stretch or fold, or was.

In end-effector coordinates the inertia grows without limit there, and one Runge-Kutta step would leap over the instant,
as if the machine had bounced off, or go off with a wrong rate.  Here each step changes the sine of no elbow by more
than a small share: where an arm approaches the edge until such steps shrink to nothing, the run is lost.

These functions are compiled once for all kinds of runs, and so know neither how many arms and runs there are nor what
the machine has: friction and gravity may be zero.
"""

from __future__ import annotations

import math

from .arms import acting, moving, placed
from .jit import outlined
from .leaves import accelerations, solve2, steep
from .plant import MOST_STEPS
from .rows import *
from .tables import *

# Largest change of an elbow's sine, as a share, in a hold of one step, and in each step where there are more; the
# shortest steps towards the edge and away from it, as shares of the hold.
WHOLE, PART, SHORTEST, LEAST = 0.05, 0.02, 1e-5, 1e-8
ALL_FORCES = ((),)


@outlined
def watch(w, W, L, dt):
    """Remember the state of each run at a sample, and in NEAR_EDGE the steepest of its arms."""
    for j in range(L):
        w[of(WAS_X, j, W, L)], w[of(WAS_Y, j, W, L)] = w[of(X, j, W, L)], w[of(Y, j, W, L)]
        w[of(WAS_VX, j, W, L)], w[of(WAS_VY, j, W, L)] = w[of(VX, j, W, L)], w[of(VY, j, W, L)]
        w[of(NEAR_EDGE, j, W, L)] = 0.0
    for i in range(W):
        for j in range(L):
            links, _ = placed(0, w, i, j, W, L, w[of(X, j, W, L)], w[of(Y, j, W, L)])
            arm = moving(ALL_FORCES, w, i, j, W, L, links, w[of(VX, j, W, L)], w[of(VY, j, W, L)])
            w[of(NEAR_EDGE, j, W, L)] = max(w[of(NEAR_EDGE, j, W, L)], steep(arm[9], arm[10], dt))


@outlined
def pushed(w, j, W, L, x, y, vx, vy):
    """Acceleration of run j at a state under the torques C, and a number that is not positive where an arm does not
    reach."""
    m11 = m12 = m22 = fx = fy = 0.0
    low = 1.0
    for i in range(W):
        links, area2 = placed(0, w, i, j, W, L, x, y)
        a, b, d, px, py, bx, by, rate, _, _, _ = moving(ALL_FORCES, w, i, j, W, L, links, vx, vy)
        c = acting(ALL_FORCES, w, i * L + j, W * L, C, rate, w[of(SHARPNESS, j, W, L)])
        m11, m12, m22, fx, fy = m11 + a, m12 + b, m22 + d, fx + px + bx * c, fy + py + by * c
        low = min(low, area2)
    kx, ky = solve2(m11, m12, m22, fx, fy)
    return kx, ky, low


@outlined
def longest(w, j, W, L, x, y, vx, vy, kx, ky, share):
    """The longest step in s in which no elbow's sine of run j changes by more than a share, accelerated by (kx, ky),
    and whether the arm that says so goes towards the edge."""
    most, closes = 0.0, False
    for i in range(W):
        (bx, by, lx, ly, ad, inv, _), _ = placed(0, w, i, j, W, L, x, y)
        base, back = bx * vx + by * vy, lx * vx + ly * vy
        l1sq, l2sq = w[at(L1SQ, i, j, W, L)], w[at(L2SQ, i, j, W, L)]
        base_acc, back_acc = accelerations(base, back, base, back, ad, inv, l1sq, l2sq)
        bends = (bx + lx) * kx + (by + ly) * ky + base_acc + back_acc
        rate, growth = ad * inv * (base + back), abs(ad * inv * bends)
        # rate h + growth h^2 / 2 = share
        need = abs(rate) + math.sqrt(rate * rate + 2.0 * share * growth)
        closes = rate > 0.0 if need > most else closes
        most = max(most, need)
    return 2.0 * share / max(most, 1e-300), closes


@outlined
def walk(w, j, W, L, dt):
    """Hold the torques C of run j once more, from the state that `watch` remembered, if one step is too long for it."""
    x, y = w[of(WAS_X, j, W, L)], w[of(WAS_Y, j, W, L)]
    vx, vy = w[of(WAS_VX, j, W, L)], w[of(WAS_VY, j, W, L)]
    kx, ky, low = pushed(w, j, W, L, x, y, vx, vy)
    if longest(w, j, W, L, x, y, vx, vy, kx, ky, WHOLE)[0] >= dt:
        return
    left = dt
    while left > 0.0:
        h, closes = longest(w, j, W, L, x, y, vx, vy, kx, ky, PART)
        # In as many steps at least as friction asks for; some time passes, whatever the accelerations.
        h = min(max(min(h, dt / max(1.0, w[of(STEPS, j, W, L)])), LEAST * dt), left)
        if not low > 0.0 or (closes and h < left and h < SHORTEST * dt):
            low, left = -1.0, 0.0
        else:
            g, s = 0.5 * h, h / 6.0
            ux, uy = vx + g * kx, vy + g * ky
            k2x, k2y, low2 = pushed(w, j, W, L, x + g * vx, y + g * vy, ux, uy)
            px, py = vx + g * k2x, vy + g * k2y
            k3x, k3y, low3 = pushed(w, j, W, L, x + g * ux, y + g * uy, px, py)
            zx, zy = vx + h * k3x, vy + h * k3y
            k4x, k4y, low4 = pushed(w, j, W, L, x + h * px, y + h * py, zx, zy)
            x, y = x + s * (vx + 2.0 * (ux + px) + zx), y + s * (vy + 2.0 * (uy + py) + zy)
            vx, vy = vx + s * (kx + 2.0 * (k2x + k3x) + k4x), vy + s * (ky + 2.0 * (k2y + k3y) + k4y)
            kx, ky, low = pushed(w, j, W, L, x, y, vx, vy)
            low = min(min(low, low2), min(low3, low4))
            left -= h
    w[of(X, j, W, L)], w[of(Y, j, W, L)], w[of(VX, j, W, L)], w[of(VY, j, W, L)] = x, y, vx, vy
    for i in range(W):
        w[at(LOW, i, j, W, L)] = low


@outlined
def hold(w, W, L, dt):
    """`walk` for the runs near the edge, and for no others: a run does not feel its neighbours."""
    for j in range(L):
        stiff = w[of(STEPS, j, W, L)] > MOST_STEPS
        if w[of(NEAR_EDGE, j, W, L)] > 1.0 and w[of(STATUS, j, W, L)] == DONE and not stiff:
            walk(w, j, W, L, dt)
