"""Electric energy per drive, and the part of it that antagonism costs.

Functions of a `run` read its `robot`, `q`, `q_a`, `c` and `dt`.
"""

from __future__ import annotations

import numpy as np

from ..machine.arguments import having, matvec, of_kind, positive_number, real_array, shaped
from ..machine.manipulator import Manipulator, manipulator
from ..mechanics.actuation import control_matrix, weighted_pseudoinverse
from ..mechanics.antagonism import steady_state_torque
from ..mechanics.kinematics import inverse_kinematics
from ..mechanics.trajectory import Trajectory


def joule_heat(c, dt: float, resistance, torque_constant) -> np.ndarray:
    """Heat R (c / k_t)^2 dt of each hold, of the shape of c, in J."""
    return resistance * (c / torque_constant) ** 2 * dt


def work_of_holds(c, q_a) -> np.ndarray:
    """Work c[k] (q_a[k+1] - q_a[k]) of each hold (..., k - 1, m) in J, for torques and angles (..., k, m)."""
    return c[..., :-1, :] * np.diff(q_a, axis=-2)


def copper_loss(robot, c, dt) -> np.ndarray:
    """Joule heat R (c / k_t)^2 dt of torques c (..., k, N) in N m, each held for dt in s: (..., N) in J per drive.

    Raises ValueError for a single row (N,), for another number of drives, and unless dt is above 0.

    >>> import numpy as np, rapkm_lite as rk
    >>> rk.copper_loss(rk.load(), np.full((1000, 3), 0.0259), dt=1e-3).round(3)
    array([0.611, 0.611, 0.611])
    """
    c = real_array("c", c, manipulator(robot).n_arms)
    shaped("c", c, c.ndim >= 2, f"(..., k, {robot.n_arms}), one row per hold")
    return np.sum(joule_heat(c, positive_number("dt", dt), robot.resistance, robot.torque_constant), axis=-2)


def mechanical_work(run) -> np.ndarray:
    """Work of the drives on the mechanism (N,) in J, the sum over holds of c[k] (q_a[k+1] - q_a[k]).

    Without friction it sums over the drives to the energy that the machine has gained: to zero in a horizontal plane on
    a closed path from rest to rest.  Raises ValueError for what is no run, such as a `Log`.

    >>> import numpy as np, rapkm_lite as rk
    >>> run = rk.simulate(rk.load(), rk.PD(7.05, 0.225), rk.triangle(rk.load()))
    >>> np.allclose(run.energy, rk.copper_loss(run.robot, run.c[:-1], run.dt) + rk.mechanical_work(run))
    True
    """
    _run(run, "q_a", "c", "dt")
    return np.sum(work_of_holds(run.c, run.q_a), axis=0)


def root_mean_square_torque(run) -> float:
    """Root mean square over the holds of the Euclidean norm of the drive torques, N m."""
    return float(np.sqrt(np.sum(run.c[:-1] ** 2) / max(len(run.c) - 1, 1)))


def antagonistic_torque(run) -> np.ndarray:
    """The part N_{A^T} c of the torques (k, N) in N m that moves nothing, at the true pose.

    Raises ValueError where a sample is an input singularity, and for what has no true pose, such as a `Log`.

    >>> import numpy as np, rapkm_lite as rk
    >>> run = rk.simulate(rk.load(), rk.PD(7.05, 0.225), rk.hold(rk.load(), [0.0, 0.0]), [4e-3, 0.0, 0.0])
    >>> np.allclose(rk.antagonistic_torque(run)[-1], run.c[-1], atol=1e-3)
    True
    """
    _run(run)
    A = control_matrix(run.robot, run.q)
    return run.c - matvec(weighted_pseudoinverse(A), matvec(A.mT, run.c))


def antagonistic_energy(run) -> float:
    """(R_el / k_t^2) times the integral of ||c_null||^2, J: what a true-pose filter removes, for identical drives.

    Errors: see `antagonistic_torque`.

    >>> import rapkm_lite as rk
    >>> run = rk.simulate(rk.load(), rk.PD(7.05, 0.225), rk.triangle(rk.load()), [4e-3, -2e-3, 5e-3])
    >>> round(rk.antagonistic_energy(run), 2)
    3.49
    """
    _run(run)
    return float(copper_loss(run.robot, antagonistic_torque(run)[:-1], run.dt).sum())


def antagonism_form(robot: Manipulator, trajectory: Trajectory, K_P) -> np.ndarray:
    """Symmetric S (N, N) in J/rad^2: offsets dq (N,) in rad cost about dq^T S dq of antagonistic energy along the path.

    S = integral of K_0^T (R_el / k_t^2) K_0 dt, where -K_0 dq are the torques at rest of the corrected (14) at each
    point of the path: quasi-static, to first order in the offsets, without friction.  Weight is left out: in a vertical
    plane drives of unequal gains fight over it, too, and the cost of offsets has a part that is linear in them.
    K_P : number, (N,) or (N, N), N m/rad.  Raises ValueError at input singularities, where the path
    leaves the workspace of `robot`, and for another number of arms.

    >>> import numpy as np, rapkm_lite as rk
    >>> S = rk.antagonism_form(rk.load(), rk.triangle(rk.load()), 7.05)
    >>> float(np.round([4e-3, -2e-3, 5e-3] @ S @ [4e-3, -2e-3, 5e-3], 2))
    3.58
    """
    trajectory = of_kind("trajectory", trajectory, Trajectory, "a Trajectory, such as triangle(robot) returns")
    if trajectory.n_arms != manipulator(robot).n_arms:
        raise ValueError(f"trajectory has {trajectory.n_arms} arms, robot has {robot.n_arms}; allowed: the same number")
    A = control_matrix(robot, inverse_kinematics(robot, trajectory.x))  # set-points may leave the path
    K_0 = -np.stack([steady_state_torque(A, K_P, unit) for unit in np.eye(robot.n_arms)], axis=-1)
    weight = robot.resistance / robot.torque_constant**2
    return np.einsum("kij,i,kil->jl", K_0[:-1], weight, K_0[:-1]) * trajectory.dt


def _run(run, *names: str) -> None:
    """What a function reads of a run; its joint angles `q` are computed when they are asked for."""
    having("run", run, "a Run, such as simulate returns", "robot", *(names or ("q", "q_a", "c", "dt")))
