"""The sampled closed loop of every law: sense, measure, find the pose, command, record, hold.

One source serves a single run (its arms side by side, with a history) and a study (many runs side by side, with sums).
All that a run does depends on its own column of the work table only, so that its numbers are the same in whatever
company it runs.
"""

from __future__ import annotations

import math
import traceback

from . import edge, plant, single
from .decentralized import command_filter, force_filter, integral, proportional
from .jit import kernel, leaf, outlined
from .laws import computed_torque
from .leaves import solve2
from .pose import find_pose
from .rows import *
from .tables import *
from .user import fill


@leaf
def start(lanes, arms, history, clock, table, w):
    """The turn of the angles before the first sample, and the first geometry of a single run, which its holds then
    make ahead."""
    if clock.first == 0:
        L, W = len(lanes), len(arms)
        for i in range(W):
            for j in range(L):
                w[at(Q, i, j, W, L)] = w[at(OLD, i, j, W, L)] = want(table, 0, ANGLE, i, W)
        if history is not None:
            single.begin(arms, w)


@leaf
def sense(lanes, arms, extra, study, history, table, o, w, dt):
    """The machine at a sample, in the layout of a study or of a single run: is one far off or near the edge?"""
    far = 0
    if study is not None:
        plant.sense(lanes, arms, extra, table, o, w)
        far = plant.compare(lanes, arms, table, o, w, dt)
    if history is not None:
        far = single.sense(arms, extra, table, o, w, dt)
    if far > 0:
        plant.mend(lanes, arms, table, o, w)
        edge.watch(w, len(arms), len(lanes), dt)
    return far > 0


@leaf
def hold(lanes, arms, extra, study, history, w, dt, far):
    """The machine until the next sample, in either layout."""
    if study is not None:
        plant.hold(lanes, arms, extra, w, dt)
        if far:
            edge.hold(w, len(arms), len(lanes), dt)
    if history is not None:
        single.hold(arms, extra, w, dt, far)


@leaf
def smooth(lanes, arms, sensor, w, i, dt, k):
    """The rate ED of an encoder through its low-pass; the first reading has none before it, and the true rate."""
    L, W = len(lanes), len(arms)
    blend = sensor.blend if k > 0 else 0.0
    for j in range(L):
        rate = (w[at(E, i, j, W, L)] - w[at(READ, i, j, W, L)]) / dt
        slow = w[at(SLOW, i, j, W, L)] if k > 0 else w[at(ED, i, j, W, L)]
        w[at(SLOW, i, j, W, L)] = slow + blend * (rate - slow)
        w[at(ED, i, j, W, L)] = w[at(SLOW, i, j, W, L)]


@outlined
def read(lanes, arms, sensor, faulty, faults, table, o, w, dt, k):
    """Errors E, ED of real encoders: jumps of their offset, counts, dropouts, rates from their differences."""
    L, W = len(lanes), len(arms)
    for i in range(W):
        for j in range(L):
            w[at(E, i, j, W, L)] = w[at(Q, i, j, W, L)] + w[at(OFFSET, i, j, W, L)]
            w[at(ED, i, j, W, L)] = w[at(QD, i, j, W, L)]
        if len(faulty) > 0:
            for j in range(L):
                w[at(E, i, j, W, L)] += faults[(k * 4 + JUMP) * W + i]
        if sensor.quantized:
            for j in range(L):
                w[at(E, i, j, W, L)] = sensor.quantum * math.floor(w[at(E, i, j, W, L)] / sensor.quantum + 0.5)
        if len(faulty) > 0 and faults[(k * 4 + HELD) * W + i] > 0.0:
            for j in range(L):
                # An encoder reads once before it repeats itself.
                w[at(E, i, j, W, L)] = w[at(READ, i, j, W, L)] if k > 0 else w[at(E, i, j, W, L)]
                w[at(ED, i, j, W, L)] = 0.0
        if sensor.filtered:
            smooth(lanes, arms, sensor, w, i, dt, k)
        for j in range(L):
            w[at(READ, i, j, W, L)] = w[at(E, i, j, W, L)]
            w[at(E, i, j, W, L)] -= want(table, o, ANGLE, i, W)
            w[at(ED, i, j, W, L)] -= want(table, o, RATE, i, W)


