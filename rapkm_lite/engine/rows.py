"""The work table `w` of runs side by side: one flat array, because the compiler then sees that no two rows overlap.

First the pair rows, one number per arm and run: row b of arm i and run j is entry (b W + i) L + j; then the run rows,
one number per run.  W is the number of arms, in a compiled single run padded to whole vector registers with arms
that weigh and do nothing; L is the number of runs.  Both come as tuples, whose length the compiler knows.
"""

from __future__ import annotations

from .jit import index

# The arms of the machine as in `tables.arm_table`; those of the controller's model follow from MODEL on.
BX, BY, L1SQ, L2SQ, HALF, MODE, S1, S2, TIP, W1, W2, FRICTION, SCALE, ELBOW_SCALE = range(14)
MODEL = 14
# What belongs to the runs of a law: offsets, gains of drives and elbows, limit of a torque, inverse weights, R / k_t^2.
OFFSET, GAIN_P, GAIN_D, GAIN_I, ELBOW_P, ELBOW_D, LIMIT, EASE, WEIGHT = range(2 * MODEL, 2 * MODEL + 9)
# The machine at the sample: angle and rate, rows b, base acceleration; sine and cosine of the angle from the desired
# one, cotangent of the elbow and its rate; what tells a lost arm and a far one; shares of the arms in the equations of
# motion.
(
    Q, QD, B1, B2, ACC, SINE, COSINE, COTANGENT, BENDS, LOW, NEAR, M11, M12, M22, FX, FY,
) = range(WEIGHT + 1, WEIGHT + 17)  # fmt: skip
# The controller: measured errors, what encoders and laws remember; A and a Newton step of the pose; the model's links;
# accelerations and errors of the joints; torques, also less friction; sums of a study.
(
    E, ED, SLOW, READ, MEMORY,
    A1, A2, P11, P12, P22, GX, GY,
    L1, L2, MAD, MDEN, MINV,
    ACC_B, ACC_E, ELBOW_E, ELBOW_ED, ASK_B, ASK_E,
    C, PUSH, OLD, COPPER, WORK,
) = range(FY + 1, FY + 29)  # fmt: skip
# The desired motion of a sample of a single run, in the order of the blocks of `tables.motion_table`.
MOTION = WORK + 1
# Two places of a single run's end-effector, eight rows each: links of `leaves.geometry`, (a x d)^2.
PLACE, OTHER = MOTION + 9, MOTION + 17
BLOCKS = OTHER + 8

# Run rows: the state, its acceleration, that of a stage, the sums of a step, its length, how many there are, the
# sharpness of the friction law in them; the pose, the two before it, its velocity, what its search needs; the joints of
# a law, their gains; reference rate, acceleration and force of a law, F^T F; sums of a study, turns that a drive is
# away from its path, how it ended; what `edge` keeps of a sample; the environment as in `tables.environment`.
(
    X, Y, VX, VY, KX, KY,
    SX, SY, SVX, SVY, TX, TY, TVX, TVY, STEP, STEPS, BEND,
    PX, PY, PX1, PY1, PX2, PY2, PVX, PVY, TODO, FAR, GUESS_X, GUESS_Y,
    JOINT_J, JOINT_K, PAIR_P1, PAIR_P2, PAIR_D1, PAIR_D2, HYSTERESIS,
    REF_X, REF_Y, ACC_X, ACC_Y, PUSH_X, PUSH_Y, G11, G12, G22,
    TORQUE2, ANTAGONISM, MISS2, FARTHEST, AROUND, STATUS, SAMPLE,
    NEAR_EDGE, WAS_X, WAS_Y, WAS_VX, WAS_VY,
    GRAVITY_X, GRAVITY_Y, SHARPNESS,
) = range(60)  # fmt: skip
# After the environment of the machine stands that of the model.
ENVIRONMENT, SINGLES = 3, 63


@index
def at(block, i, j, W, L):
    """Index of arm i and run j in a pair row."""
    return (block * W + i) * L + j


@index
def of(row, j, W, L):
    """Index of run j in a run row."""
    return (BLOCKS * W + row) * L + j


@index
def want(table, o, block, i, W):
    """Desired motion of arm i at a sample, from a block of `tables.motion_table`."""
    return table[o + 6 + block * W + i]


@index
def desired(table, o, w, block, i, W, L):
    """As `want`, of a single run from its work table, into which `single.fetch` has copied it."""
    return w[(MOTION + block) * W + i] if L == 1 else table[o + 6 + block * W + i]


@index
def move(W, source, s, target, t):
    """Copy W numbers; four are read before they are written, as one vector: a loop beside another array is not."""
    if W % 4 == 0:
        for i in range(0, W, 4):
            a, b, c, d = source[s + i], source[s + i + 1], source[s + i + 2], source[s + i + 3]
            target[t + i], target[t + i + 1], target[t + i + 2], target[t + i + 3] = a, b, c, d
    else:
        for i in range(W):
            target[t + i] = source[s + i]


@index
def total(row, w, W):
    """Sum of a pair row of a single run; of four arms as a vector register adds fastest."""
    if W == 4:
        return (w[row * W] + w[row * W + 2]) + (w[row * W + 1] + w[row * W + 3])
    s = w[row * W]
    for i in range(1, W):
        s += w[row * W + i]
    return s
