"""Pictures as recorded marks, for two renderers: a canvas in the page and, for stored pictures, Matplotlib.

>>> picture = Picture({"a": {"xlabel": "time in s"}})
>>> picture.line("a", [0, 1], [0, 2], color="#004488")
>>> [mark.kind for mark in picture.marks]
['line']
"""

from .encode import encode, scene
from .palette import Palette
from .parts import (
    bars,
    draw_machine,
    draw_workspace,
    drive_axis,
    drive_legend,
    drive_lines,
    offset_values,
    pair_legend,
    pair_lines,
    per_drive,
    told,
    traces,
    zero_line,
)
from .picture import Picture
from .plane import clamped, in_mm, middle, reached, room, roomiest, singular_curves, workspace_outline, zero_lines
from .stored import bundle, figure, png
