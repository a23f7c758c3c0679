"""Pictures to take in hand: ready-made explorers, and `explorer` to build others.

robot : any `Manipulator`; default the testbed, without friction but in `imperfections`.
Wrong arguments raise ValueError; what cannot be computed is a sentence in the picture, `problem`.

>>> from rapkm_lite import explore
>>> explore.prestress().set(level=0).numbers["largest prestress"]
'0 mN m'
"""

from ..figures.arguments import guarded as _guarded
from ..figures.machine import plane_limits
from ..figures.marks import Palette, Picture, bars, draw_machine, draw_workspace, drive_legend, pair_legend
from .controls import choice, log_slider, offset_sliders, slider, switch
from .explorer import Explorer, explorer
from .geometry import actuation, machine, prestress
from .practice import controller_choice, imperfections, own_machine
from .redundancy import allocation, calibration
from .rest import landscape, steady_state, three_opinions
from .runs import animation, decentralized_run, via_points
from .torque import computed_torque

# `explorer` checks for itself: what a reader's own draw function raises stays what it is.
globals().update({name: thing for name, thing in _guarded(globals()).items() if name != "explorer"})

# Spelled out, because editors read it.
__all__ = [
    "Explorer", "Palette", "Picture", "actuation", "allocation", "animation", "bars", "calibration", "choice",
    "computed_torque", "controller_choice", "decentralized_run", "draw_machine", "draw_workspace", "drive_legend",
    "explorer", "imperfections", "landscape", "log_slider", "machine", "offset_sliders", "own_machine", "pair_legend",
    "plane_limits", "prestress", "slider", "steady_state", "switch", "three_opinions", "via_points",
]  # fmt: skip


def __dir__():
    return __all__
