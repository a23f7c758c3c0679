"""Sliders that redraw a picture fast enough to feel alive: ready-made explorers, and `explorer` to build others.

>>> from rapkm_lite import explore
>>> explore.prestress().set(level=0).numbers["largest prestress"]
'0 mN m'
"""

from ..figures.machine import plane_limits
from .builder import Explorer, choice, explorer, log_slider, slider, switch
from .geometry import actuation, machine, prestress
from .landscape import landscape
from .live import LivePicture
from .motion import animation
from .parts import draw_machine, drive_legend, legend, offset_sliders
from .runs import bars, decentralized_run, steady_state
from .torque import computed_torque
