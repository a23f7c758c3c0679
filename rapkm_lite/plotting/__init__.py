"""Figures: ``plot_x(..., ax=None) -> ax``, one style file, one colour per arm everywhere."""

from .machine import plane_axes, plane_grid, plot_machine, plot_path, plot_workspace
from .runs import plot_energies, plot_errors, plot_torques
from .style import AFTER, ALARM, ARM_COLOURS, BEFORE, NEUTRAL, arm_colour, arm_line, axes_or_new, use_style
