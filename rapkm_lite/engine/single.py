"""`sense` and `hold` of `plant` for one run, its arms side by side in a vector register and its state in scalars.

The place of a Runge-Kutta stage is known from the stage before the last one: its geometry is made one stage ahead, in
the same loop over the arms, and kept in the rows PLACE and OTHER in turn.  A processor then does both at once.
"""

from __future__ import annotations

import math

from . import edge
from .arms import acting, moving, placed, slow
from .jit import index, kernel, leaf, outlined
from .leaves import small_angle, solve2, steep, stiffness, turned
from .plant import DECAY, MOST_STEPS, judge, mend
from .rows import *
from .tables import *


@index
def fetch(block, W, table, o, w):
    """Copy a block of the desired motion into its row."""
    move(W, table, o + 6 + block * W, w, (MOTION + block) * W)


@index
def put_place(arms, place, w, i, x, y):
    """Keep the geometry of arm i, the end-effector at (x, y), in the rows from `place` on."""
    W = len(arms)
    (bx, by, lx, ly, ad, inv, den), area2 = placed(0, w, i, 0, W, 1, x, y)
    w[place * W + i], w[(place + 1) * W + i], w[(place + 2) * W + i], w[(place + 3) * W + i] = bx, by, lx, ly
    w[(place + 4) * W + i], w[(place + 5) * W + i] = ad, inv
    w[(place + 6) * W + i], w[(place + 7) * W + i] = den, area2


@index
def get_place(arms, place, w, i):
    """What `placed` gave of arm i, from the rows that `put_place` wrote."""
    W = len(arms)
    bx, by, lx, ly = w[place * W + i], w[(place + 1) * W + i], w[(place + 2) * W + i], w[(place + 3) * W + i]
    ad, inv, den = w[(place + 4) * W + i], w[(place + 5) * W + i], w[(place + 6) * W + i]
    return (bx, by, lx, ly, ad, inv, den), w[(place + 7) * W + i]


@outlined
def begin(arms, w):
    """The first place of a run."""
    W = len(arms)
    for i in range(W):
        put_place(arms, PLACE, w, i, w[of(X, 0, W, 1)], w[of(Y, 0, W, 1)])


@leaf
def sense(arms, extra, table, o, w, dt):
    """As `plant.sense`."""
    W = len(arms)
    x, y, vx, vy = w[of(X, 0, W, 1)], w[of(Y, 0, W, 1)], w[of(VX, 0, W, 1)], w[of(VY, 0, W, 1)]
    move(W, w, Q * W, w, OLD * W)
    for block in (ANGLE, RATE, COS, SIN):
        fetch(block, W, table, o, w)
    for i in range(W):
        links, area2 = get_place(arms, PLACE, w, i)
        m11, m12, m22, fx, fy, bx, by, rate, acc, cotangent, bends = moving(extra, w, i, 0, W, 1, links, vx, vy)
        scale = w[SCALE * W + i]
        s, t = turned(links, scale * desired(table, o, w, COS, i, W, 1), scale * desired(table, o, w, SIN, i, W, 1))
        w[NEAR * W + i] = min(min(0.1 - abs(s), t), 1.0 - steep(cotangent, bends, dt))
        angle = small_angle(s)
        w[Q * W + i], w[QD * W + i] = desired(table, o, w, ANGLE, i, W, 1) + angle, rate
        w[E * W + i], w[ED * W + i] = angle + w[OFFSET * W + i], rate - desired(table, o, w, RATE, i, W, 1)
        w[B1 * W + i], w[B2 * W + i] = bx, by
        w[M11 * W + i], w[M12 * W + i], w[M22 * W + i] = m11, m12, m22
        w[FX * W + i], w[FY * W + i] = fx, fy
        if extra is not None:
            w[ACC * W + i] = acc
        w[LOW * W + i] = area2
        put_place(arms, OTHER, w, i, x + 0.5 * dt * vx, y + 0.5 * dt * vy)
    near = w[NEAR * W]
    for i in range(1, W):
        near = min(near, w[NEAR * W + i])
    return 0 if near >= 0.0 and w[of(AROUND, 0, W, 1)] == 0.0 else 1


@leaf
def join(arms, w):
    """End-effector acceleration from the shares of the arms."""
    W = len(arms)
    return solve2(total(M11, w, W), total(M12, w, W), total(M22, w, W), total(FX, w, W), total(FY, w, W))


