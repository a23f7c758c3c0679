"""The machine under runs side by side: `sense` what it does at a sample, `hold` torques until the next one.

The end-effector position is the coordinate, regular everywhere inside the workspace, so that the loops stay closed.
Loops run over arms, then over runs; what is summed over the arms follows in a loop of its own.
"""

from __future__ import annotations

import math

from .arms import acting, moving, placed
from .jit import leaf, outlined
from .leaves import small_angle, solve2, steep, stiffness, turned
from .rows import *
from .tables import *

# Steps across the bend of friction have lambda h <= 1/2 where lambda dt < DECAY, else <= 1; and the most steps.
DECAY, MOST_STEPS = 6.0, 4000.0


@outlined
def sense(lanes, arms, extra, table, o, w):
    """Geometry, rates and shares of all arms, and the sine and cosine of their angles from the desired motion."""
    L, W = len(lanes), len(arms)
    for i in range(W):
        ux, uy, wanted = want(table, o, COS, i, W), want(table, o, SIN, i, W), want(table, o, RATE, i, W)
        for j in range(L):
            links, area2 = placed(0, w, i, j, W, L, w[of(X, j, W, L)], w[of(Y, j, W, L)])
            m11, m12, m22, fx, fy, bx, by, rate, acc, cotangent, bends = moving(
                extra, w, i, j, W, L, links, w[of(VX, j, W, L)], w[of(VY, j, W, L)]
            )
            scale = w[at(SCALE, i, j, W, L)]
            w[at(SINE, i, j, W, L)], w[at(COSINE, i, j, W, L)] = turned(links, scale * ux, scale * uy)
            w[at(COTANGENT, i, j, W, L)], w[at(BENDS, i, j, W, L)] = cotangent, bends
            w[at(QD, i, j, W, L)], w[at(ED, i, j, W, L)] = rate, rate - wanted
            w[at(B1, i, j, W, L)], w[at(B2, i, j, W, L)] = bx, by
            w[at(M11, i, j, W, L)], w[at(M12, i, j, W, L)], w[at(M22, i, j, W, L)] = m11, m12, m22
            w[at(FX, i, j, W, L)], w[at(FY, i, j, W, L)], w[at(LOW, i, j, W, L)] = fx, fy, area2
            if extra is not None:
                w[at(ACC, i, j, W, L)] = acc


@outlined
def compare(lanes, arms, table, o, w, dt):
    """Base angles of all arms and their errors; returns 0 where none is far from the desired motion or near the edge.

    Apart from `sense`: together they need more vector registers than there are.
    """
    L, W = len(lanes), len(arms)
    count = 0
    for i in range(W):
        wanted = want(table, o, ANGLE, i, W)
        for j in range(L):
            # By a series; `mend` replaces angles that are not near.
            s, t = w[at(SINE, i, j, W, L)], w[at(COSINE, i, j, W, L)]
            edge = steep(w[at(COTANGENT, i, j, W, L)], w[at(BENDS, i, j, W, L)], dt)
            w[at(NEAR, i, j, W, L)] = min(min(0.1 - abs(s), t), 1.0 - edge)
            angle = small_angle(s)
            w[at(Q, i, j, W, L)], w[at(E, i, j, W, L)] = wanted + angle, angle + w[at(OFFSET, i, j, W, L)]
    for p in range(W * L):
        count += 1 if w[NEAR * W * L + p] < 0.0 else 0
    for j in range(L):
        count += 1 if w[of(AROUND, j, W, L)] > 0.0 else 0
    return count


