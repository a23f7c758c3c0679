"""The compiled kernels under `simulation`: plant, sensors and controllers of the sampled closed loop, arm by arm.

`tables` describes machine and motion to the kernels, `plant` moves the machine, `lockstep` runs the PD laws, one run
or many side by side, `model_based` the laws with a model.  Numba is imported, and code compiled, at the first run.
"""

from __future__ import annotations

import importlib.util
import os

COMPILED = os.environ.get("RAPKM_LITE_NUMBA", "1") != "0" and importlib.util.find_spec("numba") is not None
