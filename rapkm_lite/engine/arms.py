"""The formulas of `leaves` for arm i of run j of the work table: of the machine, or of the controller's model."""

from __future__ import annotations

from .jit import index, leaf
from .leaves import geometry, share, tanh, weight
from .rows import *


@index
def placed(first, w, i, j, W, L, x, y):
    """`geometry` of an arm with its tip at (x, y).

    first : 0 for the machine, MODEL for the model.
    """
    P, p = W * L, at(first, i, j, W, L)
    return geometry(w[BX * P + p], w[BY * P + p], w[L1SQ * P + p], w[HALF * P + p], w[MODE * P + p], x, y)


@leaf
def moving(extra, w, i, j, W, L, links, vx, vy):
    """`share` of an arm of the machine at the velocity (vx, vy) of its tip, with gravity."""
    P, p = W * L, i * L + j
    m11, m12, m22, fx, fy, bx, by, rate, acc, cotangent, bends = share(
        w[S1 * P + p], w[S2 * P + p], w[TIP * P + p], w[L1SQ * P + p], w[L2SQ * P + p], links, vx, vy
    )
    if extra is not None and len(extra) > 0:
        gravity = w[of(GRAVITY_X, j, W, L)], w[of(GRAVITY_Y, j, W, L)]
        gx, gy = weight(w[at(W1, i, j, W, L)], w[at(W2, i, j, W, L)], *gravity, links)
        fx, fy = fx + gx, fy + gy
    return m11, m12, m22, fx, fy, bx, by, rate, acc, cotangent, bends


@leaf
def acting(extra, w, p, P, row, rate, sharpness):
    """Torque in a row, entry p of pair rows of P numbers, less the friction of its drive at this rate."""
    c = w[row * P + p]
    if extra is not None:
        c -= w[FRICTION * P + p] * tanh(rate * sharpness)
    return c


@leaf
def slow(w, p, P, sharpness):
    """Negative where the friction of a drive is not that of a drive that moves fast: tanh(20) is 1 to the last bit."""
    return abs(w[QD * P + p]) * sharpness - (20.0 if w[FRICTION * P + p] > 0.0 else 0.0)
