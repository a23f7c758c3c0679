"""What the textbook tests share: machines, seeded random poses and motions, finite differences along a motion."""

import numpy as np
import pytest

import rapkm_lite as rk

MACHINES = {name: rk.load(name) for name in ("testbed", "five_bar", "four_arms", "asymmetric")}
TESTBED = MACHINES["testbed"]
FRICTIONLESS = TESTBED.replace(friction=0.0)
MODES = rk.working_modes(TESTBED)

machines = pytest.mark.parametrize("robot", MACHINES.values(), ids=MACHINES.keys())
modes = pytest.mark.parametrize("mode", MODES, ids=["".join("+" if s > 0 else "-" for s in m) for m in MODES])


def random_points(robot, count, seed=0, bend=0.05):
    """End-effector positions (count, 2) m where every arm bends: |sin(elbow)| > bend."""
    rng = np.random.default_rng(seed)
    left, right, low, high = rk.sampling_box(robot)
    points = np.empty((0, 2))
    while len(points) < count:
        x = rng.uniform([left, low], [right, high], (4 * count, 2))
        x = x[rk.reachable(robot, x)]
        bent = np.abs(np.sin(rk.inverse_kinematics(robot, x)[:, robot.n_arms :])).min(axis=-1) > bend
        points = np.concatenate([points, x[bent]])
    return points[:count]


def random_motion(robot, count, mode=None, seed=0, bend=0.05):
    """Poses q, rates qd and accelerations qdd on V, each (count, 2N), and the end-effector's x, xd, xdd behind them."""
    rng = np.random.default_rng(seed + 1)
    x = random_points(robot, count, seed, bend)
    xd, xdd = rng.normal(0, 0.3, (count, 2)), rng.normal(0, 2.0, (count, 2))
    q = rk.inverse_kinematics(robot, x, mode)
    F = rk.orthogonal_complement(robot, q)
    qd = np.einsum("kij,kj->ki", F, xd)
    F_dot = rk.orthogonal_complement_dot(robot, q, qd)
    qdd = np.einsum("kij,kj->ki", F, xdd) + np.einsum("kij,kj->ki", F_dot, xd)
    return q, qd, qdd, (x, xd, xdd)


def along(function, x, xd, step):
    """d/dt of function(x) at x along the straight motion x + t xd, by central differences of order eight."""
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    total = sum(w * (function(x + k * step * xd) - function(x - k * step * xd)) for k, w in weights.items())
    return total / step


def norm(array):
    """Largest absolute entry of each item (k, ...)."""
    return np.abs(array).reshape(len(array), -1).max(axis=-1)


class InPython(rk.Law):
    """A law that the engine does not know: another one, asked sample by sample."""

    def __init__(self, law):
        self.law, self.pose = law, law.pose

    def start(self, model, dt):
        return self.law.start(model, dt)

    def step(self, memory, sample):
        return self.law.step(memory, sample)
