"""Robust modeling and control of parallel manipulators with actuation redundancy, after Mueller and Hufnagel."""

from ._arguments import ConvergenceError
from .actuation import (
    actuation_type,
    control_matrix,
    control_vector_fields,
    degree_of_actuation,
    distal_cross_products,
    drive_pairs,
    force_polygon,
    inverse_dynamics,
    prestress_projector,
    redundant_control_matrix,
    required_wrench,
    singular_values,
    weighted_pseudoinverse,
)
from .antagonism import (
    antagonism_filter,
    command_filter,
    null_vector,
    rest_exists,
    steady_state_error,
    steady_state_torque,
)
from .closure import close_loops, estimate_pose
from .computed_torque import (
    APD,
    CTC,
    RedundantAPD,
    RedundantCTC,
    SwitchedCTC,
)
from .control import PD, AntagonismFilter, CommandFilter, Desired, Law
from .controller import Controller
from .datafiles import data_path
from .dynamics import (
    constraint_rank,
    coriolis_matrix,
    degree_of_freedom,
    forward_dynamics,
    generalized_forces,
    kinetic_energy,
    mass_matrix,
    minimal_dynamics,
    nullspace_projector,
    nullspace_projector_dot,
    orthogonal_complement,
    orthogonal_complement_dot,
    potential_energy,
    redundant_dynamics,
)
from .energy import (
    antagonism_form,
    antagonistic_energy,
    antagonistic_torque,
    copper_loss,
    measured_energies,
    mechanical_work,
    table1,
)
from .kinematics import (
    arm_vectors,
    constraint_jacobian,
    constraint_jacobian_dot,
    forward_kinematics,
    inverse_kinematics,
    loop_constraints,
    reachable,
    tips,
    working_mode,
    working_modes,
)
from .logs import Log, mystery_run
from .manipulator import Manipulator, load
from .maps import actuation_map, sampling_box, switching_map, workspace_grid
from .partition import explicit_pseudoinverse, select_independent
from .simulation import Experiment, Run, SimulationError, experiment, simulate
from .stability import closed_loop_projector, effective_gain, feedback_norm, lyapunov_function
from .studies import Sweep, sweep
from .trajectory import Trajectory, circle, follow, hold, polygon, triangle

__version__ = "0.1.0"
