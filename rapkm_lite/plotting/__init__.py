"""Figures: ``plot_x(..., ax=None) -> ax``, one style file, one colour per arm everywhere."""

from .machine import (
    pair_poses,
    plane_axes,
    plane_grid,
    plot_machine,
    plot_path,
    plot_synchronization,
    plot_working_modes,
    plot_workspace,
)
from .runs import (
    plot_antagonism,
    plot_energies,
    plot_errors,
    plot_table1,
    plot_torque_norms,
    plot_torque_plane,
    plot_torques,
)
from .studies import (
    plot_agreement,
    plot_bands,
    plot_gain_curve,
    plot_landscape,
    plot_placement,
    plot_readings,
)
from .style import AFTER, ALARM, ARM_COLOURS, BEFORE, NEUTRAL, arm_colour, arm_line, axes_or_new, use_style