@index
def acceleration(arms, extra, row, place, other, w, vx, vy, x, y):
    """End-effector acceleration at a place under the torques in a row; the other one is put at (x, y)."""
    W = len(arms)
    sharpness = w[of(SHARPNESS, 0, W, 1)]
    for i in range(W):
        links, area2 = get_place(arms, place, w, i)
        m11, m12, m22, fx, fy, bx, by, rate, _, _, _ = moving(extra, w, i, 0, W, 1, links, vx, vy)
        c = acting(extra, w, i, W, row, rate, sharpness)
        w[M11 * W + i], w[M12 * W + i], w[M22 * W + i] = m11, m12, m22
        w[FX * W + i], w[FY * W + i] = fx + bx * c, fy + by * c
        w[LOW * W + i] = min(w[LOW * W + i], area2)
        put_place(arms, other, w, i, x, y)
    return join(arms, w)


@leaf
def step(arms, extra, row, w, x, y, vx, vy, k1x, k1y, dt):
    """A Runge-Kutta step (order 4) after its first stage, from PLACE to PLACE; half of it at rate v leads to OTHER."""
    h = 0.5 * dt
    ux, uy = vx + h * k1x, vy + h * k1y
    k2x, k2y = acceleration(arms, extra, row, OTHER, PLACE, w, ux, uy, x + h * ux, y + h * uy)
    wx, wy = vx + h * k2x, vy + h * k2y
    k3x, k3y = acceleration(arms, extra, row, PLACE, OTHER, w, wx, wy, x + dt * wx, y + dt * wy)
    zx, zy = vx + dt * k3x, vy + dt * k3y
    s = dt / 6.0
    x, y = x + s * (vx + 2.0 * (ux + wx) + zx), y + s * (vy + 2.0 * (uy + wy) + zy)
    k4x, k4y = acceleration(arms, extra, row, OTHER, PLACE, w, zx, zy, x, y)
    return x, y, vx + s * (k1x + 2.0 * (k2x + k3x) + k4x), vy + s * (k1y + 2.0 * (k2y + k3y) + k4y)


@outlined
def count_steps(arms, w, kx, ky, dt):
    """Steps that friction asks of a hold; 0.0 where all drives move so fast that friction is constant in it."""
    W = len(arms)
    sharpness, m11, m12, m22 = w[of(SHARPNESS, 0, W, 1)], total(M11, w, W), total(M12, w, W), total(M22, w, W)
    stiff, fast, near = 0.0, 0.0, 0.0
    for i in range(W):
        row, rate, acc = (w[B1 * W + i], w[B2 * W + i]), w[QD * W + i], w[ACC * W + i]
        a, b, c = stiffness(w[FRICTION * W + i], sharpness, (m11, m12, m22), row, rate, acc, (kx, ky), dt)
        stiff, fast, near = stiff + a, max(fast, b * c), max(near, c)
    return max(1.0, math.ceil(max(stiff + min(stiff, DECAY), min(fast, MOST_STEPS)))) if near > 0.0 else 0.0


@outlined
def friction_hold(arms, extra, w, k1x, k1y, dt):
    """The state after as many steps as friction needs, or as are allowed."""
    W = len(arms)
    x, y, vx, vy = w[of(X, 0, W, 1)], w[of(Y, 0, W, 1)], w[of(VX, 0, W, 1)], w[of(VY, 0, W, 1)]
    n = count_steps(arms, w, k1x, k1y, dt)
    w[of(STEPS, 0, W, 1)] = max(1.0, n)
    if n == 0.0 and len(extra) == 0:
        return step(arms, None, PUSH, w, x, y, vx, vy, k1x, k1y, dt)
    most = int(min(max(1.0, n), MOST_STEPS))
    h = dt / most
    for _ in range(most):
        if most > 1:
            k1x, k1y = acceleration(arms, extra, C, PLACE, OTHER, w, vx, vy, x + 0.5 * h * vx, y + 0.5 * h * vy)
        x, y, vx, vy = step(arms, extra, C, w, x, y, vx, vy, k1x, k1y, h)
    return x, y, vx, vy


