"""Holds near the edge of the workspace, in as many steps as an arm needs that is about to stretch or fold, or was.

In end-effector coordinates the inertia grows without limit there, and one Runge-Kutta step would leap over the instant,
as if the machine had bounced off, or go off with a wrong rate.  Here each step changes the sine of no elbow by more
than a small share: where an arm approaches the edge until such steps shrink to nothing, the run is lost.
"""

from __future__ import annotations

import math

from .arms import acting, moving, placed
from .jit import leaf, outlined
from .leaves import accelerations, steep
from .plant import MOST_STEPS, asked, joined
from .rows import *
from .tables import *

# Largest change of an elbow's sine, as a share, in a hold of one step, and in each step where there are more; the
# shortest step, as a share of the hold.
WHOLE, PART, SHORTEST = 0.05, 0.02, 1e-5


@outlined
def watch(lanes, arms, extra, w, dt):
    """Remember the state of each run at a sample, and in NEAR_EDGE the steepest of its arms."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        w[of(WAS_X, j, W, L)], w[of(WAS_Y, j, W, L)] = w[of(X, j, W, L)], w[of(Y, j, W, L)]
        w[of(WAS_VX, j, W, L)], w[of(WAS_VY, j, W, L)] = w[of(VX, j, W, L)], w[of(VY, j, W, L)]
        w[of(NEAR_EDGE, j, W, L)] = 0.0
    for i in range(W):
        for j in range(L):
            links, _ = placed(0, w, i, j, W, L, w[of(X, j, W, L)], w[of(Y, j, W, L)])
            arm = moving(extra, w, i, j, W, L, links, w[of(VX, j, W, L)], w[of(VY, j, W, L)])
            w[of(NEAR_EDGE, j, W, L)] = max(w[of(NEAR_EDGE, j, W, L)], steep(arm[9], arm[10], dt))


@leaf
def pushed(lanes, arms, extra, w, j, x, y, vx, vy):
    """Acceleration of run j at a state under the torques C."""
    L, W = len(lanes), len(arms)
    for i in range(W):
        links, area2 = placed(0, w, i, j, W, L, x, y)
        m11, m12, m22, fx, fy, bx, by, rate, acc, _, _ = moving(extra, w, i, j, W, L, links, vx, vy)
        c = acting(extra, w, i * L + j, W * L, C, rate, w[of(SHARPNESS, j, W, L)])
        w[at(M11, i, j, W, L)], w[at(M12, i, j, W, L)], w[at(M22, i, j, W, L)] = m11, m12, m22
        w[at(FX, i, j, W, L)], w[at(FY, i, j, W, L)] = fx + bx * c, fy + by * c
        w[at(B1, i, j, W, L)], w[at(B2, i, j, W, L)] = bx, by
        w[at(QD, i, j, W, L)], w[at(ACC, i, j, W, L)] = rate, acc
        w[at(LOW, i, j, W, L)] = min(w[at(LOW, i, j, W, L)], area2)
    return joined(arms, w, j, W, L)


@leaf
def longest(lanes, arms, w, j, x, y, vx, vy, kx, ky, share):
    """The longest step in s in which no elbow's sine of run j changes by more than a share, accelerated by (kx, ky),
    and whether the arm that says so goes towards the edge."""
    L, W = len(lanes), len(arms)
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


@leaf
def beyond(arms, w, j, W, L):
    """Does an arm not reach the state of a stage, or is the state none?"""
    low = w[at(LOW, 0, j, W, L)]
    for i in range(1, W):
        low = min(low, w[at(LOW, i, j, W, L)])
    return not low > 0.0


@outlined
def walk(lanes, arms, extra, w, j, dt):
    """Hold the torques C of run j for dt, from the state that `watch` remembered."""
    L, W = len(lanes), len(arms)
    x, y = w[of(WAS_X, j, W, L)], w[of(WAS_Y, j, W, L)]
    vx, vy = w[of(WAS_VX, j, W, L)], w[of(WAS_VY, j, W, L)]
    for i in range(W):
        w[at(LOW, i, j, W, L)] = 1.0
    w[of(STEPS, j, W, L)] = 1.0
    left = dt
    while left > 0.0:
        k1x, k1y = pushed(lanes, arms, extra, w, j, x, y, vx, vy)
        n = 1.0 if extra is None else max(1.0, asked(arms, w, j, W, L, k1x, k1y, left))
        h, closes = longest(lanes, arms, w, j, x, y, vx, vy, k1x, k1y, PART)
        h = min(h, left / n)
        if n > MOST_STEPS or (closes and h < left and h < SHORTEST * dt) or beyond(arms, w, j, W, L):
            # Friction is too stiff, or the arm is there.
            w[of(STEPS, j, W, L)] = n
            w[at(LOW, 0, j, W, L)] = -1.0
            left = 0.0
        else:
            g, s = 0.5 * h, h / 6.0
            ux, uy = vx + g * k1x, vy + g * k1y
            k2x, k2y = pushed(lanes, arms, extra, w, j, x + g * vx, y + g * vy, ux, uy)
            px, py = vx + g * k2x, vy + g * k2y
            k3x, k3y = pushed(lanes, arms, extra, w, j, x + g * ux, y + g * uy, px, py)
            zx, zy = vx + h * k3x, vy + h * k3y
            k4x, k4y = pushed(lanes, arms, extra, w, j, x + h * px, y + h * py, zx, zy)
            x, y = x + s * (vx + 2.0 * (ux + px) + zx), y + s * (vy + 2.0 * (uy + py) + zy)
            vx, vy = vx + s * (k1x + 2.0 * (k2x + k3x) + k4x), vy + s * (k1y + 2.0 * (k2y + k3y) + k4y)
            left -= h
    w[of(X, j, W, L)], w[of(Y, j, W, L)], w[of(VX, j, W, L)], w[of(VY, j, W, L)] = x, y, vx, vy


@outlined
def hold(lanes, arms, extra, w, dt):
    """Once more the hold of the runs that one step is too long for, and of no others: a run does not feel its
    neighbours."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        if w[of(STATUS, j, W, L)] == DONE and w[of(NEAR_EDGE, j, W, L)] > 1.0:
            x, y = w[of(WAS_X, j, W, L)], w[of(WAS_Y, j, W, L)]
            vx, vy = w[of(WAS_VX, j, W, L)], w[of(WAS_VY, j, W, L)]
            kx, ky = pushed(lanes, arms, extra, w, j, x, y, vx, vy)
            if longest(lanes, arms, w, j, x, y, vx, vy, kx, ky, WHOLE)[0] < dt:
                walk(lanes, arms, extra, w, j, dt)
