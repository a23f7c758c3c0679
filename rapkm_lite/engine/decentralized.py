"""Laws of the drives alone, PD and PID, and the antagonism filters around whatever stands in C."""

from __future__ import annotations

from .jit import outlined
from .leaves import solve_regular
from .rows import *


@outlined
def proportional(lanes, arms, w):
    """PD (12)."""
    P = len(arms) * len(lanes)
    for p in range(P):
        w[C * P + p] = -(w[GAIN_P * P + p] * w[E * P + p] + w[GAIN_D * P + p] * w[ED * P + p])


@outlined
def integral(lanes, arms, w, dt):
    """PD with an integral that stands still while its drive is at the limit."""
    P = len(arms) * len(lanes)
    for p in range(P):
        e, ed, limit = w[E * P + p], w[ED * P + p], w[LIMIT * P + p]
        grown = w[MEMORY * P + p] + w[GAIN_I * P + p] * dt * e
        c = -(w[GAIN_P * P + p] * e + w[GAIN_D * P + p] * ed + grown)
        held = min(max(c, -limit), limit)
        w[C * P + p], w[MEMORY * P + p] = held, grown if held == c else w[MEMORY * P + p]


@outlined
def force_filter(lanes, drives, arms, w):
    """The filter (16) of whatever stands in C, weighted where W is not the identity."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        m11 = m12 = m22 = fx = fy = -0.0
        for i in range(N):
            a1, a2 = w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)]
            c, ease = w[at(C, i, j, W, L)], w[at(EASE, i, j, W, L)]
            m11, m12, m22 = m11 + ease * a1 * a1, m12 + ease * a1 * a2, m22 + ease * a2 * a2
            fx, fy = fx + a1 * c, fy + a2 * c
        gx, gy = solve_regular(m11, m12, m22, fx, fy)
        for i in range(N):
            w[at(C, i, j, W, L)] = w[at(EASE, i, j, W, L)] * (w[at(A1, i, j, W, L)] * gx + w[at(A2, i, j, W, L)] * gy)


@outlined
def command_filter(lanes, drives, arms, w):
    """PD drives with filtered commands (17)-(18)."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        m11 = m12 = m22 = fx = fy = n11 = n12 = n22 = hx = hy = -0.0
        for i in range(N):
            p, d = w[at(GAIN_P, i, j, W, L)], w[at(GAIN_D, i, j, W, L)]
            a1, a2 = w[at(A1, i, j, W, L)], w[at(A2, i, j, W, L)]
            e, ed, pp, dd = p * w[at(E, i, j, W, L)], d * w[at(ED, i, j, W, L)], p * p, d * d
            m11, m12, m22, fx, fy = m11 + pp * a1 * a1, m12 + pp * a1 * a2, m22 + pp * a2 * a2, fx + a1 * e, fy + a2 * e
            n11, n12, n22 = n11 + dd * a1 * a1, n12 + dd * a1 * a2, n22 + dd * a2 * a2
            hx, hy = hx + a1 * ed, hy + a2 * ed
        gx, gy = solve_regular(m11, m12, m22, fx, fy)
        rx, ry = solve_regular(n11, n12, n22, hx, hy)
        for i in range(N):
            p, d = w[at(GAIN_P, i, j, W, L)], w[at(GAIN_D, i, j, W, L)]
            w[at(C, i, j, W, L)] = -(
                w[at(A1, i, j, W, L)] * (p * p * gx + d * d * rx) + w[at(A2, i, j, W, L)] * (p * p * gy + d * d * ry)
            )