@outlined
def brake(arms, extra, w):
    """The torques PUSH: C less friction at the rates of the sample."""
    W, sharpness = len(arms), w[of(SHARPNESS, 0, len(arms), 1)]
    least = slow(w, 0, W, sharpness)
    for i in range(1, W):
        least = min(least, slow(w, i, W, sharpness))
    if least >= 0.0:
        for i in range(W):
            w[PUSH * W + i] = w[C * W + i] - math.copysign(w[FRICTION * W + i], w[QD * W + i])
    else:
        for i in range(W):
            w[PUSH * W + i] = acting(extra, w, i, W, C, w[QD * W + i], sharpness)


@leaf
def hold(arms, extra, w, dt, far):
    """As `plant.hold`, without its judgement; `far` as `loop.sense` returns it."""
    W = len(arms)
    if extra is not None:
        brake(arms, extra, w)
    for i in range(W):
        c = w[C * W + i] if extra is None else w[PUSH * W + i]
        w[FX * W + i] += w[B1 * W + i] * c
        w[FY * W + i] += w[B2 * W + i] * c
    k1x, k1y = join(arms, w)
    if extra is not None:
        x, y, vx, vy = friction_hold(arms, extra, w, k1x, k1y, dt)
    else:
        x, y, vx, vy = w[of(X, 0, W, 1)], w[of(Y, 0, W, 1)], w[of(VX, 0, W, 1)], w[of(VY, 0, W, 1)]
        x, y, vx, vy = step(arms, extra, C, w, x, y, vx, vy, k1x, k1y, dt)
    w[of(X, 0, W, 1)], w[of(Y, 0, W, 1)], w[of(VX, 0, W, 1)], w[of(VY, 0, W, 1)] = x, y, vx, vy
    if far:
        edge.hold(w, W, 1, dt)
        begin(arms, w)


@leaf
def sound(arms, extra, w):
    """Is a run beyond doubt, so that `judge` need not look at it?"""
    W = len(arms)
    x, y, vx, vy = w[of(X, 0, W, 1)], w[of(Y, 0, W, 1)], w[of(VX, 0, W, 1)], w[of(VY, 0, W, 1)]
    low, size = w[LOW * W], (abs(x) + abs(y)) + (abs(vx) + abs(vy))
    for i in range(W):
        low, size = min(low, w[LOW * W + i]), size + abs(w[C * W + i])
    steps = 1.0 if extra is None else w[of(STEPS, 0, W, 1)]
    return low > 0.0 and size < 1e300 and steps <= MOST_STEPS and w[of(STATUS, 0, W, 1)] == DONE


@leaf
def put(arms, w, x, y, vx, vy):
    """Write the state of the machine."""
    W = len(arms)
    w[of(X, 0, W, 1)], w[of(Y, 0, W, 1)], w[of(VX, 0, W, 1)], w[of(VY, 0, W, 1)] = x, y, vx, vy


@kernel
def observe(arms, extra, table, x, y, vx, vy, w, q, qd, follows):
    """True base angles and rates (N,) for a controller in Python; `table` is the desired motion of a sample, which
    follows on the last one or begins a run."""
    put(arms, w, x, y, vx, vy)
    if not follows:
        fetch(ANGLE, len(arms), table, 0, w)
        move(len(arms), w, (MOTION + ANGLE) * len(arms), w, Q * len(arms))
        w[of(AROUND, 0, len(arms), 1)] = 0.0
    begin(arms, w)
    if sense(arms, extra, table, 0, w, 0.0) > 0:
        mend(((),), arms, table, 0, w)
    for i in range(len(q)):
        q[i], qd[i] = w[Q * len(arms) + i], w[QD * len(arms) + i]


@kernel
def advance(arms, extra, table, x, y, vx, vy, w, c, dt):
    """`hold` for a controller in Python: the state after the torques c (N,), and its status."""
    W = len(arms)
    put(arms, w, x, y, vx, vy)
    # The hold before may have lost the machine: that of zero torques, by which `Plant` compiles, does where it falls.
    w[of(STATUS, 0, W, 1)] = DONE
    begin(arms, w)
    far = sense(arms, extra, table, 0, w, dt) > 0
    if far:
        edge.watch(w, len(arms), 1, dt)
    for i in range(len(c)):
        w[C * W + i] = c[i]
    hold(arms, extra, w, dt, far)
    # The angles are those of the last sample that was looked at.
    move(W, w, OLD * W, w, Q * W)
    judge(((),), arms, w, 0)
    return (w[of(X, 0, W, 1)], w[of(Y, 0, W, 1)], w[of(VX, 0, W, 1)], w[of(VY, 0, W, 1)], w[of(STATUS, 0, W, 1)])
