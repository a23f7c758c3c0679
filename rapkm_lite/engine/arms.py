"""The formulas of `leaves` for arm i of run j of the work table: of the machine, or of the controller's model."""

from __future__ import annotations

from .jit import index, leaf
from .leaves import drag, geometry, share
from .rows import *


@index
def placed(first, w, i, j, W, L, x, y):
    """`geometry` of an arm with its tip at (x, y).

    first : 0 for the machine, MODEL for the model.
    """
    return geometry(
        w[at(first + BX, i, j, W, L)],
        w[at(first + BY, i, j, W, L)],
        w[at(first + L1SQ, i, j, W, L)],
        w[at(first + HALF, i, j, W, L)],
        w[at(first + MODE, i, j, W, L)],
        x,
        y,
    )


@leaf
def surroundings(w, j, W, L):
    """Gravity vector, and the sharpness of the friction law, where the machine of a run stands."""
    return w[of(GRAVITY_X, j, W, L)], w[of(GRAVITY_Y, j, W, L)], w[of(SHARPNESS, j, W, L)]


@leaf
def moving(extra, w, i, j, W, L, env, links, vx, vy):
    """`share` of an arm of the machine at the velocity (vx, vy) of its tip, with gravity and friction."""
    m11, m12, m22, fx, fy, bx, by, rate, acc, decay = share(
        w[at(S1, i, j, W, L)], w[at(S2, i, j, W, L)], w[at(L1SQ, i, j, W, L)], w[at(L2SQ, i, j, W, L)], links, vx, vy
    )
    if extra is not None:
        gx, gy = drag(w[at(W1, i, j, W, L)], w[at(W2, i, j, W, L)], w[at(FRICTION, i, j, W, L)], env, links, rate)
        fx, fy = fx + gx, fy + gy
    return m11, m12, m22, fx, fy, bx, by, rate, acc, decay
