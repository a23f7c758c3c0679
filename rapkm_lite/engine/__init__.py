"""The compiled kernels under `simulation`: one sampled closed loop for all laws, one run or many side by side.

`rows` is the work table that everything stands in, `tables` describes machine, motion and sensors to the kernels,
`leaves` are the formulas of one arm.  From them, `plant` (many runs) and `single` (one run) sense and hold, `pose`
finds the pose, `laws` command, `user` and `pointer` ask a law that a user compiled, and `loop` is the loop.  Numba is
imported, and code compiled, at the first run.
"""

from __future__ import annotations

import importlib.util
import os

COMPILED = os.environ.get("RAPKM_LITE_NUMBA", "1") != "0" and importlib.util.find_spec("numba") is not None
