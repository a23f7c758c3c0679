"""The sampled closed loop by SciPy and the textbook layer alone, in minimal coordinates: what the engine is held to."""

import numpy as np
from scipy.integrate import solve_ivp

import rapkm_lite as rk


def acceleration(robot, x, xd, c):
    """End-effector acceleration under the drive torques c, from (6) and (7)."""
    q = rk.inverse_kinematics(robot, x)
    at = rk.at(robot, q, rk.orthogonal_complement(robot, q) @ xd)
    G, C, Q = at.minimal
    return np.linalg.solve(G, at.A.T @ c - C @ xd - Q)


def reference(robot, law, trajectory, offset, model=None, samples=None, method="DOP853", rtol=1e-12, atol=1e-14):
    """States (k, 4), base angles (k, N) and torques (k, N): one integration per hold, torques by `rk.Controller`.

    samples : how many; default all.  method : "DOP853", or "LSODA" for stiff friction.
    """
    trajectory = trajectory.for_robot(model or robot)
    controller = rk.Controller(law, model or robot, trajectory.dt)
    N, state = robot.n_arms, np.concatenate([trajectory.x[0], trajectory.xd[0]])
    states, angles, torques = [], [], []

    def rhs(t, state, c):
        return np.concatenate([state[2:], acceleration(robot, state[:2], state[2:], c)])

    for k, t in enumerate(trajectory.t[:samples]):
        q = rk.inverse_kinematics(robot, state[:2])
        qd = rk.orthogonal_complement(robot, q) @ state[2:]
        # Angles near the desired ones, without a jump at +-pi.
        q_a = q[:N] + 2 * np.pi * np.round((trajectory.q_a[k] - q[:N]) / (2 * np.pi))
        c = controller(t, q_a + offset, qd[:N], trajectory[k], truth=(state[:2], state[2:]))
        states.append(state)
        torques.append(c)
        angles.append(q_a)
        end = solve_ivp(rhs, (0.0, trajectory.dt), state, method, rtol=rtol, atol=atol, args=(c,))
        state = end.y[:, -1]
    return np.array(states), np.array(angles), np.array(torques)