@leaf
def mend(lanes, arms, table, o, w):
    """Base angles of arms more than 0.1 rad from the desired motion, by the arc tangent, on the turn of the sample
    before; where that is not the nearest to the desired one, AROUND says so."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        around = 0.0
        for i in range(W):
            if w[at(NEAR, i, j, W, L)] < 0.0 or w[of(AROUND, j, W, L)] > 0.0:
                wanted = want(table, o, ANGLE, i, W)
                links, _ = placed(0, w, i, j, W, L, w[of(X, j, W, L)], w[of(Y, j, W, L)])
                s, t = turned(links, want(table, o, COS, i, W), want(table, o, SIN, i, W))
                angle = math.atan2(s, t)
                turns = math.floor((w[at(OLD, i, j, W, L)] - wanted - angle) / (2.0 * math.pi) + 0.5)
                angle += 2.0 * math.pi * turns
                around = max(around, abs(turns))
                w[at(Q, i, j, W, L)] = wanted + angle
                w[at(E, i, j, W, L)] = angle + w[at(OFFSET, i, j, W, L)]
        w[of(AROUND, j, W, L)] = around


@outlined
def pull(lanes, arms, extra, row, w):
    """Shares of all arms at the state of a stage, under the torques in a row."""
    L, W = len(lanes), len(arms)
    for i in range(W):
        for j in range(L):
            links, area2 = placed(0, w, i, j, W, L, w[of(SX, j, W, L)], w[of(SY, j, W, L)])
            m11, m12, m22, fx, fy, bx, by, rate, _, _, _ = moving(
                extra, w, i, j, W, L, links, w[of(SVX, j, W, L)], w[of(SVY, j, W, L)]
            )
            c = acting(extra, w, i * L + j, W * L, row, rate, w[of(BEND, j, W, L)])
            w[at(M11, i, j, W, L)], w[at(M12, i, j, W, L)], w[at(M22, i, j, W, L)] = m11, m12, m22
            w[at(FX, i, j, W, L)], w[at(FY, i, j, W, L)] = fx + bx * c, fy + by * c
            low = min(w[at(LOW, i, j, W, L)], area2)
            if extra is not None:
                # A run that waits for others has ended its hold, and is not looked at there before its next sample.
                low = low if w[of(STEP, j, W, L)] > 0.0 else w[at(LOW, i, j, W, L)]
            w[at(LOW, i, j, W, L)] = low


@leaf
def joined(arms, w, j, W, L):
    """End-effector acceleration of a run from the shares of its arms."""
    m11 = m12 = m22 = fx = fy = -0.0
    for i in range(len(arms)):
        m11, m12, m22 = m11 + w[at(M11, i, j, W, L)], m12 + w[at(M12, i, j, W, L)], m22 + w[at(M22, i, j, W, L)]
        fx, fy = fx + w[at(FX, i, j, W, L)], fy + w[at(FY, i, j, W, L)]
    return solve2(m11, m12, m22, fx, fy)


@outlined
def count_steps(lanes, arms, extra, w, dt):
    """Steps of equal length that each run needs in a hold because of friction, and BEND, 0.0 where all its drives move
    so fast that friction is constant; returns the largest number, or 0.0 where that is so in all runs."""
    L, W = len(lanes), len(arms)
    most = 0.0
    for j in range(L):
        sharpness, m11, m12, m22 = w[of(SHARPNESS, j, W, L)], -0.0, -0.0, -0.0
        for i in range(W):
            m11, m12, m22 = m11 + w[at(M11, i, j, W, L)], m12 + w[at(M12, i, j, W, L)], m22 + w[at(M22, i, j, W, L)]
        stiff, fast, near = 0.0, 0.0, 0.0
        for i in range(W):
            f, row = w[at(FRICTION, i, j, W, L)], (w[at(B1, i, j, W, L)], w[at(B2, i, j, W, L)])
            rate, acc, k = w[at(QD, i, j, W, L)], w[at(ACC, i, j, W, L)], (w[of(KX, j, W, L)], w[of(KY, j, W, L)])
            a, b, c = stiffness(f, sharpness, (m11, m12, m22), row, rate, acc, k, dt)
            stiff, fast, near = stiff + a, max(fast, b * c), max(near, c)
        n = near * max(1.0, math.ceil(max(stiff + min(stiff, DECAY), min(fast, MOST_STEPS))))
        w[of(STEPS, j, W, L)] = max(1.0, n)
        w[of(BEND, j, W, L)] = 0.0 if n == 0.0 and len(extra) == 0 else sharpness
        w[of(STEP, j, W, L)] = dt / max(1.0, n)
        # A run beyond the limit takes one step and is judged afterwards.
        most = max(most, n if w[of(STATUS, j, W, L)] == DONE and n <= MOST_STEPS else min(n, 1.0))
    return most


@outlined
def first_stage(lanes, arms, w):
    """Begin the sums of a step of length STEP, and go half of it ahead."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        h = 0.5 * w[of(STEP, j, W, L)]
        vx, vy, kx, ky = w[of(VX, j, W, L)], w[of(VY, j, W, L)], w[of(KX, j, W, L)], w[of(KY, j, W, L)]
        w[of(TX, j, W, L)], w[of(TY, j, W, L)], w[of(TVX, j, W, L)], w[of(TVY, j, W, L)] = vx, vy, kx, ky
        w[of(SX, j, W, L)], w[of(SY, j, W, L)] = w[of(X, j, W, L)] + h * vx, w[of(Y, j, W, L)] + h * vy
        w[of(SVX, j, W, L)], w[of(SVY, j, W, L)] = vx + h * kx, vy + h * ky


