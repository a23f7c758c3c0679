"""Figures: ``plot_x(..., ax=None) -> ax``, one style file, one colour per arm everywhere."""

from .actuation import (
    curve_crossings,
    plot_available_forces,
    plot_control_fields,
    plot_grid_search,
    plot_map,
    plot_mode_maps,
    plot_pair_curves,
    plot_pair_measures,
    plot_parameterization_singularities,
    plot_prestress_maps,
)
from .antagonism import (
    plot_chatter,
    plot_disagreement,
    plot_fight_map,
    plot_gain_ratio,
    plot_log,
    plot_rest_torques,
    plot_torque_steps,
)
from .constraints import (
    plot_complement_size,
    plot_configuration_space,
    plot_cut_tree,
    plot_joint_angles,
    plot_loop_gaps,
    plot_pin_forces,
    plot_topology,
)
from .machine import (
    plane_axes,
    plane_grid,
    plot_machine,
    plot_path,
    plot_synchronization,
    plot_working_modes,
    plot_workspace,
)
from .robust import (
    plot_ee_errors,
    plot_ee_paths,
    plot_effective_gain,
    plot_feedback_along,
    plot_feedback_map,
    plot_lyapunov,
    plot_pairs,
    plot_partition_rules,
    plot_step_response,
    plot_torques_and_errors,
)
from .runs import (
    plot_antagonism,
    plot_difference,
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