@leaf
def command(lanes, drives, arms, modelled, user, law, table, o, w, t, dt, buffer):
    """The torques C of the law."""
    if law.form == PD:
        proportional(lanes, arms, w)
    elif law.form == PID:
        integral(lanes, arms, w, dt)
    elif modelled is not None:
        computed_torque(lanes, drives, arms, modelled, law, table, o, w)
    elif user is not None:
        fill(drives, arms, law, t, table, o, w, buffer)
        user(buffer)
        answer = len(buffer) - len(drives)
        for i in range(len(drives)):
            c = buffer[answer + i]
            # A limit of a drive must not make a torque of what is none.
            w[C * len(arms) + i] = c if abs(c) < 1e100 else math.nan


@leaf
def filtered(lanes, drives, arms, posed, law, w):
    """What a filter around the law leaves of its torques C."""
    if posed is not None:
        if law.filter == FORCE_FILTER:
            force_filter(lanes, drives, arms, w)
        elif law.filter == COMMAND_FILTER:
            command_filter(lanes, drives, arms, w)


@leaf
def break_drives(lanes, arms, faults, w, k):
    """What is left of the torques C in drives that are dead or at their limit."""
    L, W = len(lanes), len(arms)
    for i in range(W):
        for j in range(L):
            c, limit = w[at(C, i, j, W, L)] * faults[(k * 4 + ALIVE) * W + i], faults[(k * 4 + LIMITED) * W + i]
            w[at(C, i, j, W, L)] = min(max(c, -limit), limit)


@leaf
def record(arms, history, w, k):
    """Sample k of a single run: a row in each flat column of its history.

    What arms that fill up a row leave behind the drives, the next sample writes over.
    """
    W, o = len(arms), history.drives * k
    history.x[2 * k], history.x[2 * k + 1] = w[of(X, 0, W, 1)], w[of(Y, 0, W, 1)]
    history.xd[2 * k], history.xd[2 * k + 1] = w[of(VX, 0, W, 1)], w[of(VY, 0, W, 1)]
    move(W, w, Q * W, history.q, o)
    move(W, w, QD * W, history.qd, o)
    move(W, w, C * W, history.c, o)
    history.joints[2 * k], history.joints[2 * k + 1] = w[of(JOINT_J, 0, W, 1)], w[of(JOINT_K, 0, W, 1)]


@outlined
def add_up(lanes, drives, arms, w):
    """Sums of a study: squared torques, per drive and all, and the weighted antagonistic part at the true pose."""
    L, N, W = len(lanes), len(drives), len(arms)
    for j in range(L):
        m11 = m12 = m22 = fx = fy = square = null = -0.0
        for i in range(N):
            a1, a2, c = w[at(B1, i, j, W, L)], w[at(B2, i, j, W, L)], w[at(C, i, j, W, L)]
            m11, m12, m22, fx, fy = m11 + a1 * a1, m12 + a1 * a2, m22 + a2 * a2, fx + a1 * c, fy + a2 * c
            w[at(COPPER, i, j, W, L)] += c * c
            square += c * c
        gx, gy = solve2(m11, m12, m22, fx, fy)
        for i in range(N):
            rest = w[at(C, i, j, W, L)] - (w[at(B1, i, j, W, L)] * gx + w[at(B2, i, j, W, L)] * gy)
            null += w[at(WEIGHT, i, j, W, L)] * (rest * rest)
        w[of(TORQUE2, j, W, L)] += square
        w[of(ANTAGONISM, j, W, L)] += null


