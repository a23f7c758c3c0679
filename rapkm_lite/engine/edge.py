"""Holds near the edge of the workspace, in as many steps as the arm needs that is about to stretch or fold.

In end-effector coordinates the inertia grows without limit there, and one Runge-Kutta step would leap over the instant,
as if the machine had bounced off.  Here each step takes a share of the time that the arm has left at its present rate:
either the hold ends before that time does, or the steps shrink to nothing, and the run is lost.
"""

from __future__ import annotations

from .arms import acting, moving, placed
from .jit import leaf, outlined
from .plant import MOST_STEPS, SHARE, asked, joined
from .rows import *
from .tables import *

# The share of the time left that a step takes, and the shortest step, as a share of the hold.
PART, SHORTEST = 0.02, 1e-5


@outlined
def watch(lanes, arms, extra, w, dt):
    """Remember the state of each run at a sample, and whether an arm of it needs such a hold: NEAR_EDGE."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        x, y, vx, vy = w[of(X, j, W, L)], w[of(Y, j, W, L)], w[of(VX, j, W, L)], w[of(VY, j, W, L)]
        w[of(WAS_X, j, W, L)], w[of(WAS_Y, j, W, L)], w[of(WAS_VX, j, W, L)], w[of(WAS_VY, j, W, L)] = x, y, vx, vy
        most = 0.0
        for i in range(W):
            links, _ = placed(0, w, i, j, W, L, x, y)
            most = max(most, moving(extra, w, i, j, W, L, links, vx, vy)[9])
        w[of(NEAR_EDGE, j, W, L)] = 1.0 if dt * most > SHARE else 0.0


@leaf
def pushed(lanes, arms, extra, w, j, x, y, vx, vy):
    """Acceleration of run j at a state, and the largest decay rate of an elbow's sine in 1/s."""
    L, W = len(lanes), len(arms)
    most = 0.0
    for i in range(W):
        links, area2 = placed(0, w, i, j, W, L, x, y)
        m11, m12, m22, fx, fy, bx, by, rate, acc, decay = moving(extra, w, i, j, W, L, links, vx, vy)
        c = acting(extra, w, i * L + j, W * L, C, rate, w[of(SHARPNESS, j, W, L)])
        w[at(M11, i, j, W, L)], w[at(M12, i, j, W, L)], w[at(M22, i, j, W, L)] = m11, m12, m22
        w[at(FX, i, j, W, L)], w[at(FY, i, j, W, L)] = fx + bx * c, fy + by * c
        w[at(B1, i, j, W, L)], w[at(B2, i, j, W, L)] = bx, by
        w[at(QD, i, j, W, L)], w[at(ACC, i, j, W, L)] = rate, acc
        w[at(LOW, i, j, W, L)] = min(w[at(LOW, i, j, W, L)], area2)
        most = max(most, decay)
    kx, ky = joined(arms, w, j, W, L)
    return kx, ky, most


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
        k1x, k1y, most = pushed(lanes, arms, extra, w, j, x, y, vx, vy)
        n = 1.0 if extra is None else max(1.0, asked(arms, w, j, W, L, k1x, k1y, left))
        h = min(left / n, PART / max(most, PART / dt))
        if n > MOST_STEPS or (h < left and h < SHORTEST * dt) or beyond(arms, w, j, W, L):
            # Friction is too stiff, or the arm is there.
            w[of(STEPS, j, W, L)] = n
            w[at(LOW, 0, j, W, L)] = -1.0
            left = 0.0
        else:
            g, s = 0.5 * h, h / 6.0
            ux, uy = vx + g * k1x, vy + g * k1y
            k2x, k2y, _ = pushed(lanes, arms, extra, w, j, x + g * vx, y + g * vy, ux, uy)
            px, py = vx + g * k2x, vy + g * k2y
            k3x, k3y, _ = pushed(lanes, arms, extra, w, j, x + g * ux, y + g * uy, px, py)
            zx, zy = vx + h * k3x, vy + h * k3y
            k4x, k4y, _ = pushed(lanes, arms, extra, w, j, x + h * px, y + h * py, zx, zy)
            x, y = x + s * (vx + 2.0 * (ux + px) + zx), y + s * (vy + 2.0 * (uy + py) + zy)
            vx, vy = vx + s * (k1x + 2.0 * (k2x + k3x) + k4x), vy + s * (k1y + 2.0 * (k2y + k3y) + k4y)
            left -= h
    w[of(X, j, W, L)], w[of(Y, j, W, L)], w[of(VX, j, W, L)], w[of(VY, j, W, L)] = x, y, vx, vy


@outlined
def hold(lanes, arms, extra, w, dt):
    """Once more the hold of the runs that are near the edge, and of no others: a run does not feel its neighbours."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        if w[of(STATUS, j, W, L)] == DONE and w[of(NEAR_EDGE, j, W, L)] > 0.0:
            walk(lanes, arms, extra, w, j, dt)