@outlined
def stage(lanes, arms, w, part):
    """Add a stage to the sums, and go a part of the step ahead."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        h = part * w[of(STEP, j, W, L)]
        kx, ky = joined(arms, w, j, W, L)
        vx, vy = w[of(SVX, j, W, L)], w[of(SVY, j, W, L)]
        w[of(TX, j, W, L)] += 2.0 * vx
        w[of(TY, j, W, L)] += 2.0 * vy
        w[of(TVX, j, W, L)] += 2.0 * kx
        w[of(TVY, j, W, L)] += 2.0 * ky
        w[of(SX, j, W, L)], w[of(SY, j, W, L)] = w[of(X, j, W, L)] + h * vx, w[of(Y, j, W, L)] + h * vy
        w[of(SVX, j, W, L)], w[of(SVY, j, W, L)] = w[of(VX, j, W, L)] + h * kx, w[of(VY, j, W, L)] + h * ky


@outlined
def last_stage(lanes, arms, extra, w):
    """The state at the end of the step; no step leads nowhere, also where accelerations are endless."""
    L, W = len(lanes), len(arms)
    for j in range(L):
        h = w[of(STEP, j, W, L)] / 6.0
        kx, ky = joined(arms, w, j, W, L)
        x = w[of(X, j, W, L)] + h * (w[of(TX, j, W, L)] + w[of(SVX, j, W, L)])
        y = w[of(Y, j, W, L)] + h * (w[of(TY, j, W, L)] + w[of(SVY, j, W, L)])
        vx = w[of(VX, j, W, L)] + h * (w[of(TVX, j, W, L)] + kx)
        vy = w[of(VY, j, W, L)] + h * (w[of(TVY, j, W, L)] + ky)
        if extra is not None:
            x, y = x if h > 0.0 else w[of(X, j, W, L)], y if h > 0.0 else w[of(Y, j, W, L)]
            vx, vy = vx if h > 0.0 else w[of(VX, j, W, L)], vy if h > 0.0 else w[of(VY, j, W, L)]
        w[of(X, j, W, L)], w[of(Y, j, W, L)], w[of(VX, j, W, L)], w[of(VY, j, W, L)] = x, y, vx, vy


@leaf
def step(lanes, arms, extra, row, w):
    """A Runge-Kutta step (order 4) of length STEP after the accelerations KX, KY of its first stage, under the torques
    in a row.

    Few and long loops over the runs: short ones would be unrolled before they could become vector instructions.
    """
    first_stage(lanes, arms, w)
    for part in (0.5, 1.0):
        pull(lanes, arms, extra, row, w)
        stage(lanes, arms, w, part)
    pull(lanes, arms, extra, row, w)
    last_stage(lanes, arms, extra, w)


@outlined
def begin_hold(lanes, arms, extra, w, dt):
    """The accelerations KX, KY of the first stage, with the shares of `sense` and the torques of the hold."""
    L, W = len(lanes), len(arms)
    for i in range(W):
        for j in range(L):
            p, P = i * L + j, W * L
            c = acting(extra, w, p, P, C, w[QD * P + p], w[of(SHARPNESS, j, W, L)])
            w[FX * P + p] += w[B1 * P + p] * c
            w[FY * P + p] += w[B2 * P + p] * c
    for j in range(L):
        w[of(KX, j, W, L)], w[of(KY, j, W, L)] = joined(arms, w, j, W, L)
        w[of(STEP, j, W, L)], w[of(STEPS, j, W, L)] = dt, 1.0


@outlined
def constant_friction(lanes, arms, w):
    """The torques PUSH: C, less friction in runs all of whose drives move so fast that it is constant in the hold.

    Whether it is must not hang on the neighbours of a run: small steps round otherwise.
    """
    L, W = len(lanes), len(arms)
    for i in range(W):
        for j in range(L):
            c, constant = w[at(C, i, j, W, L)], w[of(BEND, j, W, L)] == 0.0
            f = math.copysign(w[at(FRICTION, i, j, W, L)], w[at(QD, i, j, W, L)])
            w[at(PUSH, i, j, W, L)] = c - f if constant else c


@leaf
def small_steps(lanes, arms, extra, w, most):
    """A hold in as many steps as friction asks for; a run that needs fewer stands still while others go on."""
    L, W = len(lanes), len(arms)
    step(lanes, arms, extra, PUSH, w)
    for s in range(1, int(most)):
        for j in range(L):
            w[of(STEP, j, W, L)] = w[of(STEP, j, W, L)] if s < w[of(STEPS, j, W, L)] else 0.0
            w[of(SX, j, W, L)], w[of(SY, j, W, L)] = w[of(X, j, W, L)], w[of(Y, j, W, L)]
            w[of(SVX, j, W, L)], w[of(SVY, j, W, L)] = w[of(VX, j, W, L)], w[of(VY, j, W, L)]
        pull(lanes, arms, extra, PUSH, w)
        for j in range(L):
            w[of(KX, j, W, L)], w[of(KY, j, W, L)] = joined(arms, w, j, W, L)
        step(lanes, arms, extra, PUSH, w)


@leaf
def hold(lanes, arms, extra, w, dt):
    """Hold the torques C for dt."""
    begin_hold(lanes, arms, extra, w, dt)
    if extra is None:
        step(lanes, arms, extra, C, w)
    if extra is not None:
        most = count_steps(lanes, arms, extra, w, dt)
        constant_friction(lanes, arms, w)
        if most == 0.0 and len(extra) == 0:
            step(lanes, arms, None, PUSH, w)
        else:
            small_steps(lanes, arms, extra, w, most)


@outlined
def judge(lanes, arms, w, k):
    """Mark the runs lost in the hold after sample k, or before it by their law; returns how many have ended."""
    L, W = len(lanes), len(arms)
    ended = 0
    for j in range(L):
        low, torque = w[at(LOW, 0, j, W, L)], abs(w[at(C, 0, j, W, L)])
        for i in range(1, W):
            low, torque = min(low, w[at(LOW, i, j, W, L)]), torque + abs(w[at(C, i, j, W, L)])
        size = (abs(w[of(X, j, W, L)]) + abs(w[of(Y, j, W, L)])) + (abs(w[of(VX, j, W, L)]) + abs(w[of(VY, j, W, L)]))
        status = DONE if low > 0.0 and size < 1e300 else LEFT_WORKSPACE
        status = status if torque < 1e300 else SINGULAR
        status = status if w[of(STEPS, j, W, L)] <= MOST_STEPS else TOO_STIFF
        running = w[of(STATUS, j, W, L)] == DONE
        w[of(SAMPLE, j, W, L)] = k if running else w[of(SAMPLE, j, W, L)]
        w[of(STATUS, j, W, L)] = status if running else w[of(STATUS, j, W, L)]
        ended += 1 if w[of(STATUS, j, W, L)] != DONE else 0
    return ended