@outlined
def add_miss(lanes, arms, table, o, w):
    """Squared distance of the end-effector from the path at a sample: the sum of all, and the largest."""
    L, W = len(lanes), len(arms)
    x, y = table[o], table[o + 1]
    for j in range(L):
        dx, dy = w[of(X, j, W, L)] - x, w[of(Y, j, W, L)] - y
        square = dx * dx + dy * dy
        w[of(MISS2, j, W, L)] += square
        w[of(FARTHEST, j, W, L)] = max(w[of(FARTHEST, j, W, L)], square)


@outlined
def add_work(lanes, arms, w):
    """Work of the hold that ends at this sample."""
    P = len(arms) * len(lanes)
    for p in range(P):
        angle = w[Q * P + p]
        w[WORK * P + p] += w[C * P + p] * (angle - w[OLD * P + p])
        w[OLD * P + p] = angle


@leaf
def over(lanes, arms, extra, history, w, k):
    """Have all runs ended? A single one that is sound needs no judgement."""
    if history is not None:
        if single.sound(arms, extra, w):
            return False
    return plant.judge(lanes, arms, w, k) == len(lanes)


@kernel
def closed_loops(kind, study, modelled, user, sensor, law, clock, table, faults, w, history, buffer):
    """Sampled runs side by side, whatever their law: a single run with its history, or a study with sums in w.

    None for what is not there leaves it out of the kernel, which then compiles sooner; an `else` branch would stay in.
    history, study : the `History` of a single run, or () for a study; the other one is None.
    modelled : None for laws without a model; else an entry where the model has friction or gravity.
    user : None, or the pointer of a law that a user compiled, which finds what it needs in `buffer`.
    clock : a long run is made in parts, whose state is in w; the table holds the samples of one part.
    """
    dt = clock.dt
    lanes, drives, arms, faulty, posed, extra = kind
    columns = 6 + (FEW if modelled is None and user is None else ALL) * len(arms)
    rows = len(table) // columns
    start(lanes, arms, history, clock, table, w)
    for row in range(rows):
        k, o = clock.first + row, row * columns

        # Sense: the machine as it is, and what the hold will start from.
        far = sense(lanes, arms, extra, study, history, table, o, w, dt)
        if study is not None:
            add_work(lanes, arms, w)
            add_miss(lanes, arms, table, o, w)

        # Measure: ideal encoders have their errors from `sense`.
        if len(faulty) > 0 or sensor.quantized or sensor.filtered:
            read(lanes, arms, sensor, faulty, faults, table, o, w, dt, k)

        # Pose: where the controller thinks the machine is, if its law or filter asks.
        find_pose(lanes, drives, arms, posed, modelled, history, study, law, table, o, w, k)

        # Command: the law, the filter around it, and what is left of both in broken drives.
        command(lanes, drives, arms, modelled, user, law, table, o, w, k * dt, dt, buffer)
        filtered(lanes, drives, arms, posed, law, w)
        if len(faulty) > 0:
            break_drives(lanes, arms, faults, w, k)

        # Record.
        if history is not None:
            record(arms, history, w, k)
        if k + 1 == clock.samples:
            plant.judge(lanes, arms, w, k)
            return
        if study is not None:
            add_up(lanes, drives, arms, w)

        # Hold.
        hold(lanes, arms, extra, study, history, w, dt, far)
        if over(lanes, arms, extra, history, w, k):
            return


def stopped(error):
    """How and when a run without a compiler ended by a division by zero or at an infinite angle: status and sample.

    In the hold of finite torques it is the machine that fails, before it the law.
    """
    frames = {frame.f_code.co_name: frame.f_locals for frame, _ in traceback.walk_tb(error.__traceback__)}
    loop = frames["closed_loops"]
    W, k = len(loop["kind"].arms), loop.get("k", loop["clock"].first)
    finite = all(abs(c) < 1e300 for c in loop["w"][C * W : C * W + W])
    return (LEFT_WORKSPACE if "hold" in frames and finite else SINGULAR), k
