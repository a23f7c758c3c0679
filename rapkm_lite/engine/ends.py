"""How runs end: all of them, at their last torques, or where plain Python cannot go on."""

from __future__ import annotations

import traceback

from . import plant, single
from .jit import leaf, outlined
from .rows import *
from .tables import *


@leaf
def over(lanes, arms, extra, history, w, k):
    """Have all runs ended? A single one that is sound needs no judgement."""
    if history is not None:
        if single.sound(arms, extra, w):
            return False
    return plant.judge(lanes, arms, w, k) == len(lanes)


@outlined
def last_torque(lanes, drives, arms, w, k):
    """Mark runs whose last torques, which nothing follows, are not finite."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        size = 0.0
        for i in range(len(drives)):
            size += abs(w[at(C, i, j, W, L)])
        running = w[of(STATUS, j, W, L)] == DONE
        w[of(SAMPLE, j, W, L)] = k if running else w[of(SAMPLE, j, W, L)]
        w[of(STATUS, j, W, L)] = SINGULAR if running and not size < 1e300 else w[of(STATUS, j, W, L)]


def stopped(error):
    """How and when a run without a compiler ended by a division by zero or at an infinite angle: status and sample.

    In the hold of finite torques it is the machine that fails, before it the law.
    """
    frames = {frame.f_code.co_name: frame.f_locals for frame, _ in traceback.walk_tb(error.__traceback__)}
    loop = frames["closed_loops"]
    W, k = len(loop["kind"].arms), loop.get("k", loop["clock"].first)
    finite = all(abs(c) < 1e300 for c in loop["w"][C * W : C * W + W])
    return (LEFT_WORKSPACE if "hold" in frames and finite else SINGULAR), k
