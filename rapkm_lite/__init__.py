"""Robust modeling and control of parallel manipulators with actuation redundancy, after Mueller and Hufnagel."""

from ._arguments import ConvergenceError
from .actuation import (
    actuation_type,
    antagonism_filter,
    command_filter,
    control_matrix,
    control_vector_fields,
    degree_of_actuation,
    distal_cross_products,
    drive_pairs,
    explicit_pseudoinverse,
    inverse_dynamics,
    null_vector,
    prestress_projector,
    redundant_control_matrix,
    required_wrench,
    rest_exists,
    select_independent,
    singular_values,
    steady_state_error,
    steady_state_torque,
    weighted_pseudoinverse,
)
from .control import (
    APD,
    CTC,
    PD,
    AntagonismFilter,
    CommandFilter,
    Controller,
    Desired,
    Law,
    RedundantAPD,
    RedundantCTC,
    SwitchedCTC,
    closed_loop_projector,
    effective_gain,
    lyapunov_function,
)
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
    antagonistic_energy,
    antagonistic_torque,
    antagonism_form,
    copper_loss,
    measured_energies,
    mechanical_work,
    table1,
)
from .kinematics import (
    arm_vectors,
    close_loops,
    constraint_jacobian,
    constraint_jacobian_dot,
    estimate_pose,
    forward_kinematics,
    inverse_kinematics,
    loop_constraints,
    reachable,
    tips,
    working_mode,
    working_modes,
)
from .logs import Log, mystery_run
from .manipulator import Manipulator, data_path, load
from .maps import actuation_map, sampling_box, switching_map, workspace_grid
from .simulation import Experiment, Run, SimulationError, experiment, simulate
from .studies import Sweep, sweep
from .trajectory import Trajectory, circle, follow, hold, polygon, triangle

__version__ = "0.1.0"
