"""The work table of runs in lockstep: row r of run j is entry r * L + j of one flat array.

One array with constant rows, because the compiler then sees that the runs do not touch each other.
"""

from __future__ import annotations

# Rows of the work table: state, pose and two predecessors, sums, flags; then blocks of one row per drive.
X, Y, VX, VY, PX, PY, PX1, PY1, PX2, PY2, TORQUE2, ANTAGONISM, STATUS, SAMPLE, TODO, FAR = range(16)
SINGLES = 16
(OFFSET, GAIN_P, GAIN_D, WEIGHT, COPPER, WORK, C, Q, QD, OLD, E, ED, LAST, SLOW,
 AX, AY, DX, DY, AD, INV, A1, A2) = range(22)
BLOCKS = 22
