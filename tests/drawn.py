"""What the property tests draw: machines with a pose, motions on V, and gains of every shape that a law takes."""

import hypothesis
import numpy as np
from hypothesis import strategies as st

import rapkm_lite as rk

settings = hypothesis.settings(max_examples=40, deadline=None, derandomize=True, database=None)
kinds = st.sampled_from(["number", "diagonal", "matrix"])


@st.composite
def machines(draw, friction=False, least=2):
    """A machine and an inner pose: its arms are hung on a point that each of them reaches with a bend."""
    N, rng = draw(st.integers(least, 6)), np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    x = rng.uniform(-0.3, 0.3, 2)
    lengths = rng.uniform(0.1, 0.3, (N, 2))
    elbow = rng.uniform(0.4, np.pi - 0.4, N) * rng.choice([-1, 1], N)
    base_angle = np.sort(rng.uniform(0.0, 2 * np.pi, N)) + np.arange(N) * 0.1
    link = base_angle + elbow
    a = lengths[:, :1] * np.stack([np.cos(base_angle), np.sin(base_angle)], -1)
    d = lengths[:, 1:] * np.stack([np.cos(link), np.sin(link)], -1)
    robot = rk.Manipulator(
        base=x - a - d,
        lengths=lengths,
        masses=rng.uniform(0.05, 0.5, (N, 2)),
        centers=lengths * rng.uniform(0.2, 0.8, (N, 2)),
        inertias=rng.uniform(1e-4, 2e-3, (N, 2)),
        rotor_inertia=rng.uniform(0.0, 1e-5, N),
        friction=rng.uniform(0.0, 0.01, N) if friction else 0.0,
        gravity=rng.normal(0.0, 5.0, 2),
        load=rng.uniform(0.0, 0.3),
        mode=np.sign(elbow),
    )
    q = rk.inverse_kinematics(robot, x)
    hypothesis.assume(np.linalg.svd(rk.control_matrix(robot, q), compute_uv=False)[-1] > 0.5)
    return robot, x, q, rng


def motion(robot, q, rng):
    """Rates and accelerations on V, and those of the end-effector."""
    xd, xdd = rng.normal(0, 0.3, 2), rng.normal(0, 2.0, 2)
    F = rk.orthogonal_complement(robot, q)
    qd = F @ xd
    return xd, xdd, qd, F @ xdd + rk.orthogonal_complement_dot(robot, q, qd) @ xd


def scaled(robot, length=1.0, mass=1.0, time=1.0):
    """The machine so many times as large, as heavy and as slow; friction is not scaled."""
    return rk.Manipulator(
        base=robot.base * length,
        lengths=robot.lengths * length,
        masses=robot.masses * mass,
        centers=robot.centers * length,
        inertias=robot.inertias * mass * length**2,
        rotor_inertia=robot.rotor_inertia * mass * length**2,
        friction=0.0,
        gravity=robot.gravity * length / time**2,
        load=robot.load * mass,
        mode=robot.mode,
    )


def gain(kind, size, rng, scale=1.0):
    """A positive gain or weight within a factor of 30: one number, one per joint, or a symmetric matrix."""
    values = scale * np.exp(rng.uniform(-1.7, 1.7, size))
    if kind == "number":
        return float(values[0])
    if kind == "diagonal":
        return values
    Q = np.linalg.qr(rng.normal(size=(size, size)))[0]
    matrix = Q @ np.diag(values) @ Q.T
    return (matrix + matrix.T) / 2


def as_matrix(value, size):
    return np.diag(np.broadcast_to(value, size)) if np.ndim(value) < 2 else value


def reordered(value, order):
    """A gain or weight of arms (or joints) in another order."""
    return value if np.ndim(value) == 0 else value[np.ix_(*[order] * np.ndim(value))]
