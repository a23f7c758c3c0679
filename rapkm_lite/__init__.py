"""Robust modeling and control of parallel manipulators with actuation redundancy, after Mueller and Hufnagel.

Joint vectors q (..., 2N) in rad hold the base angles of arms 1 to N, then their elbow angles, relative to the proximal
links; rates qd and accelerations qdd likewise.  Points x (..., 2) are in m, base angles q_a (..., N) in rad, and drive
torques c (..., N) in N m.  Dots are any leading axes: none for one pose, one for those of a trajectory;
those of several arguments broadcast.  One bad pose among many stops the whole call.
Indices count from 0; "arm 2" in words is the second one, of index 1.  Numbers in brackets are equations of the chapter.

A wrong argument raises ValueError with its name, what was given and what is allowed; docstrings say what is raised
besides.  Loops are open where tips are more than 1e-3 of the longest link apart; `close_loops` closes them.  What
the cut tree alone tells (tips, h, J, G, C, Q, energies) is there for any pose; F, N_J, A and what follows from them
refuse open loops.
"""

from .control.compiled_law import CompiledLaw, compiled
from .control.computed_torque import APD, CTC, RedundantAPD, RedundantCTC, SwitchedCTC
from .control.grammar import Law
from .control.laws import PD, PID, AntagonismFilter, CommandFilter
from .control.sample import Controller, Sample
from .control.stability import closed_loop_projector, effective_gain, feedback_norm, lyapunov_function
from .machine.arguments import ConvergenceError
from .machine.datafiles import data_path
from .machine.logs import Log, mystery_run, read_log, write_log
from .machine.manipulator import Manipulator, load
from .mechanics.actuation import (
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
from .mechanics.antagonism import (
    antagonism_filter,
    command_filter,
    common_sign,
    null_basis,
    null_vector,
    rest_exists,
    steady_state_error,
    steady_state_torque,
)
from .mechanics.at import At, at
from .mechanics.calibration import Calibration, CalibrationError, calibrate
from .mechanics.closure import close_loops, estimate_pose
from .mechanics.dynamics import (
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
from .mechanics.kinematics import (
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
from .mechanics.maps import actuation_map, sampling_box, switching_map, workspace_grid
from .mechanics.matrices import complement, complement_dot, minimal_terms, projector, projector_dot, redundant_terms
from .mechanics.mjcf import to_mjcf
from .mechanics.partition import explicit_pseudoinverse, select_independent
from .mechanics.redundancy import allocate_torques, endeffector_stiffness, minimax_torques
from .mechanics.trajectory import Desired, Trajectory, circle, follow, hold, polygon, triangle
from .simulation.energy import (
    antagonism_form,
    antagonistic_energy,
    antagonistic_torque,
    copper_loss,
    mechanical_work,
)
from .simulation.experiments import Experiment, experiment, measured_energies, table1
from .simulation.faults import DeadDrive, EncoderDropout, OffsetJump, TorqueLimit
from .simulation.patience import progress
from .simulation.runs import Run, SimulationError, simulate
from .simulation.sensors import Sensors
from .simulation.studies import Sweep
from .simulation.sweeps import sweep

__version__ = "0.1.0"

# Spelled out, because editors read it.
__all__ = [
    "APD", "CTC", "PD", "PID", "AntagonismFilter", "At", "Calibration", "CalibrationError", "CommandFilter",
    "CompiledLaw", "Controller", "ConvergenceError", "DeadDrive", "Desired", "EncoderDropout", "Experiment", "Law",
    "Log", "Manipulator", "OffsetJump", "RedundantAPD", "RedundantCTC", "Run", "Sample", "Sensors", "SimulationError",
    "Sweep", "SwitchedCTC", "TorqueLimit", "Trajectory", "actuation_map", "actuation_type", "allocate_torques",
    "antagonism_filter", "antagonism_form", "antagonistic_energy", "antagonistic_torque", "arm_vectors", "at",
    "calibrate", "circle", "close_loops", "closed_loop_projector", "command_filter", "common_sign", "compiled",
    "complement", "complement_dot", "constraint_jacobian", "constraint_jacobian_dot", "constraint_rank",
    "control_matrix", "control_vector_fields", "copper_loss", "coriolis_matrix", "data_path", "degree_of_actuation",
    "degree_of_freedom", "distal_cross_products", "drive_pairs", "effective_gain", "endeffector_stiffness",
    "estimate_pose", "experiment", "explicit_pseudoinverse", "feedback_norm", "follow", "force_polygon",
    "forward_dynamics", "forward_kinematics", "generalized_forces", "hold", "inverse_dynamics", "inverse_kinematics",
    "kinetic_energy", "load", "loop_constraints", "lyapunov_function", "mass_matrix", "measured_energies",
    "mechanical_work", "minimal_dynamics", "minimal_terms", "minimax_torques", "mystery_run", "null_basis",
    "null_vector", "nullspace_projector", "nullspace_projector_dot", "orthogonal_complement",
    "orthogonal_complement_dot", "polygon", "potential_energy", "prestress_projector", "progress", "projector",
    "projector_dot", "reachable", "read_log", "redundant_control_matrix", "redundant_dynamics", "redundant_terms",
    "required_wrench", "rest_exists", "sampling_box", "select_independent", "simulate", "singular_values",
    "steady_state_error", "steady_state_torque", "sweep", "switching_map", "table1", "tips", "to_mjcf", "triangle",
    "weighted_pseudoinverse", "working_mode", "working_modes", "workspace_grid", "write_log",
]  # fmt: skip


def __dir__():
    return [*__all__, "__version__"]
